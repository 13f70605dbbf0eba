"""Boxes of objects in metres, with the camera: `boxes3d.json`.

World axes are x forward, y left, z up. Camera axes are x right, y down, z forward. A rotation is a
quaternion [w, x, y, z] from the axes of the object to those of the world.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from isethdr_catalog.dataset import is_thing
from scipy.spatial.transform import Rotation

from isethdr_core.data.camera_geometry import CARRIED

from ..job import Item, Job
from . import geometry, masks
from .masks import LICENCE, visible_objects

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.data.scene_description import Camera

AXES = {
    "world": "x forward, y left, z up, m",
    "camera": "x right, y down, z forward, m",
    "object": "size_m is along x, y, z of the object: length, width, height of a vehicle",
    "rotation": "quaternion [w, x, y, z] from object to world axes",
    "picture": "pixels from the outer corner of the first pixel, x right, y down",
}


def check(job: Job) -> None:
    """Check labels and geometry; raises as `masks.check` and `geometry.described`."""
    masks.check(job)
    for item in job.items:
        geometry.described(item)


def write(job: Job) -> None:
    """Write the boxes of all visible objects into one file."""
    images = []
    for item in job.each():
        scene = geometry.described(item)
        picture = item.picture()
        full = geometry.full_boxes(item)
        seen_things = [
            seen for seen in visible_objects(item.truth()) if is_thing(seen.row["category"])
        ]
        axes = geometry.camera_axes(scene.camera)
        boxes = []
        for seen in seen_things:
            placed = scene.objects[int(seen.row["instance"]) - 1]
            box = geometry.box_of(scene.models[placed.model], placed.pose)
            boxes.append(
                {
                    "instance": int(seen.row["instance"]),
                    "category_id": masks.CATEGORIES[placed.category],
                    "category": placed.category,
                    "name": placed.name,
                    "center_m": box.center_m.tolist(),
                    "size_m": box.size_m.tolist(),
                    "rotation": quaternion(box.rotation),
                    "center_camera_m": ((box.center_m - scene.camera.position_m) @ axes.T).tolist(),
                    "bbox": seen.box,
                    "bbox_full": full.get(int(seen.row["instance"])),
                    "visible_fraction": seen.row.get("visible_fraction"),
                    "distance_m": seen.row.get("distance_m"),
                    "truncation": seen.row.get("truncation"),
                }
                | masks.lit_by(item, seen.row)
            )
        images.append(
            masks.image_row(item, LICENCE)
            | {"camera_model": camera_model(item, scene.camera, picture), "boxes": boxes}
        )
    content = masks.head(job, "boxes of visible things") | {"axes": AXES, "images": images}
    job.write_json("boxes3d.json", content | {"categories": masks.category_rows(True)})


def camera_model(item: Item, camera: Camera, picture: xr.Dataset) -> dict[str, Any]:
    """Return the position of a camera, and the map from directions to pixels.

    The x of a pixel is cx + fx times the x of the field, and y likewise. The x of the field is the
    tangent of the field angle, or the angle itself if `projection` is equidistant. A stated
    `distortion` applies to the x of the field first.

    Parameters
    ----------
    item : run and camera of the picture.
    camera : camera of the scene's description, with position and axis.
    picture : picture with focal length, pixel pitch, grid of pixels and projection.
    """
    focal_m = 1e-3 * float(picture.attrs["focal_length_mm"])
    pitch_m = 1e-6 * float(picture.attrs["pitch_um"])
    axes = geometry.camera_axes(camera)
    return {
        "position_m": [float(v) for v in camera.position_m],
        "rotation": quaternion(axes.T),
        "fx": focal_m / pitch_m,
        "fy": focal_m / pitch_m,
        "cx": 0.5 - float(picture["x"].values[0]) / pitch_m,
        "cy": 0.5 - float(picture["y"].values[0]) / pitch_m,
        **{name: picture.attrs[name] for name in CARRIED[:2] if name in picture.attrs},
    }


def quaternion(rotation: Any) -> list[float]:
    """Return a proper rotation (3, 3) as quaternion [w, x, y, z], with w not negative."""
    found: list[float] = Rotation.from_matrix(rotation).as_quat(canonical=True).tolist()
    return [found[3], *found[:3]]
