"""Optical black rows, random telegraph noise and the defect map, and how an isp corrects them."""

import numpy as np
import pytest
from isethdr_isp import LinearIsp, MergeIsp
from isethdr_isp.readout.black_level import standard_error, with_black_level
from isethdr_isp.readout.combine import Merged
from isethdr_isp.readout.defects import corrected
from isethdr_isp.readout.noise_propagation import NoisePart, SampleNoise
from isethdr_sensors import BayerSensor, SplitPixelSensor
from isethdr_sensors.noise import telegraph_noise
from isethdr_sensors.readout.shot import readings

import isethdr_core as hdr
from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.pipeline.early_checks import check_shots
from isethdr_core.seeds import generator
from isethdr_core.uncertainty import ledger

KEY = generator(3, "A", "s1")
SIZE = (200, 250)
N = SIZE[0] * SIZE[1]
CLEAN = dict(prnu=0.0, dark_spread=0.0, column_e=0.0, dark_e_per_s=0.0)


def dark(sensor, key=KEY):
    model = sensor.model()
    raw, _ = readings(model, [np.zeros(SIZE)], key)
    reading = model.readings[0]
    return (raw[0].astype(float) - reading.black_dn) / reading.gain_dn_per_e


# --- random telegraph noise ---


def test_telegraph_noise_has_three_peaks_and_its_variance():
    """The steps are exponentially distributed. A trap moves its pixel by -1, 0 or 1 steps with
    probabilities 1/4, 1/2 and 1/4. Tolerances are 5 standard errors.
    """
    rows = range(0, 400)
    percent = 30.0
    step = 20.0
    steps = telegraph_noise.steps_e(step, percent, ("t",), rows, 500)
    found = telegraph_noise.telegraph_noise(steps, ("shot",), 0)
    trapped = steps > 0
    share = percent / 100
    n = trapped.size
    assert trapped.mean() == pytest.approx(share, abs=5 * np.sqrt(share * (1 - share) / n))
    sign = np.divide(found, steps, out=np.zeros_like(steps), where=trapped)[trapped]
    assert set(np.unique(sign)) == {-1.0, 0.0, 1.0}
    for value, probability in ((-1, 0.25), (0, 0.5), (1, 0.25)):
        error = 5 * np.sqrt(probability * (1 - probability) / len(sign))
        assert np.mean(sign == value) == pytest.approx(probability, abs=error)
    # fourth moment of the product of step and sign: share x 24 step^4 / 2
    want = telegraph_noise.rms_e(step, percent) ** 2
    spread = np.sqrt((12 * share * step**4 - want**2) / n)
    assert np.mean(found**2) == pytest.approx(want, abs=5 * spread)
    assert want == pytest.approx(share * step**2)


def test_blocks_of_rows_hold_the_same_traps():
    whole = telegraph_noise.steps_e(5.0, 10.0, ("t",), range(0, 64), 40)
    part = telegraph_noise.steps_e(5.0, 10.0, ("t",), range(32, 64), 40)
    np.testing.assert_array_equal(part, whole[32:])


def test_captures_state_telegraph_noise_as_read_noise(flat):
    fields = {**CLEAN, "read_noise_e": 3.0, "bits": 0}
    plain, traps = (
        BayerSensor(**fields, telegraph_percent=p, telegraph_e=20.0) for p in (0.0, 10.0)
    )
    stated = float(traps(flat(1e-6, 8, 8), KEY)["read_noise_e"][0])
    assert stated == pytest.approx(np.sqrt(9.0 + 0.1 * 400.0))
    # 5 standard errors of the traps' own fourth moment, 12 x share x step^4
    spread = np.sqrt((12 * 0.1 * 20.0**4 + 2 * 9.0**2) / N)
    assert dark(traps).var() == pytest.approx(stated**2, abs=5 * spread)
    same = np.isclose(dark(traps), dark(plain), atol=1e-4)
    assert same.mean() == pytest.approx(0.95, abs=0.01)  # half of the 10 % with a trap moved
    again = np.isclose(dark(traps, generator(4, "A")), dark(plain, generator(4, "A")), atol=1e-4)
    both = (~same & ~again).mean()
    assert both == pytest.approx(0.1 * 0.25, abs=0.005)  # same traps, new signs


# --- optical black ---


def test_black_rows_leave_the_image_as_it_is_and_show_the_dark(flat):
    fields = {"dark_e_per_s": 2000.0, "exposure_s": 0.02}
    light = flat(2e-5, 40, 64)
    plain = BayerSensor(**fields)(light, KEY)
    covered = BayerSensor(**fields, black_rows=30)(light, KEY)
    np.testing.assert_array_equal(plain.raw.values, covered.raw.values)
    black = covered["optical_black"].values[0].astype(float)
    assert black.shape == (30, plain.sizes["x"])
    gain = float(plain.gain_dn_per_e[0])
    want = 64 + 40.0 * float(plain.gain_dn_per_e[0])
    noise_dn = gain * np.sqrt(9.1**2 + 40.0 + 8.0**2) + 0.3
    assert black.mean() == pytest.approx(want, abs=5 * noise_dn / np.sqrt(black.size))


@pytest.mark.parametrize("fields", [{}, {"combine_bits": 20}], ids=["apart", "combined"])
def test_a_measured_black_level_needs_no_stated_one(fields, flat):
    """If the black level is measured, a stated level that is wrong by 9 DN changes no picture."""
    sensor = SplitPixelSensor(**fields, black_rows=16, dark_e_per_s=(2000.0, 300.0))
    shot = sensor(flat(2e-6, 64, 64), KEY)
    wrong = shot.assign(black_dn=shot["black_dn"] - 9.0)
    if "response_dn" in shot:
        wrong = wrong.assign(response_dn=shot["response_dn"] - 9.0)
    right, off = (MergeIsp(black="optical")(one)["xyz"].values for one in (shot, wrong))
    np.testing.assert_allclose(off, right, rtol=1e-9, atol=1e-9 * np.abs(right).max())
    stated = MergeIsp()(shot)["xyz"].values[..., 1]
    # noise of 3 e in each of 16 x 64 black pixels, against a mean of 60 e
    assert right[..., 1].mean() == pytest.approx(stated.mean(), rel=0.01)


@pytest.mark.parametrize("field", ["row_noise_e", "row_e", "column_e", "read_noise_e"])
def test_the_error_of_a_measured_black_level_includes_offsets_of_rows_and_columns(field, flat):
    """The standard deviation over devices is compared. 40 devices give it to 11 %, and 12 rows give
    the offsets of rows to 21 %.
    """
    sensor = BayerSensor(**{**CLEAN, "read_noise_e": 0.0, "black_dn": 300.0, field: 20.0}, bits=14)
    model = sensor.model()
    gain = model.readings[0].gain_dn_per_e
    raws = [
        readings(model, [np.zeros((12, 48))], generator(seed, f"{field} {seed}"))[0][0]
        for seed in range(40)
    ]
    black_e = np.array(raws, float) / gain
    stated_e = np.mean([standard_error(values) ** 2 for values in black_e]) ** 0.5
    assert stated_e == pytest.approx(black_e.mean((1, 2)).std(), rel=0.5)


def test_the_error_of_one_row_or_column_of_black_pixels_is_that_of_independent_pixels():
    values = np.arange(6.0)
    for shape in ((1, 6), (6, 1)):
        assert standard_error(values.reshape(shape)) == pytest.approx(values.std() / np.sqrt(6))


def measured_black(shot, black):
    """Return the measured black level and the rows of the ledger that speak of it."""
    book = ledger.Ledger()
    shot = shot.drop_vars("optical_black", errors="ignore")
    shot = shot.assign(optical_black=(("capture", "black_row", "black_x"), black))
    with ledger.stage(book, "isp") as row:
        level = float(with_black_level(shot, "optical")["black_dn"][0])
    return level, [error for error in row.errors if "black" in error.label]


OF_BLACK = {
    "0.2 DN": {"read_noise_e": 1.3},
    "0.5 DN": {"read_noise_e": 3.2},
    "2 DN": {"read_noise_e": 12.7},
    "5 DN": {"read_noise_e": 31.7},
    "rows": {"read_noise_e": 3.2, "row_noise_e": 20.0},
    "telegraph": {"read_noise_e": 12.7, "telegraph_percent": 3.0, "telegraph_e": 50.0},
    "few electrons": {"read_noise_e": 0.3, "dark_e_per_s": 3.0, "bits": 0},
    "coarse": {"read_noise_e": 40.0, "bits": 8},
}


@pytest.mark.parametrize("fields", OF_BLACK.values(), ids=OF_BLACK.keys())
def test_the_rule_for_outliers_does_not_move_the_black_level(fields, flat):
    """40 shots of 40 devices with 16 black rows each. Coarse codes shift the mean as those of the
    image, so the mean of all pixels is the truth. One shot has a standard error of s; the mean of
    all shots may differ by s / 10.
    """
    sensor = BayerSensor(**{**CLEAN, "exposure_s": 0.01, **fields})
    shot = sensor(flat(1e-6, 8, 8), KEY)
    dark_dn = float(shot["gain_dn_per_e"][0] * shot["dark_e"][0])
    moved = []
    levels = []
    for seed in range(40):
        key = generator(seed, f"black {seed}")
        raw, _ = readings(sensor.model(), [np.zeros((16, 120))], key)
        level, _ = measured_black(shot, raw)
        levels.append(level)
        moved.append(level - (raw[0].astype(float).mean() - dark_dn))
    scatter = np.std(moved) / np.sqrt(len(moved))
    assert abs(np.mean(moved)) < 0.1 * np.std(levels) + 3 * scatter
    if "telegraph_e" not in fields:
        np.testing.assert_allclose(moved, 0.0, atol=1e-3)  # no pixel is left out


@pytest.mark.parametrize("share", [0.05, 0.3, 0.48, 0.52, 0.8])
def test_a_lamp_that_blooms_into_the_black_rows_does_not_move_the_black_level(share, flat):
    sensor = BayerSensor(**CLEAN, read_noise_e=9.0)
    shot = sensor(flat(1e-6, 8, 8), KEY)
    raw, _ = readings(sensor.model(), [np.zeros((16, 200))], KEY)
    columns = int(share * 200)
    alone, _ = measured_black(shot, raw[:, :, columns:])
    raw[0, :, :columns] = 4095  # full wells
    raw[0, 9:, 0] = 2000  # the charge ends in this row
    found, rows = measured_black(shot, raw)
    assert found == pytest.approx(alone, abs=1e-9)
    assert f"up to {16 * columns} per capture left out" in rows[0].label
    # the pixels that count
    error = standard_error(raw[0, :, columns:].astype(float)) / float(shot["gain_dn_per_e"][0])
    assert rows[0].value == pytest.approx(error, rel=1e-9)
    assert any("isp.black=stated" in row.label for row in rows) == (share > 0.5)


def in_doubt(rows):
    return [row for row in rows if "isp.black=stated" in row.label]


@pytest.mark.parametrize("share", [0.96, 1.0])
@pytest.mark.parametrize("added_dn", [200, 1000, 1800, 4095])
def test_charge_in_nearly_all_black_pixels_is_reported(share, added_dn, flat):
    sensor = BayerSensor(**CLEAN, read_noise_e=9.0)
    shot = sensor(flat(1e-6, 8, 8), KEY)
    raw, _ = readings(sensor.model(), [np.zeros((16, 200))], KEY)
    columns = int(share * 200)
    raw[0, :, :columns] = np.minimum(raw[0, :, :columns].astype(int) + added_dn, 4095)
    level, rows = measured_black(shot, raw)
    [doubt] = in_doubt(rows)
    assert "further apart than noise and drift explain" in doubt.label
    gain, stated = (float(shot[name][0]) for name in ("gain_dn_per_e", "black_dn"))
    assert doubt.value == pytest.approx((level - stated) / gain)
    assert level - stated == pytest.approx(min(added_dn, 4095 - stated), rel=0.01)


@pytest.mark.parametrize(("moved_dn", "doubtful"), [(-40, False), (40, False), (-140, True)])
def test_a_stated_level_that_drifted_is_not_taken_for_charge(moved_dn, doubtful, flat):
    """2 % of the range are 76 DN, and the noise of 9 e allows 7 DN."""
    sensor = BayerSensor(**CLEAN, read_noise_e=9.0, black_dn=300.0)
    shot = sensor(flat(1e-6, 8, 8), KEY)
    raw, _ = readings(sensor.model(), [np.zeros((16, 200))], KEY)
    alone, _ = measured_black(shot, raw)
    level, rows = measured_black(shot, raw.astype(int) + moved_dn)
    assert level == pytest.approx(alone + moved_dn)
    assert bool(in_doubt(rows)) == doubtful


def test_offsets_that_the_sensor_states_raise_no_doubt(flat):
    """A single black row has an offset of its own, here up to 330 DN."""
    sensor = BayerSensor(**{**CLEAN, "read_noise_e": 9.0, "row_e": 1000.0, "black_dn": 800.0})
    shot = sensor(flat(1e-6, 8, 8), KEY)
    gain, stated = (float(shot[name][0]) for name in ("gain_dn_per_e", "black_dn"))
    moved_dn = []
    for seed in range(20):
        raw, _ = readings(sensor.model(), [np.zeros((1, 120))], generator(seed, f"row {seed}"))
        level, rows = measured_black(shot, raw)
        assert not in_doubt(rows)
        moved_dn.append(abs(level - stated))
    assert max(moved_dn) > 0.02 * 4095 + 7


KNEES = ((2048, 1024), (2**20 - 1, 4095))  # 2 DN per code, then 341 DN per code
LOW_KNEES = ((512, 512), (2**20 - 1, 4095))  # 1 DN per code, then 292 DN per code


@pytest.mark.parametrize(
    ("combine_bits", "companding", "added"),
    [(0, (), 1000), (20, (), 1000), (20, KNEES, 1000), (20, LOW_KNEES, 450), (20, LOW_KNEES, 452)],
)
def test_charge_in_the_black_pixels_of_combined_captures_is_reported(
    combine_bits, companding, added, flat
):
    """2 % of the range of combined captures would be three ranges of the most sensitive one. The
    charge lies in the coarse part of the companded codes, the black level in the fine one.
    """
    sensor = SplitPixelSensor(black_rows=8, combine_bits=combine_bits, companding=companding)
    shot = sensor(flat(1e-6, 16, 16), KEY)
    charged = shot.assign(optical_black=shot["optical_black"] + added)
    for captures, doubtful in ((shot, False), (charged, True)):
        book = ledger.Ledger()
        with ledger.stage(book, "isp") as row:
            with_black_level(captures, "optical")
        assert bool(in_doubt(row.errors)) == doubtful


@pytest.mark.parametrize(("share", "added_dn"), [(0.03, -50), (0.92, 1000)])
def test_few_low_pixels_are_outliers_and_many_are_those_without_charge(share, added_dn, flat):
    """3 % of the pixels are too low, as those with telegraph noise; or 92 % hold charge."""
    sensor = BayerSensor(**CLEAN, read_noise_e=9.0)
    shot = sensor(flat(1e-6, 8, 8), KEY)
    raw, _ = readings(sensor.model(), [np.zeros((16, 200))], KEY)
    columns = int(share * 200)
    alone, _ = measured_black(shot, raw[:, :, columns:])
    moved = raw.astype(int)
    moved[0, :, :columns] += added_dn
    level, rows = measured_black(shot, moved)
    assert level == pytest.approx(alone, abs=1e-9)
    assert bool(in_doubt(rows)) == (share > 0.5)


def test_the_error_of_black_pixels_with_gaps_is_that_of_the_others():
    rng = np.random.default_rng(0)
    means = []
    stated = []
    for _ in range(200):
        values = rng.normal(size=(12, 40)) + 2 * rng.normal(size=(12, 1)) + rng.normal(size=40)
        values[rng.uniform(size=values.shape) < 0.2] = np.nan
        values[:, :5] = np.nan
        means.append(np.nanmean(values))
        stated.append(standard_error(values) ** 2)
    # 200 means give their standard deviation to 5 %
    assert np.mean(stated) ** 0.5 == pytest.approx(np.std(means), rel=0.2)


def test_a_saturated_pixel_stays_saturated_with_a_measured_black_level(flat):
    """Measured black levels above the stated one move the table of the combined codes beyond its
    top code, which the saturated pixels have.
    """
    sensor = SplitPixelSensor(
        black_rows=4,
        combine_bits=20,
        full_well_e=(22000.0, 15800.0),
        swing_v=(1.078, 1.078, 0.7742),
    )
    shot = sensor(flat(1e6, 16, 16), KEY)
    raised = shot.assign(optical_black=shot["optical_black"] + 40)
    assert shot["saturated"].all()
    table = with_black_level(raised, "optical")["response_dn"].values[0]
    assert table[0] > shot["response_dn"].values[0, 0] + 30
    assert not MergeIsp(black="optical")(raised)["valid"].any()


def test_no_black_rows_are_refused_before_any_work(flat):
    with pytest.raises(ConfigError, match="no optical black rows; type sensor.black_rows=16"):
        check_shots((BayerSensor(),), LinearIsp(black="optical"))
    check_shots((BayerSensor(black_rows=4),), LinearIsp(black="optical"))
    with pytest.raises(UnitError, match="optical_black"):
        LinearIsp(black="optical")(BayerSensor()(flat(1e-6, 8, 8), KEY))


# --- defects ---


def hot(**fields):
    return BayerSensor(
        **{**CLEAN, "hot_percent": 1.0, "hot_dark_e_per_s": 1e5, "defect_e_per_s": 500.0, **fields}
    )


def test_the_map_names_hot_pixels_and_stays(flat):
    light = flat(1e-6, 96, 96)
    one, two = (hot()(light, generator(k, "A", "x"))["defect"].values for k in (1, 2))
    np.testing.assert_array_equal(one, two)
    # an exponential distribution of mean 1e5 e/s has a share of exp(-0.005) beyond 500 e/s
    assert one.mean() == pytest.approx(0.01 * np.exp(-0.005), abs=5 * np.sqrt(0.01 / one.size))
    assert "defect" not in hot(defect_e_per_s=np.inf)(light, KEY)


def test_defects_are_interpolated_and_nothing_else_moves(flat):
    light = flat(5e-5, 96, 96)
    shot = hot()(light, KEY)
    kept, mended = (LinearIsp(defects=d)(shot)["xyz"].values for d in ("kept", "interpolated"))
    clean = LinearIsp()(hot(hot_percent=0.0)(light, KEY))["xyz"].values
    near = np.zeros(shot["defect"].shape, bool)
    y, x = np.nonzero(shot["defect"].values)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            near[np.clip(y + dy, 0, 95), np.clip(x + dx, 0, 95)] = True
    np.testing.assert_array_equal(mended[~near], kept[~near])
    worst = np.abs(mended - clean)[..., 1].max()
    assert worst < 6 * clean[..., 1].std() < np.abs(kept - clean)[..., 1].max()


def test_a_ramp_is_kept_and_a_border_is_not_invented():
    y, x = np.mgrid[0:20, 0:20].astype(float)
    ramp = 3 * x + 2 * y
    spoilt = np.zeros(ramp.shape, bool)
    spoilt[10, 10] = spoilt[5, 12] = spoilt[0, 0] = True
    valid = np.ones(ramp.shape, bool)
    source = np.zeros(ramp.shape, np.uint8)
    mosaic = Merged(np.where(spoilt, 999.0, ramp), np.full(ramp.shape, 4.0), valid, source)
    out = corrected(mosaic, spoilt, (2, 2))
    np.testing.assert_allclose(out.signal_e[1:], ramp[1:], rtol=1e-12)
    assert out.signal_e[0, 0] == np.mean([ramp[2, 0], ramp[0, 2]])
    assert out.variance_e2[10, 10] == 2.0 and out.valid.all()
    alone = corrected(mosaic, np.ones(ramp.shape, bool), (2, 2))
    assert not alone.valid.any()


def test_the_fixed_pattern_of_a_defect_is_that_of_the_neighbours_in_its_mean():
    """PRNU of independent pixels halves in the mean of a pair. The offset of a column does not in
    the mean of two pixels of that column, and halves in that of two columns.
    """
    across = np.full((9, 9), 10.0)
    across[:, 5:] = 1000.0  # an edge, along which the pair is chosen
    for signal, of_column in ((across, 3.0), (across.T, 3.0 / 2)):
        hot = signal.copy()
        hot[4, 4] = 2e4
        parts = NoisePart(0.01 * hot**2), NoisePart(np.full((9, 9), 3.0), "any", "same")
        valid = np.ones((9, 9), bool)
        mosaic = Merged(
            hot, np.full((9, 9), 4.0), valid, np.zeros((9, 9), np.uint8), SampleNoise(parts)
        )
        defect = np.zeros((9, 9), bool)
        defect[4, 4] = True
        out = corrected(mosaic, defect, (1, 1))
        assert out.signal_e[4, 4] == 10.0
        mended = [part.variance_e2[4, 4] for part in out.fixed.parts]
        assert mended == pytest.approx([0.01 * 10.0**2 / 2, of_column])
        assert parts[0].variance_e2[4, 4] == 0.01 * 2e4**2, "the argument is not changed"


@pytest.mark.parametrize("name", ["lofic", "lin_log"])
@pytest.mark.parametrize("field", ["black_rows", "telegraph_percent", "defect_e_per_s"])
def test_soft_knees_refuse_what_they_do_not_model(name, field):
    with pytest.raises(ConfigError, match=f"sensor.{field} is"):
        hdr.build("sensor", name, **{field: 4})


@pytest.mark.parametrize(
    "fields", [{"telegraph_percent": 101.0}, {"telegraph_e": -1.0}, {"black_rows": -1}]
)
def test_bad_fields_are_refused_by_name(fields):
    with pytest.raises(ConfigError, match=f"{next(iter(fields))} is"):
        BayerSensor(**fields)
