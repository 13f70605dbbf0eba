"""Terrain: rings of triangles around the roads, finer near them, that share the roads' edges."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from isethdr_core.extras import needed

from ..ground_height import ROOF_BESIDE_M, GroundHeight
from ..profile import Floats
from ..road import Road
from ..stations import stations
from .arrangement import Ints, Vertices, triangulated

with needed("meshes of roads", "mitsuba"):
    import shapely

# distances of the rings from the roads' edges; the first ones carry the ditch
RINGS_M = (0.5, 2.2, 3.2, 5.5, 8.0, 12.0, 18.0, 27.0, 40.0, 60.0, 90.0, 140.0, 230.0, 360.0)
SPACING = 0.45  # spacing of the vertices on a ring over the ring's distance from the road
SPACING_M = (1.6, 60.0)  # least and greatest spacing


class Terrain(NamedTuple):
    """Triangles of the first ring (`verge`: gravel beside a country road) and of the other land."""

    land: Ints
    verge: Ints


def terrain(paved: Any, roofs: Sequence[Any], vertices: Vertices) -> Terrain:
    """Return the triangles around the paved area and around the roofs of tunnels.

    Parameters
    ----------
    paved : plan of the paved area, a polygon of shapely, m.
    roofs : plans of the land over tunnels, polygons of shapely, m.
    vertices : collects the plan points; triangles refer to them by index.
    """
    inner = shapely.unary_union([paved, *roofs])
    taken = inner
    rings = []
    for distance in RINGS_M:
        grown = shapely.buffer(inner, distance, quad_segs=3)
        grown = shapely.simplify(grown, 0.04 * distance)
        step = float(np.clip(SPACING * distance, *SPACING_M))
        grown = shapely.set_precision(shapely.segmentize(grown, step), 1e-3)
        rings.append(shapely.get_parts(shapely.difference(grown, taken)))
        taken = grown
    first = _triangles(rings[0], vertices)
    return Terrain(np.concatenate([_triangles(r, vertices) for r in rings[1:]]), first)


def _triangles(polygons: Any, vertices: Vertices) -> Ints:
    polygons = polygons[shapely.get_type_id(polygons) == 3]
    return np.concatenate([np.empty((0, 3), np.intp), *triangulated(polygons, vertices)])


def roof(road: Road, first_m: float, last_m: float) -> Any:
    """Return the plan of the land over a tunnel.

    Parameters
    ----------
    road : the road that the tunnel carries.
    first_m, last_m : ends of the tunnel along its reference line, m.
    """
    s = stations(road, first_m, last_m)
    right, left = road.edges(s)
    sides = road.line.points(s, right - ROOF_BESIDE_M), road.line.points(s, left + ROOF_BESIDE_M)
    return shapely.set_precision(shapely.Polygon(np.concatenate([sides[0], sides[1][::-1]])), 1e-3)


def land_heights(ground: GroundHeight, points: Floats) -> Floats:
    """Return the heights of the land at plan points (n, 2), m, in parts to save memory."""
    parts = np.array_split(points, max(1, len(points) // 20000))
    return np.concatenate([ground.land_at(part) for part in parts])
