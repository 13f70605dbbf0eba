"""Noise, full well, converter and fixed pattern in whole shots: photon transfer, shared charge,
persistence from shot to shot, and limits.
"""

import numpy as np
import pytest
from isethdr_sensors import BayerSensor, IdealSensor, RgbwSensor, SplitPixelSensor
from isethdr_sensors.readout.converter import check_black_level
from isethdr_sensors.readout.shot import readings
from numpy.testing import assert_allclose, assert_array_equal
from scipy.special import erfc

from isethdr_core.ledger import Ledger, stage
from isethdr_core.seeds import generator

KEY = generator(3, "A", "s1")
SIZE = (200, 256)
N = SIZE[0] * SIZE[1]
CLEAN = dict(prnu=0.0, dark_spread=0.0, column_e=0.0, dark_e_per_s=0.0)
CLEAN_SPLIT = dict(
    prnu=(0.0, 0.0), dark_spread=(0.0, 0.0), column_e=(0.0,) * 3, dark_e_per_s=(0.0, 0.0)
)


def electrons_read(sensor, mean_e, key=KEY, size=SIZE):
    """Return the electrons (capture, y, x) decoded from a shot of uniform charge, and the mask of
    saturated pixels.
    """
    model = sensor.model()
    light = [
        np.full(size, float(mean_e) * diode.fill_factor / model.photodiodes[0].fill_factor)
        for diode in model.photodiodes
    ]
    raw, saturated = readings(model, light, key)
    gain, black = (
        np.array([getattr(r, name) for r in model.readings])[:, None, None]
        for name in ("gain_dn_per_e", "black_dn")
    )
    return (raw.astype(float) - black) / gain, saturated


@pytest.mark.parametrize("mean_e", [0.0, 1.0, 30.0, 1000.0, 15000.0])
def test_photon_transfer(mean_e):
    # variance = mean + read^2 + step^2 / 12; 5 standard errors sqrt(2 / n) of a variance
    sensor = BayerSensor(**CLEAN)
    found, _ = electrons_read(sensor, mean_e)
    step = 1 / sensor.model().readings[0].gain_dn_per_e
    want = mean_e + 9.1**2 + step**2 / 12
    assert_allclose(found.var(), want, rtol=5 * np.sqrt(2 / N))
    assert_allclose(found.mean(), mean_e, atol=5 * np.sqrt(want / N))


def test_photon_transfer_slope_is_the_gain():
    # European Machine Vision Association standard 1288: K = d variance / d mean, both in DN
    sensor = BayerSensor(**CLEAN)
    gain = sensor.model().readings[0].gain_dn_per_e
    levels = np.array([500.0, 2000.0, 5000.0, 10000.0, 20000.0])
    shots = [electrons_read(sensor, level)[0] * gain for level in levels]
    slope = np.polyfit([s.mean() for s in shots], [s.var() for s in shots], 1)[0]
    # 5 standard errors; all levels share their random numbers, so their errors do not average out
    assert_allclose(slope, gain, rtol=0.03)


def test_readings_of_one_charge_share_its_shot_noise():
    found, _ = electrons_read(SplitPixelSensor(**CLEAN_SPLIT), 4000.0)
    correlation = np.corrcoef(found.reshape(3, -1))
    # shot variance 4000 against read and rounding variance of the two readings
    lplg = 3.05**2 + 5.458**2 / 12
    lphg = 0.83**2 + 1.337**2 / 12
    assert_allclose(correlation[0, 1], 4000 / np.sqrt((4000 + lplg) * (4000 + lphg)), atol=1e-4)
    assert abs(correlation[0, 2]) < 5 / np.sqrt(N) and abs(correlation[1, 2]) < 5 / np.sqrt(N)
    # the two readings differ by read noise and rounding alone
    assert_allclose((found[0] - found[1]).var(), lplg + lphg, rtol=5 * np.sqrt(2 / N))


def test_read_noise_below_black_survives():
    found, _ = electrons_read(SplitPixelSensor(**CLEAN_SPLIT), 0.0)
    assert np.all(found.min((1, 2)) < 0)
    # clipping adds no bias; the rms noise is below 4 e
    assert_allclose(found.mean((1, 2)), 0, atol=5 * 4 / np.sqrt(N))
    assert not electrons_read(SplitPixelSensor(bits=0), 0.0)[0].min() >= 0


def test_too_low_a_black_level_is_stated_with_its_bias(flat):
    ledger = Ledger()
    with stage(ledger, "sensor"):
        captures = BayerSensor(black_dn=0.0, **CLEAN)(flat(0.0, 300, 300), KEY)
    [note] = [o for o in ledger[0].left_out if "below code 0" in o.what]
    read = captures.raw.values / float(captures.gain_dn_per_e[0])
    # 0.15 e: 5 standard errors of 9.1 e / sqrt(9e4); 1 %: rounding in steps of 6.2 e adds less
    assert_allclose(read.mean(), note.bound, rtol=0.01, atol=0.15)


@pytest.mark.parametrize(
    "fields",
    [
        {"read_noise_e": 12.0},
        {"row_noise_e": 12.0},
        {"row_e": 12.0},
        {"telegraph_e": 12.0, "telegraph_percent": 100.0},
    ],
)
def test_every_noise_of_a_reading_counts_for_the_black_level(fields):
    ledger = Ledger()
    reading = (
        BayerSensor(black_dn=1.0, **{**CLEAN, "read_noise_e": 0.0, **fields}).model().readings[0]
    )
    with stage(ledger, "sensor"):
        check_black_level(reading)
    black_e = 1.0 / reading.gain_dn_per_e
    t = black_e / 12.0
    want = 12.0 * (np.exp(-t * t / 2) / np.sqrt(2 * np.pi) - t * erfc(t / np.sqrt(2)) / 2)
    assert_allclose(ledger[0].left_out[0].bound, want, rtol=1e-9)


def test_full_well_and_top_code():
    sensor = SplitPixelSensor()
    for mean_e in (2.2e4 * 1.1, 1e6, 1e12, 1e30):
        found, saturated = electrons_read(sensor, mean_e, size=(40, 50))
        assert saturated[:2].all()
        # 1.078 V at 49 uV/e and at 200 uV/e
        assert found[0].max() <= 22000.0 + 1e-6 and found[1].max() <= 5390.0 + 1e-6
    assert saturated.all() and found[2].max() <= 7900 + 1e-6
    found, saturated = electrons_read(sensor, 20000.0)
    assert not saturated[0].any() and saturated[1].all() and not saturated[2].any()


def test_charge_at_full_well_is_saturated_even_where_noise_hides_it():
    # the well (1000 e) ends far below the converter's top
    sensor = BayerSensor(full_well_e=1000.0)
    found, saturated = electrons_read(sensor, 5000.0)
    assert saturated.all() and (found < 1000).mean() > 0.3
    assert_allclose(found.mean(), 1000, atol=1)


def test_fixed_pattern_persists_from_shot_to_shot_and_differs_between_devices():
    sensor = BayerSensor(prnu=0.05, dsnu_e=20.0, column_e=10.0)
    first, second, other = (
        electrons_read(sensor, 5000.0, key)[0][0]
        for key in (generator(1, "A", "s1"), generator(2, "A", "s2"), generator(1, "B", "s1"))
    )
    pattern = (0.05 * 5000) ** 2 + 20**2 + 10**2
    temporal = 5000 + 9.1**2 + 0.2
    shared = np.corrcoef(first.ravel(), second.ravel())[0, 1]
    # 5 standard errors; the column pattern has only 256 samples
    assert_allclose(shared, pattern / (pattern + temporal), atol=0.02)
    assert abs(np.corrcoef(first.ravel(), other.ravel())[0, 1]) < 0.02
    assert_allclose((first - second).var() / 2, temporal, rtol=5 * np.sqrt(2 / N))


def test_fixed_pattern_amplitudes():
    for field, want in (
        ({"prnu": 0.01}, 100.0),
        ({"dsnu_e": 30.0}, 30.0),
        ({"column_e": 30.0}, 30.0),
    ):
        average = np.mean(
            [
                electrons_read(
                    BayerSensor(**{**CLEAN, "read_noise_e": 0.0, **field}), 10000.0, generator(k)
                )[0][0]
                for k in range(16)
            ],
            axis=0,
        )
        left = 10000 / 16  # temporal variance that 16 shots leave
        if "column_e" in field:
            average = average.mean(0)
            left = left / SIZE[0]
        assert_allclose(average.var(), want**2 + left, rtol=5 * np.sqrt(2 / average.size))


def test_dark_spread_scales_with_the_dark_charge():
    sensor = BayerSensor(
        **{**CLEAN, "dark_e_per_s": 9.1e5, "dark_spread": 0.2, "read_noise_e": 0.0}
    )
    found, _ = electrons_read(sensor, 0.0)
    mean = 9.1e5 * 0.016
    assert_allclose(found.mean(), mean, rtol=5 * 0.2 / np.sqrt(N))
    # the spread is clipped below -5 sigma, which does not matter here; 3 %: 5 standard errors of a
    # variance over 5e4 pixels
    assert_allclose(found.var(), mean + (0.2 * mean) ** 2, rtol=0.03)


def test_rounding_error_of_the_converter():
    # without noise, a linear ramp over many codes has an error that is uniform over one step: its
    # rms is step / sqrt(12)
    sensor = BayerSensor(noise=False, **CLEAN)
    model = sensor.model()
    ramp = np.linspace(0, 20000, N).reshape(SIZE)
    raw, _ = readings(model, [ramp], None)
    gain = model.readings[0].gain_dn_per_e
    error = (raw[0].astype(float) - 64) / gain - ramp
    assert np.abs(error).max() <= 0.5 / gain * (1 + 1e-9)
    assert_allclose(error.std(), 1 / gain / np.sqrt(12), rtol=0.01)  # 3000 codes, 16 samples each


@pytest.mark.parametrize(
    "sensor", [BayerSensor(), RgbwSensor(prnu=0.02), SplitPixelSensor(dsnu_e=(1, 1, 1))]
)
def test_any_block_gives_the_same_bits(sensor):
    mean = np.geomspace(1e-3, 1e6, 60 * 70).reshape(60, 70)[
        :, np.random.default_rng(0).permutation(70)
    ]
    light = [mean * d.fill_factor for d in sensor.model().photodiodes]
    whole = readings(sensor.model(), light, KEY)
    for rows in (1, 7, 60):
        for a, b in zip(whole, readings(sensor.model(), light, KEY, block_rows=rows), strict=True):
            assert_array_equal(a, b)


def test_light_elsewhere_changes_no_pixel():
    model = SplitPixelSensor().model()
    mean = np.full((30, 40), 100.0)
    before = readings(model, [mean, mean * 0.01], KEY)[0]
    mean[5, 6] = 1e9
    after = readings(model, [mean, mean * 0.01], KEY)[0]
    changed = np.argwhere((before != after).any(0))
    assert_array_equal(changed, [[5, 6]])


@pytest.mark.parametrize(
    "make, ideal",
    [
        (
            lambda: BayerSensor(
                noise=False, bits=0, dark_e_per_s=0.0, full_well_e=np.inf, swing_v=1e12
            ),
            dict(pitch_um=3.75),
        ),
        (
            lambda: RgbwSensor(
                noise=False, bits=0, dark_e_per_s=0.0, full_well_e=np.inf, swing_v=1e12
            ),
            dict(pitch_um=3.75, cfa="RG/WB"),
        ),
        (
            lambda: SplitPixelSensor(
                noise=False,
                bits=0,
                dark_e_per_s=(0, 0),
                full_well_e=(np.inf,) * 2,
                swing_v=(1e12,) * 3,
                fill_factor=(0.5, 0.5),
            ),
            dict(pitch_um=2.8, cfa="GRBG", fill_factor=0.5),
        ),
    ],
)
def test_every_sensor_reduces_to_the_ideal_one(make, ideal, make_light):
    light = make_light(np.random.default_rng(0).lognormal(-7, 3, (31, 20, 20)), 4.0)
    want = IdealSensor(peak_qe=0.65, **ideal)(light)
    got = make()(light, None)
    for capture in range(got.sizes["capture"]):
        assert_array_equal(got.raw.values[capture], want.raw.values[0])
        assert not got.saturated.values.any()
    # rounding of float32
    assert_allclose(want.raw.values, IdealSensor(peak_qe=0.65, **ideal).expected(light), rtol=1e-7)
    assert_array_equal(got["filter"], want["filter"])


def test_mean_of_many_shots_is_expected(make_light):
    light = make_light(np.random.default_rng(0).lognormal(-8, 1, (31, 10, 10)), 6.0)
    sensor = SplitPixelSensor(bits=0, **CLEAN_SPLIT)
    shots = np.array([sensor(light, generator(k)).raw.values for k in range(60)])
    expected = sensor.expected(light).values
    read = np.array([3.05, 0.83, 0.83])[:, None, None]
    free = expected < np.array([20000, 5000, 7000])[:, None, None]
    z = (shots.mean(0) - expected) / np.sqrt((expected + read**2) / 60)
    assert free.mean() > 0.5 and np.abs(z[free]).max() < 5.5  # in 1000 pixels: p = 4e-5
    assert abs(z[free].mean()) < 5 / np.sqrt(free.sum())  # and all of them together
    assert abs(z[free].std() - 1) < 0.1
