"""Visible motion: by how far each tile of a scene moves in the field during a shot.

The point that a tile shows moves with its object, as a rigid body, and is seen by the camera of a
later moment. The sky lies at infinity, so it moves only if the camera turns.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from ..data.camera_geometry import projection_of
from ..data.scene_description import Camera, SceneDescription
from ..physics.optics.projection import direction

LABELS = ("distance", "instance")  # labels that `displacement` reads


def displacement(description: SceneDescription, scene: xr.Dataset) -> np.ndarray:
    """Return the motion (y, x) of each tile until the next frame of a description, in the unit of
    the field coordinates; NaN where a point gets behind the camera.

    Parameters
    ----------
    description : scene description with `next_frame`.
    scene : radiance with the labels `distance` and `instance`.
    """
    following = description.next_frame
    assert following is not None  # callers request the next frame
    projection = projection_of(scene)
    x, y = np.meshgrid(scene.x.values, scene.y.values)
    here = _axes(description.camera)
    there = _axes(following.camera)
    way = np.moveaxis(direction(x, y, projection), 0, -1) @ here
    instance = scene["instance"].values
    # in float64: a point 200 m away moves by less than a millimetre in a millisecond
    reach = np.where(instance > 0, scene["distance"].values, 1.0).astype(float)
    moved = np.asarray(description.camera.position_m, float) + reach[..., None] * way
    for number in np.unique(instance[instance > 0]):
        tiles = instance == number
        pose = np.asarray(description.objects[number - 1].pose, float)
        step = np.asarray(following.poses[number - 1], float) @ np.linalg.inv(pose)
        moved[tiles] = moved[tiles] @ step[:3, :3].T + step[:3, 3]
    points = (moved - np.asarray(following.camera.position_m, float)) @ there.T
    points[instance == 0] = way[instance == 0] @ there.T
    seen = np.stack(_coordinates(points, projection))
    seen[:, (points[..., 2] <= 0) & (projection == "tangent")] = np.nan
    return np.hypot(seen[0] - x, seen[1] - y)


def _axes(camera: Camera) -> np.ndarray:
    """Return the camera's axes (right, down, forward) in the world, one per row; z is up."""
    forward = np.asarray(camera.target_m, float) - np.asarray(camera.position_m, float)
    forward = forward / np.linalg.norm(forward)
    # a camera that looks straight up or down has x at the top of its picture
    up = (0.0, 0.0, 1.0) if abs(forward[2]) < 1 - 1e-9 else (1.0, 0.0, 0.0)
    right = np.cross(forward, up)
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def _coordinates(points: np.ndarray, projection: str) -> tuple[np.ndarray, np.ndarray]:
    """Return field coordinates x and y of points (..., 3) in camera axes."""
    x, y, z = np.moveaxis(points, -1, 0)
    if projection == "tangent":
        depth = np.where(z > 0, z, np.nan)
        return x / depth, y / depth
    across = np.hypot(x, y)
    scale = np.arctan2(across, z) / np.where(across > 0, across, 1.0)
    return x * scale, y * scale
