"""Bicycles without riders: city, racing, mountain, folding and cargo bicycles."""

from __future__ import annotations

from functools import lru_cache

from ...geometry.mesh.piece import Assembly
from ...geometry.two_wheelers import bicycle
from ..riding import RidingPosition
from ..thing import Detail, Thing
from . import two_wheelers


def shares() -> dict[str, float]:
    """Return the families with their shares of the traffic."""
    return two_wheelers.shares("bicycle")


@lru_cache(maxsize=256)
def shape_of(family: str, variant: int) -> bicycle.Bicycle:
    """Return the shape of a bicycle."""
    return bicycle.Bicycle(**two_wheelers.fields_of("bicycle", family, variant))


def thing(family: str, variant: int) -> Thing:
    """Return a bicycle; its mesh is not built."""
    shape = shape_of(family, variant)
    return Thing(family, variant, "bicycle", shape.size_m, "bicycle", shape.colour)


def build(thing: Thing, detail: Detail) -> Assembly:
    """Return the mesh of a bicycle."""
    model = bicycle.build(shape_of(thing.family, thing.variant), thing.family)
    return two_wheelers.at_detail(model, detail)


def riding_position(thing: Thing) -> RidingPosition:
    """Return the points where its rider sits, holds on and pedals."""
    shape = shape_of(thing.family, thing.variant)
    saddle = shape.points["saddle"] + [-0.05, 0, 0.03]
    return two_wheelers.position(saddle, shape.grips[0], shape.pedals)
