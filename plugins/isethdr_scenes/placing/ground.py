"""Poses of things on the ground, from the heights under their corners."""

from __future__ import annotations

import numpy as np

from ..roads.network import Network
from .boxes import carrier, solids
from .site import Foot

WHEELS = (0.62, 0.70)  # wheelbase / length and track / width of a vehicle
# signs of x and y of the corners: front left, front right, rear left, rear right
SIGNS = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)], float)


def contact_points(foot: Foot) -> np.ndarray:
    """Return the four plan points (4, 2), m, that set the height of a thing.

    They are under the wheels of a vehicle. For all other things, panels included, they are the
    corners of the box that stands on the ground.
    """
    below = solids(carrier(foot.thing))[0]
    half = np.array([below.length_m, below.width_m]) * foot.scale / 2
    if foot.lean == "surface":
        half = half * WHEELS
    along = SIGNS * half + [below.x_m * foot.scale, below.y_m * foot.scale]
    cos = np.cos(foot.heading_rad)
    sin = np.sin(foot.heading_rad)
    return np.stack(
        [
            foot.x_m + cos * along[:, 0] - sin * along[:, 1],
            foot.y_m + sin * along[:, 0] + cos * along[:, 1],
        ],
        1,
    )


def heights(network: Network, feet: list[Foot]) -> np.ndarray:
    """Return the heights (n, 4), m, of the ground or bridge at the contact points of each thing."""
    points = np.array([contact_points(foot) for foot in feet]).reshape(-1, 4, 2)
    out = np.empty(points.shape[:2])
    ground = np.array([not foot.level for foot in feet], bool)
    if ground.any():
        out[ground] = network.height(points[ground][..., 0], points[ground][..., 1])
    for k in np.flatnonzero(~ground):
        road = network.road(feet[k].road)
        beside = road.line.beside(points[k])
        out[k] = road.height(beside.s_m, beside.t_m)
    return out


def poses(network: Network, feet: list[Foot]) -> list[np.ndarray]:
    """Return the (4, 4) pose of each thing, at the mean of the heights under it.

    The `lean` of the thing states whether it is upright, or tilted with the surface or along its
    panel.
    """
    if not feet:
        return []
    return [_pose(foot, z) for foot, z in zip(feet, heights(network, feet), strict=True)]


def _pose(foot: Foot, z: np.ndarray) -> np.ndarray:
    below = solids(carrier(foot.thing))[0]
    length = below.length_m * foot.scale
    width = below.width_m * foot.scale
    ahead = aside = 0.0
    if foot.lean == "surface":
        ahead = (z[0] + z[1] - z[2] - z[3]) / 2 / (WHEELS[0] * length)
        aside = (z[0] + z[2] - z[1] - z[3]) / 2 / (WHEELS[1] * width)
    elif foot.lean == "line":
        aside = (z[0] + z[2] - z[1] - z[3]) / 2 / width
    cos = np.cos(foot.heading_rad)
    sin = np.sin(foot.heading_rad)
    forward = np.array([cos, sin, ahead])
    left = np.array([-sin, cos, aside])
    up = np.cross(forward, left)
    up = up / np.linalg.norm(up)
    forward = forward / np.linalg.norm(forward)
    out = np.eye(4)
    out[:3, 0], out[:3, 1], out[:3, 2] = forward, np.cross(up, forward), up
    out[:3, 3] = foot.x_m, foot.y_m, z.mean()
    return out
