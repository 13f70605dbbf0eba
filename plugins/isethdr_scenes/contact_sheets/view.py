"""The scene of one thing on asphalt under a uniform sky, seen obliquely from the front."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.scene import Camera, Model, Placed, SceneDescription

from ..geometry.mesh.piece import Assembly, pose
from ..geometry.mesh.primitives import grid
from ..geometry.vehicles.headlamp import own_headlamps
from ..lamp_spectra import sky_of
from ..materials import used
from ..things import Thing, build

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import Part

SKY_CD_M2 = 4000.0
FIELD_DEG = 34.0
ASPECT = 4 / 3
ASIDE_DEG = 38.0  # angle of the camera from straight ahead of the thing
FILLED = 0.94  # largest share of the field that the box around the thing fills
GROUND_M = 150.0
OFF = ("brake", "brake_high", "reverse", "indicator_front", "indicator_rear")


def scene_of(thing: Thing) -> SceneDescription:
    """Return the scene of a thing. Headlamps at the camera, in the group `headlights`, light it by
    night.
    """
    camera = _camera(thing)
    plane = np.array([[(x, y, 0.0) for y in (-GROUND_M, GROUND_M)] for x in (-GROUND_M, GROUND_M)])
    ground = Assembly("ground").add(grid(plane, "ground", "asphalt")).model()
    models = {
        "thing": _lit(build(thing, "near").model()),
        "ground": ground,
        "own": own_headlamps(0.3, 0.65, 0.65).model(),
    }
    x, y, _ = camera.position_m
    facing = float(np.degrees(np.arctan2(-y, -x)))
    objects = (
        Placed("thing", "thing", thing.category, np.eye(4)),
        Placed("ground", "ground", "road", np.eye(4)),
        Placed("own", "own", "own vehicle", pose(x, y, 0.0, facing)),
    )
    return SceneDescription(
        f"sheet of {thing.family}", models, objects, used(models), camera, sky_of(SKY_CD_M2)
    )


def _lit(model: Model) -> Model:
    """Return the model with only those lamps that are on while driving."""

    def switched(part: Part) -> Part:
        return replace(part, lamp=None) if part.lamp and part.lamp.kind in OFF else part

    return Model(model.name, tuple(switched(part) for part in model.parts))


def _camera(thing: Thing) -> Camera:
    """Return the nearest camera that sees the whole box of the thing."""
    size = np.array(thing.size_m)
    target = np.array([0.0, 0.0, 0.5 * size[2]])
    aside = np.radians(ASIDE_DEG)
    corners = size * [[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0, 1)]

    def eye(distance: float) -> np.ndarray:
        height = max(0.35 * size[2], min(1.5, 0.8 * size[2])) + 0.08 * distance
        return np.array([distance * np.cos(aside), -distance * np.sin(aside), height])

    def fits(distance: float) -> bool:
        ahead = target - eye(distance)
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        up = np.cross(right, ahead)
        to = corners - eye(distance)
        depth = to @ ahead
        half = FILLED * np.tan(np.radians(FIELD_DEG) / 2)
        if depth.min() <= 0:
            return False
        across = np.abs(to @ right / depth).max()
        over = np.abs(to @ up / depth).max()
        return bool(across < half and over < half / ASPECT)

    distances = np.geomspace(0.3, 200.0, 400)
    distance = next(float(d) for d in distances if fits(float(d)))
    return Camera(tuple(eye(distance).tolist()), tuple(target.tolist()), FIELD_DEG, ASPECT)
