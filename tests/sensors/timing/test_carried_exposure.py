"""Exposure carried from frame to frame: every sensor with an exposure rule states the exposure it
settles at, and takes a given one.
"""

import numpy as np
import pytest

import isethdr_core as hdr
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.protocols import CarriesExposure
from isethdr_core.sequence.exposure import Exposure

SENSORS = [
    "bayer",
    "staggered",
    *(
        pytest.param(name, marks=pytest.mark.slow)
        for name in ("dual_gain", "split_pixel", "lofic", "lin_log", "interleaved")
    ),
]


def camera(name, **fields):
    rule = {"exposure_rule": "histogram", "auto_gain_max": 4.0, "exposure_max_s": 0.01}
    return hdr.build("sensor", name, **(rule | fields))


def light_of(make_light, level=1e-3):
    """Return light over three decades."""
    values = level * np.geomspace(0.03, 30.0, 16 * 16).reshape(16, 16)
    return make_light(np.broadcast_to(values, (31, 16, 16)).copy(), pitch_um=3.75)


@pytest.mark.parametrize("level", [1e-2, 1e-5])
@pytest.mark.parametrize("each", [False, True])
@pytest.mark.parametrize("name", SENSORS)
def test_at_its_settled_exposure_a_sensor_takes_the_single_shot(name, each, level, make_light):
    if each and name != "staggered":
        return
    sensor = camera(name, **({"exposure_each": True} if each else {}))
    light = light_of(make_light, level)
    settled = sensor.settled_exposure(light)
    assert (settled.exposure.gain > 1) == (level == 1e-5)
    key = hdr.generator(seed=3)
    alone = sensor(light, key)
    carried = sensor.at_exposure(settled.exposure)(light, key)
    np.testing.assert_array_equal(alone.raw.values, carried.raw.values)
    np.testing.assert_array_equal(alone.exposure_s.values, carried.exposure_s.values)


@pytest.mark.parametrize("name", SENSORS)
def test_a_carried_exposure_ignores_the_light(name, make_light):
    sensor = camera(name, noise=False)
    held = sensor.at_exposure(Exposure(0.002, 1.0))
    exposures = [
        held(light_of(make_light, level), hdr.generator()).exposure_s.values
        for level in (1e-5, 1e-2)
    ]
    np.testing.assert_array_equal(*exposures)
    assert exposures[0].max() == 0.002


def test_ratios_that_a_sensor_has_no_exposures_for_are_refused():
    with pytest.raises(ConfigError, match=r"BayerSensor has the ratios .* type for example"):
        camera("bayer").at_exposure(Exposure(0.002, 1.0, (1.0, 0.1)))
    with pytest.raises(ConfigError, match="expected 3 of them, or none"):
        camera("staggered").at_exposure(Exposure(0.002, 1.0, (1.0, 0.1)))


def test_only_automatic_exposure_is_carried():
    assert camera("bayer").longest_exposure_s == 0.01
    assert camera("bayer", exposure_rule="fixed").longest_exposure_s is None
    assert not isinstance(hdr.build("sensor", "ideal"), CarriesExposure)
