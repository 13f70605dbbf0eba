"""A thing of an asset pack: its mesh in metres with materials and lamps, and levels of detail."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from isethdr_core.errors import ConfigError

from ...geometry.mesh.piece import Assembly, Piece, compact, face_areas, unit
from ..detail import coarser
from ..thing import Detail, Thing
from .emitters import emission, selected
from .manifest import Axes, Direction, ThingForm
from .mesh_file import FilePart
from .surfaces import material_names

# axes of the formats: those of the glTF standard, and those of this package for other formats
FORMAT_AXES = {".glb": Axes(forward="z", up="y")}
OUR_AXES = Axes(forward="x", up="z")
CREASE_DEG = 40.0  # largest angle at which two faces meet without a sharp edge
# sizes of the cells of the coarser levels, as shares of the largest side
CELLS: dict[str, float] = {"middle": 1 / 90, "far": 1 / 45, "distant": 1 / 18}
FEW = 400  # number of triangles; a mesh with fewer is never made coarser


@dataclass(frozen=True)
class Asset:
    """A mesh of a pack. Two assets with the same name and digest are equal."""

    name: str
    digest: str  # digest of the bytes of all files of its pack
    licence: str = field(compare=False)
    file: str = field(compare=False)
    share: float = field(compare=False)  # share of the draws of its group or family
    mesh: Assembly = field(compare=False, repr=False)

    def build(self, detail: str) -> Assembly:
        """Return the mesh at a level: near, middle, far or distant."""
        return _level(self, detail)

    def triangles(self) -> tuple[int, int, int, int]:
        """Return the number of triangles at each level."""
        near, middle, far, distant = (
            sum(len(part.faces) for part in self.build(level).parts) for level in ("near", *CELLS)
        )
        return near, middle, far, distant


@dataclass(frozen=True)
class AssetThing(Thing):
    """A thing of an asset pack."""

    asset: Asset | None = None

    def built(self, detail: Detail) -> Assembly:
        """Return its mesh at a level of detail."""
        assert self.asset is not None
        return self.asset.build(detail)


@lru_cache(maxsize=64)
def _level(asset: Asset, detail: str) -> Assembly:
    count = sum(len(part.faces) for part in asset.mesh.parts)
    if detail == "near" or count < FEW or all(part.lamp for part in asset.mesh.parts):
        return asset.mesh
    low, high = _extent(asset.mesh.parts)
    made = coarser(asset.mesh, float((high - low).max()) * CELLS[detail])
    kept = [part for part in made.parts if len(part.faces)]
    return Assembly(made.name, kept) if kept else asset.mesh


def in_metres(parts: Sequence[FilePart], form: ThingForm) -> list[FilePart]:
    """Return the parts in metres, with x ahead, y to the left and z up.

    They are centred in x and y, with their lowest point at z = 0. `form` states scale and axes.
    """
    axes = form.axes or FORMAT_AXES.get(Path(form.file).suffix.lower(), OUR_AXES)
    forward, up = (_vector(axis) for axis in (axes.forward, axes.up))
    turn = form.scale * np.stack([forward, np.cross(up, forward), up])
    turned = [replace(part, vertices=part.vertices @ turn.T) for part in parts]
    low, high = _extent(turned)
    middle = (low + high) / 2
    middle[2] = low[2]
    return [replace(part, vertices=part.vertices - middle) for part in turned]


def _vector(axis: Direction) -> np.ndarray:
    out = np.zeros(3)
    out["xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    return out


def _extent(parts: Sequence[FilePart] | Sequence[Piece]) -> tuple[np.ndarray, np.ndarray]:
    used = np.concatenate([part.vertices[np.unique(part.faces)] for part in parts])
    return used.min(0), used.max(0)


def as_one(parts: Sequence[FilePart]) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices (n, 3) and the faces (m, 3) of all parts."""
    first = np.cumsum([0] + [len(part.vertices) for part in parts])
    faces = [part.faces + k for part, k in zip(parts, first)]
    return np.concatenate([part.vertices for part in parts]), np.concatenate(faces)


def size_of(parts: Sequence[FilePart]) -> tuple[float, float, float]:
    """Return length, width and height of parts in metres."""
    low, high = _extent(parts)
    length, width, height = (round(float(v), 3) for v in high - low)
    return length, width, height


def assembled(
    parts: Sequence[FilePart], form: ThingForm, name: str, folder: Path
) -> tuple[Assembly, list[str]]:
    """Return the mesh with materials and lamps, and the mistakes in them.

    Parameters
    ----------
    parts : parts of the file, in metres.
    form : entry of the manifest, with materials and lamps.
    name : name of the thing.
    folder : folder of the pack, with the files of beams.
    """
    out = Assembly(name)
    mistakes = []
    found = np.zeros(len(form.lamps), bool)
    lit: list[list[Piece]] = [[] for _ in form.lamps]
    for part in parts:
        surface = material_names(part, form.materials)
        if surface is None:
            mistakes.append(
                f"no material is stated for the part {' / '.join(part.names)}; type"
                f" materials: {{{part.names[-1]}: paint_red}} or materials: {{default: ...}}"
            )
            continue
        number, names = surface
        whole = Piece(part.names[0], part.vertices, part.faces, names[0])
        whole = creased(whole)
        areas = face_areas(whole)
        middles = whole.vertices[whole.faces].mean(1)
        left = np.ones(len(whole.faces), bool)
        for k, lamp_form in enumerate(form.lamps):
            on = left & selected(lamp_form, part.names, middles, areas)
            found[k] |= bool(on.any())
            left &= ~on
            lit[k] += _pieces(whole, on, number, names)
        out.add(*_pieces(whole, left, number, names))
    for k, (lamp_form, pieces) in enumerate(zip(form.lamps, lit, strict=True)):
        if not found[k]:
            mistakes.append(
                f"lamps[{k}] ({lamp_form.kind}): no face of {lamp_form.part or 'its box'} looks"
                f" along the axis {list(lamp_form.axis)}; {_places(parts)}"
            )
            continue
        areas = np.concatenate([face_areas(piece) for piece in pieces])
        try:
            emitted = emission(lamp_form, areas, folder)
        except ConfigError as error:
            mistakes.append(f"lamps[{k}] ({lamp_form.kind}): {error}")
            continue
        one = _joined(pieces, f"{lamp_form.kind}.{k}")
        out.add(replace(one, lamp=emitted))
    return out, mistakes


def _places(parts: Sequence[FilePart]) -> str:
    """Return text with the first parts and their boxes, which helps to find a lamp's faces."""
    told = []
    for part in parts[:8]:
        low, high = _extent([part])
        told.append(f"{' / '.join(part.names)} {low.round(2).tolist()} {high.round(2).tolist()}")
    return "the parts, with their least and greatest x, y, z: " + "; ".join(told)


def _pieces(whole: Piece, on: np.ndarray, number: np.ndarray, names: list[str]) -> list[Piece]:
    """Return the faces that `on` selects, as one piece per material.

    Parameters
    ----------
    whole : piece with all faces.
    on : (m,) which faces are taken.
    number : (m,) number of the material of each face.
    names : names of the materials.
    """
    out = []
    for k, name in enumerate(names):
        faces = whole.faces[on & (number == k)]
        if len(faces):
            out.append(compact(replace(whole, faces=faces, material=name)))
    return out


def _joined(pieces: Sequence[Piece], name: str) -> Piece:
    """Return pieces joined into one, with the material of the first piece."""
    first = np.cumsum([0] + [len(piece.vertices) for piece in pieces])
    return Piece(
        name,
        np.concatenate([piece.vertices for piece in pieces]),
        np.concatenate([piece.faces + k for piece, k in zip(pieces, first)]),
        pieces[0].material,
        np.concatenate([piece.normals for piece in pieces]),
    )


def creased(piece: Piece, angle_deg: float = CREASE_DEG) -> Piece:
    """Return the piece with one normal per corner of each face.

    The normal is the mean over the faces that meet at the corner, weighted by area. Faces at more
    than `angle_deg` to the corner's own face are left out.
    """
    areas = face_areas(piece)
    normals = unit(areas)
    places = np.round(piece.vertices * 1e5).astype(np.int64)
    _, ids = np.unique(places, axis=0, return_inverse=True)
    corner_id = ids.reshape(-1)[piece.faces].ravel()
    face = np.repeat(np.arange(len(piece.faces)), 3)
    order = np.argsort(corner_id, kind="stable")
    _, first, count = np.unique(corner_id[order], return_index=True, return_counts=True)
    # all pairs of corners at the same place
    start = np.repeat(first, count**2)
    within = np.arange(len(start)) - np.repeat(np.cumsum(count**2) - count**2, count**2)
    of = np.repeat(count, count**2)
    one = order[start + within // of]
    other = order[start + within % of]
    near = (normals[face[one]] * normals[face[other]]).sum(1) > np.cos(np.radians(angle_deg))
    total = np.stack(
        [
            np.bincount(one[near], areas[face[other[near]], axis], 3 * len(piece.faces))
            for axis in range(3)
        ],
        1,
    )
    vertices = piece.vertices[piece.faces].reshape(-1, 3)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    return replace(piece, vertices=vertices, faces=faces, normals=unit(total))
