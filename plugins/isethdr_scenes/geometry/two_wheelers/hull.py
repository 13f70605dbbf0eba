"""Hulls: smooth closed bodies through sections, for tanks, seats and fairings."""

from __future__ import annotations

import numpy as np

from ..mesh.cutting import curve
from ..mesh.piece import Piece
from ..mesh.primitives import grid

Station = tuple[float, float, float, float]  # x, middle z, half width, half height, m


def hull(
    stations: list[Station],
    name: str,
    material: str,
    corner: float = 2.4,
    soft_m: float = 0.02,
) -> Piece:
    """Return a smooth closed body through sections.

    Parameters
    ----------
    stations : sections of the body, from front to rear: x, height of the middle, half width and
        half height, m.
    name : name of the piece.
    material : name of the material.
    corner : exponent of the section; 2 is an ellipse, and higher values are boxier.
    soft_m : rounding of the profiles along x, m.
    """
    table = np.asarray(stations, float)
    along = -table[:, 0]
    u = np.linspace(along[0], along[-1], 30)
    z, wide, high = (curve(np.stack([along, table[:, k]], 1), soft_m)(u) for k in (1, 2, 3))
    u = np.concatenate([u[:1], u, u[-1:]])
    z, wide, high = (np.concatenate([v[:1], v, v[-1:]]) for v in (z, wide, high))
    wide[[0, -1]] = 1e-4
    high[[0, -1]] = 1e-4
    angle = np.linspace(0, 2 * np.pi, 28, endpoint=False)
    y_of = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** (2 / corner)
    z_of = np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** (2 / corner)
    points = np.stack(
        [
            np.repeat(-u[:, None], len(angle), 1),
            wide[:, None] * y_of,
            z[:, None] + high[:, None] * z_of,
        ],
        -1,
    )
    return grid(points, name, material, close_v=True)
