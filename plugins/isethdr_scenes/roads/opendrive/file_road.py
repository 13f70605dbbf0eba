"""A road of a file as a base road: the camera's lane, the part about it, lit and urban or not."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from isethdr_core.errors import ConfigError, did_you_mean

from ..kinds import BaseRoad, names
from ..lane_path import LaneKey, LanePath
from ..network import Network
from ..profile import Floats
from .overpasses import with_overpasses
from .road_file import RoadFile, numbered, read
from .window import moved, window
from .words import URBAN

WINDOW_M = 350.0  # roads further from the camera are left out
AHEAD_M = 20.0  # of a lane's start, where the camera starts without further fields
LEAST_M = 4.0  # from a lane's ends to the middle of the camera's car
FAR_M = 2000.0  # coordinates beyond are shifted: single precision of meshes


@dataclass(frozen=True)
class Choices:
    """What a user chooses of a road file; None and "" are taken from the file."""

    road_id: str = ""
    lane_id: int | None = None
    s_m: float | None = None  # along the road
    lit: bool | None = None
    urban: bool | None = None
    speed_limit_kmh: float | None = None


class Start(NamedTuple):
    """Where the camera's car is: a lane, metres along it, and how it stands on it."""

    lane: LanePath
    along_m: float
    aside_m: float = 0.0  # to the left of the lane's middle
    turn_rad: float = 0.0  # from the lane's direction to the left


@dataclass(frozen=True, eq=False)
class FileRoad:
    """A base road made of a file."""

    base: BaseRoad
    shift_m: Floats  # (2,) from the file's coordinates to those of the scene
    file: RoadFile
    bridges: tuple[str, ...]  # roads that got a bridge which the file does not state


@lru_cache(maxsize=4)
def _read(path: Path, modified_ns: int, size: int) -> RoadFile:
    return read(path)


def content(path: Path) -> RoadFile:
    """Return what a road file holds; a file that has not changed is read once.

    Raises
    ------
    CatalogError : as `road_file.read`.
    """
    if not path.is_file():
        return read(path)
    told = path.stat()
    return _read(path, told.st_mtime_ns, told.st_size)


def file_road(path: Path, seed: int, choices: Choices, at: Start | None = None) -> FileRoad:
    """Return the base road of a file about the camera's lane.

    Parameters
    ----------
    path : the file (.xodr).
    seed : of what the file does not state, such as textures and what stands beside the road.
    choices : lane of the camera, light, type of place and speed limit, where they are set.
    at : where the camera's car is; None: as the choices say, or on the longest lane.

    Raises
    ------
    CatalogError : as `road_file.read`.
    ConfigError : no such road or lane; no driving lane at all; an s beyond the road.
    """
    file = content(path)
    at = at or Start(*start(file, path, choices))
    lane = at.lane
    middle = lane.at(at.along_m)[:2, 3]
    shift = -np.round(middle, -2) if np.abs(middle).max() > FAR_M else np.zeros(2)
    near = moved(window(file.network, middle, WINDOW_M), shift)
    near, bridges = with_overpasses(near)
    if choices.speed_limit_kmh is not None:
        limit = choices.speed_limit_kmh
        near = replace(near, roads=tuple(replace(r, speed_limit_kmh=limit) for r in near.roads))
    road = near.road(lane.road.name)
    urban = _flag(choices.urban, file.own.get("urban"), road.type in URBAN)
    own = file.own.get("kind", "")
    base = BaseRoad(
        own if own in names() else f"road of {path.name}",
        seed,
        near,
        *_found(near, lane, middle + shift),
        road.speed_limit_kmh,
        _flag(choices.lit, file.own.get("lit"), urban),
        urban,
        np.inf,
        at.aside_m,
        at.turn_rad,
    )
    return FileRoad(base, shift, file, bridges)


def _flag(chosen: bool | None, told: str | None, usual: bool) -> bool:
    if chosen is not None:
        return chosen
    return usual if told is None else told == "true"


def _found(network: Network, lane: LanePath, place: Floats) -> tuple[LaneKey, float]:
    """Return the key of a lane in the part of a network, and the metres along it at a place."""
    road = network.road(lane.road.name)
    s = float(road.line.beside(place[None])[0][0])
    key = LaneKey(road.name, road.section_at(s), lane.lane.number)
    return key, float(network.lane(key).along_lane(s))


def start(file: RoadFile, path: Path, choices: Choices) -> tuple[LanePath, float]:
    """Return the lane of the camera's car and the metres along it.

    Without a choice: the longest driving lane outside of junctions, near its start. A file that
    `isethdr roads write` made tells its own.

    Parameters
    ----------
    file : content of the file.
    path : its path, for messages.
    choices : road, lane and metres along the road, where they are set.

    Raises
    ------
    ConfigError : no such road or lane, or no driving lane.
    """
    told = file.own.get("start", "").split()
    if told and not choices.road_id and choices.lane_id is None and choices.s_m is None:
        choices = replace(choices, road_id=told[0], lane_id=int(told[1]), s_m=float(told[2]))
    lanes = [lane for lane in file.network.lanes() if _fits(lane)]
    if choices.road_id:
        roads = [road.name for road in file.network.roads]
        if choices.road_id not in roads:
            raise ConfigError(
                f"scene.road_id is {choices.road_id!r}, but {path} has no such"
                f" road{did_you_mean(choices.road_id, roads)}"
            )
        every = file.network.lanes(("driving", "biking", "parking", "shoulder", "border", "none"))
        lanes = [lane for lane in every if lane.road.name == choices.road_id]
    if choices.s_m is not None:
        lanes = _at(lanes, path, choices)
    if choices.lane_id is not None:
        lanes = _numbered(lanes, path, choices)
    driving = [lane for lane in lanes if lane.type == "driving"]
    lanes = driving or (lanes if choices.lane_id is not None else [])
    if not lanes:
        where = f"road {choices.road_id} of {path}" if choices.road_id else str(path)
        raise ConfigError(
            f"{where} has no driving lane of {2 * LEAST_M:g} m or more for the camera; expected"
            " one; type for example scene.road_id=<road> scene.lane_id=-1"
        )
    lane = max(lanes, key=lambda item: (not item.road.junction, round(item.length_m, 3)))
    if choices.s_m is not None:
        along = float(lane.along_lane(choices.s_m))
    else:
        along = min(AHEAD_M, lane.length_m / 2)
    return lane, float(np.clip(along, min(LEAST_M, lane.length_m / 2), lane.length_m))


def _fits(lane: LanePath) -> bool:
    return lane.length_m >= 2 * LEAST_M


def _at(lanes: list[LanePath], path: Path, choices: Choices) -> list[LanePath]:
    s = float(choices.s_m or 0.0)
    if not choices.road_id:
        raise ConfigError(
            f"scene.s_m is {s:g} without a road; expected both; type for example"
            f" scene.road_id={lanes[0].road.name if lanes else 1}"
        )
    road = lanes[0].road if lanes else None
    if road is not None and not 0 <= s <= road.length_m:
        raise ConfigError(
            f"scene.s_m is {s:g}, but road {road.name} of {path} is {road.length_m:.1f} m long;"
            f" type for example scene.s_m={road.length_m / 2:.0f}"
        )
    return [lane for lane in lanes if lane.section == lane.road.section_at(s)]


def _numbered(lanes: list[LanePath], path: Path, choices: Choices) -> list[LanePath]:
    found = [lane for lane in lanes if lane.lane.number == choices.lane_id]
    if found:
        return found
    numbers = sorted({lane.lane.number for lane in lanes})
    raise ConfigError(
        f"scene.lane_id is {choices.lane_id}, but road {choices.road_id or '(any)'} of {path} has"
        f" lanes {', '.join(map(str, numbers)) or 'none'} there; type for example"
        f" scene.lane_id={numbers[0] if numbers else -1}"
    )


def file_of(base: BaseRoad) -> RoadFile:
    """Return a kind of road as a file, with the camera's start, light and kind in its header."""
    ids = numbered(base.network)
    s = float(base.lane.along_road(base.start_m))
    own = {
        "kind": base.name,
        "start": f"{ids['road', base.start.road]} {base.start.number} {s!r}",
        "lit": str(base.lit).lower(),
        "urban": str(base.urban).lower(),
    }
    return RoadFile(base.network, f"{base.name} {base.seed}", "", own)
