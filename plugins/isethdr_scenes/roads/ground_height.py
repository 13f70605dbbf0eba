"""Height of the ground: the roads at ground level, and the land that meets them at their edges.

The land follows the heights of the roads around, has low hills away from them and a ditch beside
them. At the edge of a road it has the height of the edge. Near a road it rises or falls from the
edge by no more than a fixed slope, which forms cuttings and embankments.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .profile import Floats
from .road import LANE_TYPES, Lane, Road

BERM_M = 1.0  # width of the level land beside a road's edge
SLOPE = 1 / 1.7  # slope of an embankment or a cutting
# height of the roof of a tunnel (the land over it) above the road, and its width beyond the edges
ROOF_M = 7.5
ROOF_BESIDE_M = 1.2
SMOOTHING_M = 12.0  # added to distances in the weights by which the land follows several roads
HILLS = ((210.0, 1.0), (83.0, 0.35), (31.0, 0.10))  # wavelength m, share of the relief
# distances from a road's edge at which hills start and reach their full height
HILLS_FROM_M = 6.0
HILLS_FULL_M = 60.0
OFF_ROAD = len(LANE_TYPES)
BOUND_M = 2.0  # step of the samples that bound a road
TOUCH_M = 2e-3  # a point nearer to a road's edge than this lies on the road


@dataclass(frozen=True)
class Land:
    """The land beside the roads."""

    relief_m: float = 1.5  # height of the hills
    ditch_m: float = 0.4  # depth of the ditch along the roads; 0: none
    seed: int = 0
    material: str = "meadow"


class Seen(NamedTuple):
    """Plan points in the coordinates of one road."""

    s_m: Floats
    t_m: Floats  # clamped to the road
    distance_m: Floats  # distance from the road's edges, 0 on the road
    height_m: Floats  # height of the nearest place of the road


@dataclass(frozen=True)
class GroundHeight:
    """Height of the ground at plan points (n, 2), m."""

    roads: Sequence[Road]
    land: Land

    def seen(self, road: Road, points: Floats) -> Seen:
        """Return plan points in the coordinates of a road."""
        s, t, beyond = road.line.beside(points)
        right, left = road.edges(s)
        clamped = np.clip(t, right, left)
        distance = np.hypot(t - clamped, beyond)
        height = road.height(s, clamped) + _raised(road, s, clamped)
        return Seen(s, clamped, distance, height)

    def at(self, points: Floats) -> Floats:
        """Return the height of the ground."""
        height = np.empty(len(points))
        done = np.zeros(len(points), bool)
        ranks = self._ranks(points)
        best = np.full(len(points), OFF_ROAD)
        for road, (rank, s, t) in zip(self.roads, ranks):
            here = rank < best
            height[here] = road.height(s[here], t[here]) + _raised(road, s[here], t[here])
            best[here] = rank[here]
            done |= here
        height[~done] = self.land_at(points[~done])
        return height

    def lane_ranks(self, points: Floats) -> NDArray[np.intp]:
        """Return the index in `LANE_TYPES` of the type of the lane at each point.

        Where roads overlap it is the least index; off the roads it is `OFF_ROAD`.
        """
        best = np.full(len(points), OFF_ROAD)
        for rank, _, _ in self._ranks(points):
            best = np.minimum(best, rank)
        return best

    def _ranks(self, points: Floats) -> list[tuple[NDArray[np.intp], Floats, Floats]]:
        found = []
        for road, (low, high) in zip(self.roads, self._bounds):
            rank = np.full(len(points), OFF_ROAD)
            s = np.zeros(len(points))
            t = np.zeros(len(points))
            near = np.flatnonzero(((points >= low) & (points <= high)).all(1))
            if len(near):
                s[near], t[near], beyond = road.line.beside(points[near])
                rank[near] = lane_ranks(road, s[near], t[near])
                off = (beyond > TOUCH_M) | road.on_structure("bridge", s[near])
                rank[near[off]] = OFF_ROAD
            found.append((rank, s, t))
        return found

    @cached_property
    def _bounds(self) -> tuple[tuple[Floats, Floats], ...]:
        """Return the least and the greatest x and y of each road, its lanes included."""
        found = []
        for road in self.roads:
            s = np.linspace(0, road.length_m, max(2, int(np.ceil(road.length_m / BOUND_M)) + 1))
            right, left = road.edges(s)
            # between two samples the line leaves their bounding box by less than their spacing
            reach = float(max(np.abs(right).max(), np.abs(left).max())) + BOUND_M
            points = road.line.points(s)
            found.append((points.min(0) - reach, points.max(0) + reach))
        return tuple(found)

    @cached_property
    def _shaping(self) -> tuple[Road, ...]:
        """Return the roads that shape the land: those outside junctions, or all without any."""
        return tuple(r for r in self.roads if not r.junction) or tuple(self.roads)

    def land_at(self, points: Floats) -> Floats:
        """Return the height of the land, also where a road runs over or through it."""
        if not len(points):
            return np.empty(0)
        seen = [self.seen(road, points) for road in self.roads]
        near = np.min([view.distance_m for view in seen], 0)
        total = weights = np.zeros(len(points))
        for road, view in zip(self.roads, seen):
            if road in self._shaping:
                # a road on a bridge or in a tunnel does not lie at the height of the land
                weight = (view.distance_m + SMOOTHING_M) ** -3.0
                weight = weight * np.where(_free(road, view.s_m), 1.0, 1e-6)
                total = total + weight * view.height_m
                weights = weights + weight
        land = total / weights + self._hills(points, near)
        low = np.full(len(points), -np.inf)
        high = np.full(len(points), np.inf)
        for road, view in zip(self.roads, seen):
            land = np.maximum(land, _over_tunnels(road, view))
            held = _at_ground(road, view)
            reach = SLOPE * np.maximum(held.distance_m - BERM_M, 0)
            low = np.maximum(low, held.height_m - reach)
            high = np.minimum(high, held.height_m + reach)
        # beside a tunnel there is no ditch
        open_air = [
            np.where(road.on_structure("tunnel", view.s_m), np.inf, view.distance_m)
            for road, view in zip(self.roads, seen)
        ]
        return np.clip(land, np.minimum(low, high), high) - self._ditch(np.min(open_air, 0))

    def _hills(self, points: Floats, near: Floats) -> Floats:
        rng = np.random.default_rng([self.land.seed, 11])
        out = np.zeros(len(points))
        for wavelength, share in HILLS:
            for _ in range(3):
                angle, phase = rng.uniform(0, 2 * np.pi, 2)
                k = 2 * np.pi / wavelength * rng.uniform(0.8, 1.25)
                along = points @ np.array([np.cos(angle), np.sin(angle)])
                out += self.land.relief_m * share / 3 * np.sin(k * along + phase)
        rise = np.clip((near - HILLS_FROM_M) / (HILLS_FULL_M - HILLS_FROM_M), 0, 1)
        return out * rise * rise * (3 - 2 * rise)

    def _ditch(self, near: Floats) -> Floats:
        depth = self.land.ditch_m
        return np.interp(near, (0.0, 0.5, 2.2, 3.2, 5.5, 8.0), (0, 0.1, 1, 1, 0.15, 0)) * depth


def lane_ranks(road: Road, s: Floats, t: Floats) -> NDArray[np.intp]:
    """Return the index of the lane's type in `LANE_TYPES` at (s, t), `OFF_ROAD` outside.

    Parameters
    ----------
    road : road with the lanes.
    s, t : (n,) places along the reference line and to its left, m.
    """
    rank = np.full(len(s), OFF_ROAD)
    for lane, inside in _in_lanes(road, s, t):
        rank[inside] = np.minimum(rank[inside], LANE_TYPES.index(lane.type))
    return rank


def _in_lanes(road: Road, s: Floats, t: Floats) -> Iterator[tuple[Lane, NDArray[np.intp]]]:
    """Yield each lane of a road with the indices of the points in it. A point on a border lies in
    both lanes.
    """
    for k, section in enumerate(road.sections):
        first, last = road.span(k)
        here = np.flatnonzero((s >= first - 1e-9) & (s <= last + 1e-9))
        for lane, (inner, outer) in zip(section.lanes, road.borders(k, s[here]).values()):
            low = np.minimum(inner, outer) - TOUCH_M
            high = np.maximum(inner, outer) + TOUCH_M
            yield lane, here[(t[here] >= low) & (t[here] <= high) & (high - low > 3 * TOUCH_M)]


def _at_ground(road: Road, view: Seen) -> Seen:
    """Return plan points in the coordinates of the part of a road that lies on the ground.

    For a point beside a bridge or a tunnel, distance and height are those of the nearer end of the
    structure at which the road continues on the ground: from there the land falls or rises by the
    slope. If the road continues at neither end, the distance is infinite.
    """
    if not road.structures:
        return view
    s, t, distance, height = (np.array(part) for part in view)
    for span in road.structures:
        inside = np.flatnonzero((view.s_m >= span.start_m) & (view.s_m <= span.end_m))
        best = np.full(len(inside), np.inf)
        level = np.zeros(len(inside))
        for end, beyond in ((span.start_m, -TOUCH_M), (span.end_m, TOUCH_M)):
            if not 0 <= end + beyond <= road.length_m or not _free(road, np.array(end + beyond)):
                continue
            away = np.hypot(view.distance_m[inside], view.s_m[inside] - end)
            nearer = away < best
            right, left = road.edges(end)
            across = np.clip(view.t_m[inside], right, left)
            level = np.where(nearer, road.height(np.full(len(inside), end), across), level)
            best = np.where(nearer, away, best)
        distance[inside], height[inside] = best, level
    return Seen(s, t, distance, height)


def _over_tunnels(road: Road, view: Seen) -> Floats:
    """Return the least height of the land around tunnels. It falls from the roofs by the slope."""
    least = np.full(len(view.s_m), -np.inf)
    for span in (x for x in road.structures if x.kind == "tunnel"):
        s = np.clip(view.s_m, span.start_m, span.end_m)
        beside = np.maximum(view.distance_m - ROOF_BESIDE_M, 0.0)
        away = np.hypot(beside, view.s_m - s)
        least = np.maximum(least, road.elevation.at(s) + ROOF_M - SLOPE * away)
    return least


def _free(road: Road, s: Floats) -> NDArray[np.bool_]:
    return ~(road.on_structure("bridge", s) | road.on_structure("tunnel", s))


def _raised(road: Road, s: Floats, t: Floats) -> Floats:
    """Return the height by which the lane at (s, t) is raised, m; on a border that of the lower
    lane.
    """
    out = np.full(len(s), np.inf)
    for lane, inside in _in_lanes(road, s, t):
        out[inside] = np.minimum(out[inside], lane.raised_m)
    return np.where(np.isfinite(out), out, 0.0)
