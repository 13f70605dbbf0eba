"""Network of roads: lanes to drive on, junctions, the height of the ground, and free areas.

network = kind("country_curve", seed=3).network
for lane in network.lanes():             # driving lanes
    pose = lane.at(12.0)                 # 4x4, on the surface, x along the traffic
z = network.height(x, y)                 # road, pavement or land at ground level
for area in network.free_areas("verge"): # where roadside things may stand
    pose = area.at(s_m=5.0, across=0.5)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from .free_areas import AreaKind, FreeArea, free_areas
from .ground_height import GroundHeight, Land
from .lane_path import LaneKey, LanePath
from .profile import Floats
from .road import LANE_TYPES, Road


@dataclass(frozen=True)
class Connection:
    """A path through a junction: from an incoming road onto a connecting road."""

    incoming: str
    connecting: str
    contact: str = "start"  # end of the connecting road at which the traffic enters
    lanes: tuple[tuple[int, int], ...] = ()  # (incoming, connecting) lane numbers


@dataclass(frozen=True)
class Junction:
    """A junction and the paths through it."""

    name: str
    connections: tuple[Connection, ...] = ()


@dataclass(frozen=True)
class Network:
    """Roads, the junctions that join them, and the land around them."""

    roads: tuple[Road, ...]
    junctions: tuple[Junction, ...] = ()
    land: Land = field(default_factory=Land)

    @cached_property
    def _by_name(self) -> dict[str, Road]:
        return {road.name: road for road in self.roads}

    def road(self, name: str) -> Road:
        """Return the road of that name."""
        return self._by_name[name]

    @cached_property
    def _paths(self) -> dict[LaneKey, LanePath]:
        return {
            LaneKey(road.name, k, lane.number): LanePath(road, k, lane)
            for road in self.roads
            for k, section in enumerate(road.sections)
            for lane in section.lanes
        }

    def lanes(self, types: Sequence[str] = ("driving",)) -> tuple[LanePath, ...]:
        """Return the lanes of some types, one per road section, in the order of the roads."""
        return tuple(path for path in self._paths.values() if path.type in types)

    def lane(self, key: LaneKey) -> LanePath:
        """Return the lane of that key."""
        return self._paths[key]

    def successors(self, key: LaneKey) -> tuple[LaneKey, ...]:
        """Return the lanes that continue a lane in its direction of traffic; several before a
        junction.
        """
        return self._successors.get(key, ())

    @cached_property
    def _successors(self) -> dict[LaneKey, tuple[LaneKey, ...]]:
        return {key: tuple(self._next(path)) for key, path in self._paths.items()}

    def _next(self, path: LanePath) -> list[LaneKey]:
        road = path.road
        section = path.section
        forward = path.direction > 0
        number = path.lane.successor if forward else path.lane.predecessor
        onward = section + 1 if forward else section - 1
        if 0 <= onward < len(road.sections):
            return self._known(LaneKey(road.name, onward, number) if number else None)
        link = road.successor if forward else road.predecessor
        if link is None:
            return []
        if link.kind == "road":
            met = self.road(link.name)
            at = 0 if link.end == "start" else len(met.sections) - 1
            return self._known(LaneKey(met.name, at, number) if number else None)
        found: list[LaneKey] = []
        for connection in (c for j in self.junctions if j.name == link.name for c in j.connections):
            through = self.road(connection.connecting)
            at = 0 if connection.contact == "start" else len(through.sections) - 1
            for incoming, connecting in connection.lanes:
                if connection.incoming == road.name and incoming == path.lane.number:
                    found += self._known(LaneKey(through.name, at, connecting))
        return found

    def _known(self, key: LaneKey | None) -> list[LaneKey]:
        return [key] if key in self._paths else []

    @cached_property
    def ground(self) -> GroundHeight:
        """Return the model of the ground's height."""
        return GroundHeight(self.roads, self.land)

    def height(self, x_m: ArrayLike, y_m: ArrayLike) -> Floats:
        """Return the height of the ground, m: carriageway, pavement, or the land beside them.

        Decks of bridges and the hill over a tunnel do not count as ground.
        """
        x, y = np.broadcast_arrays(np.asarray(x_m, float), np.asarray(y_m, float))
        points = np.stack([x.ravel(), y.ravel()], 1)
        return self.ground.at(points).reshape(x.shape)

    def lane_types(self, x_m: ArrayLike, y_m: ArrayLike) -> list[str]:
        """Return the type of the lane at each plan point at ground level, "" off the roads.

        Where roads cross, the type that comes first in `road.LANE_TYPES` is returned.
        """
        x, y = np.broadcast_arrays(np.asarray(x_m, float), np.asarray(y_m, float))
        ranks = self.ground.lane_ranks(np.stack([x.ravel(), y.ravel()], 1))
        return [(*LANE_TYPES, "")[rank] for rank in ranks]

    def free_areas(self, kind: AreaKind) -> tuple[FreeArea, ...]:
        """Return the strips of a kind where roadside things may stand: "verge", "field",
        "pavement", "parking" or "median".
        """
        return free_areas(self.roads, self.ground, kind)
