"""The dipped beam of a car: candela over two angles, inside all limits of UN R112, class B.

A model for right-hand traffic, designed by hand, not measured. It consists of a hot spot a little
to the right, which decreases towards the near road so that the luminance of the road falls steadily
with distance; a wide flood on the road; a cut-off, level on the left and rising by 15 degrees on
the right; and stray light above it, which the test points for overhead signs require. The
inflection of the cut-off at 2.5 degrees left is 0.57 degrees below the horizon, as the regulation
aims a lamp.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from isethdr_core.scene import IntensityTable

# --- degrees ---
# angle below the horizon of the middle of the logistic step on the left; the inflection of the
# cut-off lies at 0.57
CUT_OFF_DOWN = 0.81
RISE = np.tan(np.radians(15.0))  # slope of the cut-off on the right
STEP_WIDTH = 0.105  # scale of the logistic step; the sharpness G is 0.2 to 0.32
HOT_RIGHT = 1.0  # angle of the hot spot to the right
HOT_HALF_WIDTH = 4.2  # half width of the hot spot at 1/e
# angles below the horizon at which hot spot and flood have half of their intensity
HOT_DOWN = 2.1
FLOOD_DOWN = 4.5
# half widths of the flood and of the stray light at 1/e
FLOOD_HALF_WIDTH = 22.0
STRAY_UP = 10.0
STRAY_ASIDE = 30.0
EDGE = 50.0  # largest angle of the table


@dataclass(frozen=True)
class BeamLevels:
    """Luminous intensities of the parts of a dipped beam."""

    hot_cd: float
    flood_cd: float
    stray_cd: float


R112_B = BeamLevels(15_000.0, 4_800.0, 170.0)  # UN R112, class B
CLASS_C = BeamLevels(17_000.0, 8_500.0, 170.0)  # UN R149-01, class C: wider and brighter


def candela(left_deg: np.ndarray, up_deg: np.ndarray) -> np.ndarray:
    """Return the luminous intensity, cd, of class B at angles left of and above the axis,
    degrees.
    """
    return candela_of(R112_B, left_deg, up_deg)


def candela_of(levels: BeamLevels, left_deg: np.ndarray, up_deg: np.ndarray) -> np.ndarray:
    """Return the luminous intensity, cd.

    Parameters
    ----------
    levels : intensities of the parts of the beam, cd.
    left_deg : angles left of the axis, degrees.
    up_deg : angles above the axis, degrees; they broadcast with `left_deg`.
    """
    left, up = np.broadcast_arrays(np.asarray(left_deg, float), np.asarray(up_deg, float))
    down = np.maximum(-up, 0.0)
    cut_off = -CUT_OFF_DOWN + RISE * np.maximum(-left, 0.0)
    below = 1 / (1 + np.exp(np.clip((up - cut_off) / STEP_WIDTH, -60, 60)))
    hot = levels.hot_cd / (1 + (down / HOT_DOWN) ** 2)
    hot = hot * np.exp(-(((left + HOT_RIGHT) / HOT_HALF_WIDTH) ** 2))
    flood = levels.flood_cd / (1 + (down / FLOOD_DOWN) ** 2)
    flood = flood * np.exp(-((left / FLOOD_HALF_WIDTH) ** 2))
    stray = levels.stray_cd * np.exp(-((up / STRAY_UP) ** 2) - (left / STRAY_ASIDE) ** 2)
    return below * (hot + flood) + stray


@cache
def beam_table(levels: BeamLevels) -> tuple[IntensityTable, float]:
    """Return the table of a beam relative to its largest intensity, and that intensity, cd."""
    left, up = nodes_deg()
    value = candela_of(levels, left, up[:, None])
    return IntensityTable(left, up, value / value.max()), float(value.max())


def nodes_deg() -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (left, up) of the table, degrees; they are dense around the cut-off."""
    aside = np.r_[np.arange(0, 8, 0.25), np.arange(8, 20, 1.0), np.arange(20, EDGE + 1, 3.0)]
    down = np.r_[np.arange(2.0, 6, 0.25), np.arange(6, 14, 1.0), np.arange(14, EDGE + 1, 3.0)]
    above = np.r_[np.arange(3.0, 6, 0.25), np.arange(6, EDGE + 1, 4.0)]
    up = np.r_[-down[::-1], np.arange(-1.95, 2.96, 0.05), above]
    return np.r_[-aside[:0:-1], aside], up
