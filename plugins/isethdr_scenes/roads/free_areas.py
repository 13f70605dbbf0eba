"""Free areas: strips along the roads where roadside things may stand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from isethdr_core.errors import ConfigError

from .ground_height import OFF_ROAD, GroundHeight
from .profile import Floats
from .road import Flags, Road

AreaKind = Literal["verge", "field", "pavement", "parking", "median"]
LANES_OF: dict[str, tuple[str, ...]] = {
    "pavement": ("sidewalk",),
    "parking": ("parking",),
    "median": ("median",),
}
# distances of both borders from the road's edge
VERGE_M = (0.5, 4.0)
FIELD_M = (4.0, 40.0)
STEP_M = 1.0  # spacing of the places that are checked for other roads
LEAST_M = 2.0  # shorter strips are left out


@dataclass(frozen=True)
class FreeArea:
    """A strip on one side of a road. In its methods `s_m` runs along the road from the strip's
    start, and `across` from 0 at the border towards the road's middle to 1 at the other border.
    """

    kind: AreaKind
    road: Road
    side: int  # 1 left of the reference line, -1 right
    first_m: float
    last_m: float
    lane: tuple[int, int] | None  # section and number of the lane; None: land beside the road
    beside_m: tuple[float, float]  # distances of both borders from the road's edge, without a lane
    ground: GroundHeight

    @property
    def length_m(self) -> float:
        """Return the length along the reference line."""
        return self.last_m - self.first_m

    @property
    def direction(self) -> int:
        """Return 1 if the traffic beside the strip goes along the reference line, -1 if against."""
        return -self.side if self.road.right_hand else self.side

    def _span(self, s: Floats) -> tuple[Floats, Floats]:
        if self.lane is not None:
            inner, outer = self.road.borders(self.lane[0], s)[self.lane[1]]
            return inner, outer
        right, left = self.road.edges(s)
        edge = left if self.side > 0 else right
        return edge + self.side * self.beside_m[0], edge + self.side * self.beside_m[1]

    def width_m(self, s_m: float) -> float:
        """Return the width of the strip."""
        inner, outer = self._span(np.array(self.first_m + s_m))
        return float(abs(outer - inner))

    def plan(self, s_m: Floats, across: Floats) -> Floats:
        """Return the plan points (..., 2) of places in the strip."""
        s = self.first_m + np.asarray(s_m, float)
        inner, outer = self._span(s)
        return self.road.line.points(s, inner + across * (outer - inner))

    def at(self, s_m: float, across: float, turn_rad: float = 0.0) -> Floats:
        """Return the (4, 4) pose of an upright thing on the ground of the strip.

        x points along the traffic beside the strip, turned to the left by `turn_rad`.

        Parameters
        ----------
        s_m : metres from the start of the strip, along the road.
        across : place across the strip, as a share of its width: 0 at its border towards the road's
            middle, 1 at the other one.
        turn_rad : turn to the left of the traffic beside the strip, radians.
        """
        x, y = self.plan(np.array(s_m), np.array(across))
        heading = float(self.road.line.at(self.first_m + s_m).heading_rad) + turn_rad
        if self.direction < 0:
            heading += np.pi
        pose = np.eye(4)
        cos = np.cos(heading)
        sin = np.sin(heading)
        pose[:2, :2] = [[cos, -sin], [sin, cos]]
        pose[:3, 3] = x, y, self.ground.at(np.array([[x, y]]))[0]
        return pose


Taken = Callable[[FreeArea, Floats, Floats], Flags]


def free_areas(roads: Sequence[Road], ground: GroundHeight, kind: AreaKind) -> tuple[FreeArea, ...]:
    """Return the strips of one kind, without the stretches where another road runs.

    Parameters
    ----------
    roads : all roads of a network.
    ground : height of the ground, on which things of a strip stand.
    kind : kind of the strips, one of `AreaKind`.

    Raises
    ------
    ConfigError : there is no such kind.
    """
    if kind not in get_args(AreaKind):
        raise ConfigError(
            f"there is no free area {kind!r}; there are {', '.join(get_args(AreaKind))}"
        )
    found: list[FreeArea] = []
    for road in roads:
        if kind in LANES_OF:
            for area in _lane_strips(road, ground, kind):
                found += _cut(area, _taken_lane)
        elif not road.junction:
            beside = VERGE_M if kind == "verge" else FIELD_M
            for side in (1, -1):
                strip = FreeArea(kind, road, side, 0.0, road.length_m, None, beside, ground)
                found += _cut(strip, _taken_land)
    return tuple(found)


def _lane_strips(road: Road, ground: GroundHeight, kind: AreaKind) -> list[FreeArea]:
    return [
        FreeArea(
            kind, road, int(np.sign(lane.number)), *road.span(k), (k, lane.number), (0, 0), ground
        )
        for k, section in enumerate(road.sections)
        for lane in section.lanes
        if lane.type in LANES_OF[kind]
    ]


def _taken_land(area: FreeArea, s: Floats, across: Floats) -> Flags:
    """Return where a road runs on a strip of land, or the strip's own road is on a structure."""
    points = area.plan(s, across)
    road = area.road
    taken = area.ground.lane_ranks(points.reshape(-1, 2)).reshape(s.shape) < OFF_ROAD
    at = area.first_m + s
    return taken | road.on_structure("bridge", at) | road.on_structure("tunnel", at)


def _taken_lane(area: FreeArea, s: Floats, across: Floats) -> Flags:
    """Return where a lane is narrow, or where another road's carriageway crosses it."""
    points = area.plan(s, across).reshape(-1, 2)
    least = area.ground.lane_ranks(points).reshape(s.shape)
    inner, outer = area._span(area.first_m + s)
    crossed = (least == 0) & (across > 0.01) & (across < 0.99)
    return np.asarray(crossed | (np.abs(outer - inner) < 0.3))


def _cut(area: FreeArea, taken: Taken) -> list[FreeArea]:
    """Return the parts of a strip that `taken` leaves free."""
    steps = max(2, int(area.length_m / STEP_M) + 1)
    s, across = np.meshgrid(
        np.linspace(0, area.length_m, steps), (0.05, 0.35, 0.65, 0.95), indexing="ij"
    )
    free = np.concatenate([[False], ~taken(area, s, across).any(1), [False]])
    starts = np.flatnonzero(~free[:-1] & free[1:])
    ends = np.flatnonzero(free[:-1] & ~free[1:]) - 1
    at = area.first_m + s[:, 0]
    return [
        FreeArea(
            area.kind,
            area.road,
            area.side,
            float(at[a]),
            float(at[b]),
            area.lane,
            area.beside_m,
            area.ground,
        )
        for a, b in zip(starts, ends)
        if at[b] - at[a] >= LEAST_M
    ]
