"""Pieces: parts that can be moved, renamed and joined. An assembly collects pieces for a `Model`.

Units are metres. Models stand on z = 0, look along +x, and have +y on their left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.scene import Model, Part

from ...lamps import lamp

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import Lamp


@dataclass(frozen=True, eq=False)
class Piece(Part):
    """A part under construction: a `Part` with methods that move and rename it."""

    material: str = "plastic_black"

    def moved(self, matrix: np.ndarray) -> Piece:
        """Return the piece moved by a (4, 4) matrix. Faces point outward even after mirroring."""
        m = np.asarray(matrix, float)
        turn = m[:3, :3]
        vertices = self.vertices @ turn.T + m[:3, 3]
        # Normals need the inverse transpose. It keeps them perpendicular to a stretched surface.
        normals = None if self.normals is None else unit(self.normals @ np.linalg.inv(turn))
        faces = self.faces if np.linalg.det(turn) > 0 else self.faces[:, ::-1]
        lit = self.lamp and replace(
            self.lamp, axis=tuple(map(float, unit(turn @ np.array(self.lamp.axis))))
        )
        return replace(self, vertices=vertices, faces=faces, normals=normals, lamp=lit)

    def named(self, name: str, material: str | None = None, lamp: Lamp | None = None) -> Piece:
        """Return the piece under another name, with another material or lamp where given.

        Parameters
        ----------
        name : the new name.
        material : name of another material; None: as before.
        lamp : `Lamp` in place of the piece's own; None: as before.
        """
        return replace(self, name=name, material=material or self.material, lamp=lamp or self.lamp)

    def offset(self, distance: float) -> Piece:
        """Return the piece pushed along its normals by `distance` metres."""
        return replace(self, vertices=self.vertices + distance * self.normals)


@dataclass
class Assembly:
    """A named list of pieces that grows until `model()` freezes it."""

    name: str
    parts: list[Piece] = field(default_factory=list)

    def add(self, *pieces: Piece) -> Assembly:
        """Append pieces, leaving out empty ones, and return self."""
        self.parts += [p for p in pieces if len(p.faces)]
        return self

    def moved(self, matrix: np.ndarray, name: str | None = None) -> Assembly:
        """Return a copy moved by a (4, 4) matrix."""
        return Assembly(name or self.name, [p.moved(matrix) for p in self.parts])

    def model(self, name: str | None = None) -> Model:
        """Return the finished model, with one part per material and one part per lamp.

        Fewer parts mean fewer shapes for the renderer. A lamp is a part of its own because its
        intensity is that of the whole part. Left and right lamps stay two parts.
        """
        groups: dict[tuple, list[Piece]] = {}
        for p in self.parts:
            key = (f"{p.name} {p.lamp.axis}", p.material) if p.lamp else (None, p.material)
            groups.setdefault((*key, p.normals is None), []).append(p)
        parts = [
            join(pieces, pieces[0].name if name else material)
            for (name, material, _), pieces in groups.items()
        ]
        return Model(name or self.name, tuple(parts))


def unit(v: np.ndarray) -> np.ndarray:
    """Return `v` (..., 3) scaled to length 1 along its last axis."""
    return v / np.maximum(np.sqrt(squared_length(v)), 1e-12)[..., None]


def squared_length(v: np.ndarray) -> np.ndarray:
    """Return the sum of squares of `v` (..., 3) along its last axis.

    It adds column by column, because numpy's sum along an axis of 3 takes four times as long.
    """
    total = v[..., 0] * v[..., 0]
    for k in range(1, v.shape[-1]):
        total += v[..., k] * v[..., k]
    return total


def pose(
    x: float = 0.0,
    y: float = 0.0,
    z: float = 0.0,
    yaw: float = 0.0,
    scale: tuple[int, int, int] = (1, 1, 1),
) -> np.ndarray:
    """Return the (4, 4) matrix that scales, then turns about z, then shifts.

    Parameters
    ----------
    x : shift ahead, m.
    y : shift to the left, m.
    z : shift upwards, m.
    yaw : turn to the left about z, degrees.
    scale : (3,) factors along x, y and z; negative factors mirror.
    """
    c = np.cos(np.radians(yaw))
    s = np.sin(np.radians(yaw))
    m = np.eye(4)
    m[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) * np.asarray(scale, float)
    m[:3, 3] = x, y, z
    return m


def shift(x: float, y: float, z: float) -> np.ndarray:
    """Return the (4, 4) matrix of a shift.

    Parameters
    ----------
    x : shift ahead, m.
    y : shift to the left, m.
    z : shift upwards, m.
    """
    m = np.eye(4)
    m[:3, 3] = x, y, z
    return m


def mirrored(piece: Piece, name: str | None = None) -> Piece:
    """Return a copy on the other side of the plane y = 0."""
    return replace(
        piece.moved(pose(scale=(1, -1, 1))), name=name or piece.name.replace("left", "right")
    )


def join(pieces: Sequence[Piece], name: str) -> Piece:
    """Return pieces joined into one, with the material and lamp of the first piece."""
    first = np.cumsum([0] + [len(p.vertices) for p in pieces])
    normals = None if pieces[0].normals is None else np.concatenate([p.normals for p in pieces])
    return replace(
        pieces[0],
        name=name,
        vertices=np.concatenate([p.vertices for p in pieces]),
        faces=np.concatenate([p.faces + k for p, k in zip(pieces, first)]),
        normals=normals,
    )


def face_areas(part: Part) -> np.ndarray:
    """Return the vector area (m, 3) of each face, m2. The vector points along the outward normal;
    its length is the area.
    """
    v = part.vertices
    f = part.faces
    return _cross(v, f) / 2


def face_sizes(part: Part) -> np.ndarray:
    """Return the area (m,) of each face, m2."""
    return np.sqrt(squared_length(face_areas(part)))


def vertex_normals(
    vertices: np.ndarray, faces: np.ndarray, ids: np.ndarray | None = None
) -> np.ndarray:
    """Return area-weighted normals (n, 3). Vertices at the same place share one normal.

    Parameters
    ----------
    vertices : (n, 3) m.
    faces : (m, 3) indices of the corners of each face.
    ids : (n,) number of the place of each vertex, from 0; None: as from `places_of`.
    """
    face = _cross(vertices, faces)
    if ids is None:
        ids = places_of(vertices)
    corners = ids.take(faces).ravel()
    count = int(ids.max()) + 1
    total = np.stack([np.bincount(corners, np.repeat(face[:, c], 3), count) for c in range(3)], 1)
    return unit(total).take(ids, 0)


def places_of(vertices: np.ndarray, mesh: np.ndarray | None = None) -> np.ndarray:
    """Return the number of the place of each vertex (n,), from 0.

    Vertices that round to the same point of a grid of 10 um share a place.

    Parameters
    ----------
    vertices : (n, 3) m.
    mesh : (n,) number of the mesh of each vertex, from 0. Only vertices of the same mesh share a
        place. None: all vertices are of one mesh.
    """
    position = np.round(vertices.T * 1e5).astype(np.int64, order="C")  # a row for each axis
    position -= position.min(1)[:, None]
    span = position.max(1) + 1
    if mesh is not None:  # shift the meshes apart along x
        position[0] += mesh * span[0]
        span[0] *= mesh.max() + 1
    new = np.zeros(len(vertices), np.intp)
    # number the distinct places: a vertex begins a new place if it differs from the last in order
    if float(span[0]) * float(span[1]) * float(span[2]) < 2.0**62:  # an int64 can encode a place
        key = (position[0] * span[1] + position[1]) * span[2] + position[2]
        order = np.argsort(key)
        in_order = key.take(order)
        new[1:] = in_order[1:] != in_order[:-1]
    else:
        order = np.lexsort(position)
        in_order = position.take(order, 1)
        new[1:] = (in_order[:, 1:] != in_order[:, :-1]).any(0)
    ids = np.empty(len(vertices), np.intp)
    ids[order] = np.cumsum(new)
    return ids


def extent_of(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the greatest coordinates (3,) of vertices (n, 3), m.

    It reduces row by row of a transposed copy, because numpy's minimum along the first axis of
    (n, 3) takes ten times as long.
    """
    rows = np.ascontiguousarray(vertices.T)
    return rows.min(1), rows.max(1)


def greatest(*values: np.ndarray) -> np.ndarray:
    """Return the elementwise maximum of arrays (n,).

    `numpy.max` of a list of arrays would first copy all of them into one array.
    """
    return reduce(np.maximum, values)


def _cross(v: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Return the cross product (m, 3) of two sides of each face. It points along the outward
    normal; its length is twice the area.
    """
    a = v.take(f[:, 0], 0)  # much faster than v[...] for rows
    return cross(v.take(f[:, 1], 0) - a, v.take(f[:, 2], 0) - a)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the cross product of vectors (..., 3) with vectors (..., 3) or one vector (3,).

    The result equals that of `numpy.cross`. This function is much faster for few vectors.
    """
    ax, ay, az = a.T
    bx, by, bz = b.T
    out = np.empty(a.shape)
    x, y, z = out.T
    x[...] = ay * bz - az * by
    y[...] = az * bx - ax * bz
    z[...] = ax * by - ay * bx
    return out


def flat(piece: Piece) -> Piece:
    """Return the piece with unshared vertices, so that each face is shaded flat."""
    vertices = piece.vertices.take(piece.faces, 0).reshape(-1, 3)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    return replace(
        piece, vertices=vertices, faces=faces, normals=np.repeat(unit(face_areas(piece)), 3, 0)
    )


def compact(piece: Piece) -> Piece:
    """Return the piece without vertices that no face uses."""
    used = np.zeros(len(piece.vertices), bool)
    used[piece.faces] = True
    if used.all():
        return piece
    rows = np.flatnonzero(used)
    normals = None if piece.normals is None else piece.normals.take(rows, 0)
    return replace(
        piece,
        vertices=piece.vertices.take(rows, 0),
        faces=(np.cumsum(used) - 1).take(piece.faces),
        normals=normals,
    )


def lit(piece: Piece, kind: str, axis: tuple[float, float, float]) -> list[Piece]:
    """Return an emitting piece and its housing. Faces within 60 degrees of `axis` emit.

    Parameters
    ----------
    piece : housing whose faces are divided.
    kind : kind of lamp of `isethdr_scenes.lamps`.
    axis : (3,) unit vector along which the lamp shines.
    """
    on = unit(face_areas(piece)) @ np.asarray(axis, float) > 0.5
    front, housing = (compact(replace(piece, faces=piece.faces[k])) for k in (on, ~on))
    return [replace(front, lamp=lamp(kind, axis)), replace(housing, name=piece.name + ".housing")]
