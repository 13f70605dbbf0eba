"""A small scene in time for tests: a box waits for two seconds and then moves; a lamp blinks."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from isethdr_core.scene import (
    Camera,
    Lamp,
    Material,
    Model,
    NextFrame,
    Part,
    Placed,
    SceneDescription,
    flat,
)

CAMERA = Camera((0.0, 0.0, 1.0), (10.0, 0.0, 1.0), 40.0, 2.0)
SQUARE = np.array([[0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]], float)
FACES = np.array([[0, 2, 1], [0, 3, 2]])
MATERIALS = {"matt": Material("matt")}
WAITS_S = 2.0
AXIS = (-1.0, 0.0, 0.0)  # direction of the normal of the square's faces


def shifted(x_m: float, y_m: float = 0.0, z_m: float = 1.0) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = x_m, y_m, z_m
    return pose


def square(name: str, lamp: Lamp | None = None) -> Model:
    return Model(name, (Part(name, SQUARE.copy(), FACES.copy(), "matt", lamp=lamp),))


@dataclass(frozen=True)
class Waiting:
    """The box moves after `WAITS_S`. The lamp `blinker` changes its intensity every second. An
    object without surfaces moves all the time.
    """

    time_s: float = 0.0
    frames_per_s: float | None = None

    def box(self, time_s: float) -> np.ndarray:
        return shifted(12.0, max(time_s - WAITS_S, 0.0))

    def __call__(self) -> SceneDescription:
        after_s = 1 / (self.frames_per_s or 1)
        candela = 40.0 + 20.0 * (int(self.time_s) % 2)
        blinks = Lamp("indicator", "blinker", candela, flat(1.0), AXIS)
        models = {
            "box": square("box"),
            "steady": square("steady", Lamp("street", "steady", 50.0, flat(1.0), AXIS)),
            "blinker": square("blinker", blinks),
            "hidden": Model("hidden", ()),
        }
        objects = (
            Placed("box", "box", "car", self.box(self.time_s)),
            Placed("steady", "steady", "street lamp", shifted(9.0, 4.0, 3.0) @ turned()),
            Placed("blinker", "blinker", "car", shifted(9.0, -4.0, 3.0) @ turned()),
            Placed("away", "hidden", "car", shifted(self.time_s, 99.0)),
        )
        following = None
        if self.frames_per_s is not None:
            later = replace(self, time_s=self.time_s + after_s, frames_per_s=None)()
            following = NextFrame(after_s, CAMERA, tuple(o.pose for o in later.objects))
        return SceneDescription(
            "waiting", models, objects, MATERIALS, CAMERA, flat(1e-4), following
        )


def turned() -> np.ndarray:
    """Return the pose of a half turn about z, which makes a lamp face the box."""
    return np.diag([-1.0, -1.0, 1.0, 1.0])
