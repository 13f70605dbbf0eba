"""Projections: relation between the coordinates (x, y) of a field and directions.

- `tangent`: x and y are tangents of the field angle, as in a pinhole camera: (x, y) = tan(theta)
  (cos phi, sin phi).
- `equidistant`: x and y are proportional to the field angle: (x, y) = theta (cos phi, sin phi),
  theta in radians up to pi.
"""

from __future__ import annotations

import numpy as np

PROJECTIONS = ("tangent", "equidistant")


def angle_rad(
    x: float | np.ndarray, y: float | np.ndarray, projection: str = "tangent"
) -> float | np.ndarray:
    """Return the field angle at field coordinates (broadcast), radians.

    Parameters
    ----------
    x, y : field coordinates: tangents, or radians for an equidistant projection; any shapes that
        broadcast.
    projection : `tangent` or `equidistant`.
    """
    radius = np.hypot(x, y)
    return radius if _equidistant(projection) else np.arctan(radius)


def direction(
    x: float | np.ndarray, y: float | np.ndarray, projection: str = "tangent"
) -> np.ndarray:
    """Return unit vectors (3, ...) of field coordinates (broadcast); their components point right,
    down and forward.

    Parameters
    ----------
    x, y : field coordinates: tangents, or radians for an equidistant projection; x right, y down;
        any shapes that broadcast.
    projection : `tangent` or `equidistant`.
    """
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    if _equidistant(projection):
        theta = np.hypot(x, y)
        across = np.sinc(theta / np.pi)  # sin(theta) / theta
        return np.stack([across * x, across * y, np.cos(theta)])
    length = np.sqrt(1 + x**2 + y**2)
    return np.stack([x / length, y / length, 1 / length])


def solid_angle_per_area(
    x: float | np.ndarray, y: float | np.ndarray, projection: str = "tangent"
) -> float | np.ndarray:
    """Return d(solid angle) / (dx dy), sr: cos^3 theta for tangents, sin(theta) / theta for
    angles.

    Parameters
    ----------
    x, y : field coordinates: tangents, or radians for an equidistant projection; any shapes that
        broadcast.
    projection : `tangent` or `equidistant`.
    """
    if _equidistant(projection):
        return np.sinc(np.hypot(x, y) / np.pi)
    return (1 + np.square(x) + np.square(y)) ** -1.5


def cos4(
    x: float | np.ndarray, y: float | np.ndarray, projection: str = "tangent"
) -> float | np.ndarray:
    """Return the irradiance of a uniform scene through a flat entrance pupil, over that on the
    axis, for a lens that images these coordinates without distortion.

    It is the cosine of the pupil times the solid angle of a tile: cos^4 theta for tangents,
    cos(theta) sin(theta) / theta for angles. It is negative beyond 90 degrees, where no light
    enters a flat pupil.

    Parameters
    ----------
    x, y : field coordinates: tangents, or radians for an equidistant projection; any shapes that
        broadcast.
    projection : `tangent` or `equidistant`.
    """
    if _equidistant(projection):
        return np.cos(np.hypot(x, y)) * solid_angle_per_area(x, y, projection)
    return 1 / np.square(1 + np.square(x) + np.square(y))


def depth_m(
    distance_m: float | np.ndarray,
    x: float | np.ndarray,
    y: float | np.ndarray,
    projection: str = "tangent",
) -> np.ndarray:
    """Return depth along the axis, m; it is negative behind the camera.

    Parameters
    ----------
    distance_m : distance along the ray, m; infinite for the sky.
    x, y : field coordinates of the rays: tangents, or radians for an equidistant projection; any
        shapes that broadcast.
    projection : `tangent` or `equidistant`.
    """
    cosine = np.cos(angle_rad(x, y, projection))
    distance_m, cosine = np.broadcast_arrays(np.asarray(distance_m, float), cosine)
    at_infinity = np.isinf(distance_m)
    return np.where(at_infinity, distance_m, np.where(at_infinity, 0.0, distance_m) * cosine)


def _equidistant(projection: str) -> bool:
    if projection not in PROJECTIONS:
        raise ValueError(
            f"projection {projection!r} is unknown; expected one of {', '.join(PROJECTIONS)}"
        )
    return projection == "equidistant"
