"""The material of each face: as the manifest says, else the colour that the file states."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...coloured import name_of
from .manifest import Colour
from .mesh_file import FilePart

OPAQUE = 200  # of 255: what has less opacity is a pane of glass


def material_names(
    part: FilePart, materials: Mapping[str, str | Colour]
) -> tuple[np.ndarray, list[str]] | None:
    """Return (number of the material of each face, names), or None where nothing states one.

    The manifest names a material by the part's mesh or material, by the colour `#rrggbb` of a face,
    or `default` for what is left.
    """
    for name in part.names:
        if name in materials:
            return np.zeros(len(part.faces), int), [_name(materials[name])]
    if part.colours is None:
        if "default" not in materials:
            return None
        return np.zeros(len(part.faces), int), [_name(materials["default"])]
    found, number = np.unique(part.colours, axis=0, return_inverse=True)
    return number.reshape(-1), [_of_colour(colour, materials) for colour in found]


def _of_colour(colour: np.ndarray, materials: Mapping[str, str | Colour]) -> str:
    code = "#" + "".join(f"{int(v):02x}" for v in colour[:3])
    wanted = materials.get(code, materials.get(code.upper(), materials.get("default")))
    if wanted is not None:
        return _name(wanted)
    return name_of(code, "satin" if colour[3] >= OPAQUE else "glass")


def _name(wanted: str | Colour) -> str:
    return wanted if isinstance(wanted, str) else name_of(wanted.colour, wanted.finish)
