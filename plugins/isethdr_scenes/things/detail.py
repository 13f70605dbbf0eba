"""Coarser meshes for things that are far away, by merging near vertices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..geometry.mesh.piece import Assembly, Piece, compact, face_sizes

LEAST_FACE_M2 = 1e-10  # slivers of cuts, which no picture shows


def clean(model: Assembly) -> Assembly:
    """Return a copy without faces of no area."""
    if not model.parts:
        return Assembly(model.name)
    joined = _joined(model.parts)
    return _without_slivers(model.name, model.parts, joined)


class _Joined(NamedTuple):
    """Meshes of several parts in one: a car has 240 parts, which are slow one by one."""

    vertices: np.ndarray  # (n, 3) m
    faces: np.ndarray  # (m, 3) into these vertices
    vertex_ends: np.ndarray  # (parts + 1,) where each part begins and ends
    face_ends: np.ndarray  # (parts + 1,)


def _joined(parts: Sequence[Piece]) -> _Joined:
    vertex_ends = np.cumsum([0] + [len(part.vertices) for part in parts])
    return _Joined(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + first for part, first in zip(parts, vertex_ends)]),
        vertex_ends,
        np.cumsum([0] + [len(part.faces) for part in parts]),
    )


def _without_slivers(name: str, parts: Sequence[Piece], joined: _Joined) -> Assembly:
    """Return the parts without faces of no area, and without vertices that no face uses.

    Parameters
    ----------
    name : of the assembly.
    parts : whose meshes these are.
    joined : their meshes in one.
    """
    size = face_sizes(Piece(name, joined.vertices, joined.faces))
    solid = size > LEAST_FACE_M2
    used = np.zeros(len(joined.vertices), bool)
    used[joined.faces if solid.all() else joined.faces[solid]] = True
    out = Assembly(name)
    for k, part in enumerate(parts):
        kept = solid[joined.face_ends[k] : joined.face_ends[k + 1]]
        if not kept.all():
            out.add(compact(replace(part, faces=part.faces[kept])))
        elif used[joined.vertex_ends[k] : joined.vertex_ends[k + 1]].all():
            out.add(part)
        else:
            out.add(compact(part))
    return out


def centred(model: Assembly) -> Assembly:
    """Return a copy whose extent is centred in x and y."""
    low, high = extent_m(model)
    middle = (low + high) / 2
    middle[2] = 0.0
    parts = [replace(p, vertices=p.vertices - middle) for p in model.parts]
    return Assembly(model.name, parts)


def extent_m(model: Assembly) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the largest x, y, z of all vertices, m."""
    v = np.concatenate([part.vertices for part in model.parts])
    return v.min(0), v.max(0)


def coarser(model: Assembly, cell_m: float) -> Assembly:
    """Return a copy whose vertices within one cell of `cell_m` are one vertex; its extent stays.

    All parts share the merged places, so that no gap opens between them. Lamps stay as they are:
    their candela belong to their faces.
    """
    dark = [part for part in model.parts if part.lamp is None]
    lit = [part for part in model.parts if part.lamp is not None]
    joined = _joined(dark)
    ids, places = _cells(joined.vertices, cell_m)
    merged, moved = _moved_to(dark, joined, ids, places)
    return _without_slivers(model.name, merged, moved).add(*lit)


def _cells(vertices: np.ndarray, cell_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of the cell of each vertex, and the place of each cell: the mean of its
    vertices, moved to the end of the extent where one of them is there.
    """
    low = vertices.min(0)
    high = vertices.max(0)
    cell = np.floor((vertices - low) / cell_m + 0.5).astype(np.int64)
    span = cell.max(0) + 1
    key = (cell[:, 0] * span[1] + cell[:, 1]) * span[2] + cell[:, 2]
    _, ids, count = np.unique(key, return_inverse=True, return_counts=True)
    total = np.stack([np.bincount(ids, vertices[:, k]) for k in range(3)], 1)
    places = total / count[:, None]
    for axis in range(3):
        for end in (low[axis], high[axis]):
            places[ids[vertices[:, axis] == end], axis] = end
    return ids, places


def _moved_to(
    parts: Sequence[Piece], joined: _Joined, ids: np.ndarray, places: np.ndarray
) -> tuple[list[Piece], _Joined]:
    """Return parts whose vertices are cells, without faces between fewer than three cells and faces
    that are there twice in a part; and their meshes in one.

    Parameters
    ----------
    parts : as they are.
    joined : their meshes in one, of n vertices.
    ids : (n,) cell of each vertex.
    places : (cells, 3) place of each cell, m.
    """
    count = np.diff(joined.vertex_ends)
    owner = np.repeat(np.arange(len(parts)) * len(places), count)
    cells, own = np.unique(owner + ids, return_inverse=True)  # a part's cells follow each other
    vertex_ends = np.searchsorted(cells, np.arange(len(parts) + 1) * len(places))
    vertices = places.take(cells % len(places), 0)
    normals = np.concatenate(
        [np.zeros_like(p.vertices) if p.normals is None else p.normals for p in parts]
    )
    normals = _unit_or_up(np.stack([np.bincount(own, normals[:, k]) for k in range(3)], 1))
    faces = own.take(joined.faces)
    kept = _distinct(faces)
    faces = faces.take(kept, 0)
    face_ends = np.searchsorted(kept, joined.face_ends)
    out = []
    for k, part in enumerate(parts):
        there = slice(vertex_ends[k], vertex_ends[k + 1])
        own_faces = faces[face_ends[k] : face_ends[k + 1]] - vertex_ends[k]
        own_normals = None if part.normals is None else normals[there]
        out.append(replace(part, vertices=vertices[there], faces=own_faces, normals=own_normals))
    return out, _Joined(vertices, faces, vertex_ends, face_ends)


def _distinct(faces: np.ndarray) -> np.ndarray:
    """Return the rows, in order, of faces (m, 3) between three vertices; the first row where
    several faces share all three.
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
    """Return vectors (n, 3) of length 1; upwards where both sides of a thin part cancel."""
    length = np.linalg.norm(v, axis=1)
    out = v / np.maximum(length, 1e-9)[:, None]
    out[length < 1e-3] = (0.0, 0.0, 1.0)
    return out
