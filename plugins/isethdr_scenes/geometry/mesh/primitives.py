"""Primitives: quad grids, balls, boxes, lathed profiles and tubes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .piece import Piece, cross, flat, places_of, unit, vertex_normals

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

# Reference directions for the rings of a tube. The second serves paths that run along the first.
SIDEWAYS = np.array([0.31, 0.17, 0.94])
OTHERWISE = np.array([0.9, 0.4, 0.17])
END_M = 1e-5  # radius to which closed tubes narrow at their ends
BOX_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
BOX_SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
BOX_FACES = np.array([t for a, b, c, d in BOX_SIDES for t in ((a, b, c), (a, c, d))])


def grid(
    points: np.ndarray,
    name: str = "grid",
    material: str = "plastic_black",
    close_u: bool = False,
    close_v: bool = False,
    smooth: bool = True,
) -> Piece:
    """Return a grid of quads as triangles.

    Parameters
    ----------
    points : (n, m, 3), m. u runs along the first axis and v along the second. The outward direction
        is d/du x d/dv.
    name : name of the piece.
    material : name of the material.
    close_u, close_v : whether the last row or column is joined to the first.
    smooth : whether there is one normal per vertex; else one per face.
    """
    p = np.asarray(points, float)
    v = p.reshape(-1, 3)
    f = _grid_faces(p.shape[0], p.shape[1], close_u, close_v)
    if smooth:
        return Piece(name, v, f, material, vertex_normals(v, f))
    return flat(Piece(name, v, f, material))


@lru_cache(maxsize=512)  # 50 kB each; a car has 90 different ones
def _grid_faces(n: int, m: int, close_u: bool, close_v: bool) -> np.ndarray:
    """Return the triangles (k, 3) of a grid of n x m points. The array is cached and read-only.

    Parameters
    ----------
    n : number of rows of points, along u.
    m : number of columns of points, along v.
    close_u : whether the last row is joined to the first.
    close_v : whether the last column is joined to the first.
    """
    i, j = np.meshgrid(np.arange(n - (not close_u)), np.arange(m - (not close_v)), indexing="ij")
    k = lambda a, b: ((a % n) * m + b % m).ravel()
    a = k(i, j)
    b = k(i + 1, j)
    c = k(i + 1, j + 1)
    d = k(i, j + 1)
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    faces.flags.writeable = False
    return faces


def ball(
    centre: np.ndarray = (0, 0, 0),
    radii: tuple[float, float, float] = (1, 1, 1),
    name: str = "ball",
    material: str = "plastic_black",
    n: int = 12,
) -> Piece:
    """Return an ellipsoid.

    Parameters
    ----------
    centre : (3,) m.
    radii : (3,) along x, y and z, m.
    name : name of the piece.
    material : name of the material.
    n : number of rings from pole to pole; twice as many faces go around.
    """
    a = np.linspace(-np.pi / 2, np.pi / 2, n + 1)[:, None]
    b = np.linspace(0, 2 * np.pi, 2 * n, endpoint=False)[None, :]
    p = np.stack([np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a) + 0 * b], -1)
    return grid((p * radii + centre)[::-1], name, material, close_v=True)


def box(
    centre: tuple[float, float, float],
    size: tuple[float, float, float],
    name: str = "box",
    material: str = "plastic_black",
    r: float = 0.0,
    n: int = 3,
) -> Piece:
    """Return a box with sharp or rounded edges.

    Parameters
    ----------
    centre : (3,) m.
    size : (3,) full sizes along x, y and z, m.
    name : name of the piece.
    material : name of the material.
    r : radius of the edges, m; 0: sharp edges, shaded flat.
    n : steps of each rounded edge.
    """
    half = np.asarray(size, float) / 2
    r = min(r, half.min())
    if r <= 0:
        return sharp_boxes(np.array([centre], float), np.array([size], float), name, material)
    directions, signs, faces = _rounded(n)
    points = signs * (half - r) + r * directions + centre
    return Piece(name, points, faces, material, directions)


@lru_cache(maxsize=16)
def _rounded(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the directions (k, 3) of the vertices of a rounded box, their signs (k, 3), and the
    faces (m, 3). The arrays are cached and read-only.

    Parameters
    ----------
    n : steps of each rounded edge.
    """
    lat = np.concatenate(
        [
            [-np.pi / 2],
            -np.linspace(np.pi / 2 - 1e-3, 1e-3, n + 1),
            np.linspace(1e-3, np.pi / 2 - 1e-3, n + 1),
            [np.pi / 2],
        ]
    )[:, None]
    q = np.linspace(1e-3, np.pi / 2 - 1e-3, n + 1)
    lon = np.concatenate([q + k * np.pi / 2 for k in range(4)])[None, :]
    d = np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat) + 0 * lon], -1)
    directions = d[::-1].reshape(-1, 3)
    signs = np.where(np.abs(directions) < 1e-9, 0, np.sign(directions))
    for fixed in (directions, signs):
        fixed.flags.writeable = False
    return directions, signs, _grid_faces(*d.shape[:2], False, True)


def sharp_boxes(centres: np.ndarray, sizes: np.ndarray, name: str, material: str) -> Piece:
    """Return boxes with sharp edges, shaded flat, as one piece.

    Parameters
    ----------
    centres : (k, 3) m.
    sizes : (k, 3) full sizes along x, y and z, m.
    name : name of the piece.
    material : name of the material.
    """
    corners = BOX_CORNERS * (sizes[:, None] / 2) + centres[:, None]
    return _flat_alike(corners, BOX_FACES, name, material)


def flat_grids(
    points: np.ndarray, name: str, material: str, close_u: bool = False, close_v: bool = False
) -> Piece:
    """Return grids of quads, one normal per face, as one piece. It equals joined flat grids.

    Parameters
    ----------
    points : (k, n, m, 3) points of k grids, m, ordered as in `grid`.
    name : name of the piece.
    material : name of the material.
    close_u, close_v : whether the last row or column of each grid is joined to the first.
    """
    faces = _grid_faces(*points.shape[1:3], close_u, close_v)
    return _flat_alike(points.reshape(len(points), -1, 3), faces, name, material)


def _flat_alike(vertices: np.ndarray, faces: np.ndarray, name: str, material: str) -> Piece:
    """Return meshes with equal faces, shaded flat, as one piece.

    Parameters
    ----------
    vertices : (k, n, 3) vertices of k meshes, m.
    faces : (m, 3) indices of the corners of the faces, equal in all meshes.
    name : name of the piece.
    material : name of the material.
    """
    corners = vertices.take(faces.ravel(), 1).reshape(-1, 3, 3)
    a, b, c = corners.transpose(1, 0, 2)
    normals = np.repeat(unit(cross(b - a, c - a) / 2), 3, 0)
    own = np.arange(3 * len(corners)).reshape(-1, 3)
    return Piece(name, corners.reshape(-1, 3), own, material, normals)


def lathe(
    profile: Sequence[tuple[float, float]],
    name: str = "lathe",
    material: str = "plastic_black",
    n: int = 32,
    axis: str = "y",
    turn: tuple[float, float] = (0, 2 * np.pi),
) -> Piece:
    """Return the surface of a profile that turns about an axis.

    Faces point outward if the profile rises along the axis. A disc faces along the axis if its
    profile runs from rim to centre.

    Parameters
    ----------
    profile : (k, 2) radius and height along the axis, m.
    name : name of the piece.
    material : name of the material.
    n : number of stations around the axis.
    axis : `x`, `y` or `z`.
    turn : first and last angle, radians; the surface of a whole turn is closed.
    """
    r, h = np.asarray(profile, float).T
    full = abs(turn[1] - turn[0]) > 6.28
    a = np.linspace(*turn, n, endpoint=not full)
    c = np.cos(a)[:, None] * r
    s = np.sin(a)[:, None] * r
    h = np.broadcast_to(h, c.shape)
    p = {"x": (h, c, s), "y": (s, h, c), "z": (c, s, h)}[axis]
    return grid(np.stack(p, -1), name, material, close_u=full)


def tube(
    path: ArrayLike,
    radius: float | list[float],
    name: str = "tube",
    material: str = "plastic_black",
    sides: int = 8,
    caps: bool = True,
) -> Piece:
    """Return a round tube along a polyline.

    Parameters
    ----------
    path : (k, 3) points of the middle line, m.
    radius : one number, or one for each point, m.
    name : name of the piece.
    material : name of the material.
    sides : number of sides of the section.
    caps : whether both ends are closed.
    """
    p = np.asarray(path, float)
    r = np.broadcast_to(np.asarray(radius, float), len(p)).copy()
    if caps:
        p = np.concatenate([p[:1], p, p[-1:]])
        r = np.concatenate([[END_M], r, [END_M]])
    return grid(_rings(p, r, sides), name, material, close_v=True)


class Stem(NamedTuple):
    """An open tube: its middle line and the radius along it."""

    path: ArrayLike  # (k, 3) points of the middle line, m
    radius: ArrayLike  # one number, or one for each point, m
    sides: int  # number of sides of the section


def tubes(stems: Sequence[Stem], name: str = "tubes", material: str = "plastic_black") -> Piece:
    """Return open tubes as one piece. It equals joined tubes and takes a fraction of the time.

    Parameters
    ----------
    stems : tubes, in the order of their vertices and faces in the piece.
    name : name of the piece.
    material : name of the material.
    """
    alike: dict[tuple[int, int], list[int]] = {}
    for k, stem in enumerate(stems):
        alike.setdefault((len(stem.path), stem.sides), []).append(k)
    points = np.array([len(stem.path) for stem in stems])
    sides = np.array([stem.sides for stem in stems])
    first = np.cumsum(np.append(0, points * sides))
    first_face = np.cumsum(np.append(0, 2 * (points - 1) * sides))
    vertices = np.empty((first[-1], 3))
    faces = np.empty((first_face[-1], 3), np.int64)
    for (count, around), rows in alike.items():
        paths = np.array([stems[k].path for k in rows], float)
        radii = np.array([np.broadcast_to(stems[k].radius, count) for k in rows], float)
        own = _grid_faces(count, around, False, True)
        start = first.take(rows)[:, None]
        vertices[start + np.arange(count * around)] = _rings(paths, radii, around).reshape(
            len(rows), -1, 3
        )
        faces[first_face.take(rows)[:, None] + np.arange(len(own))] = own + start[..., None]
    apart = np.arange(len(vertices))  # no two vertices of an open tube are at the same place
    return Piece(name, vertices, faces, material, vertex_normals(vertices, faces, apart))


def closed_tubes(paths: np.ndarray, radii: np.ndarray, sides: int) -> Piece:
    """Return tubes with closed ends as one piece.

    The piece equals joined tubes and takes a fraction of the time.

    Parameters
    ----------
    paths : (k, n, 3) points of the middle lines of k tubes, m.
    radii : (k, n) radii at these points, m.
    sides : number of sides of the sections.
    """
    paths = np.concatenate([paths[:, :1], paths, paths[:, -1:]], 1)
    ends = np.full((len(radii), 1), END_M)
    rings = _rings(paths, np.concatenate([ends, radii, ends], 1), sides)
    tubes, count, _, _ = rings.shape
    vertices = rings.reshape(-1, 3)
    own = _grid_faces(count, sides, False, True)
    first = np.arange(tubes) * count * sides
    faces = (own + first[:, None, None]).reshape(-1, 3)
    places = places_of(vertices, np.repeat(np.arange(tubes), count * sides))
    normals = vertex_normals(vertices, faces, places)
    return Piece("tubes", vertices, faces, normals=normals)


@lru_cache(maxsize=64)
def _circle(sides: int) -> tuple[np.ndarray, np.ndarray]:
    """Return cosine and sine (sides, 1) of equal angles of a circle, cached and read-only."""
    a = np.linspace(0, 2 * np.pi, sides, endpoint=False)[:, None]
    circle = np.cos(a), np.sin(a)
    for fixed in circle:
        fixed.flags.writeable = False
    return circle


def _slopes(path: np.ndarray) -> np.ndarray:
    """Return the central differences (..., k, 3) of points along paths, one-sided at the ends.

    The result equals that of `numpy.gradient`, which takes five times as long for few points.
    """
    out = np.empty_like(path)
    np.subtract(path[..., 2:, :], path[..., :-2, :], out=out[..., 1:-1, :])
    out[..., 1:-1, :] /= 2.0
    np.subtract(path[..., 1, :], path[..., 0, :], out=out[..., 0, :])
    np.subtract(path[..., -1, :], path[..., -2, :], out=out[..., -1, :])
    return out


def _rings(path: np.ndarray, radius: np.ndarray, sides: int) -> np.ndarray:
    """Return the points (..., k, sides, 3) of rings around polylines, m.

    Parameters
    ----------
    path : (..., k, 3) points of the middle lines, m.
    radius : (..., k) radii at these points, m.
    sides : number of points of each ring.
    """
    t = unit(_slopes(path) + 1e-12)
    side = cross(t, SIDEWAYS)
    weak = (np.linalg.norm(side, axis=-1) < 0.2).any(-1)
    if weak.any():
        side = np.where(weak[..., None, None], cross(t, OTHERWISE), side)
    side = unit(side)
    up = cross(side, t)
    cosine, sine = _circle(sides)
    ring = cosine * side[..., None, :] + sine * up[..., None, :]
    return path[..., None, :] + radius[..., None, None] * ring
