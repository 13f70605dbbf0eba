"""Gait: people who walk on by as much as their steps are long.

Thighs swing as a cosine, so that within a step a foot slides by up to a tenth of a metre.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..packs.asset import AssetThing
from ..ranges import generator
from ..thing import Thing
from .families import Walker, figure, look_of, pace_of

CYCLES_PER_S = 0.95  # of two steps each; adults take 1.8 to 2 steps a second
PHASES = (0.0, 0.25)  # of the widest and of the narrowest pose; the gait is symmetric


class Gait(NamedTuple):
    """How a person walks."""

    phase: float  # 0..1, of the drawn pose
    stride_deg: float  # of each thigh, to the front and to the rear
    cycle_m: float  # way of two steps


def gait(thing: Thing) -> Gait | None:
    """Return how a person walks; None for one who stands, as those of asset packs do."""
    if isinstance(thing, AssetThing):
        return None
    return _gait(thing.family, thing.variant)


@lru_cache(maxsize=256)
def _gait(family: str, variant: int) -> Gait | None:
    rng = generator(family, variant)
    body = look_of(family, rng).body
    stride, phase, stands = pace_of(family, rng)
    if stands:
        return None
    # while its foot is on the ground, a thigh swings from one end of its stride to the other
    step_m = 2 * (body.thigh_m + body.shin_m) * float(np.sin(np.radians(stride)))
    return Gait(phase, stride, 2 * step_m)


def walking_speed_m_s(thing: Thing) -> float:
    """Return the speed of a person, 0 for one who stands."""
    walk = gait(thing)
    return walk.cycle_m * CYCLES_PER_S if walk else 0.0


@lru_cache(maxsize=256)
def largest_size_m(thing: Thing) -> tuple[float, float, float]:
    """Return length, width and height that hold a person in all poses of the gait."""
    sizes = [figure(thing.family, thing.variant, phase).size_m() for phase in PHASES]
    length, width, height = np.max([thing.size_m, *sizes], axis=0).tolist()
    return length, width, height


def walked(thing: Thing, way_m: float) -> Thing:
    """Return a person after a way."""
    walk = gait(thing)
    if walk is None:
        return thing
    phase = (walk.phase + way_m / walk.cycle_m) % 1.0
    size = figure(thing.family, thing.variant, phase).size_m()
    return Walker(thing.family, thing.variant, thing.category, size, thing.group, phase=phase)
