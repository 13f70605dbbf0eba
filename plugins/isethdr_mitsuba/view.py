"""View: the camera as a grid of tiles in tangents, margin included, and its axes in the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from isethdr_core.errors import ConfigError

LARGEST_FIELD_DEG = 150.0  # a tangent grid stretches without limit towards 180 degrees


@dataclass(frozen=True, eq=False)
class View:
    """Tiles seen by a pinhole: tangents x (right) and y (down) of their centres, and world axes (unit vectors)."""

    x: np.ndarray            # (columns,) tangents of the tile centres
    y: np.ndarray            # (rows,)
    pitch_x: float           # tangents per tile
    pitch_y: float
    field: tuple[float, float]   # nominal (width, height) in tangents, without margin
    origin_m: np.ndarray     # (3,)
    right: np.ndarray        # (3,)
    down: np.ndarray         # (3,)
    forward: np.ndarray      # (3,)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.y), len(self.x)

    def to_camera(self, points_m) -> np.ndarray:
        """Return (n, 3) world points in camera axes (right, down, forward), m."""
        return (np.asarray(points_m, float) - self.origin_m) @ np.stack([self.right, self.down, self.forward], 1)

    def to_world(self, directions) -> np.ndarray:
        """Return (n, 3) camera directions (right, down, forward) in world axes."""
        return np.asarray(directions, float) @ np.stack([self.right, self.down, self.forward])


def view_of(camera, width: int, height: int, margin: float) -> View:
    """Return the view of `camera` with `width` x `height` tiles on its field and `margin` of that more on every side."""
    for name, value in (("width", width), ("height", height)):
        if value < 1:
            raise ConfigError(f"renderer {name} is {value}; expected at least 1 tile; type renderer.{name}=360")
    if not 0 <= margin <= 2:
        raise ConfigError(f"renderer margin is {margin:g}; expected 0 to 2 of the field on each side; type renderer.margin=0.1")
    if not 0 < camera.horizontal_field_deg < LARGEST_FIELD_DEG:
        raise ConfigError(f"the camera's horizontal field is {camera.horizontal_field_deg:g} degrees; "
                          f"expected above 0 and below {LARGEST_FIELD_DEG:g} on a tangent grid")
    field_x = 2 * np.tan(np.radians(camera.horizontal_field_deg) / 2)
    field_y = field_x / camera.aspect
    forward = np.subtract(camera.target_m, camera.position_m).astype(float)
    length = np.linalg.norm(forward)
    if length == 0:
        raise ConfigError(f"the camera looks at its own position {camera.position_m}; expected another target_m")
    forward /= length
    # world z is up; a camera that looks straight up or down keeps world x (forward) as the top of its picture
    up = np.array([0.0, 0, 1]) if abs(forward[2]) < 1 - 1e-9 else np.array([1.0, 0, 0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    pitch = field_x / width, field_y / height
    tiles = [np.arange(-round(n * margin), n + round(n * margin)) for n in (width, height)]
    return View(x=(tiles[0] - (width - 1) / 2) * pitch[0], y=(tiles[1] - (height - 1) / 2) * pitch[1],
                pitch_x=pitch[0], pitch_y=pitch[1], field=(field_x, field_y), origin_m=np.asarray(camera.position_m, float),
                right=right, down=np.cross(forward, right), forward=forward)
