"""Read noise as a function of analog gain: a floor, and noise added after the gain, which the gain
divides.
"""

import numpy as np
import pytest
from isethdr_sensors import (
    BayerSensor,
    DualGainSensor,
    LoficSensor,
    SplitPixelSensor,
    StaggeredSensor,
)
from isethdr_sensors.readout.shot import readings

from isethdr_core.errors import ConfigError
from isethdr_core.plugins.registry import build
from isethdr_core.seeds import generator

SIZE = (160, 200)
N = SIZE[0] * SIZE[1]
CLEAN = dict(prnu=0.0, dark_spread=0.0, column_e=0.0, dark_e_per_s=0.0)
# a floor of 1.5 e, and noise after the gain of 600 uV, which is 6 e at a gain of 1
FLOOR_E = 1.5
BEHIND_UV = 600.0
CONVERSION = 100.0


def camera(gain, **fields):
    return BayerSensor(
        **{
            **CLEAN,
            "read_noise_e": FLOOR_E,
            "after_gain_noise_uv": BEHIND_UV,
            "conversion_gain_uv_per_e": CONVERSION,
            "swing_v": 0.8,
            "analog_gain": gain,
            **fields,
        }
    )


def dark_dn(sensor):
    model = sensor.model()
    return readings(model, [np.zeros(SIZE)], generator(5, "A", "dark"))[0].astype(float)


@pytest.mark.parametrize("gain", [0.5, 1.0, 2.0, 4.0, 8.0, 16.0])
def test_variance_of_codes_in_the_dark_is_the_closed_form(gain):
    """The variance is K^2 (floor^2 + (V / (c g))^2) + 1 / 12 DN^2. K in DN per electron is computed
    here from the sensor's fields, not read from its model. The tolerance is 5 standard errors
    sqrt(2 / n) of a variance.
    """
    dn_per_e = (4095 - 64) / (0.8e6 / (CONVERSION * gain))
    want = dn_per_e**2 * (FLOOR_E**2 + (BEHIND_UV / (CONVERSION * gain)) ** 2) + 1 / 12
    np.testing.assert_allclose(dark_dn(camera(gain))[0].var(), want, rtol=5 * np.sqrt(2 / N))


def test_input_referred_noise_falls_to_its_floor():
    """n^2 = a + b / g^2: a straight line over 1 / g^2 that starts at the square of the floor."""
    gains = np.array([0.5, 1.0, 2.0, 4.0, 16.0, 100.0])
    found = np.array([camera(g).model().readings[0].read_noise_e for g in gains])
    slope, start = np.polyfit(gains**-2, found**2, 1)
    np.testing.assert_allclose([start, slope], [FLOOR_E**2, 36.0], rtol=1e-9)
    assert np.all(np.diff(found) < 0)


def test_captures_state_it(flat):
    shot = camera(4.0)(flat(1e-6, 8, 8), generator(1))
    assert float(shot["read_noise_e"][0]) == pytest.approx(np.hypot(1.5, 1.5), rel=1e-12)


@pytest.mark.parametrize(
    "sensor", [BayerSensor, StaggeredSensor, DualGainSensor, SplitPixelSensor, LoficSensor]
)
def test_none_behind_the_gain_leaves_every_number(sensor):
    fields = np.atleast_1d(sensor().read_noise_e)
    found = [r.read_noise_e for r in sensor().model().readings]
    assert found == list(np.broadcast_to(fields, len(found)))


def test_a_high_conversion_gain_hides_noise_behind_it():
    """LCG and HCG read one charge: 98 uV are fewer electrons at 200 than at 49 uV/e."""
    lcg, hcg = DualGainSensor(after_gain_noise_uv=98.0).model().readings
    assert lcg.read_noise_e == pytest.approx(np.hypot(3.05, 2.0))
    assert hcg.read_noise_e == pytest.approx(np.hypot(0.83, 0.49))


@pytest.mark.parametrize("bad", [-1.0, float("nan"), 1e7])
def test_no_such_voltage(bad):
    with pytest.raises(ConfigError, match="after_gain_noise_uv is"):
        build("sensor", "bayer", after_gain_noise_uv=bad)
