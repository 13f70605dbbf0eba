"""Motorcycles and scooters without riders."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...geometry.mesh.piece import Assembly
from ...geometry.two_wheelers import motorcycle, scooter
from ..riding import RidingPosition
from ..thing import Detail, Thing
from . import two_wheelers


def shares() -> dict[str, float]:
    """Return the families with their shares of the traffic."""
    return two_wheelers.shares("motorcycle") | two_wheelers.shares("scooter")


@lru_cache(maxsize=256)
def shape_of(family: str, variant: int) -> motorcycle.Motorcycle | scooter.Scooter:
    """Return the shape of a motorcycle or scooter."""
    if family in two_wheelers.shares("scooter"):
        return scooter.Scooter(**two_wheelers.fields_of("scooter", family, variant), seed=variant)
    return motorcycle.Motorcycle(
        **two_wheelers.fields_of("motorcycle", family, variant), seed=variant
    )


def thing(family: str, variant: int) -> Thing:
    """Return a motorcycle or scooter; its mesh is not built."""
    shape = shape_of(family, variant)
    return Thing(family, variant, "motorcycle", shape.size_m, "motorcycle", shape.colour)


def build(thing: Thing, detail: Detail) -> Assembly:
    """Return the mesh of a motorcycle or scooter."""
    shape = shape_of(thing.family, thing.variant)
    if isinstance(shape, scooter.Scooter):
        model = scooter.build(shape, thing.family)
    else:
        model = motorcycle.build(shape, thing.family)
    return two_wheelers.at_detail(model, detail)


def riding_position(thing: Thing) -> RidingPosition:
    """Return the points where its rider sits, holds on and rests the feet."""
    at = shape_of(thing.family, thing.variant).points
    feet = (at["foot"], at["foot"] * np.array([1, -1, 1]))
    return two_wheelers.position(at["seat"], at["grip"], feet)
