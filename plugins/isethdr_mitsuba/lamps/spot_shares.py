"""Sampling weights of the spots: in proportion to the light that each sends to visible surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import mitsuba as mi
import numpy as np

from .spots import Spot

if TYPE_CHECKING:
    from ..world.view import View

POINTS = 2000  # approximate number of tested points on surfaces that the camera sees
# Part of the weights that depends on intensity alone. It serves light that reaches the camera over
# several surfaces.
EVERYWHERE = 0.2


def seen_points(scene: Any, view: View) -> np.ndarray:
    """Return (n, 3) points, m, spread evenly over what the camera sees."""
    rows, columns = view.shape
    step = max(1, int(np.sqrt(rows * columns / POINTS)))
    x, y = np.meshgrid(view.x[step // 2 :: step], view.y[step // 2 :: step])
    points = []
    for d in view.to_world(view.rays(x.ravel(), y.ravel())):
        hit = scene.ray_intersect_preliminary(mi.Ray3f(view.origin_m, d))
        if hit.is_valid():
            points.append(view.origin_m + hit.t * d)
    return np.reshape(points, (-1, 3))


def illuminance(spots: list[Spot], points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the illuminance (spot, point), lx, of faces that face each spot, without occlusion;
    and the distance (spot, point), m.
    """
    illuminance_lx = np.zeros((len(spots), len(points)))
    distance = np.ones((len(spots), len(points)))
    for k, s in enumerate(spots):
        way = points - s.point
        distance[k] = np.maximum(np.linalg.norm(way, axis=1), 1e-3)
        illuminance_lx[k] = s.candela(way / distance[k][:, None]) / distance[k] ** 2
    return illuminance_lx, distance


def shares(spots: list[Spot], lux: np.ndarray) -> np.ndarray:
    """Return the sampling weight (spot,) of each spot; the sum is 1. `lux` is the illuminance
    (spot, point) from `illuminance`.
    """
    strength = np.sqrt([s.peak_cd * np.radians(s.cutoff_deg) ** 2 for s in spots])
    total = lux.sum(0)
    part = lux[:, total > 0] / total[total > 0]
    if not part.size:
        return strength / strength.sum()
    # the variance at a point is least if the weights are in proportion to the lamps' light there
    useful = np.sqrt(np.mean(part**2, 1))
    return EVERYWHERE * strength / strength.sum() + (1 - EVERYWHERE) * useful / useful.sum()


def extent_error(spots: list[Spot], lux: np.ndarray, distance: np.ndarray) -> float:
    """Return the mean error, relative, of points in place of extended lamps: the mean over points
    of (radius / distance)^2, weighted by illuminance.

    Parameters
    ----------
    spots : lamps as points, with their radii, m.
    lux : (spot, point) illuminance.
    distance : (spot, point) m.
    """
    radius = np.array([s.radius_m for s in spots])
    error = np.minimum((radius[:, None] / distance) ** 2, 1)
    return float((error * lux).sum() / lux.sum()) if lux.sum() > 0 else 0.0
