"""Tables of a study: scores by camera; objects by class, distance and illuminance."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from isethdr_catalog.dataset import is_thing

from isethdr_core.data.categories import CATEGORIES
from isethdr_core.data.quantities import LUMINANCE

from ..summary import DISTANCES_M, LUX, bounds, illuminance
from .cameras import Imaged, Shot
from .intervals import Mean, mean_over_roads

DETECTION = "contrast_detection"  # score of an object: its detection probability, 0 to 1
NOT_KNOWN = "not known"


@dataclass(frozen=True)
class Seen:
    """One object as one camera shows it."""

    scene: int
    road: str
    camera: str
    name: str
    category: str
    distance_m: float
    # vertical illuminance towards the camera by all light groups; NaN if it is not known
    illuminance_lx: float
    detection: float


@dataclass(frozen=True)
class Row:
    """Means of all cameras."""

    name: str
    objects: int  # number of objects in all scenes
    means: tuple[Mean, ...]  # means by camera


@dataclass(frozen=True)
class FrameRow:
    """One score of the whole picture.

    Luminances of day and night are decades apart. So their means are geometric, and cameras are
    compared by ratios.
    """

    metric: str
    unit: str
    geometric: bool
    means: tuple[Mean, ...]  # means by camera
    differences: tuple[Mean, ...]  # differences or ratios to the first camera, of the same scenes


@dataclass(frozen=True)
class Tables:
    """All tables of a study."""

    cameras: list[str]
    frame: list[FrameRow]
    objects: dict[str, list[Row]]  # {title: rows}
    seen: list[Seen]


def cameras_of(shots: Sequence[Shot]) -> list[str]:
    """Return the names of the cameras, in their order in the runs."""
    return list(dict.fromkeys(str(score["camera"]) for shot in shots for score in shot.scores))


def seen_objects(shots: Sequence[Shot]) -> list[Seen]:
    """Return the objects with a detection score, once for each camera. Surfaces and plants are left
    out.
    """
    found = []
    for shot in shots:
        rows = {name_of(row): row for row in reversed(shot.objects)}
        rows |= {f"{name_of(row)} {row['instance']}": row for row in shot.objects}
        for score in shot.scores:
            row = rows.get(str(score["object"]))
            if score["metric"] != DETECTION or row is None or not is_thing(row["category"]):
                continue
            found.append(
                Seen(
                    scene=shot.number,
                    road=shot.road,
                    camera=str(score["camera"]),
                    name=str(score["object"]),
                    category=row["category"],
                    distance_m=float(row["distance_m"]),
                    illuminance_lx=illuminance(row, shot.weights),
                    detection=float(score["value"]),
                )
            )
    return found


def name_of(row: Mapping[str, Any]) -> str:
    """Return the name that metrics give to an object of the table."""
    return str(row.get("name") or row.get("category") or row["instance"])


def by_class(seen: Sequence[Seen], cameras: Sequence[str]) -> list[Row]:
    """Return a row for each class of objects, the most frequent class first.

    Parameters
    ----------
    seen : objects as the cameras show them.
    cameras : names of the cameras.
    """
    names = [name for name in CATEGORIES if is_thing(name)]
    rows = _rows(seen, cameras, names, lambda one: one.category)
    return sorted(rows, key=lambda row: -row.objects)


def by_distance(seen: Sequence[Seen], cameras: Sequence[str]) -> list[Row]:
    """Return a row for each class of distance.

    Parameters
    ----------
    seen : objects as the cameras show them.
    cameras : names of the cameras.
    """
    names = bounds(DISTANCES_M, "m")
    return _rows(seen, cameras, names, lambda one: names[_place(one.distance_m, DISTANCES_M)])


def by_illuminance(seen: Sequence[Seen], cameras: Sequence[str]) -> list[Row]:
    """Return a row for each decade of illuminance, and one for objects with an unknown illuminance.

    Parameters
    ----------
    seen : objects as the cameras show them.
    cameras : names of the cameras.
    """
    names = bounds(LUX, "lx")

    def name(one: Seen) -> str:
        known = math.isfinite(one.illuminance_lx)
        return names[_place(one.illuminance_lx, LUX)] if known else NOT_KNOWN

    rows = _rows(seen, cameras, [*names, NOT_KNOWN], name)
    return [row for row in rows if row.objects or row.name != NOT_KNOWN]


def _place(value: float, limits: Sequence[float]) -> int:
    return int(np.searchsorted(limits, value, side="right"))


def _rows(
    seen: Sequence[Seen],
    cameras: Sequence[str],
    names: Sequence[str],
    name_of_one: Callable[[Seen], str],
) -> list[Row]:
    members: dict[str, list[Seen]] = {name: [] for name in names}
    for one in seen:
        members[name_of_one(one)].append(one)
    rows = []
    for name, group in members.items():
        means = []
        for camera in cameras:
            own = [one for one in group if one.camera == camera]
            values = [one.detection for one in own]
            roads = [one.road for one in own]
            means.append(mean_over_roads(values, roads, (0.0, 1.0)))
        objects = len({(one.scene, one.name) for one in group})
        rows.append(Row(name, objects, tuple(means)))
    return rows


def frame_rows(shots: Sequence[Shot], cameras: Sequence[str]) -> list[FrameRow]:
    """Return a row for each score of the whole picture.

    Parameters
    ----------
    shots : scores of all scenes.
    cameras : names of the cameras; the others are compared with the first.
    """
    units = {}
    values = {}
    for shot in shots:
        for score in shot.scores:
            if not score["object"]:
                units[str(score["metric"])] = str(score["unit"])
                values[shot.number, score["metric"], score["camera"]] = float(score["value"])
    rows = []
    for metric, unit in units.items():
        columns = [
            [values.get((shot.number, metric, camera), math.nan) for shot in shots]
            for camera in cameras
        ]
        geometric = unit == LUMINANCE and all(v > 0 for c in columns for v in c if v == v)
        if geometric:
            columns = [[math.log(v) for v in column] for column in columns]
        roads = [shot.road for shot in shots]
        means = [mean_over_roads(column, roads) for column in columns]
        differences = [
            mean_over_roads([b - a for a, b in zip(columns[0], column, strict=True)], roads)
            for column in columns[1:]
        ]
        if geometric:
            means, differences = ([exponential(m) for m in of] for of in (means, differences))
        rows.append(FrameRow(metric, unit, geometric, tuple(means), tuple(differences)))
    return rows


def exponential(mean: Mean) -> Mean:
    """Return the geometric mean with its interval, from the mean of the logarithms."""
    ends = (math.exp(v) for v in (mean.value, mean.low, mean.high))
    return Mean(*ends, mean.count, mean.roads)


def tables_of(imaged: Imaged) -> Tables:
    """Return all tables."""
    cameras = cameras_of(imaged.shots)
    seen = seen_objects(imaged.shots)
    objects = {
        "class": by_class(seen, cameras),
        "distance": by_distance(seen, cameras),
        "illuminance": by_illuminance(seen, cameras),
    }
    return Tables(cameras, frame_rows(imaged.shots, cameras), objects, seen)
