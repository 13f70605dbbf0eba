"""Rules: checks of a layout without meshes. Each check returns the things that violate it."""

from __future__ import annotations

import numpy as np

from .boxes import corners, overlapping, solids
from .ground import heights
from .plan import FREE_M, FREE_WIDTH_M, Layout, Standing, Viewpoint
from .site import ALLOWED, MIRROR_M, OVERHEAD_M

HEIGHT_M = 0.02  # largest distance between a thing's foot and the ground under it
CAMERA_M = 0.10  # least distance of the camera from any box


def overlaps(layout: Layout) -> list[str]:
    """Return pairs of things that overlap, except partners such as a bicycle and its rider."""
    boxes = []
    owner = []
    for k, standing in enumerate(layout.standing):
        own = standing.foot.boxes()
        boxes.append(own)
        owner += [k] * len(own)
    if not boxes:
        return []
    rows = np.concatenate(boxes)
    of = np.array(owner)
    found = []
    for k in range(len(rows)):
        hits = np.flatnonzero(overlapping(rows[k], rows[k + 1 :]) & (of[k + 1 :] != of[k]))
        for j in of[k + 1 :][hits]:
            one = layout.standing[of[k]].foot
            two = layout.standing[j].foot
            if one.partner != two.name and two.partner != one.name:
                found.append(f"{one.name} and {two.name}")
    return found


def off_the_ground(layout: Layout) -> list[str]:
    """Return things that do not stand at the mean height of the ground under their corners."""
    if not layout.standing:
        return []
    feet = [s.foot for s in layout.standing]
    under = heights(layout.base.network, feet).mean(1)
    found = []
    for standing, height in zip(layout.standing, under, strict=True):
        if abs(standing.pose[2, 3] - height) > HEIGHT_M:
            found.append(f"{standing.name} stands {standing.pose[2, 3] - height:+.3f} m too high")
    return found


def misplaced(layout: Layout) -> list[str]:
    """Return things that stand on types of lanes on which their role may not stand."""
    boxes = []
    owner = []
    for standing in layout.standing:
        for box in standing.foot.boxes():
            if box[6] < OVERHEAD_M:
                row = box.copy()
                row[2:4] -= MIRROR_M if standing.foot.role == "parked" else 0.0
                boxes.append(row)
                owner.append(standing)
    if not boxes:
        return []
    points = corners(np.array(boxes))
    types = layout.base.network.lane_types(points[..., 0].ravel(), points[..., 1].ravel())
    of = np.array(types).reshape(points.shape[:2])
    return [
        f"{standing.name} ({standing.foot.role}) stands on {sorted(set(row))}"
        for standing, row in zip(owner, of, strict=True)
        if standing.foot.role not in ("driving", "works")
        and not set(row) <= set(ALLOWED[standing.foot.role])
    ]


def before_camera(layout: Layout, view: Viewpoint) -> list[str]:
    """Return things in the area in front of the camera that must stay free."""
    box = np.array(
        [
            view.x_m + FREE_M / 2 * np.cos(view.heading_rad),
            view.y_m + FREE_M / 2 * np.sin(view.heading_rad),
            FREE_M / 2,
            FREE_WIDTH_M / 2,
            np.cos(view.heading_rad),
            np.sin(view.heading_rad),
            0.0,
            5.0,
            0.0,
        ]
    )
    return [
        s.name
        for s in layout.standing
        if s.foot.level == 0 and overlapping(box, s.foot.boxes()).any()
    ]


def holding(layout: Layout, point_m: np.ndarray) -> Standing | None:
    """Return the thing with a box that contains a point (3,), m, or None."""
    for standing in layout.standing:
        if standing.gone:
            continue
        local = np.linalg.inv(standing.pose) @ np.append(point_m, 1.0)
        for solid in _solids(standing):
            inside = abs(local[0] - solid[0]) < solid[2] / 2 + CAMERA_M
            inside &= abs(local[1] - solid[1]) < solid[3] / 2 + CAMERA_M
            inside &= solid[4] - 1.0 < local[2] < solid[5] + CAMERA_M
            if inside:
                return standing
    return None


def _solids(standing: Standing) -> np.ndarray:
    return standing.foot.scale * np.asarray(solids(standing.foot.thing), float)
