"""Poses: things put on the ground by the heights under their corners."""

from __future__ import annotations

import numpy as np

from ..roads.network import Network
from .boxes import carrier, solids
from .site import Foot

# of a vehicle's length and width: where its wheels stand
WHEELS = (0.62, 0.70)
SIGNS = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)], float)  # front left, front right, rear ...


def contact_points(foot: Foot) -> np.ndarray:
    """Return the four plan points (4, 2) under a thing at which its height is taken: under the
    wheels of a vehicle, under the ends of a panel, else under the corners of what stands on the
    ground.
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
    """Return the height (n, 4) of what carries each thing, under its contact points, m."""
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
    """Return the (4, 4) pose of each thing: on the mean of the heights under it, upright, tilted
    with the surface, or along its panel.
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
