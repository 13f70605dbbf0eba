"""Automatic gain acts where the exposure has reached its limit, and only there."""

import numpy as np
import pytest
from isethdr_sensors.timing import auto_exposure

import isethdr_core as hdr
from isethdr_core.errors import ConfigError

SENSORS = ["bayer", "dual_gain", "split_pixel", "staggered", "lofic", "lin_log", "interleaved"]
RULES = ["centre", "histogram", "percentile", "highlights"]


def camera(name="bayer", **fields):
    return hdr.build(
        "sensor",
        name,
        **{"exposure_rule": "histogram", "auto_gain_max": 16.0, "exposure_max_s": 0.01, **fields},
    )


def dim(make_light, level=1e-5):
    """Return light over one decade, too dim for any rule to reach its target in 10 ms."""
    values = level * np.geomspace(0.5, 5.0, 24 * 24).reshape(24, 24)
    return make_light(np.broadcast_to(values, (31, 24, 24)).copy(), pitch_um=3.75)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("name", SENSORS)
def test_the_amplified_reading_meets_the_target(name, rule, make_light):
    """Meter again on a sensor that has the found gain from the start."""
    sensor = camera(name, exposure_rule=rule, auto_gain_max=200.0)
    light = dim(make_light)
    found = auto_exposure.settle(sensor, light)
    assert found.exposure_s == 0.01 and 1 < found.gain < sensor.auto_gain_max
    k = sensor.gained_reading()
    again = sensor.with_gain(found.gain)
    share = again.expected(light).values[k] / again.exposure_s * 0.01 / again.full_scale_e()[k]
    offset = np.arange(len(share)) - (len(share) - 1) / 2
    width = np.hypot(*share.shape) / 4
    weight = np.exp(-(offset[:, None] ** 2 + offset**2) / 2 / width**2)
    level = {
        "centre": np.average(np.minimum(share, 1), weights=weight),
        "histogram": np.median(share),
        "percentile": np.percentile(share, 95.0),
        "highlights": share.max(),
    }[rule]
    assert level == pytest.approx(0.5, rel=1e-3)  # full scale is a whole number of codes


@pytest.mark.parametrize("name", SENSORS)
def test_a_shot_with_automatic_gain_is_the_shot_with_that_gain(name, make_light):
    light = dim(make_light)
    key = hdr.generator(seed=4)
    sensor = camera(name, auto_gain_max=2.0, exposure_min_s=0.004, exposure_max_s=0.004)
    shot = sensor(light, key)
    assert shot.attrs["analog_gain_factor"] == 2.0
    gains = np.array(sensor.analog_gain, float)
    gains[sensor.gained_reading() if gains.ndim else ...] *= 2
    fixed = hdr.build("sensor", name, exposure_s=0.004, analog_gain=gains.tolist())(light, key)
    np.testing.assert_array_equal(shot.raw.values, fixed.raw.values)


def test_gain_stays_where_the_exposure_suffices(make_light):
    shot = camera(exposure_max_s=10.0)(dim(make_light), hdr.generator())
    assert shot.attrs["analog_gain_factor"] == 1.0


def test_twice_the_light_takes_half_the_gain(make_light):
    sensor = camera(dark_e_per_s=0.0, auto_gain_max=500.0)
    once, twice = (auto_exposure.settle(sensor, dim(make_light, k * 1e-5)).gain for k in (1, 2))
    assert twice == pytest.approx(once / 2, rel=1e-9)  # the tolerance of the root is 1e-12


def test_darkness_takes_all_the_gain(make_light):
    dark = make_light(np.zeros((31, 8, 8)), pitch_um=3.75)
    found = auto_exposure.settle(camera(dark_e_per_s=0.0), dark)
    assert (found.exposure_s, found.gain, found.limit) == (0.01, 16.0, "exposure_max_s")


def test_gain_lowers_the_noise_behind_it(make_light):
    """The shot states a read noise of sqrt(floor^2 + (V / (c g))^2)."""
    sensor = camera(read_noise_e=1.0, after_gain_noise_uv=880.0)
    shot = sensor(dim(make_light), hdr.generator())
    gain = shot.attrs["analog_gain_factor"]
    assert float(shot["read_noise_e"][0]) == pytest.approx(np.hypot(1.0, 8.0 / gain), rel=1e-12)


def test_what_a_lens_may_leave_out_is_weighed_against_the_largest_gain():
    from isethdr_core.demand import Demand

    fields = {"read_noise_e": 1.0, "after_gain_noise_uv": 880.0}
    asked = camera(**fields).narrow(Demand(wavelength_nm=tuple(range(400, 701, 10))))
    assert asked.response.read_noise_e == pytest.approx(np.hypot(1.0, 0.5))


@pytest.mark.parametrize("bad", [0.5, 1001.0, float("nan")])
def test_no_such_gain(bad):
    with pytest.raises(ConfigError, match="auto_gain_max is"):
        camera(auto_gain_max=bad)


def test_a_gain_beyond_what_amplifiers_have_is_refused_when_the_sensor_is_made():
    with pytest.raises(
        ConfigError, match="auto_gain_max is 16, but this sensor cannot have that gain"
    ):
        camera(analog_gain=100.0)
