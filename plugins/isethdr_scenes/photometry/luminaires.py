"""Luminaires and traffic signals as tables of candela over two angles: models, designed by hand,
not measured.

A luminaire looks down. Its table counts `left_deg` along the road and `up_deg` across it, towards
the road. All of them are cut off below the horizontal plane, as full cut-off luminaires are. A
signal looks level, towards those who wait.

| name | distribution | flux, lm |
|---|---|---|
| road | batwing along the road, brightest 62 degrees to either side, narrow across it | 8 000 |
| tunnel | flat batwing along the road, brightest 50 degrees to either side, wide across | 4 350 |
| post_top | even all round, brightest 55 degrees off the axis | 4 000 |
| high_mast | even all round about an axis tilted outwards | 20 000 |
| signal | 200 cd on its axis, half of it 10 degrees aside and 7 degrees below, 3 above | 23 |

A signal of 200 mm has 200 cd on its axis, as of level 2 of EN 12368, an assumption. Its widths are
a model of a lens for wide roads; the table of the standard was not read.

The fluxes are those of usual LED luminaires of these heights, an assumption. The batwing makes the
illuminance of the road even: intensity rises as 1 / cos^3 of the angle, as far as it reaches.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from isethdr_core.scene import IntensityTable

from .families import LampPattern

FLUX_LM = {"road": 8_000.0, "tunnel": 4_350.0, "post_top": 4_000.0, "high_mast": 20_000.0}
SIGNAL_CD = 200.0
# of a signal, where the intensity has fallen to a half: aside, below, above
SIGNAL_HALF_DEG = (10.0, 7.0, 3.0)
SIGNAL_REST = 0.004  # of the intensity on the axis, far beside it
STEP_DEG = 2.0
WIDEST_DEG = 88.0
# where the intensity has fallen to a half; logistic width
CUT_OFF_DEG = 74.0
CUT_WIDTH_DEG = 4.0


@cache
def luminaire(name: str) -> LampPattern:
    """Return a luminaire of `FLUX_LM`, or the `signal`; its rules are none."""
    if name == "signal":
        return _signal()
    angle = np.arange(-WIDEST_DEG, WIDEST_DEG + STEP_DEG / 2, STEP_DEG)
    along, across = np.meshgrid(angle, angle)
    forward = np.cos(np.radians(across)) * np.cos(np.radians(along))
    off_axis = np.degrees(np.arccos(forward))
    value = _SHAPES[name](along, across, off_axis) * _cut_off(off_axis)
    peak = FLUX_LM[name] / _solid_angle(angle, value / value.max())
    return LampPattern(IntensityTable(angle, angle, value / value.max()), float(peak), ())


def _road(along: np.ndarray, across: np.ndarray, off_axis: np.ndarray) -> np.ndarray:
    reach = np.minimum(np.abs(along), 62.0)
    beside = np.exp(-(((across - 12.0) / 32.0) ** 2))
    return beside / np.cos(np.radians(reach)) ** 2


def _tunnel(along: np.ndarray, across: np.ndarray, off_axis: np.ndarray) -> np.ndarray:
    reach = np.minimum(np.abs(along), 50.0)
    beside = np.exp(-((across / 50.0) ** 2))
    return beside / np.cos(np.radians(reach)) ** 1.5


def _post_top(along: np.ndarray, across: np.ndarray, off_axis: np.ndarray) -> np.ndarray:
    return 1 / np.cos(np.radians(np.minimum(off_axis, 55.0))) ** 1.5


def _high_mast(along: np.ndarray, across: np.ndarray, off_axis: np.ndarray) -> np.ndarray:
    return 1 / np.cos(np.radians(np.minimum(off_axis, 45.0)))


_SHAPES = {"road": _road, "tunnel": _tunnel, "post_top": _post_top, "high_mast": _high_mast}


def _signal() -> LampPattern:
    """Return a traffic signal, whose light goes down towards those who wait rather than up."""
    left = np.arange(-60.0, 60.1, 1.0)
    up = np.arange(-40.0, 20.1, 0.5)
    aside, below, above = SIGNAL_HALF_DEG
    half = np.where(up < 0, below, above)
    fall = 0.5 ** ((left / aside) ** 2 + ((up / half) ** 2)[:, None])
    return LampPattern(
        IntensityTable(left, up, (1 - SIGNAL_REST) * fall + SIGNAL_REST), SIGNAL_CD, ()
    )


def _cut_off(off_axis: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp((off_axis - CUT_OFF_DEG) / CUT_WIDTH_DEG * 2))


def _solid_angle(angle: np.ndarray, value: np.ndarray) -> float:
    """Return the integral of a table over directions, sr, by the trapezoidal rule."""
    rad = np.radians(angle)
    return float(np.trapezoid(np.trapezoid(value * np.cos(rad)[:, None], rad, axis=0), rad))
