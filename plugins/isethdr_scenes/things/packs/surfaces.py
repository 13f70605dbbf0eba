"""The material of each face: that of the manifest, or else the colour in the file."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...coloured import name_of
from .manifest import Colour
from .mesh_file import FilePart

OPAQUE = 200  # least opacity of 255; a surface with less opacity is glass


def material_names(
    part: FilePart, materials: Mapping[str, str | Colour]
) -> tuple[np.ndarray, list[str]] | None:
    """Return the number (m,) of the material of each face, and the names of the materials.

    The result is None if neither the manifest nor the file states a material. In the manifest the
    key of a material is a name of the part, the colour `#rrggbb` of a face, or `default` for all
    other faces.
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
