"""Regions cut out of the flat faces of trucks and buses, and their mirrors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from ..mesh.cutting import Within, polygon
from ..mesh.piece import Piece
from ..mesh.primitives import box, tube
from .body import Body

if TYPE_CHECKING:
    from ..mesh.piece import Assembly

FRONT = (1.0, 0.0, 0.0)
BACK = (-1.0, 0.0, 0.0)


@dataclass(frozen=True)
class Region:
    """A region of a flat face of a body."""

    name: str
    material: str
    # corners, m: (|y|, z) on front and rear, (u, z) on a side
    outline: Sequence[tuple[float, float]]
    face: Literal["front", "rear", "left", "right", "sides"] = "rear"
    sunk_m: float = 0.0  # distance by which it is moved inwards
    trim: str | None = None  # material of a frame around it; None: no frame
    margin_m: float = 0.02  # width of the frame


def cut_region(b: Body, region: Region) -> Piece:
    """Cut a region out of the paint and return it."""
    shape = polygon(region.outline, 0.012)

    def value(part: Piece, grow: float = 0.0) -> np.ndarray:
        u, ay, z, y = b.at(part)
        half = b.shell.width / 2
        across = ay
        if region.face == "front":
            beside = u - 0.55
        elif region.face == "rear":
            beside = b.shell.length - 0.45 - u
        else:
            across = u
            beside = 0.8 * half - {"sides": ay, "left": y, "right": -y}[region.face]
        return np.maximum(shape(across, z, Within(part.faces, beside, grow)) - grow, beside)

    if region.trim is None:
        return b.take(region.name, region.material, value(b.paint), region.sunk_m)
    around = value(b.paint, region.margin_m)
    frame = b.take(region.name + ".trim", region.trim, around, region.sunk_m)
    return b.carve(frame, region.name, region.material, value(frame))[0]


def mirrors(
    model: Assembly,
    x: float,
    half: float,
    z: float,
    size: tuple[float, float, float] = (0.10, 0.22, 0.42),
) -> None:
    """Add a mirror on an arm on either side.

    Parameters
    ----------
    model : assembly that gets the mirrors.
    x : distance of the mirrors ahead of the origin, m.
    half : half the width of the vehicle, m.
    z : height of the middles, m.
    size : (3,) depth, width and height of the housing, m.
    """
    for s in (1, -1):
        model.add(
            box((x, s * (half + 0.20), z), size, "mirror", "plastic_black", 0.04),
            box(
                (x - size[0] / 2 - 0.002, s * (half + 0.20), z),
                (0.006, size[1] - 0.04, size[2] - 0.05),
                "mirror.glass",
                "chrome",
                0.002,
            ),
            tube(
                [
                    (x - 0.02, s * (half - 0.06), z + 0.26),
                    (x, s * (half + 0.20), z + 0.27),
                    (x, s * (half + 0.20), z - 0.26),
                    (x - 0.02, s * (half - 0.06), z - 0.25),
                ],
                0.014,
                "mirror.arm",
                "plastic_black",
            ),
        )
