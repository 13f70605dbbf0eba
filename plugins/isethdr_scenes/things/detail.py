"""Coarser meshes for things that are far away. Vertices close to each other are merged."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..geometry.mesh.piece import Assembly, Piece, face_sizes

LEAST_FACE_M2 = 1e-10  # least area of a face; smaller ones are slivers of cuts, never visible
MOST_IN_TABLE = 4_000_000  # largest number of possible keys that are numbered by a table


def clean(model: Assembly) -> Assembly:
    """Return a copy without faces that have no area."""
    if not model.parts:
        return Assembly(model.name)
    joined = _joined(model.parts)
    return _without_slivers(model.name, model.parts, joined)


class _Joined(NamedTuple):
    """Meshes of several parts as one. A car has 140 parts, and processing each alone is slow."""

    vertices: np.ndarray  # (n, 3) m
    faces: np.ndarray  # (m, 3) indices of vertices
    normals: np.ndarray | None  # (n, 3), 0 in parts without normals; None: no part has normals
    vertex_ends: np.ndarray  # (parts + 1,) first vertex of each part, and the end of the last part
    face_ends: np.ndarray  # (parts + 1,) the same of faces

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


def _without_slivers(name: str, parts: Sequence[Piece], joined: _Joined) -> Assembly:
    """Return the parts without faces that have no area, and without vertices that no face uses.

    Parameters
    ----------
    name : name of the assembly.
    parts : parts that give names, materials and lamps.
    joined : their meshes as one.
    """
    size = face_sizes(Piece(name, joined.vertices, joined.faces))
    solid = size > LEAST_FACE_M2
    whole = bool(solid.all())
    faces = joined.faces if whole else joined.faces.compress(solid, 0)
    face_ends = joined.face_ends if whole else _ends_of(solid, joined.face_ends)
    used = np.zeros(len(joined.vertices), bool)
    used[faces] = True
    if used.all():
        kept = joined._replace(faces=faces, face_ends=face_ends)
    else:
        kept = _Joined(
            joined.vertices.compress(used, 0),
            (np.cumsum(used) - 1).take(faces),
            None if joined.normals is None else joined.normals.compress(used, 0),
            _ends_of(used, joined.vertex_ends),
            face_ends,
        )
    return Assembly(name).add(*kept.apart(parts))


def _ends_of(kept: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return the ends of parts, as in `_Joined`, after some elements are left out.

    Parameters
    ----------
    kept : (n,) whether each element stays.
    ends : (parts + 1,) ends of the parts among all elements.
    """
    return np.append(0, np.cumsum(kept)).take(ends)


def centred(model: Assembly) -> Assembly:
    """Return a copy with its extent centred in x and y."""
    low, high = extent_m(model)
    middle = (low + high) / 2
    middle[2] = 0.0
    parts = [
        Piece(p.name, p.vertices - middle, p.faces, p.material, p.normals, p.lamp)
        for p in model.parts
    ]
    return Assembly(model.name, parts)


def extent_m(model: Assembly) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the largest x, y, z of all vertices, m."""
    v = np.concatenate([part.vertices for part in model.parts])
    return v.min(0), v.max(0)


def coarser(model: Assembly, cell_m: float) -> Assembly:
    """Return a copy with all vertices in a cell of `cell_m` merged. Its extent does not change.

    All parts share the merged places, so that no gap opens between them. Lamps do not change,
    because their intensities belong to their faces.
    """
    dark = [part for part in model.parts if part.lamp is None]
    lit = [part for part in model.parts if part.lamp is not None]
    joined = _joined(dark)
    ids, places = _cells(joined.vertices, cell_m)
    merged = _moved_to(joined, ids, places)
    return _without_slivers(model.name, dark, merged).add(*lit)


def _cells(vertices: np.ndarray, cell_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of the cell of each vertex, and the place of each cell.

    The place is the mean of the cell's vertices. Along an axis it is the end of the extent if one
    of these vertices is there.
    """
    low = vertices.min(0)
    high = vertices.max(0)
    cell = np.floor((vertices - low) / cell_m + 0.5).astype(np.int64)
    span = cell.max(0) + 1
    key = (cell[:, 0] * span[1] + cell[:, 1]) * span[2] + cell[:, 2]
    _, ids = _numbered(key)
    count = np.bincount(ids)
    total = np.stack([np.bincount(ids, vertices[:, k]) for k in range(3)], 1)
    places = total / count[:, None]
    for axis in range(3):
        for end in (low[axis], high[axis]):
            places[ids[vertices[:, axis] == end], axis] = end
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
    _, pair = np.unique(low * number + high, return_inverse=True)
    _, first = np.unique(pair * number + (a + b + c - low - high), return_index=True)
    return thick[np.sort(first)]


def _unit_or_up(v: np.ndarray) -> np.ndarray:
    """Return unit vectors (n, 3). They point up where the normals of a thin part cancel."""
    length = np.linalg.norm(v, axis=1)
    out = v / np.maximum(length, 1e-9)[:, None]
    out[length < 1e-3] = (0.0, 0.0, 1.0)
    return out
