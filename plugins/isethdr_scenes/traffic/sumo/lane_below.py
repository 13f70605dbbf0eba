"""The lane of the road on which a vehicle is: the nearest lane in its direction."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from ...placing.site import OnLane
from ...roads.network import Network
from ...roads.profile import Floats
from ..tracks import Track

TYPES = ("driving", "biking", "parking", "shoulder", "border", "sidewalk")
NEAREST = 24  # number of nearest points that are compared
REACH_M = 8.0  # largest distance of a vehicle from a point of its lane
TURN_RAD = 1.05  # largest angle between a vehicle and its lane
TURN_WEIGHT_M = 2.0  # distance that counts as much as an angle of one radian


class LanesBelow:
    """Look-up of lanes by plan point and heading."""

    def __init__(self, network: Network) -> None:
        self._network = network

    @cached_property
    def _tracks(self) -> tuple[Track, ...]:
        return tuple(Track(path) for path in self._network.lanes(TYPES))

    @cached_property
    def _points(self) -> tuple[cKDTree, np.ndarray, Floats, Floats]:
        """Return a tree of all points, and for each point its track, its s and its heading."""
        of = [np.full(len(track.s_m), k) for k, track in enumerate(self._tracks)]
        plan = [track.plan_m for track in self._tracks]
        s = [track.s_m for track in self._tracks]
        heading = [track.heading_rad for track in self._tracks]
        return (
            cKDTree(np.concatenate(plan)),
            np.concatenate(of),
            np.concatenate(s),
            np.concatenate(heading),
        )

    def at(self, point_m: Floats, heading_rad: float) -> OnLane | None:
        """Return the lane at a plan point (2,), and the place along and aside; None without one."""
        tree, of, s, headings = self._points
        distance, near = tree.query(point_m, NEAREST, distance_upper_bound=REACH_M)
        near = near[np.isfinite(distance)]
        if not len(near):
            return None
        turn = np.abs(np.angle(np.exp(1j * (headings[near] - heading_rad))))
        way = point_m - tree.data[near]
        cos = np.cos(headings[near])
        sin = np.sin(headings[near])
        aside = way[:, 1] * cos - way[:, 0] * sin
        ahead = way[:, 0] * cos + way[:, 1] * sin
        cost = np.abs(aside) + np.abs(ahead) + TURN_WEIGHT_M * turn
        cost[turn > TURN_RAD] = np.inf
        k = int(np.argmin(cost))
        if not np.isfinite(cost[k]):
            return None
        track = self._tracks[of[near[k]]]
        along = float(np.clip(s[near[k]] + ahead[k], 0.0, track.length_m))
        return OnLane(track.path.key, along, float(aside[k]))
