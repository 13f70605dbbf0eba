"""Surface: meshes of roads with markings, kerbs, pavements and medians, and of the land around.

    ground = surface(network)
    ground.roads, ground.land, ground.structures     # assemblies
    meshes(network)                                  # all of them as one assembly

Carriageway, pavements, kerbs and land share their vertices; steps are closed by upright faces.
Markings lie 4 mm above the carriageway.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..geometry.mesh.piece import Assembly, Piece, compact, flat, vertex_normals
from ..geometry.mesh.primitives import grid
from .ground.arrangement import Arrangement, Face, Ints, Vertices, arrange
from .ground.structures import structures
from .ground.terrain import land_heights, roof, terrain
from .markings import patches
from .network import Network
from .profile import Floats
from .road import LANE_TYPES, Road

PAINT_M = 0.004  # height of markings above the road
STEP_M = 1e-4  # a smaller difference of heights is no step
MATERIALS = {
    "sidewalk": "concrete",
    "biking": "asphalt",
    "border": "concrete",
    "median": "meadow",
    "curb": "concrete",
    "rail": "gravel",
}
PAINTS = {"white": "road_paint", "yellow": "road_paint_yellow"}
VERGE = "gravel"


class Surface(NamedTuple):
    """Meshes of the ground, by kind."""

    roads: Assembly  # carriageways, pavements, kerbs, markings
    land: Assembly
    structures: Assembly  # bridges, tunnels, rails


def meshes(network: Network) -> Assembly:
    """Return roads, land and structures as one assembly in world coordinates."""
    found = surface(network)
    return Assembly("ground", [piece for assembly in found for piece in assembly.parts])


def surface(network: Network) -> Surface:
    """Return roads, land and structures in world coordinates."""
    vertices = Vertices()
    plan = arrange(network.roads, vertices)
    roads = Assembly("road")
    count = len(plan.points)
    base = _base_heights(plan)
    top = np.full(count, -np.inf)  # greatest height of the faces that meet at a vertex
    for face in plan.faces:
        np.maximum.at(top, face.triangles, base[face.triangles] + face.owner.lane.raised_m)
    roofs = [
        (road, span, roof(road, span.start_m, span.end_m))
        for road in network.roads
        for span in road.structures
        if span.kind == "tunnel"
    ]
    around = terrain(plan.paved, [r[2] for r in roofs], vertices)
    points = vertices.points
    land_z = np.concatenate([top, land_heights(network.ground, points[count:])])
    roads.add(*_faces(points, base, plan.faces))
    land = Assembly("land").add(
        _piece("verge", points, land_z, around.verge, _verge_material(network)),
        _piece("land", points, land_z, around.land, network.land.material),
    )
    edges = _Edges()
    for face in plan.faces:
        edges.add(face.triangles, base + face.owner.lane.raised_m)
    edges.add(np.concatenate([around.verge, around.land]), land_z)
    roads.add(_walls(points, edges))
    for road in network.roads:
        roads.add(*_paint(road))
    return Surface(roads, land, structures(network, roofs))


def _verge_material(network: Network) -> str:
    return VERGE if network.land.material == "meadow" else network.land.material


def _base_heights(plan: Arrangement) -> Floats:
    """Return the height of each vertex on its road, without the raise of its lane.

    Its road is that of the adjoining face whose lane type comes first in `LANE_TYPES`.
    """
    best = np.full(len(plan.points), len(LANE_TYPES) + 1)
    owner = np.full(len(plan.points), -1)
    roads: dict[str, tuple[int, Road]] = {}
    for face in plan.faces:
        road = face.owner.road
        number, _ = roads.setdefault(road.name, (len(roads), road))
        rank = LANE_TYPES.index(face.owner.lane.type)
        at = np.unique(face.triangles)
        at = at[best[at] > rank]
        best[at], owner[at] = rank, number
    heights = np.zeros(len(plan.points))
    for number, road in roads.values():
        mine = np.flatnonzero(owner == number)
        if len(mine):
            s, t, _ = road.line.beside(plan.points[mine])
            heights[mine] = road.height(s, t)
    return heights


def _material(face: Face) -> str:
    return MATERIALS.get(face.owner.lane.type, face.owner.road.surface)


def _faces(points: Floats, base: Floats, faces: Iterable[Face]) -> list[Piece]:
    """Return the faces as one piece per lane type, material and height above the carriageway."""
    groups: dict[tuple[str, str, float], list[Ints]] = defaultdict(list)
    for face in faces:
        lane = face.owner.lane
        kind = "carriageway" if lane.type in ("driving", "shoulder", "none") else lane.type
        material = "gravel" if face.owner.road.surface == "gravel" else _material(face)
        groups[kind, material, lane.raised_m].append(face.triangles)
    return [
        _piece(kind, points, base + raised, np.concatenate(triangles), material)
        for (kind, material, raised), triangles in groups.items()
    ]


def _piece(name: str, points: Floats, z: Floats, triangles: Ints, material: str) -> Piece:
    """Return triangles over vertices as a piece with smooth normals."""
    if not len(triangles):
        return Piece(name, np.empty((0, 3)), triangles, material)
    count = len(z)
    vertices = np.concatenate([points[:count], z[:, None]], 1)
    piece = compact(Piece(name, vertices, triangles, material))
    return replace(piece, normals=vertex_normals(piece.vertices, piece.faces))


class _Edges:
    """Sides of triangles by their two vertices, with the heights of the triangles there."""

    def __init__(self) -> None:
        self._pairs: list[Ints] = []
        self._heights: list[Floats] = []

    def add(self, triangles: Ints, z: Floats) -> None:
        """Add the sides of triangles whose vertices have the heights `z`."""
        sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        self._pairs.append(sides)
        self._heights.append(z[sides])

    def steps(self) -> tuple[Ints, Floats, Floats]:
        """Return the sides (n, 2) at which two triangles meet at different heights.

        They run in the direction of the higher triangle. Its heights and those of the lower one
        follow, each (n, 2).
        """
        pairs = np.concatenate(self._pairs)
        heights = np.concatenate(self._heights)
        forward = pairs[:, 0] < pairs[:, 1]
        keys = np.sort(pairs, 1)
        order = np.lexsort((forward, keys[:, 1], keys[:, 0]))
        keys = keys[order]
        pairs = pairs[order]
        heights = heights[order]
        forward = forward[order]
        same = np.flatnonzero((keys[1:] == keys[:-1]).all(1) & (forward[1:] != forward[:-1]))
        first = heights[same]
        second = heights[same + 1][:, ::-1]
        apart = np.abs(first - second).max(1) > STEP_M
        same = same[apart]
        first = first[apart]
        second = second[apart]
        up = (first.sum(1) >= second.sum(1))[:, None]
        sides = np.where(up, pairs[same], pairs[same + 1])
        high = np.where(up, first, second[:, ::-1])
        low = np.where(up, second, first[:, ::-1])
        return sides, high, low


def _walls(points: Floats, edges: _Edges) -> Piece:
    """Return the upright faces that close all steps: kerbs and the edges of pavements."""
    sides, high, low = edges.steps()
    corner = points[sides]  # (n, 2, 2): the higher face lies to the left
    a = corner[:, 0]
    b = corner[:, 1]
    rows = np.stack(
        [
            np.column_stack([a, low[:, 0]]),
            np.column_stack([b, low[:, 1]]),
            np.column_stack([b, high[:, 1]]),
            np.column_stack([a, high[:, 0]]),
        ],
        1,
    )
    k = 4 * np.arange(len(rows))[:, None]
    faces = np.concatenate([k + [0, 1, 2], k + [0, 2, 3]])
    return flat(Piece("kerb", rows.reshape(-1, 3), faces, "concrete"))


def _paint(road: Road) -> list[Piece]:
    """Return the markings of a road."""
    pieces = []
    for patch in patches(road):
        points = road.points(patch.st_m[..., 0], patch.st_m[..., 1], PAINT_M)
        piece = grid(points, patch.name, PAINTS[patch.colour])
        up = piece.normals[:, 2].sum() > 0
        pieces.append(piece if up else grid(points[:, ::-1], patch.name, PAINTS[patch.colour]))
    return pieces
