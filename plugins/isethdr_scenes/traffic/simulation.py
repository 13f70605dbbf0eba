"""Simulation: drivers and pedestrians in steps of a tenth of a second, and their state at any time.

A driver or pedestrian whose step would lead too near to another object does not move in that step.
"""

from __future__ import annotations

from itertools import chain
from typing import NamedTuple

import numpy as np

from ..placing.boxes import FIELDS, overlapping
from ..placing.plan import Layout
from ..placing.site import Foot, OnLane
from ..placing.vehicles import EGO_M, dense_speed_m_s
from ..roads.lane_path import LaneKey
from ..things.thing import Thing
from .drivers import LOOK_M, Driver, Road, driver, lanes_of, wanted_m_s2
from .following import accepted_gap_s, speed_that_stops_m_s
from .junctions import Junctions
from .obstacles import Obstacle, obstacles
from .pedestrians import Footways, Pedestrian, pedestrians
from .signal_plan import signal_plan
from .tracks import Tracks

STEP_S = 0.1
NO_BOXES = np.empty((0, FIELDS))
OWN = "own vehicle"
OWN_HEIGHT_M = 1.5
FAR_M = 1e6  # coordinate to which removed boxes are moved
NEAR_M = 25.0  # boxes farther apart than this cannot touch
GAP_M = 0.02  # least gap between boxes after a step
SIDEWAYS_M_S = 0.5  # lateral speed of a vehicle that makes room in a narrow lane
STANDING_M_S = 0.1  # slower vehicles count as standing
PASSES = 6  # passes along queues in which start speeds are limited


class Moved(NamedTuple):
    """One driver at one time."""

    lane: OnLane
    speed_m_s: float
    acceleration_m_s2: float
    gone: bool


class _Noted(NamedTuple):
    """One driver after a step."""

    at_m: float
    aside_m: float
    speed_m_s: float
    acceleration_m_s2: float
    gone: bool


class State(NamedTuple):
    """All drivers and pedestrians at one time."""

    drivers: dict[str, Moved]
    people: dict[str, tuple[float, float]]  # plan points, m
    own_way_m: float  # distance that the camera's car has driven


class Simulation:
    """Motion of a layout over time. The same layout gives the same traffic."""

    def __init__(self, layout: Layout, vehicles_per_km: float) -> None:
        self.base = layout.base
        self._tracks = Tracks(layout.base.network)
        feet = [standing.foot for standing in layout.standing]
        riders: dict[str, Foot] = {foot.partner: foot for foot in feet if foot.partner}
        top = dense_speed_m_s(vehicles_per_km)
        self._drivers = [
            driver(foot, _with(riders.get(foot.name)), self._tracks, _share(foot) * top)
            for foot in feet
            if foot.lane is not None
        ]
        self._drivers.append(driver(self._own(), (), self._tracks, top))
        moving = {one.name for one in self._drivers} | {
            foot.name for foot in feet if foot.partner in {one.name for one in self._drivers}
        }
        self._people = pedestrians(foot for foot in feet if foot.name not in moving)
        self._footways = Footways(layout.base.network, self._people, STEP_S)
        moving |= {one.name for one in self._people}
        # people walk through grass
        still = [f for f in feet if f.name not in moving and f.thing.group != "grass"]
        crossing = [foot.boxes() for foot in still if foot.role == "crossing"]
        self._crossing_still = np.concatenate([NO_BOXES, *crossing])
        self._still = np.concatenate([NO_BOXES, *(foot.boxes() for foot in still)])
        self._places = _Places(
            self._still,
            {
                **{one: one.boxes(self._tracks, one.at_m) for one in self._drivers},
                **{one: one.boxes(*one.after(0.0)) for one in self._people},
            },
        )
        self._junctions = Junctions(self._tracks, signal_plan(layout.signals))
        self._walls: dict[LaneKey, list[Obstacle]] = {}
        self._at: list[list[_Noted]] = []
        self._walked: list[list[tuple[float, float]]] = []
        self._start()

    def _own(self) -> Foot:
        """Return the camera's car as a thing on its lane."""
        thing = Thing("own", 0, "own vehicle", (*EGO_M, OWN_HEIGHT_M), "car")
        pose = self.base.pose()
        heading = float(np.arctan2(pose[1, 0], pose[0, 0]))
        lane = OnLane(self.base.start, self.base.start_m, self.base.aside_m)
        return Foot(OWN, thing, float(pose[0, 3]), float(pose[1, 3]), heading, "driving", lane=lane)

    def _start(self) -> None:
        """Give all drivers a speed at which none has to brake hard, and record the first state."""
        stops = self._junctions.update(self._drivers, 0.0)
        road = self._road()
        for one in self._drivers:
            one.speed_m_s = one.free_m_s(self._tracks)
        for _ in range(PASSES):  # those behind follow those ahead
            for one in self._drivers:
                ahead = road.ahead_of(one, stops.get(one, np.inf))
                safe = speed_that_stops_m_s(ahead.gap_m, ahead.speed_m_s)
                one.speed_m_s = min(one.speed_m_s, safe)
        for one in self._drivers:
            gap_m = road.ahead_of(one, np.inf).gap_m
            one.time_gap_s = accepted_gap_s(gap_m, one.speed_m_s)
        self._note()

    def _road(self) -> Road:
        lanes = lanes_of(self._drivers)
        crossing = [one for one in self._people if one.foot.role == "crossing"]
        walking = [one for one in self._people if one.foot.role != "crossing"]
        on_foot = {
            True: np.concatenate([self._crossing_still, *(self._boxes(one) for one in crossing)]),
            False: np.concatenate([NO_BOXES, *(self._boxes(one) for one in walking)]),
        }
        found: dict[LaneKey, list[Obstacle]] = {}
        for key in lanes:
            track = self._tracks[key]
            if key not in self._walls:
                self._walls[key] = obstacles(track, self._still)
            moving = (obstacles(track, boxes, whole) for whole, boxes in on_foot.items())
            found[key] = [*self._walls[key], *chain.from_iterable(moving)]
        return Road((one for one in self._drivers if not one.gone), found)

    def _boxes(self, person: Pedestrian) -> np.ndarray:
        """Return the boxes that a pedestrian occupies now."""
        return person.boxes(*person.after(STEP_S * person.steps))

    def step(self) -> None:
        """Advance by `STEP_S`."""
        stops = self._junctions.update(self._drivers, STEP_S * (len(self._at) - 1))
        road = self._road()
        active = [one for one in self._drivers if not one.gone]
        wanted = [
            wanted_m_s2(one, self._tracks, road.ahead_of(one, stops.get(one, np.inf)))
            for one in active
        ]
        for one, acceleration in zip(active, wanted, strict=True):
            self._drive(one, acceleration)
        for k, person in enumerate(self._people):
            if not self._footways.may_stand(k, person.steps + 1):
                continue
            if self._places.move(person, person.boxes(*person.after(STEP_S * (person.steps + 1)))):
                person.steps += 1
        self._note()

    def _drive(self, one: Driver, acceleration: float) -> None:
        speed = max(0.0, one.speed_m_s + acceleration * STEP_S)
        at = one.at_m + (one.speed_m_s + speed) / 2 * STEP_S
        aside = one.aside_m
        shift = SIDEWAYS_M_S * STEP_S if speed > STANDING_M_S else 0.0
        one.aside_m += min(max(one.aside_in(self._tracks) - aside, -shift), shift)
        one.extend(self._tracks, at + LOOK_M)
        if at > one.end_m(self._tracks):
            one.gone = True
            self._places.remove(one)
        elif self._places.move(one, one.boxes(self._tracks, at)):
            one.acceleration_m_s2 = (speed - one.speed_m_s) / STEP_S
            one.speed_m_s = speed
            one.at_m = at
        else:
            one.aside_m = aside
            one.acceleration_m_s2 = -one.speed_m_s / STEP_S
            one.speed_m_s = 0.0

    def _note(self) -> None:
        self._at.append(
            [
                _Noted(one.at_m, one.aside_m, one.speed_m_s, one.acceleration_m_s2, one.gone)
                for one in self._drivers
            ]
        )
        self._walked.append([one.after(STEP_S * one.steps) for one in self._people])

    def at(self, time_s: float) -> State:
        """Return the state at a time, s. Places are interpolated linearly between the steps."""
        before = int(time_s / STEP_S + 1e-9)
        while len(self._at) < before + 2:
            self.step()
        part = time_s / STEP_S - before
        drivers = {}
        way = 0.0
        for one, old, new in zip(
            self._drivers, self._at[before], self._at[before + 1], strict=True
        ):
            aside = old.aside_m + part * (new.aside_m - old.aside_m)
            at = old.at_m + part * (new.at_m - old.at_m)
            lane = one.on_lane(at)._replace(aside_m=aside)
            if one.name == OWN:
                way = at - self.base.start_m
            acceleration = new.acceleration_m_s2 if part else old.acceleration_m_s2
            drivers[one.name] = Moved(lane, old.speed_m_s, acceleration, old.gone)
        people = {}
        for person, here, there in zip(
            self._people, self._walked[before], self._walked[before + 1], strict=True
        ):
            x, y = (a + part * (b - a) for a, b in zip(here, there, strict=True))
            people[person.name] = (x, y)
        return State(drivers, people, way)


class _Places:
    """The boxes of all things; those of drivers and pedestrians can be changed."""

    def __init__(self, still: np.ndarray, moving: dict[Driver | Pedestrian, np.ndarray]) -> None:
        self._rows = np.concatenate([still, *moving.values()])
        self._of: dict[Driver | Pedestrian, slice] = {}
        start = len(still)
        for one, boxes in moving.items():
            self._of[one] = slice(start, start + len(boxes))
            start += len(boxes)

    def remove(self, one: Driver | Pedestrian) -> None:
        """Remove the boxes of a driver or a pedestrian."""
        self._rows[self._of[one], :2] = FAR_M

    def move(self, one: Driver | Pedestrian, boxes: np.ndarray) -> bool:
        """Move a driver or a pedestrian to new boxes if that place is free; return whether it was.

        Boxes that are already nearer than `GAP_M` to a thing may stay near it, but not overlap it.
        """
        own = self._of[one]
        near = (np.abs(self._rows[:, :2] - boxes[0, :2]) < NEAR_M).all(1)
        near[own] = False
        others = self._rows[near]
        here = np.array([overlapping(box, others, GAP_M) for box in self._rows[own]]).any(0)
        there = np.array([overlapping(box, others, GAP_M) for box in boxes]).any(0)
        touching = there.any() and any(overlapping(box, others).any() for box in boxes)
        if touching or (there & ~here).any():
            return False
        self._rows[own] = boxes
        return True


def _with(rider: Foot | None) -> tuple[Thing, ...]:
    return (rider.thing,) if rider else ()


def _share(foot: Foot) -> float:
    """Return the ratio of a driver's speed to the free speed, drawn by name and thing."""
    return float(np.random.default_rng([foot.thing.variant, len(foot.name)]).uniform(0.93, 1.03))
