"""Obstacles: things and people in the way of a lane, other than drivers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..placing.boxes import corners
from .tracks import Track

REACH_M = 3.5  # things farther from a lane's middle are not in the way
LOW_M = 2.0  # things that hang higher are not in the way
CLEARANCE_M = 0.05


class Obstacle(NamedTuple):
    """The place on a lane where an obstacle begins, and its extent to both sides."""

    s_m: float
    left_m: float  # left end, to the left of the middle of the lane
    right_m: float  # right end, likewise: negative to the right of the middle

    def meets(self, aside_m: float, width_m: float) -> bool:
        """Return whether the obstacle is in the way of a vehicle with an offset `aside_m` to the
        left of the lane's middle and a width `width_m`.
        """
        half = width_m / 2 + CLEARANCE_M
        return aside_m - half < self.left_m and aside_m + half > self.right_m


def obstacles(track: Track, boxes: np.ndarray, whole: bool = False) -> list[Obstacle]:
    """Return the obstacles that boxes form for the drivers of a lane.

    Parameters
    ----------
    track : the lane.
    boxes : (n, FIELDS) boxes in the world, as made by `placing.boxes.rows`.
    whole : whether an obstacle blocks the whole width of the lane, as for people who cross.
    """
    low = boxes[boxes[:, 6] < LOW_M]
    if not len(low):
        return []
    points = corners(low)
    s, t = track.beside(points.reshape(-1, 2), REACH_M)
    s = s.reshape(points.shape[:2])
    t = t.reshape(points.shape[:2])
    found = []
    for k in np.flatnonzero(np.isfinite(s).any(1)):
        left, right = (np.inf, -np.inf) if whole else (np.nanmax(t[k]), np.nanmin(t[k]))
        found.append(Obstacle(float(np.nanmin(s[k])), float(left), float(right)))
    return found
