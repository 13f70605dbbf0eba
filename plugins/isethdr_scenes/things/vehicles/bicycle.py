"""The bicycle of `geometry.road_users` as a family: one shape, its paint and crank drawn."""

from __future__ import annotations

from functools import lru_cache

from ...geometry.mesh.piece import Assembly
from ...geometry.road_users import cyclist
from ..detail import centred, clean, coarser
from ..ranges import generator
from ..riding import Point, RidingPosition
from ..thing import Detail, Thing

FAMILY, GROUP = "bicycle", "bicycle"
SIZE_M = (1.7, 0.6, 1.037)
MIDDLE_X_M = 0.065  # of the mesh of `cyclist.bicycle`, which has its origin between the wheels
PAINTS = ("black", "blue", "grey", "green", "red", "silver", "white", "orange")
CELL_M: dict[Detail, float] = {"middle": 0.012, "far": 0.035}


def shares() -> dict[str, float]:
    """Return the one family."""
    return {FAMILY: 1.0}


def thing(family: str, variant: int) -> Thing:
    """Return a bicycle; the same variant, the same bicycle."""
    paint, _ = _drawn(variant)
    return Thing(family, variant, "bicycle", SIZE_M, GROUP, paint)


def build(thing: Thing, detail: Detail) -> Assembly:
    """Return the mesh, centred in x and y on z = 0."""
    paint, crank_deg = _drawn(thing.variant)
    model = centred(clean(cyclist.bicycle(f"paint_{paint}", crank_deg)[0]))
    return coarser(model, CELL_M[detail]) if detail in CELL_M else model


def riding_position(thing: Thing) -> RidingPosition:
    """Return where its rider sits, holds on and pedals."""
    _, crank_deg = _drawn(thing.variant)
    return _position(crank_deg)


@lru_cache(maxsize=64)
def _position(crank_deg: float) -> RidingPosition:
    _, pedals, grips, saddle = cyclist.bicycle(crank=crank_deg)

    def point(v) -> Point:
        return float(v[0]) - MIDDLE_X_M, float(v[1]), float(v[2])

    left, right = (point(grip) for grip in grips)
    # the ball of the foot rests on the pedal, 11 mm above its middle; one sits behind the middle
    feet = [point(pedal + [0, 0, 0.011]) for pedal in pedals]
    return RidingPosition(point(saddle + [-0.05, 0, 0.03]), (left, right), (feet[0], feet[1]))


def _drawn(variant: int) -> tuple[str, float]:
    """Return the paint, and the angle of the crank in degrees."""
    rng = generator(FAMILY, variant)
    return PAINTS[int(rng.integers(len(PAINTS)))], float(rng.uniform(0, 360))
