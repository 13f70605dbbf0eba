"""Sampling weights of the spots: in proportion to the light that each sends to visible surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import mitsuba as mi
import numpy as np

from .spots import Spot

if TYPE_CHECKING:
    from ..world.view import View

POINTS = 2000  # of what the camera sees
# share given by intensity alone: for light that reaches the camera over several surfaces
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
    """Return (spot, point) illuminance, lx, of faces turned towards each spot with nothing in
    between; and distance, m.
    """
    illuminance_lx = np.zeros((len(spots), len(points)))
    distance = np.ones((len(spots), len(points)))
    for k, s in enumerate(spots):
        way = points - s.point
        distance[k] = np.maximum(np.linalg.norm(way, axis=1), 1e-3)
        illuminance_lx[k] = s.candela(way / distance[k][:, None]) / distance[k] ** 2
    return illuminance_lx, distance


def shares(spots: list[Spot], lux: np.ndarray) -> np.ndarray:
    """Return how often each spot is looked for; they sum to 1. `lux`: (spot, point) of
    `illuminance`.
    """
    strength = np.sqrt([s.peak_cd * np.radians(s.cutoff_deg) ** 2 for s in spots])
    total = lux.sum(0)
    part = lux[:, total > 0] / total[total > 0]
    if not part.size:
        return strength / strength.sum()
    # the variance of a point's light is least with shares as its parts
    useful = np.sqrt(np.mean(part**2, 1))
    return EVERYWHERE * strength / strength.sum() + (1 - EVERYWHERE) * useful / useful.sum()


def extent_error(spots: list[Spot], lux: np.ndarray, distance: np.ndarray) -> float:
    """Return the mean over points, weighted by light, of (radius / distance)^2: a disc against the
    point in its place.

    Parameters
    ----------
    spots : lamps as points, with their radii, m.
    lux : (spot, point) illuminance.
    distance : (spot, point) m.
    """
    radius = np.array([s.radius_m for s in spots])
    error = np.minimum((radius[:, None] / distance) ** 2, 1)
    return float((error * lux).sum() / lux.sum()) if lux.sum() > 0 else 0.0
