"""Coarser meshes for things that are far away. Vertices close to each other are merged."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..geometry.mesh.piece import Assembly, Piece, extent_of, face_sizes, squared_length

LEAST_FACE_M2 = 1e-10  # least area of a face; smaller ones are slivers of cuts, never visible
MOST_IN_TABLE = 4_000_000  # largest number of possible keys that are numbered by a table

MOST_IN_KEY = 1_600_000  # largest number of vertices of which an int64 encodes three


def clean(model: Assembly) -> Assembly:
    """Return a copy without faces that have no area."""
    if not model.parts:
        return Assembly(model.name)
    solid = _without_slivers(_joined(model.parts))
    return Assembly(model.name).add(*solid.apart(model.parts))


class _Joined(NamedTuple):
    """Meshes of several parts as one. A car has 140 parts, and processing each alone is slow."""

    vertices: np.ndarray  # (n, 3) m
    faces: np.ndarray  # (m, 3) indices of vertices
    normals: np.ndarray | None  # (n, 3), 0 in parts without normals; None: no part has normals
    vertex_ends: np.ndarray  # (parts + 1,) first vertex of each part, and the end of the last part
    face_ends: np.ndarray  # (parts + 1,) the same of faces

    def beginning(self, count: int) -> _Joined:
        """Return the meshes of the first `count` parts as one."""
        vertex_ends = self.vertex_ends[: count + 1]
        face_ends = self.face_ends[: count + 1]
        return _Joined(
            self.vertices[: vertex_ends[-1]],
            self.faces[: face_ends[-1]],
            None if self.normals is None else self.normals[: vertex_ends[-1]],
            vertex_ends,
            face_ends,
        )

    def apart(self, parts: Sequence[Piece]) -> list[Piece]:
        """Return the meshes as separate parts, with names, materials and lamps of `parts`."""
        out = []
        vertex_ends = self.vertex_ends.tolist()
        face_ends = self.face_ends.tolist()
        for k, part in enumerate(parts):
            there = slice(vertex_ends[k], vertex_ends[k + 1])
            faces = self.faces[face_ends[k] : face_ends[k + 1]] - vertex_ends[k]
            normals = None
            if self.normals is not None and part.normals is not None:
                normals = self.normals[there]
            vertices = self.vertices[there]
            out.append(Piece(part.name, vertices, faces, part.material, normals, part.lamp))
        return out


def _joined(parts: Sequence[Piece]) -> _Joined:
    vertex_ends = np.cumsum([0] + [len(part.vertices) for part in parts])
    normals = None
    if any(part.normals is not None for part in parts):
        normals = np.concatenate(
            [np.zeros_like(p.vertices) if p.normals is None else p.normals for p in parts]
        )
    return _Joined(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + first for part, first in zip(parts, vertex_ends.tolist())]),
        normals,
        vertex_ends,
        np.cumsum([0] + [len(part.faces) for part in parts]),
    )


def _without_slivers(joined: _Joined) -> _Joined:
    """Return meshes without faces that have no area, and without vertices that no face uses."""
    size = face_sizes(Piece("joined", joined.vertices, joined.faces))
    solid = size > LEAST_FACE_M2
    whole = bool(solid.all())
    faces = joined.faces if whole else joined.faces.compress(solid, 0)
    face_ends = joined.face_ends if whole else _ends_of(solid, joined.face_ends)
    used = np.zeros(len(joined.vertices), bool)
    used[faces] = True
    if used.all():
        return joined._replace(faces=faces, face_ends=face_ends)
    return _Joined(
        joined.vertices.compress(used, 0),
        (np.cumsum(used) - 1).take(faces),
        None if joined.normals is None else joined.normals.compress(used, 0),
        _ends_of(used, joined.vertex_ends),
        face_ends,
    )


def _ends_of(kept: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return the ends of parts, as in `_Joined`, after some elements are left out.

    Parameters
    ----------
    kept : (n,) whether each element stays.
    ends : (parts + 1,) ends of the parts among all elements.
    """
    return np.append(0, np.cumsum(kept)).take(ends)


def finished(model: Assembly, cell_m: float | None = None) -> Assembly:
    """Return a copy that is cleaned, centred, and coarser if a cell is given.

    The result is that of `clean`, `centred` and `coarser`, which would join all parts three times.

    Parameters
    ----------
    model : the assembly.
    cell_m : width of the cells in which vertices are merged, m; None: all vertices stay.
    """
    parts = model.parts
    dark = [part for part in parts if part.lamp is None]
    if cell_m is not None:  # dark parts first, so that their meshes are the beginning of the whole
        parts = dark + [part for part in parts if part.lamp is not None]
    whole = _without_slivers(_joined(parts))
    whole = whole._replace(vertices=whole.vertices - _middle_m(whole.vertices))
    if cell_m is None:
        return Assembly(model.name).add(*whole.apart(parts))
    merged = _merged(whole.beginning(len(dark)), cell_m)
    lit = whole.apart(parts)[len(dark) :]
    return Assembly(model.name).add(*merged.apart(dark), *lit)


def centred(model: Assembly) -> Assembly:
    """Return a copy with its extent centred in x and y."""
    middle = _middle_m(np.concatenate([part.vertices for part in model.parts]))
    parts = [
        Piece(p.name, p.vertices - middle, p.faces, p.material, p.normals, p.lamp)
        for p in model.parts
    ]
    return Assembly(model.name, parts)


def _middle_m(vertices: np.ndarray) -> np.ndarray:
    """Return the middle (3,) in x and y of the extent of vertices (n, 3), at z = 0, m."""
    low, high = extent_of(vertices)
    middle = (low + high) / 2
    middle[2] = 0.0
    return middle


def extent_m(model: Assembly) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the largest x, y, z of all vertices, m."""
    return extent_of(np.concatenate([part.vertices for part in model.parts]))


def coarser(model: Assembly, cell_m: float) -> Assembly:
    """Return a copy with all vertices in a cell of `cell_m` merged. Its extent does not change.

    All parts share the merged places, so that no gap opens between them. Lamps do not change,
    because their intensities belong to their faces.
    """
    dark = [part for part in model.parts if part.lamp is None]
    lit = [part for part in model.parts if part.lamp is not None]
    merged = _merged(_joined(dark), cell_m)
    return Assembly(model.name).add(*merged.apart(dark), *lit)


def _merged(joined: _Joined, cell_m: float) -> _Joined:
    """Return meshes with all vertices in a cell of `cell_m` merged, without slivers."""
    ids, places = _cells(joined.vertices, cell_m)
    return _without_slivers(_moved_to(joined, ids, places))


def _cells(vertices: np.ndarray, cell_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of the cell of each vertex, and the place of each cell.

    The place is the mean of the cell's vertices. Along an axis it is the end of the extent if one
    of these vertices is there.
    """
    rows = np.ascontiguousarray(vertices.T)
    low, high = extent_of(vertices)
    cell = np.floor((rows - low[:, None]) / cell_m + 0.5).astype(np.int64)
    span = cell.max(1) + 1
    key = (cell[0] * span[1] + cell[1]) * span[2] + cell[2]
    _, ids = _numbered(key)
    count = np.bincount(ids)
    places = np.stack([np.bincount(ids, row) / count for row in rows], 1)
    for axis, row in enumerate(rows):
        for end in (low[axis], high[axis]):
            places[ids.take(np.flatnonzero(row == end)), axis] = end
    return ids, places


def _numbered(key: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distinct keys in order, and the number of each key among them.

    The result is that of `numpy.unique` for keys (n,) from 0. If the largest key is small enough, a
    table replaces the sort.
    """
    count = int(key.max(initial=0)) + 1
    if count > MOST_IN_TABLE:
        return np.unique(key, return_inverse=True)
    there = np.zeros(count, bool)
    there[key] = True
    return np.flatnonzero(there), (np.cumsum(there) - 1).take(key)


def _moved_to(joined: _Joined, ids: np.ndarray, places: np.ndarray) -> _Joined:
    """Return meshes with one vertex for each cell of a part.

    Faces between fewer than three cells are left out, and so are repeated faces of a part.

    Parameters
    ----------
    joined : the meshes as one, with n vertices.
    ids : (n,) cell of each vertex.
    places : (cells, 3) place of each cell, m.
    """
    parts = len(joined.vertex_ends) - 1
    owner = np.repeat(np.arange(parts) * len(places), np.diff(joined.vertex_ends))
    cells, own = _numbered(owner + ids)  # the cells of a part are consecutive
    vertex_ends = np.searchsorted(cells, np.arange(parts + 1) * len(places))
    normals = joined.normals
    if normals is not None:
        normals = _unit_or_up(np.stack([np.bincount(own, normals[:, k]) for k in range(3)], 1))
    faces = own.take(joined.faces)
    kept = _distinct(faces)
    face_ends = np.searchsorted(kept, joined.face_ends)
    vertices = places.take(cells % len(places), 0)
    return _Joined(vertices, faces.take(kept, 0), normals, vertex_ends, face_ends)


def _distinct(faces: np.ndarray) -> np.ndarray:
    """Return the rows, in order, of faces (m, 3) that have three different vertices.

    If several faces have the same vertices, only the first row is returned.
    """
    a, b, c = faces.T
    thick = np.flatnonzero((a != b) & (b != c) & (a != c))
    a, b, c = faces.take(thick, 0).T
    low = np.minimum(np.minimum(a, b), c)
    high = np.maximum(np.maximum(a, b), c)
    number = int(faces.max(initial=0)) + 1
    pair = low * number + high
    if number > MOST_IN_KEY:
        _, pair = np.unique(pair, return_inverse=True)
    key = pair * number + (a + b + c - low - high)
    order = np.argsort(key)
    key = key.take(order)
    starts = np.flatnonzero(np.append(True, key[1:] != key[:-1])[: len(key)])
    return thick[np.sort(np.minimum.reduceat(order, starts))] if len(key) else thick


def _unit_or_up(v: np.ndarray) -> np.ndarray:
    """Return unit vectors (n, 3). They point up where the normals of a thin part cancel."""
    length = np.sqrt(squared_length(v))
    out = v / np.maximum(length, 1e-9)[:, None]
    out[length < 1e-3] = (0.0, 0.0, 1.0)
    return out
