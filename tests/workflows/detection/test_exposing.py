"""The exposure at another level of light: few pixels decide the same exposure as all pixels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from isethdr_sensors.timing import auto_exposure
from isethdr_workflows.detection.exposing import Metered, decisive

from isethdr_core.plugins.registry import build

DARK_E_PER_S = np.full((4, 1, 1), 3.7)


@pytest.mark.parametrize(
    ("fields", "pixels"),
    [
        ({"exposure_rule": "percentile"}, 2),
        ({"exposure_rule": "percentile", "auto_gain_max": 8.0}, 2),
        ({"exposure_rule": "percentile", "exposure_percentile": 100.0}, 2),
        ({"exposure_rule": "histogram"}, 2),
        ({"exposure_rule": "highlights", "exposure_lamp_ratio": np.inf}, 1),
        ({"exposure_rule": "highlights"}, 90 * 171),
        ({"exposure_rule": "centre"}, 90 * 171),
    ],
)
def test_few_pixels_decide_the_exposure_of_all(fields, pixels):
    """The result is the same to the last bit, because ranks do not change by rounding."""
    sensor = replace(build("sensor", "bayer"), **fields)
    count = len(sensor.model().readings)
    dark = DARK_E_PER_S[:count]
    light = np.random.default_rng(0).lognormal(5.0, 2.0, (count, 90, 171))
    every = Metered(sensor, light + dark, dark, 6e-3)
    of_few, few = decisive(sensor, light + dark)
    assert few[0].size == pixels
    chosen = Metered(of_few, few, dark, 6e-3)
    for factor in (1.0, 1e-3, 0.3, 7.0, 1e3):
        assert chosen.settled(factor) == every.settled(factor)
    assert auto_exposure.settled_at(sensor, light + dark, 6e-3) == chosen.settled(1.0)
