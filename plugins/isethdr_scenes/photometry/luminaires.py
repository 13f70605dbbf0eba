"""Luminaires and traffic signals as tables of candela over two angles.

They are models, designed by hand, not measured. The axis of a luminaire points down. In its table
`left_deg` is the angle along the road and `up_deg` the angle across it, towards the road. All
luminaires are full cut-off: their light ends below the horizontal plane. The axis of a signal is
level and points to the waiting traffic.

| name | distribution | flux, lm |
|---|---|---|
| road | batwing along the road, brightest 62 degrees to either side, narrow across it | 8 000 |
| tunnel | flat batwing along the road, brightest 50 degrees to either side, wide across | 4 350 |
| post_top | even all round, brightest 55 degrees off the axis | 4 000 |
| high_mast | even all round about an axis tilted outwards | 20 000 |
| signal | 200 cd on its axis, half of it 10 degrees aside and 7 degrees below, 3 above | 23 |

A signal of 200 mm has 200 cd on its axis. This assumes level 2 of EN 12368. The widths of its beam
are a model of a lens for wide roads; they are not taken from the table of the standard.

The fluxes are those of usual LED luminaires of these heights; this is an assumption. The batwing
makes the illuminance along the road more uniform. Its intensity rises with the angle along the road
up to the brightest angle, as 1 / cos^2 (`road`) or 1 / cos^1.5 (`tunnel`). An intensity of
1 / cos^3 would give uniform illuminance.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from isethdr_core.scene import IntensityTable

from .families import LampPattern

FLUX_LM = {"road": 8_000.0, "tunnel": 4_350.0, "post_top": 4_000.0, "high_mast": 20_000.0}
SIGNAL_CD = 200.0
# angles to the side, down and up at which the intensity of a signal has fallen to a half
SIGNAL_HALF_DEG = (10.0, 7.0, 3.0)
SIGNAL_REST = 0.004  # intensity of a signal far from its axis / intensity on the axis
STEP_DEG = 2.0
WIDEST_DEG = 88.0
CUT_OFF_DEG = 74.0  # angle off the axis at which the cut-off halves the intensity
CUT_WIDTH_DEG = 4.0  # twice the scale of the logistic function of the cut-off


@cache
def luminaire(name: str) -> LampPattern:
    """Return a luminaire of `FLUX_LM`, or the `signal`. It has no rules."""
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
    """Return a traffic signal. Its beam reaches further down, to waiting traffic, than up."""
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
