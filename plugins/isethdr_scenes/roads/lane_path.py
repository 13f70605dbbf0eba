"""Lane path: the middle of a lane as traffic drives along it, and the poses on it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .profile import Floats
from .road import Lane, Road

STEP_M = 0.5  # step of the table from metres along the lane to metres along the road


class LaneKey(NamedTuple):
    """Key of a lane: road, index of the section, number of the lane."""

    road: str
    section: int
    number: int


@dataclass(frozen=True)
class LanePath:
    """One lane of one section. Metres along it count in the direction of its traffic."""

    road: Road
    section: int
    lane: Lane

    @property
    def key(self) -> LaneKey:
        """Return the key of the lane."""
        return LaneKey(self.road.name, self.section, self.lane.number)

    @property
    def type(self) -> str:
        """Return the type of the lane."""
        return self.lane.type

    @property
    def direction(self) -> int:
        """Return 1 if the traffic goes along the reference line, -1 if it goes against it."""
        return 1 if (self.lane.number < 0) == self.road.right_hand else -1

    @cached_property
    def _table(self) -> tuple[Floats, Floats]:
        """Return metres along the lane and the s of the road, both in the order of the traffic."""
        first, last = self.road.span(self.section)
        s = np.linspace(first, last, max(3, int(np.ceil((last - first) / STEP_M)) + 1))
        if self.direction < 0:
            s = s[::-1]
        step = np.linalg.norm(np.diff(self._centre(s), axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(step)]), s

    def _centre(self, s: Floats) -> Floats:
        return self.road.points(s, self.offset_m(s), self.lane.raised_m)

    def offset_m(self, s_road_m: ArrayLike) -> Floats:
        """Return the lateral offset t of the lane's middle, m, at metres along the road."""
        inner, outer = self.road.borders(self.section, s_road_m)[self.lane.number]
        return (inner + outer) / 2

    @property
    def length_m(self) -> float:
        """Return the length of the lane's middle."""
        return float(self._table[0][-1])

    def along_road(self, s_m: ArrayLike) -> Floats:
        """Return metres along the road for metres along the lane."""
        return np.asarray(np.interp(np.asarray(s_m, float), *self._table))

    def along_lane(self, s_road_m: ArrayLike) -> Floats:
        """Return metres along the lane for metres along the road."""
        metres, s = self._table
        order = slice(None) if self.direction > 0 else slice(None, None, -1)
        return np.asarray(np.interp(np.asarray(s_road_m, float), s[order], metres[order]))

    def width_m(self, s_m: ArrayLike) -> Floats:
        """Return the width of the lane."""
        s = self.along_road(s_m) - self.road.span(self.section)[0]
        return self.lane.width.at(s)

    def points(self, s_m: ArrayLike) -> Floats:
        """Return the points (..., 3) of the lane's middle on the surface."""
        return self._centre(self.along_road(s_m))

    def at(self, s_m: float, aside_m: float = 0.0) -> Floats:
        """Return the (4, 4) pose `s_m` along the lane and `aside_m` to the left of its middle.

        x points along the traffic, z along the normal of the surface. The pose puts a thing that
        stands at its own origin on the lane.
        """
        s = float(self.along_road(s_m))
        h = 0.05
        ahead = self.offset_m(np.array([s - h, s, s + h]))
        curvature = float(self.road.line.at(s).curvature_per_m)
        drift = np.arctan2(float(ahead[2] - ahead[0]) / (2 * h), 1 - curvature * float(ahead[1]))
        turn = float(drift) if self.direction > 0 else float(drift) + np.pi
        t = float(ahead[1]) + self.direction * aside_m
        return self.road.pose(s, t, turn, self.lane.raised_m)
