"""Site: a road, the things placed on it so far, and the random numbers of each step."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, NamedTuple
from zlib import crc32

import numpy as np

from ..roads.free_areas import AreaKind, FreeArea
from ..roads.kinds import BaseRoad
from ..roads.lane_path import LaneKey
from ..roads.road import LANE_TYPES, Road
from ..things.stock import BUNDLED, Stock
from ..things.thing import Thing
from .boxes import Taken, corners, rows, solids

REACH_M = 200.0  # largest distance of things from the camera's car
LEAST_AREA_M = 1.5  # least length of an area in which something may stand
MIRROR_M = 0.2  # length by which mirrors of parked vehicles may reach over the line of their bay
OVERHEAD_M = 4.5  # least height of parts that may hang over a carriageway
Role = Literal[
    "driving", "parked", "riding", "crossing", "walking", "works", "roadside", "scenario"
]
# types of lanes on which things of a role may stand; "" is off the road
ALLOWED: dict[Role, tuple[str, ...]] = {
    "driving": LANE_TYPES,
    "riding": ("driving", "biking", "shoulder", "border"),
    "crossing": ("driving", "biking", "parking", "shoulder", "border", "sidewalk"),
    "parked": ("parking", "shoulder"),
    "walking": ("sidewalk", "shoulder", "border", ""),
    "works": (*LANE_TYPES, ""),
    "scenario": (*LANE_TYPES, ""),
    "roadside": ("sidewalk", "median", "border", "curb", ""),
}
MAY_STAND = {
    role: np.array([kind in allowed for kind in (*LANE_TYPES, "")])
    for role, allowed in ALLOWED.items()
}
Lean = Literal["upright", "surface", "line"]


class OnLane(NamedTuple):
    """Place of a vehicle on a lane."""

    key: LaneKey
    s_m: float  # place of its middle along the lane
    aside_m: float  # distance to the left of the lane's middle


@dataclass(frozen=True)
class Foot:
    """A thing and its place in plan."""

    name: str
    thing: Thing
    x_m: float
    y_m: float
    heading_rad: float
    role: Role = "roadside"
    lamps: tuple[str, ...] = ()
    scale: float = 1.0
    # upright; tilted with the surface, as a vehicle; or tilted along its y axis only, as a panel
    lean: Lean = "upright"
    road: str = ""  # name of the road that carries it; it sets the height only on a bridge
    level: int = 0  # 1 on a bridge, else 0
    partner: str = ""  # name of the other of a pair that touches, such as a bicycle and its rider
    lane: OnLane | None = None  # place on a lane, for traffic
    stops: str = ""  # for a traffic light: name of the road with the traffic that it controls

    def boxes(self) -> np.ndarray:
        """Return the boxes (n, FIELDS) that it occupies."""
        at = (self.x_m, self.y_m, self.heading_rad)
        return rows(solids(self.thing), at, self.scale, self.level)


class Place(NamedTuple):
    """A plan point and a heading."""

    x_m: float
    y_m: float
    heading_rad: float


@dataclass(eq=False)
class Site:
    """A road that is being filled with things."""

    base: BaseRoad
    seed: int
    feet: list[Foot] = field(default_factory=list)  # things placed so far
    taken: Taken = field(default_factory=Taken)  # boxes occupied so far
    stock: Stock = BUNDLED  # things that may be drawn

    def rng(self, step: str) -> np.random.Generator:
        """Return the random numbers of one step. They do not depend on other steps."""
        return np.random.default_rng([self.seed, crc32(step.encode())])

    @cached_property
    def middle(self) -> np.ndarray:
        """Return the plan point (2,) of the camera's car, m."""
        return self.base.pose()[:2, 3]

    @cached_property
    def _areas(self) -> dict[AreaKind, tuple[FreeArea, ...]]:
        return {}

    def areas(self, kind: AreaKind) -> tuple[FreeArea, ...]:
        """Return the free areas of one kind that are long enough to stand in."""
        if kind not in self._areas:
            found = self.base.network.free_areas(kind)
            self._areas[kind] = tuple(area for area in found if area.length_m > LEAST_AREA_M)
        return self._areas[kind]

    @cached_property
    def open_roads(self) -> tuple[Road, ...]:
        """Return the roads that are not part of a junction."""
        return tuple(road for road in self.base.network.roads if not road.junction)

    @cached_property
    def length_km(self) -> float:
        """Return the length of all open roads within reach, km."""
        total = 0.0
        for road in self.open_roads:
            s = np.arange(0.5, road.length_m, 1.0)
            total += float(self.near(road.line.points(s)).sum())
        return total / 1000

    def near(self, points: np.ndarray) -> np.ndarray:
        """Return which plan points (..., 2) are within reach of the camera's car."""
        return np.linalg.norm(np.asarray(points) - self.middle, axis=-1) < REACH_M

    def beside(self, road: Road, side: int, s_m: float, beyond_m: float) -> Place:
        """Return a place next to a road. Its heading is that of the traffic on that side.

        Parameters
        ----------
        road : the road.
        side : 1 on the left of the reference line, -1 on its right.
        s_m : place along the reference line, m.
        beyond_m : distance outside of the road's edge, m; negative on the road.
        """
        right, left = road.edges(s_m)
        t = float(left if side > 0 else right) + side * beyond_m
        x, y = road.line.points(s_m, t)
        heading = float(road.line.at(s_m).heading_rad)
        along = side < 0 if road.right_hand else side > 0
        return Place(float(x), float(y), heading if along else heading + np.pi)

    def allowed(self, feet: list[Foot]) -> np.ndarray:
        """Return which feet are within reach and stand only where their role may stand."""
        if not feet:
            return np.zeros(0, bool)
        boxes = []
        owner = []
        for k, foot in enumerate(feet):
            low = [_shrunk(box, foot.role) for box in foot.boxes() if box[6] < OVERHEAD_M]
            boxes += low
            owner += [k] * len(low)
        points = corners(np.array(boxes))
        points = np.concatenate([points, np.array(boxes)[:, None, :2]], 1)
        ranks = self.base.network.ground.lane_ranks(points.reshape(-1, 2)).reshape(len(boxes), -1)
        ok = self.near(np.array([(f.x_m, f.y_m) for f in feet]))
        for k, row in zip(owner, ranks, strict=True):
            ok[k] &= bool(MAY_STAND[feet[k].role][row].all())
        return ok

    def put(self, foot: Foot, gap_m: float) -> bool:
        """Place a foot if nothing is closer than `gap_m`; return whether it was placed."""
        boxes = foot.boxes()
        if not self.taken.free(boxes, gap_m):
            return False
        self.taken.add(boxes)
        self.feet.append(foot)
        return True

    def put_pair(self, foot: Foot, partner: Foot, gap_m: float) -> bool:
        """Place two feet that touch, and return whether they were placed.

        Parameters
        ----------
        foot : a vehicle.
        partner : its rider.
        gap_m : least distance to all other things, m.
        """
        boxes = np.concatenate([foot.boxes(), partner.boxes()])
        if not self.taken.free(boxes, gap_m):
            return False
        self.taken.add(boxes)
        self.feet += [foot, partner]
        return True

    def put_first(self, feet: list[Foot], count: int, gap_m: float) -> int:
        """Place the first `count` of `feet` that may stand where they are.

        Parameters
        ----------
        feet : candidates, in order of preference.
        count : largest number to place.
        gap_m : least distance to all other things, m.

        Returns
        -------
        The number of feet placed.
        """
        placed = 0
        for foot, ok in zip(feet, self.allowed(feet), strict=True):
            if placed == count:
                break
            placed += bool(ok) and self.put(foot, gap_m)
        return placed

    def put_each(self, choices: list[list[Foot]], gap_m: float) -> int:
        """Place the first foot of each list that may stand where it is; return the number placed.

        `gap_m` is the least distance to all other things, m.
        """
        fine = iter(self.allowed([foot for feet in choices for foot in feet]))
        placed = 0
        for feet in choices:
            ok = [next(fine) for _ in feet]
            placed += any(good and self.put(foot, gap_m) for foot, good in zip(feet, ok))
        return placed

    def put_all(self, feet: list[Foot], gap_m: float = 0.0) -> int:
        """Place all `feet` that may stand where they are; return the number placed."""
        return self.put_first(feet, len(feet), gap_m)


def _shrunk(box: np.ndarray, role: Role) -> np.ndarray:
    """Return the box that must lie on allowed lanes. For parked vehicles it excludes mirrors."""
    if role != "parked":
        return box
    out = box.copy()
    out[2:4] -= MIRROR_M
    return out


def drawn_count(expected: float, rng: np.random.Generator) -> int:
    """Return a random whole number with the mean `expected`."""
    return int(np.floor(expected + rng.random()))
