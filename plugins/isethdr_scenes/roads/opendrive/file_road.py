"""A road file as a base road: the camera's lane, the roads around it, light and type of place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from isethdr_core.errors import CatalogError, ConfigError, did_you_mean

from ..kinds import BaseRoad, names
from ..lane_path import LaneKey, LanePath
from ..network import Network
from ..profile import Floats
from .overpasses import with_overpasses
from .road_file import RoadFile, numbered, read
from .window import moved, window
from .words import URBAN

WINDOW_M = 350.0  # roads farther from the camera are left out
AHEAD_M = 20.0  # distance from a lane's start at which the camera's car starts by default
LEAST_M = 4.0  # least distance from a lane's ends to the middle of the camera's car
# types of lanes that may be chosen for the camera's car
CAMERA_LANES = ("driving", "biking", "parking", "shoulder", "border", "none")
FAR_M = 2000.0  # larger coordinates are shifted, because meshes have single precision


@dataclass(frozen=True)
class Choices:
    """Choices of a user about a road file; for None and "" the file decides."""

    road_id: str = ""
    lane_id: int | None = None
    s_m: float | None = None  # place of the camera along the road
    lit: bool | None = None
    urban: bool | None = None
    speed_limit_kmh: float | None = None


class Start(NamedTuple):
    """Place of the camera's car: a lane, metres along it, and offset and turn on it."""

    lane: LanePath
    along_m: float
    aside_m: float = 0.0  # offset to the left of the lane's middle
    turn_rad: float = 0.0  # turn to the left of the lane's direction


@dataclass(frozen=True, eq=False)
class FileRoad:
    """A base road made of a file."""

    base: BaseRoad
    shift_m: Floats  # (2,) shift from the file's coordinates to those of the scene
    file: RoadFile
    bridges: tuple[str, ...]  # roads with an added bridge that the file does not state


@lru_cache(maxsize=4)
def _read(path: Path, modified_ns: int, size: int) -> RoadFile:
    return read(path)


def content(path: Path) -> RoadFile:
    """Return the content of a road file; a file that has not changed is read once.

    Raises
    ------
    CatalogError : as `road_file.read`.
    """
    if not path.is_file():
        return read(path)
    told = path.stat()
    return _read(path, told.st_mtime_ns, told.st_size)


def file_road(path: Path, seed: int, choices: Choices, at: Start | None = None) -> FileRoad:
    """Return the base road of a file around the camera's lane.

    Parameters
    ----------
    path : road file (.xodr).
    seed : seed of everything that the file does not state, such as textures and things beside the
        road.
    choices : choices of the lane of the camera, light, type of place and speed limit.
    at : place of the camera's car; None: that of `start`.

    Raises
    ------
    CatalogError : as `road_file.read`.
    ConfigError : no such road or lane; no driving lane at all; an s beyond the road.
    """
    file = content(path)
    at = at or Start(*start(file, path, choices))
    lane = at.lane
    middle = lane.at(at.along_m)[:2, 3]
    _check_near(lane, middle, path)
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


def _check_near(lane: LanePath, middle: Floats, path: Path) -> None:
    """Raise CatalogError if the line of the camera's road lies outside the window."""
    away = abs(float(lane.road.line.beside(middle[None]).t_m[0]))
    if not away < WINDOW_M - AHEAD_M:
        raise CatalogError(
            f"{path}, road {lane.road.name}, lane {lane.lane.number}: its middle is {away:.0f} m"
            f" from the reference line of the road; expected less than {WINDOW_M - AHEAD_M:g} m;"
            " type another lane: scene.road_id=<road> scene.lane_id=<lane>"
        )


def _flag(chosen: bool | None, told: str | None, usual: bool) -> bool:
    if chosen is not None:
        return chosen
    return usual if told is None else told == "true"


def _found(network: Network, lane: LanePath, place: Floats) -> tuple[LaneKey, float]:
    """Return the key of a lane in a cut network, and the metres along it of a plan point."""
    road = network.road(lane.road.name)
    s = float(road.line.beside(place[None])[0][0])
    key = LaneKey(road.name, road.section_at(s), lane.lane.number)
    return key, float(network.lane(key).along_lane(s))


def start(file: RoadFile, path: Path, choices: Choices) -> tuple[LanePath, float]:
    """Return the lane of the camera's car and the metres along it.

    Without a choice it is a place near the start of the longest driving lane outside of junctions.
    A file made by `isethdr roads write` states its own place.

    Parameters
    ----------
    file : content of the file.
    path : path of the file, for messages.
    choices : choices of road, lane and metres along the road.

    Raises
    ------
    ConfigError : no such road or lane, or no driving lane.
    CatalogError : the place that the file states is none.
    """
    told = file.own.get("start", "").split()
    if told and not choices.road_id and choices.lane_id is None and choices.s_m is None:
        choices = _of_file(told, path, choices)
    lanes = [lane for lane in file.network.lanes() if fits(lane)]
    every = file.network.lanes(CAMERA_LANES)
    if choices.road_id:
        roads = [road.name for road in file.network.roads]
        if choices.road_id not in roads:
            raise ConfigError(
                f"scene.road_id is {choices.road_id!r}, but {path} has no such"
                f" road{did_you_mean(choices.road_id, roads)}"
            )
        lanes = [lane for lane in every if lane.road.name == choices.road_id]
    if choices.s_m is not None:
        lanes = _at(lanes, path, choices)
    if choices.lane_id is not None:
        lanes = _numbered(lanes, path, choices)
    driving = [lane for lane in lanes if lane.type == "driving"]
    others = lanes if choices.road_id else every
    lanes = driving or (lanes if choices.lane_id is not None else [])
    if not lanes:
        where = f"road {choices.road_id} of {path}" if choices.road_id else str(path)
        raise ConfigError(f"{where} has {_no_driving_lane(others)}")
    lane = max(lanes, key=lambda item: (not item.road.junction, round(item.length_m, 3)))
    if choices.s_m is not None:
        along = float(lane.along_lane(choices.s_m))
    else:
        along = min(AHEAD_M, lane.length_m / 2)
    return lane, float(np.clip(along, min(LEAST_M, lane.length_m / 2), lane.length_m))


def _of_file(told: list[str], path: Path, choices: Choices) -> Choices:
    """Return the choices with the start that a file states: road, lane, metres along the road."""
    try:
        road, number, along = told
        lane_id = int(number)
        s_m = float(along)
    except ValueError:
        s_m = math.nan
    if not math.isfinite(s_m):
        raise CatalogError(
            f"{path}, header: the value of the userData isethdr.start is {' '.join(told)!r};"
            " expected the id of a road, a lane and metres along the road, for example '1 -1 40';"
            " correct it, or remove the element"
        )
    return replace(choices, road_id=road, lane_id=lane_id, s_m=s_m)


def no_start(network: Network) -> str:
    """Return why the camera's car has no usual place in a network; empty if it has one."""
    if any(map(fits, network.lanes())):
        return ""
    return _no_driving_lane(network.lanes(CAMERA_LANES))


def _no_driving_lane(others: Sequence[LanePath]) -> str:
    """Return the words for a lack of driving lanes, with another lane that may be chosen."""
    said = f"no driving lane of {2 * LEAST_M:g} m or more for the camera"
    if not others:
        return f"{said}, and no other lane for it; expected one; type another scene.road"
    lane = max(others, key=lambda item: item.length_m)
    return (
        f"{said}; expected one, or the choice of another lane; type for example"
        f" scene.road_id={lane.road.name} scene.lane_id={lane.lane.number}"
    )


def fits(lane: LanePath) -> bool:
    """Return whether a lane is long enough for the camera's car."""
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
    """Return a base road as a file, with the camera's start, light and kind in its header."""
    ids = numbered(base.network)
    s = float(base.lane.along_road(base.start_m))
    own = {
        "kind": base.name,
        "start": f"{ids['road', base.start.road]} {base.start.number} {s!r}",
        "lit": str(base.lit).lower(),
        "urban": str(base.urban).lower(),
    }
    return RoadFile(base.network, f"{base.name} {base.seed}", "", own)
