"""Parts of street furniture and buildings: boxes or quads as one piece, faces that emit light."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...geometry.mesh.piece import Assembly, Piece, face_areas, flat
from ...geometry.mesh.primitives import box
from ...lamps import lamp
from ..ranges import drawn, generator, read

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

FILE = "furniture.yaml"


def family_data(family: str) -> dict:
    """Return the entry of a family in the data file."""
    return read(FILE)["families"][family]


def families_of(group: str) -> dict[str, float]:
    """Return the families of a group with their shares."""
    families = read(FILE)["families"]
    return {name: entry["share"] for name, entry in families.items() if entry["group"] == group}


def numbers(family: str, variant: int) -> tuple[dict, np.random.Generator]:
    """Return the numbers of one member of a family, and the generator for more random numbers."""
    rng = generator(family, variant)
    return drawn(family_data(family), rng), rng


def boxes(centres: ArrayLike, sizes: ArrayLike, name: str, material: str) -> Piece:
    """Return boxes as one piece, shaded flat.

    Parameters
    ----------
    centres : (n, 3) m.
    sizes : (n, 3) or (3,) full sizes along x, y and z, m.
    name : name of the piece.
    material : name of its material.
    """
    centres = np.atleast_2d(np.asarray(centres, float))
    sizes = np.broadcast_to(np.asarray(sizes, float), centres.shape)
    one = box((0, 0, 0), (1.0, 1.0, 1.0), name, material)
    count = len(one.vertices)
    vertices = one.vertices[None] * sizes[:, None] + centres[:, None]
    faces = one.faces[None] + count * np.arange(len(centres))[:, None, None]
    normals = np.tile(one.normals, (len(centres), 1))
    return Piece(name, vertices.reshape(-1, 3), faces.reshape(-1, 3), material, normals)


def quads(corners: ArrayLike, name: str, material: str) -> Piece:
    """Return quads as one piece, shaded flat.

    Parameters
    ----------
    corners : (n, 4, 3) m, counter-clockwise as seen from outside.
    name : name of the piece.
    material : name of its material.
    """
    corners = np.asarray(corners, float).reshape(-1, 4, 3)
    first = 4 * np.arange(len(corners))[:, None]
    faces = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]])
    return flat(Piece(name, corners.reshape(-1, 3), faces, material))


def shining(piece: Piece, kind: str, axis: ArrayLike, candela: float | None = None) -> Piece:
    """Return the piece as a lamp.

    Parameters
    ----------
    piece : faces that emit.
    kind : kind of lamp, a key of `lamps.KINDS`.
    axis : (3,) direction of the axis of its light, of any length.
    candela : luminous intensity along the axis, cd; None: the intensity of the kind, times the area
        of the faces as seen along the axis, m2.
    """
    made = lamp(kind, axis)
    if candela is None:
        seen = face_areas(piece) @ np.asarray(made.axis)
        candela = made.intensity_cd * float(np.maximum(seen, 0).sum())
    return replace(piece, lamp=replace(made, intensity_cd=float(candela)))


def upright(assembly: Assembly, shift_x: float) -> Assembly:
    """Return the assembly shifted along x by `shift_x`, m, which centres its extent."""
    matrix = np.eye(4)
    matrix[0, 3] = shift_x
    return assembly.moved(matrix)
