"""Kinds of base road: a table of ranges (`kinds.yaml`), and the builders that read it.

base = kind("country_curve", seed=3)
base.pose()                       # 4x4: where the camera's car starts, x ahead
base.network.lanes()
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.plugins.yaml_text import read_yaml

from .lane_path import LaneKey, LanePath
from .layouts.corridor import Layout, corridor
from .layouts.crossings import car_park, crossing, roundabout
from .layouts.draw import Draw
from .layouts.levels import overpass, railway, ramp
from .network import Network
from .profile import Floats

LAYOUTS: dict[str, Callable[[Draw], Layout]] = {
    "corridor": corridor,
    "crossing": crossing,
    "roundabout": roundabout,
    "car_park": car_park,
    "overpass": overpass,
    "railway": railway,
    "ramp": ramp,
}


@dataclass(frozen=True)
class BaseRoad:
    """A network drawn from a kind, with the start of the camera's car and road properties."""

    name: str
    seed: int
    network: Network
    start: LaneKey  # lane of the camera's car
    start_m: float  # start of the camera's car along that lane
    speed_limit_kmh: float
    lit: bool  # street lamps or luminaires stand along it
    urban: bool
    curvature_limit_per_m: float  # largest allowed curvature of a reference line
    aside_m: float = 0.0  # offset of the camera's car to the left of its lane's middle
    turn_rad: float = 0.0  # turn of the camera's car to the left of its lane's direction

    @property
    def lane(self) -> LanePath:
        """Return the lane on which the camera's car starts."""
        return self.network.lane(self.start)

    @property
    def right_hand(self) -> bool:
        """Return whether traffic keeps to the right on the road of the camera's car."""
        return self.lane.road.right_hand

    def pose(self) -> Floats:
        """Return the (4, 4) pose of the camera's car on the surface: x ahead, z up."""
        return turned(self.lane.at(self.start_m, self.aside_m), self.turn_rad)


def turned(pose: Floats, turn_rad: float) -> Floats:
    """Return a pose (4, 4) turned to the left about its own z axis."""
    out = pose.copy()
    if turn_rad:
        cos = np.cos(turn_rad)
        sin = np.sin(turn_rad)
        out[:3, :2] = pose[:3, :2] @ np.array([[cos, -sin], [sin, cos]])
    return out


@cache
def table() -> dict[str, dict[str, Any]]:
    """Return the ranges of all kinds by name."""
    text = files(__package__).joinpath("kinds.yaml").read_text()
    kinds: dict[str, dict[str, Any]] = read_yaml(text)
    return kinds


def names() -> tuple[str, ...]:
    """Return the names of all kinds."""
    return tuple(table())


def kind(name: str, seed: int = 0) -> BaseRoad:
    """Return a base road of a kind; the same seed gives the same road.

    Raises
    ------
    ConfigError : there is no such kind.
    """
    if name not in table():
        raise ConfigError(f"there is no road {name!r}; there are {', '.join(names())}")
    ranges = table()[name]
    draw = Draw(name, seed, ranges)
    layout = LAYOUTS[ranges["layout"]](draw)
    return BaseRoad(
        name,
        seed,
        layout.network,
        layout.start,
        layout.start_m,
        draw.number("speed_limit_kmh"),
        bool(draw.value("lit")),
        bool(draw.value("urban")),
        draw.number("curvature_limit_per_m"),
    )
