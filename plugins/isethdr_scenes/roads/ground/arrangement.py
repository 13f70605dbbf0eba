"""Arrangement: the plan of all roads at ground level as faces that share their vertices.

The outlines of all lanes are noded on a grid of 1 mm and cut into faces. Where lanes overlap, a
face belongs to the lane type that comes first in `LANE_TYPES`, so that a carriageway continues
through the pavement of another road. Faces share vertices and a vertex has one height, so no gap
can arise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from isethdr_core.extras import needed

from ..profile import Floats
from ..road import LANE_TYPES, Lane, Road
from ..stations import stations

with needed("meshes of roads", "mitsuba"):
    import shapely

Ints = NDArray[np.intp]
GRID_M = 1e-3  # grid to which vertices are rounded in plan
SMALL_M2 = 4.0  # smaller holes between the roads through a junction are paved
THIN_M = 5e-3  # narrower lanes have no face


class Owner(NamedTuple):
    """The road and the lane that a face belongs to."""

    road: Road
    lane: Lane


@dataclass(frozen=True)
class Face:
    """The area of one lane as triangles, with the road and the lane it belongs to."""

    triangles: Ints  # (n, 3) indices of vertices, counter-clockwise
    owner: Owner


@dataclass
class Arrangement:
    """Vertices in plan (n, 2), faces over them, and the outline of all faces."""

    points: Floats
    faces: list[Face]
    paved: Any  # shapely geometry


class Vertices:
    """Vertices in plan. Points that round to the same millimetre are one vertex."""

    def __init__(self) -> None:
        self._index: dict[tuple[int, int], int] = {}

    def of(self, points: Floats) -> Ints:
        """Return the indices of plan points (n, 2); new ones are added."""
        keys = np.round(points / GRID_M).astype(np.int64)
        index = self._index
        return np.array([index.setdefault((x, y), len(index)) for x, y in keys.tolist()], np.intp)

    @property
    def points(self) -> Floats:
        """Return the plan coordinates (n, 2) of all vertices, m."""
        return np.array(list(self._index), float).reshape(-1, 2) * GRID_M


def arrange(roads: Sequence[Road], vertices: Vertices) -> Arrangement:
    """Return the faces of all roads, without the decks of bridges."""
    outlines = []
    owners = []
    cuts = []
    for road in roads:
        for k, section in enumerate(road.sections):
            for first, last in _on_ground(road, *road.span(k)):
                s = stations(road, first, last)
                borders = road.borders(k, s)
                for lane in section.lanes:
                    inner, outer = borders[lane.number]
                    if np.abs(outer - inner).max() < THIN_M:
                        continue
                    ring = [road.line.points(s, inner), road.line.points(s, outer)[::-1]]
                    outlines.append(shapely.Polygon(np.concatenate(ring)))
                    owners.append(Owner(road, lane))
                if not road.junction:
                    right, left = _all_edges(road, k, s)
                    ends = np.stack([road.line.points(s, right), road.line.points(s, left)], 1)
                    cuts += list(shapely.linestrings(ends))
    lanes = np.array([o if o.is_valid else o.buffer(0) for o in outlines], object)
    lines = [*shapely.boundary(lanes), *cuts]
    noded = shapely.unary_union(lines, grid_size=GRID_M)
    cells = shapely.get_parts(shapely.polygonize([noded]))
    # the smallest triangle on the grid is half a grid square; leaving one out would open a hole
    cells = cells[shapely.area(cells) > GRID_M**2 / 4]
    chosen = _owners(cells, lanes, owners)
    kept = [k for k in range(len(cells)) if k in chosen]
    triangles = triangulated(cells[kept], vertices)
    faces = [Face(t, chosen[k]) for k, t in zip(kept, triangles)]
    return Arrangement(vertices.points, faces, shapely.unary_union(cells[kept]))


def _all_edges(road: Road, section: int, s: Floats) -> tuple[Floats, Floats]:
    t = np.array([b[1] for b in road.borders(section, s).values()] + [road.lane_offset.at(s)])
    return t.min(0), t.max(0)


def _on_ground(road: Road, first: float, last: float) -> list[tuple[float, float]]:
    """Return the parts of a stretch that lie on no bridge."""
    parts = [(first, last)]
    for bridge in (b for b in road.structures if b.kind == "bridge"):
        parts = [
            (max(a, low), min(b, high))
            for a, b in parts
            for low, high in ((-np.inf, bridge.start_m), (bridge.end_m, np.inf))
            if min(b, high) - max(a, low) > GRID_M
        ]
    return parts


def _owners(cells: Any, lanes: Any, owners: list[Owner]) -> dict[int, Owner]:
    """Return the owner of each cell. A small cell outside all lanes belongs to the nearest driving
    lane; a large one has no owner.
    """
    inside = shapely.point_on_surface(cells)
    cell, lane = shapely.STRtree(lanes).query(inside, predicate="intersects")
    found: dict[int, Owner] = {}
    rank = {kind: k for k, kind in enumerate(LANE_TYPES)}
    for c, k in zip(cell.tolist(), lane.tolist()):
        now = found.get(c)
        if now is None or rank[owners[k].lane.type] < rank[now.lane.type]:
            found[c] = owners[k]
    holes = [k for k in range(len(cells)) if k not in found and shapely.area(cells[k]) < SMALL_M2]
    if holes:
        driving = [k for k, owner in enumerate(owners) if owner.lane.type == "driving"]
        near = shapely.STRtree(lanes[driving]).nearest(cells[holes])
        found |= {hole: owners[driving[n]] for hole, n in zip(holes, near.tolist())}
    return found


def triangulated(cells: Any, vertices: Vertices) -> list[Ints]:
    """Return the triangles (n, 3) of each polygon, over its own vertices, counter-clockwise."""
    count = shapely.get_num_coordinates(cells)
    simple = (count == 5) & (shapely.get_num_interior_rings(cells) == 0)
    result: list[Ints] = [np.empty((0, 3), np.intp)] * len(cells)
    quads = np.flatnonzero(simple)
    if len(quads):
        corners = shapely.get_coordinates(cells[quads]).reshape(-1, 5, 2)[:, :4]
        turned = _cross(corners).sum(1) < 0
        corners[turned] = corners[turned, ::-1]
        convex = (_cross(corners) > 0).all(1)
        index = vertices.of(corners[convex].reshape(-1, 2)).reshape(-1, 4)
        for k, (a, b, c, d) in zip(quads[convex].tolist(), index.tolist()):
            result[k] = np.array([[a, b, c], [a, c, d]], np.intp)
        simple[quads[~convex]] = False
    others = np.flatnonzero(~simple)
    parts = shapely.constrained_delaunay_triangles(cells[others])
    triangles, which = shapely.get_parts(parts, return_index=True)
    corners = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3]
    turned = _cross(corners).sum(1) < 0
    corners[turned] = corners[turned, ::-1]
    index = vertices.of(corners.reshape(-1, 2)).reshape(-1, 3)
    proper = (index[:, 0] != index[:, 1]) & (index[:, 1] != index[:, 2])
    proper &= index[:, 0] != index[:, 2]
    for n, k in enumerate(others.tolist()):
        result[k] = index[proper & (which == n)]
    return result


def _cross(corners: Floats) -> Floats:
    """Return at each corner twice the signed area of the triangle with its neighbours."""
    before = np.roll(corners, 1, 1) - corners
    after = np.roll(corners, -1, 1) - corners
    return np.asarray(after[..., 0] * before[..., 1] - after[..., 1] * before[..., 0])
