"""Exact areas: the fraction of each square tile that a disc or a half plane covers."""

from __future__ import annotations

import numpy as np


def disc(
    x: np.ndarray, y: np.ndarray, pitch: float, centre_x: float, centre_y: float, radius: float
) -> np.ndarray:
    """Return the fraction (y, x) of each tile that a disc covers. All lengths have the same unit.

    The area of the disc between its centre and each tile corner has a closed form. The covered area
    of a tile is the second difference of these areas. It is exact to rounding for any ratio of disc
    to tile size.

    Parameters
    ----------
    x, y : (column,), (row,) middles of the tiles.
    pitch : side of a tile.
    centre_x, centre_y : middle of the disc.
    radius : radius of the disc.
    """
    edges_x = (np.append(x - pitch / 2, x[-1] + pitch / 2) - centre_x) / radius
    edges_y = (np.append(y - pitch / 2, y[-1] + pitch / 2) - centre_y) / radius
    corner = _disc_corner(edges_x[None, :], edges_y[:, None])
    area = np.diff(np.diff(corner, axis=0), axis=1) * (radius / pitch) ** 2
    return np.clip(area, 0.0, 1.0)  # rounding only: 1e-16 of the disc


def half_plane(x: np.ndarray, y: np.ndarray, pitch: float, angle_deg: float) -> np.ndarray:
    """Return the fraction (y, x) of each tile that lies right of a line through the origin.

    Parameters
    ----------
    x, y : (column,), (row,) middles of the tiles, in any unit.
    pitch : side of a tile, in the same unit.
    angle_deg : turn of the line clockwise from upright, degrees.
    """
    angle = np.radians(angle_deg)
    normal = np.cos(angle), np.sin(angle)
    # signed distance of tile centres in tiles; a tile reaches (|a| + |b|) / 2 to either side of it
    distance = (normal[0] * x[None, :] + normal[1] * y[:, None]) / pitch
    a, b = sorted(abs(n) for n in normal)
    reach = distance + (a + b) / 2
    # The line is parallel to tile edges. The general form would divide by zero. The difference is
    # below 1e-7.
    if a < 1e-7:
        return np.clip(reach / b, 0.0, 1.0)
    ramp = lambda t: np.square(np.maximum(t, 0.0)) / 2
    # Far inside the half plane the result is 1. Limiting the reach to one tile avoids the
    # cancellation of four large squares.
    inside = np.minimum(reach, a + b)
    return np.clip(
        (ramp(inside) - ramp(inside - a) - ramp(inside - b) + ramp(inside - a - b)) / (a * b),
        0.0,
        1.0,
    )


def _disc_corner(right: np.ndarray, bottom: np.ndarray) -> np.ndarray:
    """Return the area of the unit disc within x = 0..right and y = 0..bottom, which is odd in both.

    The area is the integral of min(bottom, sqrt(1 - x^2)) over x.
    """
    right = np.clip(right, -1, 1)
    bottom = np.clip(bottom, -1, 1)
    size = np.abs(right)
    level = np.abs(bottom)
    knee = np.sqrt(1 - level**2)
    area = np.where(size <= knee, level * size, level * knee + _half(size) - _half(knee))
    return np.sign(right) * np.sign(bottom) * area


def _half(t: np.ndarray) -> np.ndarray:
    """Return the integral of sqrt(1 - x^2) from 0 to t."""
    return (t * np.sqrt(1 - t**2) + np.arcsin(t)) / 2
