"""Spots of a lens by an independent trace of skew rays.

Nothing here uses the surfaces, the rays, or the pupils of the package. Rays meet a surface by
Feder's steps to its tangent plane, in direction cosines; slopes are complex-step derivatives of the
sag. The border of the beam is found by bisection, and the beam is integrated by Gauss's rule.

Source: Feder (1951), Optical calculations with automatic computing machinery, J. Opt. Soc. Am. 41,
630, section IV.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

DIRECTIONS = 128  # number of directions around the beam
RADII = 16  # number of Gauss nodes from the middle of the beam to its border
HALVINGS = 40  # number of bisections that find the border
STEP_MM = 1e-13  # a step to a tangent plane this short ends the search of the surface


class Face(NamedTuple):
    """A surface, the medium behind it and the distance to the next one; lengths in mm."""

    curvature: float = 0.0
    distance: float = 0.0  # to the next vertex; behind the last surface, to the sensor
    index: float = 1.0  # refractive index behind the surface
    conic: float = 0.0
    terms: Mapping[int, float] = {}  # {power of r: coefficient}
    rim: float = np.inf  # radius beyond which it stops rays
    is_stop: bool = False

    def sag(self, r):
        """Return the sag, mm, at distances r from the axis, mm."""
        root = np.sqrt(1 - (1 + self.conic) * (self.curvature * r) ** 2)
        return self.curvature * r**2 / (1 + root) + sum(a * r**p for p, a in self.terms.items())


class Spot(NamedTuple):
    """Rms distance of rays from their centroid, and distance of the centroid from the axis; mm."""

    radius: float
    centroid: float


def spot(faces: Sequence[Face], angle_deg: float, widest: float) -> Spot:
    """Return the spot of collimated light on the sensor.

    Parameters
    ----------
    faces : from front to back.
    angle_deg : angle between the light and the axis; the light travels towards larger y.
    widest : half width, mm, of a square in the plane of the first vertex that holds the beam.
    """
    angle = np.radians(angle_deg)
    at = np.linspace(-widest, widest, 81)
    x, y = np.meshgrid(at, at)
    _, _, passes = _followed(faces, x, y, angle)
    middle = y[passes].mean()
    around = (np.arange(DIRECTIONS) + 0.5) * 2 * np.pi / DIRECTIONS
    inside = np.zeros(DIRECTIONS)
    outside = np.full(DIRECTIONS, 2 * widest)
    for _ in range(HALVINGS):
        half = (inside + outside) / 2
        _, _, passes = _followed(
            faces, half * np.cos(around), middle + half * np.sin(around), angle
        )
        inside = np.where(passes, half, inside)
        outside = np.where(passes, outside, half)
    place, weight = np.polynomial.legendre.leggauss(RADII)
    r = (place[:, None] + 1) / 2 * inside
    x, y, _ = _followed(faces, r * np.cos(around), middle + r * np.sin(around), angle)
    area = weight[:, None] * r * inside
    centroid = (area * y).sum() / area.sum()
    squares = x**2 + (y - centroid) ** 2
    return Spot(float(np.sqrt((area * squares).sum() / area.sum())), float(centroid))


@np.errstate(invalid="ignore", divide="ignore")
def _followed(faces, x, y, angle):
    """Trace rays that cross the first vertex plane at (x, y), mm, to the sensor.

    Return x and y on the sensor, mm, and a mask of the rays that pass all rims.
    """
    cosines = [0.0 * x, np.full(x.shape, np.sin(angle)), np.full(x.shape, np.cos(angle))]
    z = 0.0 * x
    passes = np.full(x.shape, True)
    before = 1.0
    for face in faces:
        for _ in range(50):
            tilt = _slope_over_r(face, np.hypot(x, y))
            along = cosines[2] - tilt * (x * cosines[0] + y * cosines[1])
            step = (face.sag(np.hypot(x, y)) - z) / along
            x, y, z = (p + step * c for p, c in zip((x, y, z), cosines))
            if not np.any(np.abs(step) > STEP_MM):
                break
        passes &= np.hypot(x, y) < face.rim
        # length of the normal (-tilt x, -tilt y, 1)
        tilt = _slope_over_r(face, np.hypot(x, y))
        length = np.sqrt(1 + tilt**2 * (x**2 + y**2))
        into = (cosines[2] - tilt * (x * cosines[0] + y * cosines[1])) / length
        ratio = before / face.index
        turn = (np.sqrt(1 - ratio**2 * (1 - into**2)) - ratio * into) / length
        normal = (-tilt * x, -tilt * y, 1.0)
        cosines = [ratio * c + turn * n for c, n in zip(cosines, normal)]
        before = face.index
        z = z - face.distance
    x, y = (p - z * c / cosines[2] for p, c in zip((x, y), cosines))
    return x, y, passes & np.isfinite(x)


def _slope_over_r(face: Face, r):
    """Return (d sag / dr) / r; 0 on the axis, where the normal is parallel to the axis."""
    tiny = 1e-30
    return np.where(r > 0, np.imag(face.sag(r + 1j * tiny)) / tiny / r, 0.0)
