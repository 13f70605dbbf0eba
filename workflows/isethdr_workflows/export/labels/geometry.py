"""The geometry of a stored scene: the box of each object in metres, and its box in a picture.

A run does not store meshes. They are built again from the recorded fields of the scene. The result
is refused unless all objects are at their recorded positions.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_catalog.dataset import is_thing

from isethdr_core.data import camera_geometry
from isethdr_core.data.scene_description import Camera, Model, Placed, SceneDescription
from isethdr_core.errors import CatalogError, IsetHdrError
from isethdr_core.plugins.registry import build

from ..job import Item

if TYPE_CHECKING:
    import xarray as xr

SAME_M = 1e-6  # largest difference of equal positions, which are stored as float64
WIDER = 1.1  # limit of field coordinates, over the largest ones in the frame
NEAREST_M = 1e-3  # parts of an object nearer to the camera's plane are left out of its box


@dataclass(frozen=True, eq=False)
class Box3d:
    """A box along the axes of its object.

    Parameters
    ----------
    center_m : (3,) centre in world axes (x forward, y left, z up).
    size_m : (3,) length, width, height along the object's own x, y, z.
    rotation : (3, 3) proper rotation from the object's axes to world axes.
    """

    center_m: np.ndarray
    size_m: np.ndarray
    rotation: np.ndarray

    def corners_m(self) -> np.ndarray:
        """Return the corners (8, 3) in world axes, m."""
        signs = np.stack(np.meshgrid(*[[-0.5, 0.5]] * 3, indexing="ij"), -1).reshape(8, 3)
        return self.center_m + (signs * self.size_m) @ self.rotation.T


def described(item: Item) -> SceneDescription:
    """Build the scene of a run again and return its description.

    Raises
    ------
    CatalogError : the scene has no geometry, cannot be built, or has other objects than the run.
    """
    if not item.attributes.get("scene_ids"):
        raise _unknown(item, "its scene states its own radiance and has no geometry")
    found = _built(json.dumps(item.attributes["config"]["scene"], sort_keys=True))
    if isinstance(found, str):
        raise _unknown(item, found)
    for row in item.attributes.get("objects") or []:
        if _differs(row, found.objects):
            raise _unknown(
                item,
                f"{row['name']!r} has another position in the scene of this version; run it again,"
                " or install the isethdr that stored it",
            )
    return found


def _unknown(item: Item, why: str) -> CatalogError:
    return CatalogError(f"run {item.key} has no boxes in metres: {why}")


def _differs(row: dict[str, Any], objects: tuple[Placed, ...]) -> bool:
    """Return whether an object of the table differs from the object of this number in the scene."""
    number = int(row["instance"])
    at = row.get("position_m")
    if at is None or number > len(objects):
        return True
    placed = objects[number - 1]
    named = (row["name"], row["category"]) == (placed.name, placed.category)
    return not (named and np.allclose(at, placed.pose[:3, 3], rtol=0, atol=SAME_M))


@lru_cache(maxsize=2)
def _built(settings: str) -> SceneDescription | str:
    """Return the description of a scene from its fields as JSON, or a text that says why there is
    none.
    """
    fields = json.loads(settings)
    name = fields.pop("name")
    try:
        made = build("scene", name, **fields)()
    except IsetHdrError as error:
        return f"its scene cannot be made again ({error})"
    return made if isinstance(made, SceneDescription) else f"the scene {name!r} has no geometry"


def box_of(model: Model, pose: np.ndarray) -> Box3d:
    """Return the smallest box along the axes of a model that holds all of its parts.

    Parameters
    ----------
    model : model of the object.
    pose : (4, 4) from the model to the world: rotation, one scale for each axis, and position.
    """
    corners = np.concatenate([np.asarray(part.vertices, float) for part in model.parts])
    low = corners.min(0)
    high = corners.max(0)
    scale = np.linalg.norm(pose[:3, :3], axis=0)
    rotation = pose[:3, :3] / scale
    if np.linalg.det(rotation) < 0:  # a mirrored model; a box equals its mirror image
        rotation = rotation * [1, -1, 1]
    center = pose[:3, :3] @ (low + high) / 2 + pose[:3, 3]
    return Box3d(center, (high - low) * scale, rotation)


def camera_axes(camera: Camera) -> np.ndarray:
    """Return the unit vectors right, down, forward of a camera (3, 3), as rows in world axes.

    World z is up in the picture. If the camera looks along world z, world x is up instead.
    """
    forward = np.subtract(camera.target_m, camera.position_m).astype(float)
    forward /= np.linalg.norm(forward)
    up = [0.0, 0, 1] if abs(forward[2]) < 1 - 1e-9 else [1.0, 0, 0]
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


@lru_cache(maxsize=1024)  # two formats use them
def full_boxes(item: Item) -> dict[int, list[float]]:
    """Return {number: box [left, top, width, height], px} of each visible object, as if nothing hid
    it. The boxes are cut at the frame. The result is empty if the geometry cannot be built again.
    """
    try:
        scene = described(item)
    except CatalogError:
        return {}
    picture = item.picture()
    rows = item.truth().attrs.get("objects") or []
    found = {}
    for row in filter(lambda row: is_thing(row["category"]), rows):
        placed = scene.objects[int(row["instance"]) - 1]
        points = points_in_front(scene.models[placed.model], placed.pose, scene.camera)
        box = box_in_picture(points, picture) if len(points) else None
        if box is not None:
            found[int(row["instance"])] = box
    return found


def points_in_front(model: Model, pose: np.ndarray, camera: Camera) -> np.ndarray:
    """Return points (n, 3) in camera axes (right, down, forward), m, that have the same box in the
    picture as the object. They are corners of triangles, and points at which edges cross a plane
    just in front of the camera.

    Parameters
    ----------
    model : of the object.
    pose : (4, 4) from the model to the world.
    camera : camera with position, axis and projection.
    """
    axes = camera_axes(camera)
    points = []
    for part in model.parts:
        world = np.asarray(part.vertices, float) @ pose[:3, :3].T + pose[:3, 3]
        corners = (world - camera.position_m) @ axes.T
        before = corners[:, 2] > NEAREST_M
        if camera.projection != "tangent" or before.all():
            points.append(corners)
            continue
        faces = np.asarray(part.faces, int)
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        a, b = corners[edges[before[edges[:, 0]] != before[edges[:, 1]]]].swapaxes(0, 1)
        share = ((NEAREST_M - a[:, 2]) / (b[:, 2] - a[:, 2]))[:, None]
        points += [corners[before], a + share * (b - a)]
    return np.concatenate(points)


def box_in_picture(points: np.ndarray, picture: xr.Dataset) -> list[float] | None:
    """Return the box [left, top, width, height] of the images of points, in pixels from the top
    left corner, cut at the frame; None if nothing is within the frame.

    Parameters
    ----------
    points : (n, 3) points in camera axes, m.
    picture : picture with focal length, pixel pitch, grid of pixels and projection.
    """
    lens = camera_geometry.map_of(picture)
    projection = camera_geometry.projection_of(picture)
    focal_m = 1e-3 * float(picture.attrs["focal_length_mm"])
    pitch = 1e-6 * float(picture.attrs["pitch_um"]) / focal_m
    first = np.array([picture["x"].values[0], picture["y"].values[0]]) / focal_m - pitch / 2
    counts = np.array([picture.sizes["x"], picture.sizes["y"]])
    field = field_coordinates(points, projection)
    # far outside the frame a distortion may not be defined, so such points are moved close to it
    edge = np.linspace(0, 1, 9)[:, None] * counts * pitch + first
    u, v = lens.inverse(*np.meshgrid(*edge.T))
    reach = WIDER * np.array([np.abs(u).max(), np.abs(v).max()])
    x, y = lens.forward(*np.clip(field, -reach, reach).T)
    pixels = (np.stack([x, y], -1) - first) / pitch
    low, high = (np.clip(end, 0, counts) for end in (pixels.min(0), pixels.max(0)))
    return [*low.tolist(), *(high - low).tolist()] if (high > low).all() else None


def field_coordinates(points: np.ndarray, projection: str) -> np.ndarray:
    """Return the field coordinates (n, 2) of points: tangents of the field angle, or the angle in
    radians along the direction from the axis.

    Parameters
    ----------
    points : (n, 3) points in camera axes, any unit of length.
    projection : `tangent`, or another name for angles.
    """
    across = points[:, :2]
    forward = points[:, 2:]
    if projection == "tangent":
        return across / forward
    away = np.hypot(*across.T)[:, None]
    angle = np.arctan2(away, forward)
    return across * np.divide(angle, away, out=np.ones_like(away), where=away > 0)
