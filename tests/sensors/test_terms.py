"""Optional noise terms of a sensor: each follows its law in whole shots."""

import numpy as np
import pytest
from isethdr_sensors import (
    BayerSensor,
    DualGainSensor,
    InterleavedSensor,
    SingleSensor,
    SplitPixelSensor,
    StaggeredSensor,
)
from isethdr_sensors.charge.blooming import bloom
from isethdr_sensors.charge.crosstalk import kernel, mixed_efficiency, spread
from isethdr_sensors.readout.companding import compand, decompand, table
from isethdr_sensors.readout.shot import readings
from isethdr_sensors.spectral.quantum_efficiency import quantum_efficiency
from numpy.testing import assert_allclose, assert_array_equal

from isethdr_core.errors import ConfigError
from isethdr_core.ledger import Ledger, stage
from isethdr_core.seeds import generator

SIZE = (200, 256)
N = SIZE[0] * SIZE[1]
CLEAN = dict(prnu=0.0, dark_spread=0.0, column_e=0.0, dark_e_per_s=0.0, read_noise_e=0.0, bits=0)
KNEES = ((512.0, 512.0), (1536.0, 768.0), (4095.0, 1023.0))
ALL = dict(
    optical_crosstalk_percent=2.0,
    electrical_crosstalk_percent=3.0,
    blooming_percent=10.0,
    hot_percent=0.5,
    row_e=0.5,
    row_noise_e=1.0,
    dsnu_e=1.0,
    read_tail_percent=1.0,
    inl_dn=2.0,
    companding=KNEES,
)


def read(mean_e, seed=1, sensor=SingleSensor, device="A", **fields):
    """Return the first reading (y, x) of a shot of uniform charge, in electrons if the converter is
    off.
    """
    model = sensor(**{**CLEAN, **fields}).model()
    return readings(
        model, [np.full(SIZE, float(mean_e)) for _ in model.photodiodes], generator(seed, device)
    )[0][0].astype(float)


@pytest.mark.parametrize("optical, electrical", [(0, 0), (5, 0), (0, 8), (20, 30)])
def test_crosstalk_conserves_electrons(optical, electrical):
    around = kernel(optical, electrical)
    assert_allclose(around.sum(), 1, rtol=1e-14)
    assert_allclose(
        around[2, 2],
        (1 - optical / 100) * (1 - electrical / 100) + optical * electrical / 1e4 / 5,
        rtol=1e-12,
    )
    assert_allclose(around, around[::-1], atol=1e-16)
    assert_allclose(around, around.T, atol=1e-16)
    model = SingleSensor(
        optical_crosstalk_percent=optical, electrical_crosstalk_percent=electrical
    ).model()
    # a high contrast between neighbours, up to the border
    mean = np.random.default_rng(0).lognormal(0, 8, (7, 9))
    astray = mean * np.random.default_rng(1).random((7, 9))
    both = [mean - astray, astray] if optical else [mean]
    assert_allclose(spread(both, model).sum(), mean.sum(), rtol=1e-13)
    assert spread(both, model).min() >= 0
    # a frame of one pixel keeps all electrons
    assert_allclose(spread([part[:1, :1] for part in both], model), mean[:1, :1], rtol=1e-14)


@pytest.mark.parametrize("power", [0.0, 1.0, 2.5, -1.0])
def test_light_goes_astray_as_a_power_of_its_wavelength(make_light, power):
    """With one lit pixel, the share of its light that the neighbours collect is a power of the
    wavelength.
    """
    for nm in (450.0, 550.0, 650.0):
        values = np.zeros((3, 9, 9))
        values[1, 4, 4] = 1.0
        light = make_light(values, 3.0, [nm - 10, nm, nm + 10])
        sensor = SingleSensor(
            pitch_um=3.0,
            dark_e_per_s=0.0,
            optical_crosstalk_percent=4.0,
            optical_crosstalk_power=power,
        )
        found = sensor.expected(light).values[0]
        share = 0.04 * (nm / 550) ** power
        assert_allclose(1 - found[4, 4] / found.sum(), share, rtol=1e-9)
        assert_allclose(found[[3, 5, 4, 4], [4, 4, 3, 5]] / found.sum(), share / 4, rtol=1e-12)
        clean = SingleSensor(pitch_um=3.0, dark_e_per_s=0.0).expected(light).values[0]
        assert_allclose(found.sum(), clean.sum(), rtol=1e-12)  # nothing is lost


def test_more_light_astray_than_there_is_is_refused(flat):
    with pytest.raises(ConfigError, match="send 83.6 % of the light astray within 400..700 nm"):
        SingleSensor(
            pitch_um=3.0, optical_crosstalk_percent=40.0, optical_crosstalk_power=3.055
        ).expected(flat(1e-3))


def test_crosstalk_leaves_poisson_noise_without_correlation(flat):
    # electrons move independently, so counts stay Poisson: variance = mean, neighbours independent
    sensor = SingleSensor(
        **CLEAN, swing_v=1e6, full_well_e=1e9, pitch_um=3.0, optical_crosstalk_percent=30.0
    )
    light = flat(0.1, *SIZE)
    found = sensor(light, generator(1)).raw.values[0].astype(float)
    mean = float(sensor.expected(light).mean())
    assert_allclose(found.var(), mean, rtol=5 * np.sqrt(2 / N))
    assert abs(np.corrcoef(found[:, 1:].ravel(), found[:, :-1].ravel())[0, 1]) < 5 / np.sqrt(N)


def test_efficiency_of_the_captures_includes_crosstalk(make_light):
    # in uniform light, the stated quantum efficiency gives the mean electrons of each channel
    w = np.arange(400.0, 701, 10)
    light = make_light(np.random.default_rng(0).random((31, 1, 1)) * np.ones((1, 40, 40)), 3.75, w)
    period_of_6 = "GBGGRG/RGRBGB/GBGGRG/GRGGBG/BGBRGR/GRGGBG"
    for cfa in ("RGGB", "RG/WB", "RCCC", "RRGG/RRGG/GGBB/GGBB", "RGB/RGB", period_of_6):
        clean, mixed = (
            BayerSensor(
                cfa=cfa,
                dark_e_per_s=0.0,
                optical_crosstalk_percent=a,
                electrical_crosstalk_percent=b,
            )
            for a, b in ((0, 0), (5, 8))
        )
        qe = quantum_efficiency(clean.model(), w)
        blurred = mixed_efficiency(quantum_efficiency(clean.model(), w), mixed.model(), w)
        assert np.abs(blurred / qe - 1).max() > 0.05
        filters = clean(light, generator())["filter"].values[8:-8, 8:-8]
        before, after = (s.expected(light).values[0][8:-8, 8:-8] for s in (clean, mixed))
        weights = light.values[:, 0, 0] * w  # electrons per photon times photons, up to a constant
        for channel in range(len(qe)):
            want = (blurred[channel] @ weights) / (qe[channel] @ weights)
            assert_allclose(
                after[filters == channel].mean() / before[filters == channel].mean(),
                want,
                rtol=1e-12,
            )


def test_blooming_conserves_charge_that_finds_room():
    charge = np.full((50, 3), 100.0)
    charge[20, 1] = 1000 + 6000.0
    out = bloom(charge, 1000.0, 100.0)
    assert_allclose(out.sum(), charge.sum(), rtol=1e-14)
    assert out.max() <= 1000.0
    assert_array_equal(out[:, [0, 2]], 100.0)  # along the column only
    # 3000 e each way fill three and a third wells that have 900 e of room
    assert_allclose(out[20 - 3 : 21 + 3, 1], 1000.0)
    assert_allclose(out[[16, 24], 1], 400.0, rtol=1e-12)
    # the drain takes the charge that does not bloom
    assert_allclose(bloom(charge, 1000.0, 40.0).sum(), charge.sum() - 0.6 * 6000, rtol=1e-14)
    assert_array_equal(bloom(charge, 1000.0, 0.0), np.minimum(charge, 1000.0))


def test_blooming_has_no_direction_and_loses_only_over_the_border():
    charge = np.random.default_rng(0).lognormal(5, 3, (40, 30))
    out = bloom(charge, 1000.0, 70.0)
    assert_allclose(bloom(charge[::-1], 1000.0, 70.0)[::-1], out, rtol=1e-12)
    assert np.all(out >= np.minimum(charge, 1000.0) - 1e-9) and out.max() <= 1000.0 + 1e-9
    one = bloom(np.array([[5e3]]), 1000.0, 100.0)
    assert_array_equal(one, 1000.0)  # a single pixel has no neighbours


def test_blooming_in_a_shot():
    model = SingleSensor(**{**CLEAN, "bits": 12}, blooming_percent=50.0).model()
    mean = np.full((60, 40), 100.0)
    mean[30, 20] = 1e6
    dark, bright = (readings(model, [m], generator(1)) for m in (np.full((60, 40), 100.0), mean))
    changed = np.argwhere((dark[0] != bright[0]).any(0))
    assert set(changed[:, 1]) == {20} and len(changed) > 15
    # half of 974 545 e fill wells with 25 355 e of room: 9.6 wells up, 9.6 down, and the pixel
    # itself
    assert bright[1].sum() == 19


def test_row_noise_is_new_in_every_shot_and_rows_of_the_device_stay():
    temporal = [read(100.0, seed, row_noise_e=30.0).mean(1) - 100 for seed in (1, 2)]
    shot = 100 / SIZE[1]
    assert_allclose([t.var() for t in temporal], 30.0**2 + shot, rtol=5 * np.sqrt(2 / SIZE[0]))
    assert abs(np.corrcoef(*temporal)[0, 1]) < 5 / np.sqrt(SIZE[0])
    persistent = [read(100.0, seed, row_e=30.0).mean(1) - 100 for seed in (1, 2)]
    assert np.corrcoef(*persistent)[0, 1] > 0.99
    assert abs(
        np.corrcoef(persistent[0], read(100.0, 1, row_e=30.0, device="B").mean(1))[0, 1]
    ) < 5 / np.sqrt(SIZE[0])
    inside = read(100.0, 1, row_noise_e=30.0)
    assert_allclose(
        (inside - inside.mean(1, keepdims=True)).var(),
        100 * (1 - 1 / SIZE[1]),
        rtol=5 * np.sqrt(2 / N),
    )


def test_captures_state_the_row_noise_of_their_pixels(make_light):
    """The square of the stated noise is half the variance of the difference of two shots of one
    device.
    """
    light = make_light(np.zeros((3, 40, 40)), 3.75)
    sensor = BayerSensor(read_noise_e=5.0, row_noise_e=12.0, rows=40, columns=40)
    one, two = (sensor(light, generator(seed)) for seed in (1, 2))
    apart = (one.raw.values.astype(float) - two.raw.values) / float(one.gain_dn_per_e[0])
    stated = (
        float(one.read_noise_e[0]) ** 2
        + float(one.quantisation_e[0]) ** 2 / 12
        + float(one.dark_e[0])
    )
    # all pixels of a row share its noise, so 40 rows give the variance to sqrt(2 / 40); 5 times
    # that is allowed
    assert (
        0.5 * apart.var() == pytest.approx(stated, rel=5 * np.sqrt(2 / 40))
        and one.read_noise_e[0] == 13.0
    )


def test_hot_pixels():
    one, two = (read(0.0, seed, hot_percent=2.0, hot_dark_e_per_s=1e5) for seed in (1, 2))
    count = 0.02 * N
    # 1 in 1600 hot pixels is below 1 e
    assert_allclose((one > 0).sum(), count, atol=5 * np.sqrt(count) + 0.01 * count)
    # 1e5 e/s over 16 ms; an exponential distribution has a standard deviation equal to its mean
    assert_allclose(one[one > 0].mean(), 1600, rtol=5 / np.sqrt(count))
    assert_allclose(one[one > 0].std(), 1600, rtol=5 * 2 / np.sqrt(count))
    assert ((one > 50) == (two > 50)).mean() > 0.9995  # the same pixels
    warm = read(0.0, 1, hot_percent=2.0, hot_dark_e_per_s=1e5, temperature_c=68.0)
    # dark current doubles in 8 K
    assert_allclose(warm[one > 50].mean() / one[one > 50].mean(), 2, rtol=0.01)


def test_read_noise_tail_keeps_the_rms():
    plain, tail = (read(0.0, 1, read_noise_e=5.0, read_tail_percent=p) for p in (0.0, 2.0))
    # about 1000 pixels are in the tail; they have 25 times the variance of the others, and half of
    # the total
    assert_allclose(tail.var(), 25.0, rtol=5 * np.sqrt(2 / N) * 3 + 5 * 0.3 / np.sqrt(1000))
    kurtosis = [np.mean(x**4) / np.mean(x**2) ** 2 for x in (plain, tail)]
    body = 25 / (0.98 + 0.02 * 25)
    assert_allclose(kurtosis[0], 3, rtol=0.05)
    assert_allclose(kurtosis[1], 3 * (0.98 + 0.02 * 625) * body**2 / 625, rtol=0.2)
    again = read(0.0, 2, read_noise_e=5.0, read_tail_percent=2.0)
    assert np.corrcoef((tail**2).ravel(), (again**2).ravel())[0, 1] > 0.1  # the same pixels


def test_integral_nonlinearity(flat):
    fields = {**CLEAN, "bits": 12, "noise": False}
    model, bent = (SingleSensor(**fields, inl_dn=x).model() for x in (0.0, 5.0))
    ramp = np.linspace(0, 25000, N).reshape(SIZE)
    straight, found = (readings(m, [ramp], None)[0][0].astype(float) for m in (model, bent))
    assert_allclose(np.abs(found - straight).max(), 5, atol=1)  # half a code of rounding in each
    assert np.all(np.diff(found.ravel()) >= 0)
    assert found.ravel()[0] == 64
    with pytest.raises(ConfigError, match="codes still increase"):
        SingleSensor(inl_dn=1000.0, pitch_um=3.0)(flat(0.0), generator())
    ledger = Ledger()
    with stage(ledger, "sensor"):
        SingleSensor(inl_dn=5.0, pitch_um=3.0)(flat(0.0), generator())
    (note,) = [e for e in ledger[0].errors if "non-linearity" in e.label]
    assert_allclose(note.value, 5 * 25455 / 4031, rtol=1e-4)


def test_companding_is_undone_by_its_table():
    linear = np.arange(4096.0)
    codes = compand(linear, KNEES, 4095.0)
    assert codes.max() == 1023 and np.all(np.diff(codes) >= 0) and np.all(codes == np.floor(codes))
    slope = np.select([linear <= 512, linear <= 1536], [1.0, 4.0], 2559 / 255)
    assert np.all(np.abs(decompand(codes, KNEES, 4095.0) - linear) <= slope / 2 + 1e-9)
    assert_array_equal(decompand(codes[:513], KNEES, 4095.0), linear[:513])


@pytest.mark.parametrize(
    "knees, message",
    [
        (((512.0, 512.0), (400.0, 600.0), (4095.0, 1023.0)), "increase from knee to knee"),
        (((512.0, 512.0), (4095.0, 400.0)), "increase"),
        (((512.0, 600.0), (4095.0, 1023.0)), "compression"),
        (((2000.0, 1023.0),), "top code 4095"),
        (((1.0, float("nan")),), "with nan in it"),
    ],
)
def test_bad_companding_tables_are_refused(knees, message):
    with pytest.raises(ConfigError, match=message):
        BayerSensor(companding=knees)


def test_captures_carry_the_table(flat):
    shot = BayerSensor(companding=KNEES, pitch_um=3.0)(flat(1e-2), generator(1))
    plain = BayerSensor(pitch_um=3.0)(flat(1e-2), generator(1))
    assert (
        shot.raw.dtype == np.uint16 and int(shot.raw.max()) <= 1023 and "companding_dn" not in plain
    )
    linear = np.interp(
        shot.raw.values[0], shot.companding_dn.values[0], shot.companding_linear_dn.values[0]
    )
    # 5.1 codes: half of the widest step
    assert np.abs(linear - plain.raw.values[0]).max() <= 5.1 and plain.raw.values.max() > 600
    assert_array_equal(shot.saturated, plain.saturated)
    assert table(KNEES, 4095)[0][-1] == shot.companding_linear_dn.values[0][-1]


def test_sixteen_bits_do_not_overflow(flat):
    for fields, top in (
        ({"bits": 16}, 65535),
        ({"bits": 20}, 2**20 - 1),
        ({"bits": 20, "companding": ((2.0**20 - 1, 60000.0),)}, 60000),
    ):
        shot = BayerSensor(pitch_um=3.0, noise=False, **fields)(flat(1e6), None)
        assert int(shot.raw.max()) == int(shot.raw.min()) == top and shot.saturated.values.all()


@pytest.mark.parametrize(
    "sensor",
    [
        BayerSensor(**ALL),
        SplitPixelSensor(**{**ALL, "dsnu_e": (1, 1, 1)}),
        StaggeredSensor(**ALL),
        DualGainSensor(**{**ALL, "dsnu_e": (1, 1)}),
        InterleavedSensor(**ALL),
    ],
)
def test_any_block_gives_the_same_bits_with_every_term(sensor):
    mean = np.geomspace(1e-3, 1e6, 60 * 70).reshape(60, 70)[
        :, np.random.default_rng(0).permutation(70)
    ]
    light = [mean * d.fill_factor * d.exposure_share for d in sensor.model().photodiodes]
    whole = readings(sensor.model(), light, generator(3))
    for rows in (1, 7, 60):
        for a, b in zip(
            whole, readings(sensor.model(), light, generator(3), block_rows=rows), strict=True
        ):
            assert_array_equal(a, b)
