"""Drivers: each follows a route of lanes, and keeps its distance from vehicles and obstacles."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..placing.boxes import rows, solids
from ..placing.site import Foot, OnLane
from ..roads.lane_path import LaneKey
from ..things.thing import Thing
from .following import BRAKING_M_S2, TIME_GAP_S, acceleration_m_s2
from .obstacles import Obstacle
from .tracks import Tracks

LOOK_M = 100.0  # distance ahead within which a driver sees obstacles
BESIDE_M = 0.2  # least gap between the sides of two drivers that pass each other in one lane
ASIDE_LOOKS_M = (0.0, 5.0, 10.0)  # distances ahead at which a driver sees the width of the lane
NARROW_M = 0.15  # least free width beside a vehicle in its lane
BICYCLE_M_S = 5.0
# metres ahead at which a driver looks for curves and limits
LOOKS_M = np.array([0.0, 4.0, 8.0, 16.0, 32.0, 64.0])


class Ahead(NamedTuple):
    """Gap to the next obstacle ahead of a driver, and its speed."""

    gap_m: float = np.inf
    speed_m_s: float = 0.0


@dataclass(eq=False)
class Driver:
    """A vehicle or a bicycle on its route."""

    name: str
    things: tuple[Thing, ...]  # the vehicle first
    aside_m: float  # present offset to the left of the middle of its lane
    top_m_s: float  # speed on an empty road, if the limit allows it
    turn: int  # 1 to the left at the next choice, -1 to the right, 0 straight on
    route: list[LaneKey]
    at_m: float  # distance of its middle from the start of the first lane of the route
    starts_m: list[float] = field(default_factory=lambda: [0.0])
    speed_m_s: float = 0.0
    acceleration_m_s2: float = 0.0
    time_gap_s: float = TIME_GAP_S
    gone: bool = False  # whether the driver has left the network
    drawn_aside_m: float = 0.0
    length_m: float = 0.0
    width_m: float = 0.0

    def aside_in(self, tracks: Tracks) -> float:
        """Return the wanted offset to the left of the lane's middle, m.

        In a lane that is too narrow, the vehicle keeps away from the lane at its left.
        """
        width = np.inf
        for ahead in ASIDE_LOOKS_M:
            lane = self.on_lane(self.at_m + ahead)
            track = tracks[lane.key]
            width = min(width, float(np.interp(lane.s_m, track.s_m, track.width_m)))
        room = (width - self.width_m) / 2
        if room < NARROW_M:
            return room - NARROW_M
        return min(max(self.drawn_aside_m, -room), room)

    def lane_at(self, at_m: float) -> int:
        """Return the index of the lane of the route on which a distance lies."""
        return max(bisect_right(self.starts_m, at_m) - 1, 0)

    def on_lane(self, at_m: float) -> OnLane:
        """Return the driver's lane and its place on it at a distance along the route."""
        k = self.lane_at(at_m)
        return OnLane(self.route[k], at_m - self.starts_m[k], self.aside_m)

    def extend(self, tracks: Tracks, to_m: float) -> None:
        """Extend the route to a distance, or to the end of the network."""
        while self.end_m(tracks) < to_m:
            onward = tracks.onward(self.route[-1], self.turn)
            if onward is None:
                return
            self.starts_m.append(self.end_m(tracks))
            self.route.append(onward)

    def end_m(self, tracks: Tracks) -> float:
        """Return the distance along the route at which its last lane ends."""
        return self.starts_m[-1] + tracks[self.route[-1]].length_m

    def boxes(self, tracks: Tracks, at_m: float) -> np.ndarray:
        """Return the boxes (n, FIELDS) that the driver occupies at a distance along the route."""
        lane = self.on_lane(at_m)
        track = tracks[lane.key]
        place = track.place(lane.s_m, lane.aside_m)
        level = level_of(tracks, lane)
        return np.concatenate([rows(solids(thing), place, 1.0, level) for thing in self.things])

    def free_m_s(self, tracks: Tracks) -> float:
        """Return the speed that limits and curves ahead allow with comfortable braking."""
        limit = self.top_m_s
        for distance in LOOKS_M:
            if distance > self.speed_m_s**2 / (2 * BRAKING_M_S2) + 1:
                break
            lane = self.on_lane(self.at_m + distance)
            track = tracks[lane.key]
            there = float(np.interp(lane.s_m, track.s_m, track.fastest_m_s))
            limit = min(limit, np.sqrt(there**2 + 2 * BRAKING_M_S2 * distance))
        return limit


def level_of(tracks: Tracks, lane: OnLane) -> int:
    """Return 1 for a place on a bridge, else 0."""
    path = tracks[lane.key].path
    if not path.road.structures:
        return 0
    return int(path.road.on_structure("bridge", float(path.along_road(lane.s_m))))


def driver(foot: Foot, others: tuple[Thing, ...], tracks: Tracks, top_m_s: float) -> Driver:
    """Return the driver of a placed vehicle or bicycle.

    Parameters
    ----------
    foot : vehicle on its lane; its indicators decide the turn.
    others : things that move with it, such as a rider.
    tracks : lanes as tables.
    top_m_s : speed on an empty road, m/s.
    """
    assert foot.lane is not None
    turns = [lamp.partition(":")[2] for lamp in foot.lamps if lamp.startswith("indicator")]
    sides = {1 if side == "left" else -1 for side in turns}
    made = Driver(
        foot.name,
        (foot.thing, *others),
        foot.lane.aside_m,
        min(top_m_s, BICYCLE_M_S) if foot.thing.group == "bicycle" else top_m_s,
        sides.pop() if len(sides) == 1 else 0,
        [foot.lane.key],
        foot.lane.s_m,
        drawn_aside_m=foot.lane.aside_m,
        length_m=foot.thing.size_m[0],
        width_m=max(thing.size_m[1] for thing in (foot.thing, *others)),
    )
    made.extend(tracks, made.at_m + LOOK_M)
    return made


class Road:
    """Drivers and obstacles on each lane at one time."""

    def __init__(self, drivers: Iterable[Driver], obstacles: dict[LaneKey, list[Obstacle]]) -> None:
        self._on: dict[LaneKey, list[tuple[float, Driver]]] = {}
        self._obstacles = obstacles
        for one in drivers:
            # a driver that reaches into two lanes is on both
            for at in {one.lane_at(one.at_m), one.lane_at(one.at_m - one.length_m / 2)}:
                s = one.at_m - one.starts_m[at]
                self._on.setdefault(one.route[at], []).append((s, one))

    def ahead_of(self, one: Driver, stop_m: float) -> Ahead:
        """Return the nearest thing ahead of a driver.

        Parameters
        ----------
        one : the driver.
        stop_m : distance along its route beyond which it may not go.
        """
        front = one.at_m + one.length_m / 2
        nearest = Ahead(max(stop_m - front, 0.0)) if np.isfinite(stop_m) else Ahead()
        for k in range(one.lane_at(one.at_m), len(one.route)):
            start = one.starts_m[k]
            if start > front + LOOK_M:
                break
            for s, other in self._on.get(one.route[k], ()):
                behind = start + s - other.length_m / 2
                if other is one or start + s <= one.at_m or not _meets(one, other):
                    continue
                if behind - front < nearest.gap_m:
                    nearest = Ahead(max(behind - front, 0.0), other.speed_m_s)
            for obstacle in self._obstacles.get(one.route[k], ()):
                gap = start + obstacle.s_m - front
                if -0.5 < gap < nearest.gap_m and obstacle.meets(one.aside_m, one.width_m):
                    nearest = Ahead(max(gap, 0.0))
        return nearest


def _meets(one: Driver, other: Driver) -> bool:
    """Return whether two drivers of a lane are in each other's way."""
    apart = abs(one.aside_m - other.aside_m)
    return apart < (one.width_m + other.width_m) / 2 + BESIDE_M


def wanted_m_s2(one: Driver, tracks: Tracks, ahead: Ahead) -> float:
    """Return the acceleration that a driver chooses.

    Parameters
    ----------
    one : the driver.
    tracks : lanes as tables, for limits and curves.
    ahead : gap to the next obstacle ahead and its speed, m and m/s.
    """
    free = one.free_m_s(tracks)
    return acceleration_m_s2(one.speed_m_s, free, ahead.gap_m, ahead.speed_m_s, one.time_gap_s)


def lanes_of(drivers: Iterable[Driver]) -> set[LaneKey]:
    """Return the lanes of all routes."""
    return {key for one in drivers for key in one.route}


def entries(one: Driver, tracks: Tracks) -> Iterable[tuple[float, LaneKey]]:
    """Return the entries of a route into junctions ahead: distance along the route, m, and the lane
    in the junction.
    """
    steps = zip(pairwise(one.route), one.starts_m[1:])
    return [
        (start, after)
        for (before, after), start in steps
        if start > one.at_m - one.length_m / 2
        and tracks[after].junction
        and not tracks[before].junction
    ]
