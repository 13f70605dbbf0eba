"""Tables of a study: the share of objects found by class, distance, size, illuminance and lamp, for
each camera, and the number of roads needed to tell two cameras apart.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.stats import norm, t

from ...dataset.study.intervals import LEVEL, Mean, mean_over_roads
from ...dataset.summary import DISTANCES_M, HEIGHTS, LUX, bounds
from ..frame import CLASSES

NOT_KNOWN = "not known"
PAPER = (0.224, 0.244)  # shares of persons found that the paper reports for one and three captures
POWER = 0.8  # power of the test for a difference
FEWEST_ROADS = 3  # fewest roads for an interval
LEAST_D = 0.01  # smaller d' count as this value in a geometric mean


@dataclass(frozen=True)
class Found:
    """One object in the captures of one camera at one level of light."""

    scene: int  # number of the scene
    road: str
    camera: str
    condition: str  # kind of light: night, dusk, day, tunnel, low sun
    level: float  # level of the light: factor or lux, depending on the question
    instance: int
    name: str
    kind: str
    distance_m: float
    height_px: float
    illuminance_lx: float  # vertical illuminance towards the camera; NaN if it is not known
    near_lamp: bool
    d: float  # d' against clutter and noise; NaN if there are too few windows
    noise_only: float  # d' against noise alone
    found: float  # probability of detection at the false alarms of the study
    found_noise_only: float  # the same against noise alone
    transfer: float  # contrast transfer accuracy; NaN if it was not computed
    told_apart: float = math.nan  # counted share of pairs of windows on the object's own road


class Line(NamedTuple):
    """One row of a table: the same objects for all cameras."""

    table: str
    name: str
    objects: int
    means: tuple[Mean, ...]  # share found, by camera
    differences: tuple[Mean, ...]  # difference from the camera of `compared_with`, same objects
    noise_only: tuple[float, ...]  # share found against noise alone, by camera
    transfer: tuple[Mean, ...]
    median_d: tuple[float, ...]
    noise_only_d: tuple[Mean, ...]  # geometric mean of d' against noise alone


class Needed(NamedTuple):
    """Number of roads needed to detect a difference in the share of objects found."""

    camera: str
    first: str
    paired: float
    unpaired: float


def cameras_of(rows: Sequence[Found]) -> list[str]:
    """Return the names of the cameras, in their order in the rows."""
    return list(dict.fromkeys(row.camera for row in rows))


def compared_with(camera: str, cameras: Sequence[str]) -> str:
    """Return the name of the camera that `camera` is compared with. A camera in a second form, such
    as `bayer, twice the render noise`, is compared with its first form, others with the first
    camera.

    Parameters
    ----------
    camera : name of the camera.
    cameras : names of all cameras.
    """
    own = camera.partition(", ")[0]
    return own if own != camera and own in cameras else cameras[0]


def counted(rows: Sequence[Found]) -> list[Found]:
    """Return rows with the counted share of pairs told apart in place of the share found."""
    return [replace(row, found=row.told_apart) for row in rows]


def lines(rows: Sequence[Found], cameras: Sequence[str] = ()) -> list[Line]:
    """Return the rows of all tables of a study at one level of light. Rows without any object that
    has a value are left out.

    Parameters
    ----------
    rows : objects through all cameras.
    cameras : names of the cameras; (): those of the rows.
    """
    names = cameras or cameras_of(rows)
    ways: dict[str, Callable[[Found], str]] = {
        "all": lambda row: "all objects",
        "class": lambda row: row.kind,
        "light": lambda row: row.condition,
        "distance": lambda row: _class(row.distance_m, DISTANCES_M, "m"),
        "height": lambda row: _class(row.height_px, HEIGHTS, "px"),
        "illuminance": lambda row: _class(row.illuminance_lx, LUX, "lx"),
        "lamp within 3 degrees": lambda row: "yes" if row.near_lamp else "no",
        "light and distance": lambda row: (
            f"{row.condition}, {_class(row.distance_m, DISTANCES_M, 'm')}"
        ),
    }
    found = []
    for table, name_of in ways.items():
        groups: dict[str, list[Found]] = {}
        for row in rows:
            groups.setdefault(name_of(row), []).append(row)
        made = [line(table, name, groups[name], names) for name in sorted(groups, key=_order)]
        found += [one for one in made if one.objects]
    return found


def _order(name: str) -> tuple[object, ...]:
    order = [*CLASSES, *bounds(DISTANCES_M, "m"), *bounds(HEIGHTS, "px"), *bounds(LUX, "lx")]
    parts = name.split(", ")
    last = parts[-1]
    return (parts[0] if len(parts) > 1 else "", order.index(last) if last in order else 99, name)


def _class(value: float, limits: Sequence[float], unit: str) -> str:
    if not math.isfinite(value):
        return NOT_KNOWN
    return bounds(limits, unit)[int(np.searchsorted(limits, value, side="right"))]


def line(table: str, name: str, rows: Sequence[Found], cameras: Sequence[str]) -> Line:
    """Return one row of a table from the objects that belong to it.

    Parameters
    ----------
    table : title of the table.
    name : title of the row.
    rows : objects of the row, from all cameras.
    cameras : names of all cameras. One that shows no object of the row has NaN, for example if its
        pixels are too large for objects of this height.
    """
    by_camera = {
        camera: {(row.scene, row.instance): row for row in rows if row.camera == camera}
        for camera in cameras
    }
    means = []
    differences = []
    for camera in cameras:
        own = by_camera[camera]
        means.append(of(list(own.values()), lambda row: row.found, (0.0, 1.0)))
        other = by_camera[compared_with(camera, cameras)]
        both = [(own[key], other[key]) for key in own if key in other]
        differences.append(difference(both))
    return Line(
        table=table,
        name=name,
        objects=len({(row.scene, row.instance) for row in rows if math.isfinite(row.found)}),
        means=tuple(means),
        differences=tuple(differences[1:]),
        noise_only=tuple(
            of(list(own.values()), lambda row: row.found_noise_only).value
            for own in by_camera.values()
        ),
        transfer=tuple(
            of(list(own.values()), lambda row: row.transfer, (0.0, 1.0))
            for own in by_camera.values()
        ),
        median_d=tuple(_median([row.d for row in own.values()]) for own in by_camera.values()),
        noise_only_d=tuple(geometric(list(own.values())) for own in by_camera.values()),
    )


def geometric(rows: Sequence[Found]) -> Mean:
    """Return the geometric mean of d' against noise alone, with its interval over roads. Values
    below 0.01 count as 0.01.
    """
    mean = of(rows, lambda row: float(np.log(np.maximum(row.noise_only, LEAST_D))))
    value, low, high = np.exp([mean.value, mean.low, mean.high]).tolist()
    return Mean(value, low, high, mean.count, mean.roads)


def _median(values: Sequence[float]) -> float:
    known = [value for value in values if math.isfinite(value)]
    return float(np.median(known)) if known else math.nan


def of(
    rows: Sequence[Found],
    value: Callable[[Found], float],
    limits: tuple[float, float] = (-math.inf, math.inf),
) -> Mean:
    """Return the mean of a value over objects, with its interval over roads. There is no interval
    with fewer than three roads.

    Parameters
    ----------
    rows : objects.
    value : function(object) that returns the value to average.
    limits : smallest and largest possible mean, at which the interval is cut.
    """
    return few_roads(
        mean_over_roads([value(row) for row in rows], [row.road for row in rows], limits)
    )


def difference(both: Sequence[tuple[Found, Found]]) -> Mean:
    """Return the mean difference in the share found of the same objects by two cameras."""
    values = [own.found - first.found for own, first in both]
    return few_roads(mean_over_roads(values, [own.road for own, _ in both]))


def few_roads(mean: Mean) -> Mean:
    """Return a mean; without its interval if there are fewer than three roads."""
    if mean.roads >= FEWEST_ROADS:
        return mean
    return Mean(mean.value, math.nan, math.nan, mean.count, mean.roads)


def standard_error(mean: Mean) -> float:
    """Return the standard error of a mean, from the upper end of its interval.

    The interval must not have been cut at a limit, such as a share of 1. NaN without an interval.
    """
    if mean.roads < FEWEST_ROADS:
        return math.nan
    return (mean.high - mean.value) / float(t.ppf(0.5 + LEVEL / 2, mean.roads - 1))


def roads_needed(rows: Sequence[Found], told: float = PAPER[1] - PAPER[0]) -> list[Needed]:
    """Return the number of roads that are needed to detect a difference of `told`.

    The variance over roads is that of these objects. The test is two-sided at 5 % with a power of
    80 %, so the difference must be 1.96 + 0.84 standard errors (Cohen 1988).

    Parameters
    ----------
    rows : rows of the objects in question, all cameras.
    told : difference in the share of objects found.
    """
    factor = norm.ppf(0.5 + LEVEL / 2) + norm.ppf(POWER)
    cameras = cameras_of(rows)
    by_camera = {
        camera: {(row.scene, row.instance): row for row in rows if row.camera == camera}
        for camera in cameras
    }
    alone = {
        camera: of(list(own.values()), lambda row: row.found) for camera, own in by_camera.items()
    }
    found = []
    for camera in cameras[1:]:
        other = compared_with(camera, cameras)
        first = by_camera[other]
        both = [(row, first[key]) for key, row in by_camera[camera].items() if key in first]
        paired = standard_error(difference(both))
        unpaired = math.hypot(*(standard_error(alone[name]) for name in (camera, other)))
        roads = alone[camera].roads
        found.append(
            Needed(
                camera,
                other,
                *(roads * (factor * error / told) ** 2 for error in (paired, unpaired)),
            )
        )
    return found
