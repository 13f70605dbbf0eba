"""Grilles of passenger cars: bars, a mesh, two kidneys, a shield, or a closed front."""

from __future__ import annotations

import numpy as np

from ..mesh.cutting import Within, polygon
from ..mesh.primitives import tube
from .body import Body
from .car_shapes import Car

FRAME_M = 0.014  # width of the frame around a grille
AHEAD_M = 0.5  # length of the front, from the front end; nothing behind it is cut


def grille(b: Body, c: Car, z0: float, z1: float) -> None:
    """Cut the grille between the heights z0 and z1, and add its bars.

    Parameters
    ----------
    b : body of the car, which is cut.
    c : measures, styles and paint.
    z0 : lower edge, m above the road.
    z1 : upper edge, m above the road.
    """
    style = c.front.grille
    wide, high = c.grille
    if style == "closed":
        strip = polygon([(0, z1 - 0.045), (wide, z1 - 0.045), (wide, z1 - 0.02), (0, z1 - 0.02)])
        u, ay, z, _ = b.at()
        within = Within(b.paint.faces, u - AHEAD_M)
        b.take("grille", "gloss_black", np.maximum(strip(ay, z, within), within.beside))
        return
    outline = polygon(_outline(style, wide, z0, z1), 0.012)
    u, ay, z, _ = b.at()
    within = Within(b.paint.faces, u - AHEAD_M, FRAME_M)
    v = np.maximum(outline(ay, z, within), within.beside)
    frame = "chrome" if style != "shield" else "gloss_black"
    ring = b.take("grille.frame", frame, v - FRAME_M)
    u, ay, z, _ = b.at(ring)
    b.carve(ring, "grille", "gap", outline(ay, z))
    if b.shell.coarse:  # cells of a coarse car are larger than a bar
        return
    bar = lambda path, size: b.parts.append(tube(path, size, "grille.bar", "chrome", 6))
    if style == "bars":
        for k in range(4):
            zk = z0 + 0.005 + k * 0.034 * high / 0.13
            bar(
                [
                    (c.length / 2 + 0.012 - 0.10 * y * y, y, zk)
                    for y in np.linspace(-(wide - 0.03), wide - 0.03, 9)
                ],
                0.006,
            )
    elif style in ("mesh", "kidney"):
        inner = 0.05 if style == "kidney" else 0.0
        reach = 0.62 * wide if style == "kidney" else wide - 0.05
        low = z0 - (0.05 if style == "kidney" else 0.01)
        for y in np.arange(inner + 0.02, reach, 0.045):
            for s in (1, -1):
                x = c.length / 2 + 0.010 - 0.10 * y * y
                bar([(x, s * y, low), (x, s * y, z1 - 0.03)], 0.004)


def _outline(style: str, wide: float, z0: float, z1: float) -> list[tuple[float, float]]:
    """Return corners (|y|, z), m, of one half of a grille."""
    if style == "kidney":
        return [(0.04, z0 - 0.07), (0.58 * wide, z0 - 0.06), (0.66 * wide, z1), (0.05, z1)]
    if style == "shield":
        return [
            (0, z0 - 0.10),
            (0.55 * wide, z0 - 0.10),
            (0.85 * wide, z0 + 0.02),
            (0.75 * wide, z1),
            (0, z1),
        ]
    return [(0, z0 - 0.02), (wide - 0.07, z0 - 0.02), (wide, z1 - 0.02), (0, z1 - 0.02)]
