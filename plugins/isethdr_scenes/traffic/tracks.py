"""Tracks: lanes as tables over their length, the lanes that follow them, and which lanes cross."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from ..roads.lane_path import LaneKey, LanePath
from ..roads.network import Network

STEP_M = 0.5  # step of the tables
SIDEWAYS_M_S2 = 2.5  # greatest lateral acceleration in curves
CLEARANCE_M = 2.6  # least distance of the middles of two lanes that do not cross
STRAIGHT_RAD = 0.35  # a lane that turns less does not count as a turn


@dataclass(frozen=True, eq=False)
class Track:
    """A lane as a table of its middle, every half metre."""

    path: LanePath

    @cached_property
    def s_m(self) -> np.ndarray:
        """Metres along the lane (n,)."""
        count = max(3, int(np.ceil(self.path.length_m / STEP_M)) + 1)
        return np.linspace(0.0, self.path.length_m, count)

    @cached_property
    def plan_m(self) -> np.ndarray:
        """Plan points (n, 2)."""
        return self.path.points(self.s_m)[:, :2]

    @cached_property
    def heading_rad(self) -> np.ndarray:
        """Headings (n,) without jumps."""
        way = np.gradient(self.plan_m, axis=0)
        return np.unwrap(np.arctan2(way[:, 1], way[:, 0]))

    @cached_property
    def fastest_m_s(self) -> np.ndarray:
        """Speed (n,) that the limit and the curves allow."""
        curvature = np.abs(np.gradient(self.heading_rad, self.s_m))
        in_curves = np.sqrt(SIDEWAYS_M_S2 / np.maximum(curvature, 1e-6))
        return np.minimum(self.path.road.speed_limit_kmh / 3.6, in_curves)

    @cached_property
    def width_m(self) -> np.ndarray:
        """Widths (n,) of the lane."""
        return self.path.width_m(self.s_m)

    @cached_property
    def tree(self) -> cKDTree:
        """Look-up of the plan points."""
        return cKDTree(self.plan_m)

    def beside(self, points_m: np.ndarray, reach_m: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the coordinates of plan points on the lane.

        Parameters
        ----------
        points_m : (n, 2) plan points, m.
        reach_m : largest distance from the lane's middle, m.

        Returns
        -------
        Metres along the lane (n,) and to the left of its middle (n,); NaN for points farther away.
        """
        distance, nearest = self.tree.query(points_m, distance_upper_bound=reach_m)
        near = np.isfinite(distance)
        s = np.full(len(points_m), np.nan)
        t = np.full(len(points_m), np.nan)
        k = nearest[near]
        s[near] = self.s_m[k]
        way = points_m[near] - self.plan_m[k]
        heading = self.heading_rad[k]
        t[near] = way[:, 1] * np.cos(heading) - way[:, 0] * np.sin(heading)
        return s, t

    @property
    def length_m(self) -> float:
        """Length of the lane's middle."""
        return self.path.length_m

    @property
    def junction(self) -> str:
        """Name of the junction that the lane crosses, or ""."""
        return self.path.road.junction

    def place(self, s_m: float, aside_m: float) -> tuple[float, float, float]:
        """Return (x, y, heading) of a place on the lane, m and radians.

        Beyond its ends the lane continues straight.
        """
        heading = float(np.interp(s_m, self.s_m, self.heading_rad))
        x = float(np.interp(s_m, self.s_m, self.plan_m[:, 0]))
        y = float(np.interp(s_m, self.s_m, self.plan_m[:, 1]))
        beyond = s_m - min(max(s_m, 0.0), self.length_m)
        cos = np.cos(heading)
        sin = np.sin(heading)
        return x + beyond * cos - aside_m * sin, y + beyond * sin + aside_m * cos, heading

    def turn_rad(self) -> float:
        """Return the angle by which the lane turns to the left."""
        return float(self.heading_rad[-1] - self.heading_rad[0])


class Tracks:
    """The tracks of all lanes of a network; each is made at its first use."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self._made: dict[LaneKey, Track] = {}
        self._crossing: dict[frozenset[LaneKey], bool] = {}

    def __getitem__(self, key: LaneKey) -> Track:
        """Return the track of a lane."""
        if key not in self._made:
            self._made[key] = Track(self.network.lane(key))
        return self._made[key]

    def onward(self, key: LaneKey, turn: int) -> LaneKey | None:
        """Return the lane on which the traffic of a lane continues; None at the end of the network.

        Parameters
        ----------
        key : lane that the traffic leaves.
        turn : turn at a choice: 1 to the left, -1 to the right, 0 straight on.
        """
        ways = self.network.successors(key)
        if not ways:
            return None
        turned = [self[way].turn_rad() for way in ways]
        if turn:
            sharpest = max(range(len(ways)), key=lambda k: turn * turned[k])
            if turn * turned[sharpest] > STRAIGHT_RAD:
                return ways[sharpest]
        return ways[min(range(len(ways)), key=lambda k: abs(turned[k]))]

    def cross(self, one: LaneKey, other: LaneKey) -> bool:
        """Return whether vehicles on two lanes may hit each other."""
        if one == other:
            return False
        pair = frozenset((one, other))
        if pair not in self._crossing:
            distance, _ = self[one].tree.query(self[other].plan_m)
            self._crossing[pair] = bool(distance.min() < CLEARANCE_M)
        return self._crossing[pair]
