"""Figures of merit of road surfaces: Q0, S1, S2 of an r-table, and R_L in headlamps.

Light and observer lie in the geometry of CIE 144:2001. gamma is the zenith angle of the light, beta
the angle between the vertical planes of light and observer, 0 where the light is ahead of the
observer, who looks down at an elevation of 1 degree. The reduced luminance coefficient is
r = q cos^3(gamma), where q = L / E is the BSDF, 1/sr; tables list 10^4 r.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

Bsdf = Callable[[np.ndarray, np.ndarray], np.ndarray]  # (light, observer) unit vectors -> 1/sr

TAN_GAMMA = np.r_[0:2.01:0.25, 2.5:12.01:0.5]
BETA_DEG = np.array(
    [0, 2, 5, 10, 15, 20, 25, 30, 35, 40, 45, 60, 75, 90, 105, 120, 135, 150, 165, 180], float
)
OBSERVER_DEG = 1.0
# elevations of a lamp 0.65 m high and of an observer 1.2 m high at a distance of 30 m
EN_1436_DEG = (1.24, 2.29)
# extent of the lamps in mounting heights: 4 behind the observed point, 12 ahead, 3 to either side
Q0_REACH = (-4.0, 12.0, 3.0)
SPECULAR_ROW = 8  # row of tan(gamma) = 2


class RoadFigures(NamedTuple):
    """Q0, mean luminance coefficient, 1/sr; S1 = r(2, 0) / r(0, 0); S2 = Q0 / r(0, 0)."""

    q0: float
    s1: float
    s2: float


def directions(
    observer_deg: float, tan_gamma: np.ndarray, beta_deg: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return unit vectors to the light and to the observer, z up, each of shape (..., 3).

    Parameters
    ----------
    observer_deg : angle by which the observer looks down, degrees.
    tan_gamma : tangent of the zenith angle of the light, any shape.
    beta_deg : angle between the vertical planes of light and observer, degrees; broadcasts with
        `tan_gamma`.
    """
    gamma = np.arctan(tan_gamma)
    beta = np.radians(beta_deg)
    elevation = np.radians(observer_deg)
    light = [np.sin(gamma) * np.cos(beta), np.sin(gamma) * np.sin(beta), np.cos(gamma)]
    observer = [-np.cos(elevation) + 0 * gamma, 0 * gamma, np.sin(elevation) + 0 * gamma]
    return np.stack(np.broadcast_arrays(*light), -1), np.stack(np.broadcast_arrays(*observer), -1)


def r_table(bsdf: Bsdf, observer_deg: float = OBSERVER_DEG) -> np.ndarray:
    """Return the table (29, 20) of 10^4 r of `bsdf`, rows tan(gamma), columns beta."""
    tan_gamma, beta = np.meshgrid(TAN_GAMMA, BETA_DEG, indexing="ij")
    light, observer = directions(observer_deg, tan_gamma, beta)
    return 1e4 * bsdf(light, observer) * (1 + tan_gamma**2) ** -1.5


def figures(table: np.ndarray) -> RoadFigures:
    """Return Q0, S1 and S2 of a table (29, 20) of 10^4 r; cells without a value hold 0."""
    q0 = float((Q0_WEIGHTS * table).sum()) / 1e4
    upright = float(table[0, 0])
    return RoadFigures(q0, float(table[SPECULAR_ROW, 0]) / upright, 1e4 * q0 / upright)


def weighted_difference(table: np.ndarray, reference: np.ndarray) -> float:
    """Return the rms difference of two tables over the rms of `reference`.

    Cells have the weights of Q0. Cells where the reference has no value (0) do not count.
    """
    weights = Q0_WEIGHTS * (reference > 0)
    return float(
        np.sqrt((weights * (table - reference) ** 2).sum() / (weights * reference**2).sum())
    )


def retro_luminance(
    bsdf: Bsdf, light_deg: float = EN_1436_DEG[0], observer_deg: float = EN_1436_DEG[1]
) -> float:
    """Return R_L = L / E, mcd m-2 lx-1, with E on a plane that faces the lamp (EN 1436:2018).

    Lamp and observer stand in one vertical plane on the same side.

    Parameters
    ----------
    bsdf : function(light, observer) of unit vectors, 1/sr.
    light_deg : elevation of the lamp, degrees.
    observer_deg : elevation of the observer, degrees.
    """
    tan_gamma = np.array([1 / np.tan(np.radians(light_deg))])
    light, observer = directions(observer_deg, tan_gamma, np.array([180.0]))
    return float(1e3 * bsdf(light, observer)[0] * np.sin(np.radians(light_deg)))


def _q0_weights(step: float = 0.02) -> np.ndarray:
    """Return weights (29, 20): Q0 = sum(weights * table) / 10^4.

    Q0 is the mean of q over the solid angle of the lamps of `Q0_REACH`. Cells are interpolated
    bilinearly. The table is symmetric about the plane of the observer, so one side is enough.
    """
    back, ahead, aside = Q0_REACH
    along = np.arange(back + step / 2, ahead, step)
    x, y = np.meshgrid(along, np.arange(step / 2, aside, step))
    tangent = np.hypot(x, y)
    beta = np.degrees(np.arctan2(y, x))
    tangent, beta = tangent[tangent <= TAN_GAMMA[-1]], beta[tangent <= TAN_GAMMA[-1]]
    row = np.clip(np.searchsorted(TAN_GAMMA, tangent) - 1, 0, len(TAN_GAMMA) - 2)
    column = np.clip(np.searchsorted(BETA_DEG, beta) - 1, 0, len(BETA_DEG) - 2)
    down = (tangent - TAN_GAMMA[row]) / (TAN_GAMMA[row + 1] - TAN_GAMMA[row])
    right = (beta - BETA_DEG[column]) / (BETA_DEG[column + 1] - BETA_DEG[column])
    out = np.zeros((len(TAN_GAMMA), len(BETA_DEG)))
    for below, vertical in ((0, 1 - down), (1, down)):
        for beside, horizontal in ((0, 1 - right), (1, right)):
            np.add.at(out, (row + below, column + beside), vertical * horizontal)
    # equal areas of a plane of lamps have solid angles proportional to cos^3, and r = q cos^3
    return out / ((1 + tangent**2) ** -1.5).sum()


Q0_WEIGHTS = _q0_weights()
