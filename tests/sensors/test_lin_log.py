"""The lin-log sensor is linear below its knee and logarithmic beyond it; a table inverts its
response.
"""

import re

import numpy as np
import pytest
from isethdr_sensors import BayerSensor
from isethdr_sensors.charge import soft_knee_shot
from isethdr_sensors.lin_log import LinLogSensor
from isethdr_sensors.lofic import LoficSensor
from isethdr_sensors.readout.companding import decompand
from isethdr_sensors.readout.lin_log_response import response

from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError
from isethdr_core.physics.detector import charge_dynamics as cd
from isethdr_core.seeds import generator
from isethdr_core.testing import check
from isethdr_core.uncertainty import ledger

SIZE = (60, 80)


def shot(sensor, mean_e):
    light = np.broadcast_to(np.asarray(mean_e, float), SIZE)
    raw, saturated = soft_knee_shot.readings(
        soft_knee_shot.SoftKneePixel(sensor.model(), sensor.well(), (False,)), light, generator(3)
    )
    return raw[0], saturated[0]


def table(sensor):
    return response(sensor.model().readings[0], sensor.exposure_s, sensor.well(), sensor.noise)


@pytest.mark.slow
def test_keeps_the_promises_of_a_sensor():  # default fields: tests/core/test_conformance.py
    check("sensor", "lin_log", bits=0)


def test_below_the_knee_it_is_the_bayer_sensor_bit_for_bit(flat):
    key = generator(seed=4, device="B")
    light = flat(1e-4, pitch_um=3.75)
    ours = LinLogSensor()(light, key)
    bayer = BayerSensor()(light, key)
    assert float(bayer.raw.max()) < 2000 and float(bayer.raw.max()) > 100
    for name in ("raw", "saturated", "gain_dn_per_e", "dark_e", "quantum_efficiency"):
        np.testing.assert_array_equal(ours[name].values, bayer[name].values)
    # top_dn is where the response stops being linear
    assert float(ours.top_dn[0]) < float(bayer.top_dn[0])


def test_beyond_the_knee_every_decade_of_light_is_the_same_step():
    sensor = LinLogSensor(noise=False, bits=0)
    levels = [float(shot(sensor, 10.0**k)[0][0, 0]) for k in range(6, 11)]
    # 0.01 e: raw is float32, which holds 25 000 e to 0.002 e
    np.testing.assert_allclose(np.diff(levels), 391.0 * np.log(10.0), atol=0.01)


def test_the_table_reads_six_decades_back_within_its_codes():
    sensor = LinLogSensor(noise=False, dark_e_per_s=0.0)
    dn, electrons, _ = table(sensor)
    assert np.all(np.diff(dn) > 0) and np.all(np.diff(electrons) > 0)
    step_e = 1 / sensor.model().readings[0].gain_dn_per_e
    for mean in (0.0, 100.0, 19000.0, 20500.0, 22000.0, 1e5, 1e6, 1e8, 1e10):
        raw, saturated = shot(sensor, mean)
        found = np.interp(float(raw[0, 0]), dn, electrons)
        # half a code, converted to charge, divided by the slope of the response at this light
        assert abs(found - mean) <= 0.51 * step_e / cd.slope(
            max(mean, 1.0), sensor.exposure_s, sensor.well()
        ), mean
        assert saturated[0, 0] == (mean > 17900)  # from there on more than 2 e spill


@pytest.mark.parametrize(
    "mean",
    [
        5000.0,
        pytest.param(17000.0, marks=pytest.mark.slow),
        20500.0,
        pytest.param(21000.0, marks=pytest.mark.slow),
        pytest.param(21300.0, marks=pytest.mark.slow),
        22000.0,
        pytest.param(1e5, marks=pytest.mark.slow),
        1e7,
        pytest.param(2e10, marks=pytest.mark.slow),
    ],
)
def test_the_table_reads_noisy_pixels_back_without_bias(mean):
    sensor = LinLogSensor(prnu=0.0, dark_spread=0.0, dark_e_per_s=0.0, column_e=0.0)
    dn, electrons, variance = table(sensor)
    assert np.all(np.diff(electrons) > 0)
    raw = np.concatenate(
        [
            soft_knee_shot.readings(
                soft_knee_shot.SoftKneePixel(sensor.model(), sensor.well(), (False,)),
                np.full((300, 400), mean),
                generator(k),
            )[0]
            for k in (1, 2, 3, 4)
        ]
    )
    found = np.interp(raw.astype(float), dn, electrons)
    # 5 standard errors; a bias of 0.04 % remains where the response bends within one standard
    # deviation of the noise (docs/explanation/charge_dynamics.md)
    assert found.mean() / mean == pytest.approx(
        1.0,
        abs=5 * found.std() / mean / np.sqrt(raw.size) + (4e-4 if 2.05e4 < mean < 2.4e4 else 0.0),
    )
    # mean of the stated variances over the variance found: measured 0.96 to 1.04, each +- 0.5 %,
    # where the variance rises twentyfold
    ratio = np.interp(raw, dn, variance).mean() / found.var()
    assert abs(ratio - 1) < (0.06 if 2e4 < mean < 2.5e4 else 0.015)
    if mean > 5e4:  # 5.6 %: s / 391 with s = sqrt(391 + 9.1^2 + step^2 / 12), at any light
        assert found.std() / mean == pytest.approx(
            np.sqrt(391 + 9.1**2 + 6.3**2 / 12) / 391, rel=0.01
        )


def test_a_bend_beyond_the_range_is_refused_in_the_plan_where_no_converter_has_codes():
    # a bend beyond the range of 25 454 e; a bend just before its end; and a range of 455 e with the
    # bend at 20 000 e
    for fields in (
        {"knee_e": 1e5},
        {"knee_e": 33500.0},
        {"swing_v": 0.05},
    ):
        with pytest.raises(
            ConfigError,
            match=(
                r"sensor.knee_e is .*sensor.bits=0.* the range ends at .*; type"
                r" (sensor.knee_e=\d+|a larger sensor.swing_v)"
            ),
        ) as err:
            LinLogSensor(bits=0, **fields).narrow(Demand())
        if typed := re.search(r"knee_e=(\d+)", str(err.value)):
            assert np.all(
                np.diff(table(LinLogSensor(**{**fields, "bits": 0, "knee_e": float(typed[1])}))[1])
                > 0
            ), "what it says to type works"
    assert len(table(LinLogSensor(knee_e=1e5))[0]) == 3, (
        "with codes it is a straight line with one code beyond"
    )


@pytest.mark.parametrize(
    "fields, worst",
    [
        ({"thermal_e": 100.0}, 0.09),
        ({"read_noise_e": 40.0}, 0.06),
        ({"bits": 0}, 0.09),
        ({"bits": 10}, 0.16),
    ],
)
def test_readings_state_their_variance_for_other_bends_too(fields, worst):
    """The cases are a sharper bend, more noise, no converter steps, and steps as wide as the noise.
    A variance computed without regard to the bend is 1.09 to 2.3 times too large.
    """
    sensor = LinLogSensor(prnu=0.0, dark_spread=0.0, dark_e_per_s=0.0, column_e=0.0, **fields)
    dn, electrons, variance = table(sensor)
    assert np.all(np.diff(variance[2:]) > 0)  # brighter readings state more variance
    for mean in (20400.0, 20800.0, 21200.0, 22400.0, 26000.0):
        [raw], _ = soft_knee_shot.readings(
            soft_knee_shot.SoftKneePixel(sensor.model(), sensor.well(), (False,)),
            np.full((250, 300), mean),
            generator(5),
        )
        ratio = np.interp(raw, dn, variance).mean() / np.interp(raw, dn, electrons).var()
        # largest deviations measured with 900 000 pixels: 0.06, 0.01, 0.044, 0.135; the 75 000
        # pixels here give the ratio to 0.5 to 1.4 %
        assert abs(ratio - 1) < worst, mean


def test_the_plain_inverse_is_too_bright():
    """Noise of standard deviation s, put through an exponential, raises the mean by the factor
    exp(s^2 / 2 / 391^2) = 1.0016. At the bend the bias is 0.9 %.
    """
    sensor = LinLogSensor(prnu=0.0, dark_spread=0.0, dark_e_per_s=0.0, column_e=0.0)
    dn, electrons, _ = response(
        sensor.model().readings[0], sensor.exposure_s, sensor.well(), noise=False
    )
    for mean, bias in ((1e7, 0.0016), (22000.0, 0.009)):
        raw, _ = soft_knee_shot.readings(
            soft_knee_shot.SoftKneePixel(sensor.model(), sensor.well(), (False,)),
            np.full((300, 400), mean),
            generator(1),
        )
        assert np.interp(raw[0].astype(float), dn, electrons).mean() / mean - 1 == pytest.approx(
            bias, abs=5 * 0.056 / np.sqrt(raw.size) + 2e-4
        )


def test_captures_carry_the_table(flat):
    out = LinLogSensor()(flat(1e-4, pitch_um=3.75), generator(1))
    assert (
        out.response_dn.dims
        == out.response_e.dims
        == out.response_variance_e2.dims
        == ("capture", "response_entry")
    )
    assert out.response_e.attrs["units"] == "e" and float(out.response_dn[0, -1]) == 4095.0
    assert np.interp(64.0, out.response_dn.values[0], out.response_e.values[0]) == 0.0


def test_the_converter_is_the_end():
    raw, saturated = shot(LinLogSensor(), 1e18)
    assert np.all(raw == 4095) and saturated.all()


def test_bad_fields_are_refused_by_name():
    with pytest.raises(ConfigError, match="knee_e"):
        LinLogSensor(knee_e=0.0)


def test_companded_codes_state_their_steps():
    knees = ((512.0, 512.0), (1536.0, 768.0), (4095.0, 1023.0))
    sensor = LinLogSensor(
        prnu=0.0, dark_spread=0.0, dark_e_per_s=0.0, column_e=0.0, companding=knees
    )
    dn, electrons, variance = table(sensor)
    gain = sensor.model().readings[0].gain_dn_per_e
    for code, step in ((400.0, 1.0), (700.0, 4.0)):  # on the straight part
        at = decompand(code, knees, 4095.0)
        read_e2 = np.interp(at, dn, variance) - np.interp(at, dn, electrons)
        assert read_e2 == pytest.approx(9.1**2 + (step / gain) ** 2 / 12, rel=1e-9)
    # Beyond the knee a code is 2559 / 255 DN wide, three times the noise. The variance depends on
    # the place of the light within a code, so levels across one code are joined.
    stated = found = 0.0
    for part in np.arange(6) / 6:
        mean = 1e6 * np.exp(part * 2559 / 255 / gain / 391.0)
        at = decompand(shot(sensor, mean)[0].astype(float), knees, 4095.0)
        stated += np.interp(at, dn, variance).mean() / mean**2
        found += np.interp(at, dn, electrons).var() / mean**2
    assert stated / found == pytest.approx(1.0, abs=0.15)  # 0.5 without the steps


def test_the_ledger_bounds_the_rounding_to_companded_codes(flat):
    sensor = LinLogSensor(companding=((512.0, 512.0), (1536.0, 768.0), (4095.0, 1023.0)))
    with ledger.stage(ledger.Ledger(), "sensor") as row:
        sensor(flat(1e-4, 4, 4, pitch_um=3.75), generator(1))
    [note] = [error for error in row.errors if "companded" in error.label]
    half_code_e = 2559 / 255 / 2 / sensor.model().readings[0].gain_dn_per_e
    assert note.value == pytest.approx(np.expm1(half_code_e / sensor.thermal_e))


def test_the_end_of_the_converter_is_the_end_of_companded_codes():
    knees = ((512.0, 512.0), (1536.0, 768.0), (5000.0, 1100.0))  # the top is between two codes
    sensor = LinLogSensor(companding=knees)
    raw, _ = shot(sensor, 1e18)
    assert np.all(decompand(raw.astype(float), knees, 4095.0) >= table(sensor)[0][-1])


def test_a_pixel_that_spills_in_the_dark_has_a_table():
    dn, electrons, _ = table(LinLogSensor(knee_e=5000.0))
    assert np.all(np.diff(dn) > 0) and np.all(np.diff(electrons) > 0)


@pytest.mark.parametrize("sensor, knee_e", [(LinLogSensor, 3000.0), (LoficSensor, 1500.0)])
def test_a_pixel_without_a_linear_code_is_refused(sensor, knee_e):
    with pytest.raises(ConfigError, match="sensor.knee_e is .* no code is linear"):
        sensor(knee_e=knee_e)
