"""Junctions: right of way. Of the drivers whose paths through a junction cross, one at a time is
granted its path.

A signal that is not green stops all drivers who can still stop before its line.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import takewhile

from ..roads.lane_path import LaneKey
from .drivers import Driver, entries
from .signal_plan import SignalPlan
from .tracks import Tracks

ASK_M = 35.0  # distance from a junction within which a driver may be granted its path
STOP_M = 6.5  # distance from a junction at which drivers stop: before crosswalk and stop line
PAST_M = 1.0  # a driver this far beyond that place no longer stops
SIGNAL_BRAKING_M_S2 = 3.0  # a driver that would have to brake harder passes a signal


class Junctions:
    """The paths through junctions that drivers have been granted."""

    def __init__(self, tracks: Tracks, signals: SignalPlan) -> None:
        self._tracks = tracks
        self._signals = signals
        self._given: dict[Driver, tuple[LaneKey, ...]] = {}

    def update(self, drivers: Iterable[Driver], time_s: float) -> dict[Driver, float]:
        """Release paths that drivers have left, grant new paths to the nearest drivers first, and
        return where each waiting driver must stop, m along its route.

        Parameters
        ----------
        drivers : all drivers, in a fixed order.
        time_s : time since the layout as placed, for the states of the signals, s.
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
                # a driver who is already beyond the line waits where it is
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
        """Return the distance along its route at which a driver enters its granted path."""
        return one.starts_m[one.route.index(ways[0])]

    def _inside(self, one: Driver) -> tuple[LaneKey, ...]:
        """Return the lane of a junction that a driver is on, and the next ones in that junction."""
        rear = one.lane_at(one.at_m - one.length_m / 2)
        front = one.lane_at(one.at_m + one.length_m / 2)
        for k in range(rear, front + 1):
            if self._tracks[one.route[k]].junction:
                return self._from(one, k)
        return ()

    def _needs(self, one: Driver, ways: tuple[LaneKey, ...]) -> bool:
        """Return whether a driver has not yet left the path that it was granted."""
        last = one.route.index(ways[-1])
        end = one.starts_m[last] + self._tracks[ways[-1]].length_m
        return not one.gone and one.at_m - one.length_m / 2 < end

    def _has(self, one: Driver, start: float) -> bool:
        return self._through(one, start) == self._given.get(one)

    def _through(self, one: Driver, start: float) -> tuple[LaneKey, ...]:
        """Return the lanes of the junction that a route enters at a distance."""
        return self._from(one, one.lane_at(start + 1e-6))

    def _from(self, one: Driver, first: int) -> tuple[LaneKey, ...]:
        """Return the lanes of a route from index `first` on that lie in the junction."""
        return tuple(takewhile(lambda key: self._tracks[key].junction, one.route[first:]))

    def _free(self, one: Driver, ways: tuple[LaneKey, ...]) -> bool:
        """Return whether no other driver was granted a lane that crosses one of `ways`."""
        return not any(
            self._tracks.cross(mine, theirs)
            for other, given in self._given.items()
            if other is not one
            for theirs in given
            for mine in ways
        )
