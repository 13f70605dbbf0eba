"""Motion: the displacement in the field, until the next frame, of the point that each tile shows.

The point that the centre ray of a tile meets moves with its object, which is a rigid body, and is
projected again by the camera of the next frame. The sky lies at infinity, so only rotations of the
camera move it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.data.quantities import MOTION

from .world.view import View

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import SceneDescription


def motion_label(description: SceneDescription, view: View, labels: dict) -> dict[str, np.ndarray]:
    """Return the label `motion`, or an empty dict if the scene states no next frame.

    Parameters
    ----------
    description : scene.
    view : tiles of the frame.
    labels : `instance` and `distance` (row, column) of these tiles.

    Returns
    -------
    dict
        {"motion": (row, column, uv) float32} in the unit of the field coordinates; NaN where the
        point has no coordinates in the next frame.
    """
    following = description.next_frame
    if following is None:
        return {}
    x, y = (a.ravel() for a in np.meshgrid(view.x, view.y))
    instance = labels["instance"].ravel()
    # in float64: a point 200 m away moves by less than a millimetre in a short frame
    way = view.to_world(view.rays(x, y))
    reach = np.where(instance > 0, labels["distance"].ravel(), 1.0).astype(float)
    points = view.origin_m + reach[:, None] * way
    for number in np.unique(instance[instance > 0]):
        here = instance == number
        pose = np.asarray(description.objects[number - 1].pose, float)
        moved = np.asarray(following.poses[number - 1], float) @ np.linalg.inv(pose)
        points[here] = points[here] @ moved[:3, :3].T + moved[:3, 3]
    later = view.of(following.camera)
    sky = instance == 0
    points[sky] = later.origin_m + way[sky]
    seen = later.to_camera(points)
    lost = (seen[:, 2] <= 0) & (view.projection == "tangent")
    seen[lost] = np.nan
    motion = later.coordinates(seen) - np.stack([x, y], 1)
    return {MOTION: motion.reshape(*view.shape, 2).astype(np.float32)}
