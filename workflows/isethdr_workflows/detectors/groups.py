"""Groups of objects: by distance, height, illuminance, and nearby lamps."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..dataset.summary import DISTANCES_M, HEIGHTS, LUX, bounds
from .objects import LAMP_NEAR_DEG, TruthObject


@dataclass(frozen=True)
class Group:
    """A group of objects: title of its table, title of its row, and a test of membership."""

    table: str
    row: str
    member: Callable[[TruthObject], bool]


EVERYTHING = Group("all", "all", lambda one: True)


def groups() -> list[Group]:
    """Return all groups; the first one holds every object."""
    # not the row "lamp within 3 degrees" of the study `detection`, whose lamps are those of the
    # scene, near the middle of the object
    near = f"bright pixels within {LAMP_NEAR_DEG:g} degrees of the box"
    return [
        EVERYTHING,
        *_binned("distance", DISTANCES_M, "m", lambda one: one.distance_m),
        *_binned("height", HEIGHTS, "px", lambda one: one.height_px),
        *_binned("illuminance", LUX, "lx", lambda one: one.illuminance_lx),
        Group("lamp", near, lambda one: one.lamp_near),
        Group("lamp", f"no {near}", lambda one: not one.lamp_near),
    ]


def _binned(
    table: str, limits: Sequence[float], unit: str, value: Callable[[TruthObject], float]
) -> list[Group]:
    return [
        Group(table, name, _between(place, limits, value))
        for place, name in enumerate(bounds(limits, unit))
    ]


def _between(
    place: int, limits: Sequence[float], value: Callable[[TruthObject], float]
) -> Callable[[TruthObject], bool]:
    def member(one: TruthObject) -> bool:
        known = math.isfinite(value(one))
        return known and int(np.searchsorted(limits, value(one), side="right")) == place

    return member
