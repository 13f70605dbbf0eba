"""Junctions: who may enter. A way is given to one driver at a time among those that would meet.

A signal that is not green stops all who can still stop before its line.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import takewhile

from ..roads.lane_path import LaneKey
from .drivers import Driver, entries
from .signal_plan import SignalPlan
from .tracks import Tracks

ASK_M = 35.0  # before a junction, at which a driver asks for its way
STOP_M = 6.5  # before a junction: behind crosswalk and stop line
PAST_M = 1.0  # beyond that place, from which a driver goes on
SIGNAL_BRAKING_M_S2 = 3.0  # who has to brake harder than that for a signal passes it


class Junctions:
    """The ways through the junctions that are given."""

    def __init__(self, tracks: Tracks, signals: SignalPlan) -> None:
        self._tracks = tracks
        self._signals = signals
        self._given: dict[Driver, tuple[LaneKey, ...]] = {}

    def update(self, drivers: Iterable[Driver], time_s: float) -> dict[Driver, float]:
        """Take back what was left, give new ways to the nearest first, and return where each
        driver that has to wait must stop, as a distance along its route.

        Parameters
        ----------
        drivers : all of them, in a fixed order.
        time_s : seconds from the layout as placed, at which the signals are seen.
        """
        active = [one for one in drivers if not one.gone]
        self._given = {
            one: ways
            for one, ways in self._given.items()
            if self._needs(one, ways) and not self._is_stopped(one, self._start(one, ways), time_s)
        }
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
            stopped = self._is_stopped(one, start, time_s)
            if distance < ASK_M and not stopped and self._free(one, ways):
                self._given[one] = ways
            else:
                front = one.at_m + one.length_m / 2
                # who stands beyond the line already waits where it is
                stops[one] = max(start - STOP_M, min(front, start))
        return stops

    def _is_stopped(self, one: Driver, start: float, time_s: float) -> bool:
        """Return whether a signal before a junction is not green, and a driver can still stop."""
        before = one.lane_at(start - 1e-6)
        shown = self._signals.state(one.route[before].road, time_s)
        room = start - STOP_M + PAST_M - (one.at_m + one.length_m / 2)
        needed = one.speed_m_s**2 / (2 * SIGNAL_BRAKING_M_S2)
        return shown not in ("", "green") and room >= needed

    def _start(self, one: Driver, ways: tuple[LaneKey, ...]) -> float:
        """Return where a driver enters its ways, as a distance along its route."""
        return one.starts_m[one.route.index(ways[0])]

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
