"""Obstacles: what stands or walks in the way of a lane, besides other drivers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..placing.boxes import corners
from .tracks import Track

REACH_M = 3.5  # from a lane's middle: what is further is in nobody's way
LOW_M = 2.0  # what hangs higher is not in the way
CLEARANCE_M = 0.05


class Obstacle(NamedTuple):
    """The place on a lane where something begins, and how far it reaches to both sides."""

    s_m: float
    left_m: float  # of the middle of the lane
    right_m: float  # negative to the right of it

    def meets(self, aside_m: float, width_m: float) -> bool:
        """Return whether it is in the way of a vehicle of a width, aside of the lane's middle."""
        half = width_m / 2 + CLEARANCE_M
        return aside_m - half < self.left_m and aside_m + half > self.right_m


def obstacles(track: Track, boxes: np.ndarray, whole: bool = False) -> list[Obstacle]:
    """Return what `boxes` (n, FIELDS) are to the drivers of a lane.

    Parameters
    ----------
    track : the lane.
    boxes : (n, FIELDS) boxes in the world, as of `placing.boxes.rows`.
    whole : whether drivers wait wherever in the lane something is, as for people who cross.
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
