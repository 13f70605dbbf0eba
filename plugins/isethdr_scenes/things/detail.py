"""Coarser meshes for things that are far away, by merging near vertices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..geometry.mesh.piece import Assembly, Piece, compact, face_areas

LEAST_FACE_M2 = 1e-10  # slivers of cuts, which no picture shows


def clean(model: Assembly) -> Assembly:
    """Return a copy without faces of no area."""
    out = Assembly(model.name)
    for part in model.parts:
        area = np.linalg.norm(face_areas(part), axis=1)
        out.add(compact(replace(part, faces=part.faces[area > LEAST_FACE_M2])))
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
    vertices = np.concatenate([part.vertices for part in dark])
    ids, places = _cells(vertices, cell_m)
    out = Assembly(model.name)
    first = 0
    for part in dark:
        last = first + len(part.vertices)
        out.add(_moved_to(part, ids[first:last], places))
        first = last
    return out.add(*lit)


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


def _moved_to(part: Piece, ids: np.ndarray, places: np.ndarray) -> Piece:
    """Return a part whose vertices are the cells `ids`, without faces of no area and faces that are
    there twice.
    """
    cells, own = np.unique(ids, return_inverse=True)
    normals = part.normals
    if normals is not None:
        total = np.stack([np.bincount(own, normals[:, k]) for k in range(3)], 1)
        normals = _unit_or_up(total)
    faces = own[part.faces]
    thick = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2])
    thick &= faces[:, 0] != faces[:, 2]
    faces = faces[thick]
    low, middle, high = np.sort(faces, 1).T
    key = (low * len(cells) + middle) * len(cells) + high
    _, first = np.unique(key, return_index=True)
    merged = replace(part, vertices=places[cells], faces=faces[np.sort(first)], normals=normals)
    area = np.linalg.norm(face_areas(merged), axis=1)
    return compact(replace(merged, faces=merged.faces[area > LEAST_FACE_M2]))


def _unit_or_up(v: np.ndarray) -> np.ndarray:
    """Return vectors (n, 3) of length 1; upwards where both sides of a thin part cancel."""
    length = np.linalg.norm(v, axis=1)
    out = v / np.maximum(length, 1e-9)[:, None]
    out[length < 1e-3] = (0.0, 0.0, 1.0)
    return out
