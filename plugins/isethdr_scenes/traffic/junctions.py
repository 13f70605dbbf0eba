"""Junctions: who may enter. A way is given to one driver at a time among those that would meet."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import takewhile

from ..roads.lane_path import LaneKey
from .drivers import Driver, entries
from .tracks import Tracks

ASK_M = 35.0  # before a junction, at which a driver asks for its way
STOP_M = 6.5  # before a junction: behind crosswalk and stop line


class Junctions:
    """The ways through the junctions that are given."""

    def __init__(self, tracks: Tracks, red: frozenset[str]) -> None:
        self._tracks = tracks
        self._red = red  # names of the roads that meet a red signal
        self._given: dict[Driver, tuple[LaneKey, ...]] = {}

    def update(self, drivers: Iterable[Driver]) -> dict[Driver, float]:
        """Take back what was left, give new ways to the nearest first, and return where each
        driver that has to wait must stop, as a distance along its route.
        """
        active = [one for one in drivers if not one.gone]
        self._given = {one: ways for one, ways in self._given.items() if self._needs(one, ways)}
        for one in active:
            inside = self._inside(one)
            if inside and one not in self._given:
                self._given[one] = inside
        stops: dict[Driver, float] = {}
        asking = []
        for one in active:
            for start, _ in entries(one, self._tracks)[:1]:
                if not self._has(one, start):
                    asking.append((start - one.at_m, start, one))
        for distance, start, one in sorted(asking, key=lambda ask: ask[0]):
            ways = self._through(one, start)
            road = one.route[one.lane_at(start - 1e-6)].road
            front = one.at_m + one.length_m / 2
            too_late = front > start - STOP_M + 1.0
            if distance < ASK_M and (road not in self._red or too_late) and self._free(one, ways):
                self._given[one] = ways
            else:
                # who stands beyond the line already waits where it is
                stops[one] = max(start - STOP_M, min(front, start))
        return stops

    def _inside(self, one: Driver) -> tuple[LaneKey, ...]:
        """Return the lanes of a junction that a driver is on, and those that follow there."""
        rear = one.lane_at(one.at_m - one.length_m / 2)
        front = one.lane_at(one.at_m + one.length_m / 2)
        for k in range(rear, front + 1):
            if self._tracks[one.route[k]].junction:
                return self._from(one, k)
        return ()

    def _needs(self, one: Driver, ways: tuple[LaneKey, ...]) -> bool:
        """Return whether a driver has not yet left the ways that it was given."""
        last = one.route.index(ways[-1])
        end = one.starts_m[last] + self._tracks[ways[-1]].length_m
        return not one.gone and one.at_m - one.length_m / 2 < end

    def _has(self, one: Driver, start: float) -> bool:
        return self._through(one, start) == self._given.get(one)

    def _through(self, one: Driver, start: float) -> tuple[LaneKey, ...]:
        """Return the lanes of the junction that a route enters at a distance."""
        return self._from(one, one.lane_at(start + 1e-6))

    def _from(self, one: Driver, first: int) -> tuple[LaneKey, ...]:
        """Return the lanes of a junction that follow each other in a route."""
        return tuple(takewhile(lambda key: self._tracks[key].junction, one.route[first:]))

    def _free(self, one: Driver, ways: tuple[LaneKey, ...]) -> bool:
        """Return whether nobody else was given a way that crosses one of `ways`."""
        return not any(
            self._tracks.cross(mine, theirs)
            for other, given in self._given.items()
            if other is not one
            for theirs in given
            for mine in ways
        )
