"""Structures: decks of bridges with parapets and piers, tunnels with portals, rails of a track."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...geometry.mesh.piece import Assembly, Piece, flat
from ...geometry.mesh.primitives import box, grid, tube
from ..ground_height import ROOF_BESIDE_M, ROOF_M
from ..profile import Floats
from ..road import Road, Structure
from ..stations import stations
from .arrangement import Vertices, triangulated

if TYPE_CHECKING:
    from ..network import Network

DECK_M = 0.9  # thickness of a bridge's deck
PARAPET_M = (0.25, 0.35)  # breadth and height of the kerb that carries a railing
RAILING_M = 1.1  # height of the railing
POST_STEP_M = 2.0
PIER_M = 0.45  # radius of a pier
WALL_DEPTH_M = 0.5  # depth to which the walls beside a roof reach below the land
# heights above the road at which the vault of a tunnel begins, and of its crown
SPRING_M = 3.0
TOP_M = 6.0
WALL_BESIDE_M = 0.05  # distance of a tunnel's wall from the road's edge
GAUGE_M = 1.435
RAIL_WIDTH_M = 0.07
RAIL_TOP_M = 0.004  # height of the rails above the road on a level crossing
RAIL_LOOK_M = 8.0  # distance from a level crossing within which a rail keeps its height
LUMINAIRE_STEP_M = 12.0  # spacing along the tunnel
LUMINAIRE_ASIDE_M = 2.2  # distance of a row from the middle of the road
LUMINAIRE_BELOW_M = 0.75  # distance below the crown
SKIN_M = 0.3  # thickness of a tunnel's lining, and of the bed below its road


def structures(network: Network, roofs: Sequence[tuple[Road, Structure, Any]]) -> Assembly:
    """Return all structures of a network; `roofs` are the plans of the land over tunnels."""
    found = Assembly("structures")
    for road in network.roads:
        for span in road.structures:
            if span.kind == "bridge":
                found.add(*_bridge(network, road, span))
        if any(lane.type == "rail" for section in road.sections for lane in section.lanes):
            found.add(*_rails(road))
    for road, span, plan in roofs:
        found.add(*_tunnel(road, span), _roof(road, plan, network.land.material))
        found.add(_roof_sides(network, road, plan))
    return found


def _strip(road: Road, s: Floats, t: Sequence[Floats], above: Sequence[Floats]) -> Floats:
    """Return the points (n, m, 3) of m lines along a road."""
    return np.stack([road.points(s, a, b) for a, b in zip(t, above)], 1)


def _bridge(network: Network, road: Road, span: Structure) -> list[Piece]:
    s = stations(road, span.start_m, span.end_m)
    s = np.unique(np.concatenate([s, np.arange(span.start_m, span.end_m, 4.0)]))
    found = []
    section = road.section_at(span.start_m)
    borders = road.borders(section, s)
    for lane in road.sections[section].lanes:
        inner, outer = borders[lane.number]
        low = np.minimum(inner, outer)
        high = np.maximum(inner, outer)
        raised = np.full(len(s), lane.raised_m)
        # the normal d/du x d/dv points up if v runs to the left
        top = _strip(road, s, [low, high], [raised, raised])
        material = "concrete" if lane.type == "sidewalk" else road.surface
        found.append(grid(top, "deck", material))
    right, left = road.edges(s)
    breadth, height = PARAPET_M
    for side, edge in ((-1, right), (1, left)):
        out = edge + side * breadth
        profile = [(edge, 0.0), (edge, height), (out, height), (out, -DECK_M)]
        profile = profile if side > 0 else profile[::-1]
        lines = _strip(road, s, [p[0] for p in profile], [np.full(len(s), p[1]) for p in profile])
        found.append(flat(grid(lines, "parapet", "concrete")))
        found += _railing(road, span, edge + side * breadth / 2, s)
    under = [np.full(len(s), -DECK_M)] * 2
    found.append(
        grid(_strip(road, s, [left + breadth, right - breadth], under), "under", "concrete")
    )
    return found + _piers(network, road, span)


def _railing(road: Road, span: Structure, t: Floats, s: Floats) -> list[Piece]:
    found = []
    for height in (RAILING_M, 0.72):
        path = road.points(s, t, np.full(len(s), height))
        found.append(tube(path, 0.03, "railing", "galvanised", 6))
    for at in np.arange(span.start_m + 1, span.end_m, POST_STEP_M):
        foot = road.points(at, np.interp(at, s, t), PARAPET_M[1])
        found.append(tube([foot, foot + [0, 0, RAILING_M - 0.35]], 0.025, "post", "galvanised", 6))
    return found


def _piers(network: Network, road: Road, span: Structure) -> list[Piece]:
    """Return two rows of piers, none on a carriageway."""
    found = []
    for share in (0.28, 0.72):
        at = span.start_m + share * span.length_m
        right, left = (float(t) for t in road.edges(at))
        for t in (right + 1.0, left - 1.0):
            head = road.points(at, t, -DECK_M + 0.05)
            if network.lane_types(head[0], head[1]) != [""]:
                continue
            foot = float(network.height(head[0], head[1])) - 0.5
            if head[2] - foot > 2.0:
                path = [(head[0], head[1], foot), tuple(head)]
                found.append(tube(path, PIER_M, "pier", "concrete", 14))
    return found


def _section(half: float, n: int = 24) -> Floats:
    """Return the inner outline (k, 2) of (aside, up) from the foot of the left wall over the vault
    to the right one.
    """
    a = np.linspace(0, np.pi, n)
    vault = np.stack([half * np.cos(a), SPRING_M + (TOP_M - SPRING_M) * np.sin(a)], 1)
    return np.concatenate([[(half, -0.4)], vault, [(-half, -0.4)]])


def _tunnel(road: Road, span: Structure) -> list[Piece]:
    """Return walls and vault with faces that point inwards, an outer skin, and the portal walls."""
    s = stations(road, span.start_m, span.end_m)
    s = np.unique(np.concatenate([s, np.arange(span.start_m, span.end_m, 4.0)]))
    right, left = road.edges(s)
    middle = (left + right) / 2
    half = (left - right) / 2 + WALL_BESIDE_M
    outline = _section(1.0)
    level = road.elevation.at(s)
    t = middle[:, None] + half[:, None] * outline[None, :, 0]
    plan = road.line.points(np.broadcast_to(s[:, None], t.shape), t)
    z = level[:, None] + np.broadcast_to(outline[None, :, 1], t.shape)
    points = np.concatenate([plan, z[..., None]], -1)
    last = len(outline) - 1
    found = [
        grid(points[:, :2], "wall", "tunnel_tile"),
        grid(points[:, 1:last], "vault", "tunnel_lining"),
        grid(points[:, last - 1 :], "wall", "tunnel_tile"),
    ]
    # Smooth shading lets a light path leave through the back of the lining. The skin stops such a
    # path; without the skin it would pick up light from below the horizon.
    bulge = np.sign(outline - [0, SPRING_M / 2])
    t = t + SKIN_M * bulge[None, :, 0]
    plan = road.line.points(np.broadcast_to(s[:, None], t.shape), t)
    points = np.concatenate([plan, (z + SKIN_M * bulge[None, :, 1])[..., None]], -1)
    found.append(grid(points, "skin", "gap", close_v=True))
    ends = ((span.start_m, 0, False), (span.end_m, -1, True))
    for at, k, forward in ends:
        if 1.0 < at < road.length_m - 1.0:
            found.append(_portal(road, at, (float(middle[k]), float(half[k])), forward))
    return found


def _portal(road: Road, at: float, mouth: tuple[float, float], forward: bool) -> Piece:
    """Return the wall around a mouth, seen from outside: from the vault out to the roof."""
    middle, half = mouth
    inner = _section(half)
    wide = half + ROOF_BESIDE_M - WALL_BESIDE_M
    # the outer outline goes up one side, along the roof and down the other, as the inner one does
    n = len(inner)
    corners = np.array([(wide, -1.5), (wide, ROOF_M), (-wide, ROOF_M), (-wide, -1.5)])
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    share = np.linspace(0, 1, n)
    # rows 0, 5, n - 6 and n - 1 of the outer outline are its corners
    share = np.interp(np.arange(n), [0, 5, n - 6, n - 1], length / length[-1])
    outer = np.stack([np.interp(share * length[-1], length, corners[:, k]) for k in (0, 1)], 1)
    ring = np.stack([inner, outer], 0)
    plan = road.line.points(np.full(ring.shape[:2], at), middle + ring[..., 0])
    z = float(road.elevation.at(at)) + ring[..., 1]
    points = np.concatenate([plan, z[..., None]], -1)
    return flat(grid(points if forward else points[::-1], "portal", "concrete"))


def _roof(road: Road, plan: Any, material: str) -> Piece:
    """Return the land over a tunnel."""
    vertices = Vertices()
    (triangles,) = triangulated(np.array([plan], object), vertices)
    points = vertices.points
    s, _, _ = road.line.beside(points)
    top = np.column_stack([points, road.elevation.at(s) + ROOF_M])
    return grid_free("roof", top, triangles, material)


def _roof_sides(network: Network, road: Road, plan: Any) -> Piece:
    """Return the walls between the roof of a tunnel and lower land beside it, near the portals."""
    corners = np.array(plan.exterior.coords)[:-1]
    s, t, _ = road.line.beside(corners)
    top = road.elevation.at(s) + ROOF_M
    low = np.minimum(network.ground.land_at(corners), top) - WALL_DEPTH_M
    a = np.arange(len(corners))
    b = np.roll(a, -1)
    # leave out the two edges above the portals, which have walls of their own
    a, b = (x[np.sign(t[a]) == np.sign(t[b])] for x in (a, b))
    rows = [
        np.column_stack([corners[k], z[k]]) for k, z in ((a, low), (b, low), (b, top), (a, top))
    ]
    first = 4 * np.arange(len(a))[:, None]
    faces = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]])
    points = np.stack(rows, 1).reshape(-1, 3)
    if not plan.exterior.is_ccw:
        faces = faces[:, ::-1]
    return flat(Piece("roof side", points, faces, "concrete"))


def grid_free(name: str, points: Floats, triangles: Any, material: str) -> Piece:
    """Return triangles over points as a piece with flat faces.

    Parameters
    ----------
    name : name of the piece.
    points : (n, 3) vertices, m.
    triangles : (m, 3) numbers of vertices, counter-clockwise as seen from outside.
    material : name of its material.
    """
    return flat(Piece(name, points, triangles, material))


def _rails(road: Road) -> list[Piece]:
    """Return two rails on sleepers; on a level crossing they are flush with the road."""
    s = np.arange(0.0, road.length_m + 0.5, 1.0)
    near = s[:, None] + np.linspace(-RAIL_LOOK_M, RAIL_LOOK_M, 9)
    top = road.elevation.at(near).max(1)
    raised = float(road.elevation.at(s).max() - road.elevation.at(s).min())
    top = np.maximum(top, road.elevation.at(s) + raised) + RAIL_TOP_M
    found = []
    for side in (-1, 1):
        middle = side * (GAUGE_M + RAIL_WIDTH_M) / 2
        t = middle + np.array([-0.5, -0.5, 0.5, 0.5]) * RAIL_WIDTH_M
        depth = np.array([-0.16, 0.0, 0.0, -0.16])
        plan = road.line.points(np.repeat(s[:, None], 4, 1), np.broadcast_to(t, (len(s), 4)))
        points = np.concatenate([plan, (top[:, None] + depth)[..., None]], -1)
        found.append(flat(grid(points, "rail", "steel")))
    flush = top - road.elevation.at(s) < 0.05
    for at in np.arange(0.3, road.length_m, 0.6):
        if not np.interp(at, s, flush):
            pose = road.pose(float(at), 0.0, 0.0, 0.02)
            found.append(box((0, 0, -0.08), (0.26, 2.5, 0.16), "sleeper", "concrete").moved(pose))
    return found


def luminaire_poses(road: Road) -> list[Floats]:
    """Return the (4, 4) poses of luminaires under the vaults of a road's tunnels, in two rows."""
    found = []
    for span in (x for x in road.structures if x.kind == "tunnel"):
        for at in np.arange(span.start_m + 4, span.end_m - 2, LUMINAIRE_STEP_M):
            right, left = (float(t) for t in road.edges(at))
            for side in (-1, 1):
                t = (left + right) / 2 + side * LUMINAIRE_ASIDE_M
                # luminaires are built for the left row; those of the right row are turned round
                pose = road.pose(float(at), t, 0.0 if side > 0 else np.pi)
                pose[2, 3] = float(road.elevation.at(at)) + TOP_M - LUMINAIRE_BELOW_M - 0.1
                found.append(pose)
    return found
