"""Camera on a vehicle: its mount, its line of sight, and a check that its place is free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from isethdr_core.errors import ConfigError

from .plan import Layout, Viewpoint
from .rules import holding

Mount = Literal["front", "rear", "left", "right"]
# places of the mounts: distances ahead and to the left of the middle of the camera's car, m, and
# direction, degrees to the left
MOUNTS: dict[Mount, tuple[float, float, float]] = {
    "front": (1.0, 0.0, 0.0),
    "rear": (-2.30, 0.0, 180.0),
    "left": (0.70, 0.98, 90.0),
    "right": (0.70, -0.98, -90.0),
}
LEAST_ABOVE_M = 0.2  # least height of the camera above the ground


@dataclass(frozen=True)
class Mounting:
    """A camera on a car."""

    mount: Mount = "front"
    height_m: float = 1.3
    ahead_m: float = 0.0  # distance ahead of the place of the mount
    left_m: float = 0.0  # distance to the left of the place of the mount
    heading_deg: float = 0.0  # angle to the left of the mount's direction
    pitch_deg: float = 0.0  # angle upwards


@dataclass(frozen=True)
class Eye:
    """A camera's place and line of sight in the world."""

    position_m: np.ndarray  # (3,)
    direction: np.ndarray  # (3,) unit vector

    def viewpoint(self) -> Viewpoint:
        """Return place and heading of the camera in plan."""
        heading = float(np.arctan2(self.direction[1], self.direction[0]))
        return Viewpoint(float(self.position_m[0]), float(self.position_m[1]), heading)


def eye(own: np.ndarray, mounting: Mounting) -> Eye:
    """Return the place of a camera on a car with the pose `own` (4, 4)."""
    ahead, left, turn = MOUNTS[mounting.mount]
    local = [ahead + mounting.ahead_m, left + mounting.left_m, mounting.height_m]
    position = own[:3, 3] + own[:3, :3] @ local
    heading, pitch = np.radians([turn + mounting.heading_deg, mounting.pitch_deg])
    level = [np.cos(pitch) * np.cos(heading), np.cos(pitch) * np.sin(heading), np.sin(pitch)]
    return Eye(position, own[:3, :3] @ np.array(level))


def check_eye(layout: Layout, place: Eye) -> None:
    """Raise ConfigError if the camera is inside a thing or a tunnel's wall, or too near to the
    ground.
    """
    x, y, z = (float(v) for v in place.position_m)
    where = f"the camera at ({x:.1f}, {y:.1f}, {z:.1f}) m is"
    repair = (
        "; expected a free place; type for example scene.camera_ahead_m=0 scene.camera_left_m=0"
    )
    held = holding(layout, place.position_m)
    if held is not None:
        raise ConfigError(f"{where} inside {held.name!r}{repair}")
    base = layout.base
    road = base.lane.road
    s, t, _ = (float(v[0]) for v in road.line.beside(np.array([[x, y]])))
    right, left = (float(v) for v in road.edges(s))
    inside = right < t < left
    if bool(road.on_structure("tunnel", s)) and not inside:
        raise ConfigError(f"{where} inside the wall of a tunnel{repair}")
    if bool(road.on_structure("bridge", s)):
        ground = float(road.height(s, t)) if inside else -np.inf
    else:
        ground = float(base.network.height(x, y))
    if z < ground + LEAST_ABOVE_M:
        raise ConfigError(
            f"{where} {z - ground:+.2f} m above the ground; expected {LEAST_ABOVE_M:g} or more;"
            " type for example scene.camera_height_m=1.3"
        )
