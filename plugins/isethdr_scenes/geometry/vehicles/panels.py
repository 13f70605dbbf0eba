"""Regions cut out of the flat faces of trucks and buses, and their mirrors."""

from __future__ import annotations

import numpy as np

from ..mesh.cutting import polygon
from ..mesh.primitives import box, tube

FRONT = (1.0, 0.0, 0.0)
BACK = (-1.0, 0.0, 0.0)


def region(
    b, name, material, outline, front=None, side=None, sunk=0.0, lamp=None, trim=None, margin=0.02
):
    """Cut a region out of a flat face of the body and return it.

    Parameters
    ----------
    outline : polygon in (|y|, z) on the front (`front` true) or the rear, in (u, z) on a side, m
    side : None for front and rear, 0 for both sides, 1 left, -1 right
    sunk : how far the region is pushed inwards, m
    trim : material of a frame of width `margin` around it
    """
    shape = polygon(outline, 0.012)

    def value(part, grow=0.0):
        u, ay, z, y = b.at(part)
        half = b.shell.width / 2
        if side is not None:
            return np.maximum(
                shape(u, z) - grow, (0.8 * half - ay) if side == 0 else 0.8 * half - side * y
            )
        return np.maximum(shape(ay, z) - grow, u - 0.55 if front else b.shell.length - 0.45 - u)

    if trim:
        frame = b.take(name + ".trim", trim, value(b.paint, margin), sunk)
        return b.carve(frame, name, material, value(frame), lamp)[0]
    return b.take(name, material, value(b.paint), sunk, lamp=lamp)


def mirrors(model, x, half, z, size=(0.10, 0.22, 0.42)):
    """Add a mirror on an arm on either side."""
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
