"""Roofs of buildings: gable, hip and flat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.mesh.piece import Piece, flat
from .parts import boxes, quads

PARAPET_M = 0.40  # height of a flat roof above the walls
CORNICE_M = 0.25  # overhang of a flat roof beyond the walls
FASCIA_M = 0.16  # height of the boards along the eaves


@dataclass(frozen=True)
class Roof:
    """A roof over walls of depth (x), width (y) and height, m; the ridge runs along y."""

    kind: str  # gable, hip or flat
    depth_m: float
    width_m: float
    walls_m: float
    slope: float = 0.8  # rise over run
    eaves_m: float = 0.4

    @property
    def reach_m(self) -> float:
        """Return the overhang beyond the walls on every side, m."""
        return CORNICE_M if self.kind == "flat" else self.eaves_m

    @property
    def top_m(self) -> float:
        """Return the height of the ridge or of the parapet above the ground, m."""
        if self.kind == "flat":
            return self.walls_m + PARAPET_M
        return self.walls_m + self.slope * self.depth_m / 2


def roof_pieces(roof: Roof, material: str, wall: str) -> list[Piece]:
    """Return the pieces of a roof.

    Parameters
    ----------
    roof : its kind and measures.
    material : name of the material of its slopes.
    wall : name of the material of the walls, for gables.
    """
    depth = roof.depth_m
    width = roof.width_m
    walls = roof.walls_m
    if roof.kind == "flat":
        cornice = (depth + 2 * CORNICE_M, width + 2 * CORNICE_M, PARAPET_M)
        return [boxes((0, 0, walls + PARAPET_M / 2), cornice, "parapet", "concrete")]
    reach = roof.eaves_m
    low = walls - roof.slope * roof.eaves_m
    x = depth / 2 + reach
    y = width / 2 + reach
    ridge_y = y if roof.kind == "gable" else max(width / 2 - depth / 2, 0.2)
    top = roof.top_m
    front = [(x, -y, low), (x, y, low), (0, ridge_y, top), (0, -ridge_y, top)]
    back = [(-x, y, low), (-x, -y, low), (0, -ridge_y, top), (0, ridge_y, top)]
    pieces = [quads([front, back], "roof", material)]
    ends = boxes(
        [(side * (x - 0.02), 0, low + FASCIA_M / 2) for side in (1, -1)],
        (0.04, 2 * y, FASCIA_M),
        "fascia",
        "wood",
    )
    pieces.append(ends)
    for side in (1, -1):
        if roof.kind == "gable":
            triangle = [
                (-depth / 2, side * width / 2, walls),
                (depth / 2, side * width / 2, walls),
                (0, side * width / 2, top),
            ]
            pieces.append(_triangle(triangle, side, "gable", wall))
        else:
            hip = [(x, side * y, low), (-x, side * y, low), (0, side * ridge_y, top)]
            pieces.append(_triangle(hip, side, "roof", material))
    return pieces


def _triangle(
    corners: Sequence[tuple[float, float, float]], side: int, name: str, material: str
) -> Piece:
    """Return a triangle that faces +y (`side` 1) or -y (-1)."""
    points = np.asarray(corners, float)
    normal = np.cross(points[1] - points[0], points[2] - points[0])
    order = [0, 1, 2] if normal[1] * side > 0 else [0, 2, 1]
    return flat(Piece(name, points[order], np.array([[0, 1, 2]]), material))
