"""Shapes of a pupil: discs, irises of blades, and rectangles."""

from __future__ import annotations

import numpy as np

from .convex import Convex


def disc(x: float, y: float, radius: float) -> Convex:
    """Return a disc.

    Parameters
    ----------
    x, y : centre, mm.
    radius : radius, mm.
    """
    return Convex(discs=((x, y, radius),), low=y - radius, high=y + radius)


def blades(radius: float, count: int, rotation_deg: float = 0.0, rounding: float = 0.0) -> Convex:
    """Return an iris whose corners lie on a circle.

    The edge of each blade is an arc between two corners, with the curvature `rounding` / `radius`.

    Parameters
    ----------
    radius : radius of the circle through the corners, mm.
    count : number of blades; fewer than three give the full circle.
    rotation_deg : angle by which the iris is turned, from x towards y, degrees.
    rounding : 0 for straight edges, 1 for the full circle, or a value between them.
    """
    if not 0.0 <= rounding <= 1.0:
        raise ValueError(f"rounding {rounding!r}; expected 0 (straight blades) to 1 (a circle)")
    if count < 3:
        return disc(0.0, 0.0, radius)
    angle = np.radians(rotation_deg) + 2 * np.pi * (np.arange(count) + 0.5) / count
    near = radius * np.cos(np.pi / count)
    half = radius * np.sin(np.pi / count)
    if rounding < 1e-6:
        planes = tuple((np.cos(a), np.sin(a), near) for a in angle)
        corners = radius * np.sin(angle + np.pi / count)
        return Convex(planes=planes, low=float(corners.min()), high=float(corners.max()))
    arc = radius / rounding
    centre = near - np.sqrt(arc**2 - half**2)
    discs = tuple((centre * np.cos(a), centre * np.sin(a), arc) for a in angle)
    return Convex(discs=discs, low=-radius, high=radius)


def strip(x: float, y: float, length: float, width: float, angle_rad: float) -> Convex:
    """Return a rectangle centred on (x, y), its length along `angle_rad`.

    Parameters
    ----------
    x, y : centre, mm.
    length, width : sides of the rectangle, mm.
    angle_rad : direction of the length, from x towards y, radians.
    """
    angle = angle_rad + np.pi / 2 * np.arange(4)
    reach = np.array([length, width, length, width]) / 2
    planes = tuple(
        (np.cos(a), np.sin(a), r + np.cos(a) * x + np.sin(a) * y) for a, r in zip(angle, reach)
    )
    tall = (length * abs(np.sin(angle_rad)) + width * abs(np.cos(angle_rad))) / 2
    return Convex(planes=planes, low=y - tall, high=y + tall)
