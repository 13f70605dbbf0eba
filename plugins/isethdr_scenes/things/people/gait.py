"""Gait: walking people move by the length of their steps, so feet on the ground stand still."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..packs.asset import AssetThing
from ..ranges import generator
from ..thing import Thing
from .body import Swing
from .families import Walker, centre_m, figure, figure_of_thing, look_of, pace_of

# cycles of two steps per second, 117 steps a minute (means of men and of women at free speed:
# Murray, Drought & Kory 1964; Murray, Kory & Sepic 1970)
CYCLES_PER_S = 0.975
PHASES = tuple(np.arange(8) / 8)  # phases at which the extent of a person is examined


class Gait(NamedTuple):
    """Gait of a person."""

    phase: float  # phase of the drawn pose, 0 to 1
    swing: Swing
    cycle_m: float  # length of two steps


def gait(thing: Thing) -> Gait | None:
    """Return the gait of a person; None: the person stands, as do all people of asset packs."""
    if isinstance(thing, AssetThing):
        return None
    return _gait(thing.family, thing.variant)


@lru_cache(maxsize=256)
def _gait(family: str, variant: int) -> Gait | None:
    rng = generator(family, variant)
    body = look_of(family, rng).body
    pace = pace_of(family, rng)
    return pace and Gait(pace.phase, pace.swing, 2 * pace.swing.step_m(body))


def walking_speed_m_s(thing: Thing) -> float:
    """Return the speed of a person, m/s; 0 for a person who stands."""
    walk = gait(thing)
    return walk.cycle_m * CYCLES_PER_S if walk else 0.0


@lru_cache(maxsize=256)
def largest_size_m(thing: Thing) -> tuple[float, float, float]:
    """Return length, width and height, m, of a box that holds a person in all poses of the gait.

    The middle of the box moves at constant speed. In the drawn pose it is the middle of the extent.
    """
    middle = centre_m(figure_of_thing(thing))
    poses = [figure(thing.family, thing.variant, phase) for phase in PHASES]
    sizes = np.array([thing.size_m, *(pose.size_m() for pose in poses)])
    # the middle of the extent moves with the swinging limbs
    aside = np.abs(np.subtract([middle, *(centre_m(pose) for pose in poses)], middle))
    sizes[:, :2] += 2 * aside
    length, width, height = sizes.max(axis=0).tolist()
    return length, width, height


class Walked(NamedTuple):
    """A person after walking a distance."""

    thing: Thing
    # Offset of the middle of the extent, by which a thing is placed, ahead and to the left of a
    # point that moves at constant speed. The body moves at constant speed, while the limbs swing.
    ahead_m: float
    aside_m: float


def walked(thing: Thing, way_m: float) -> Walked:
    """Return a person after walking a distance of `way_m`, m."""
    walk = gait(thing)
    if walk is None:
        return Walked(thing, 0.0, 0.0)
    phase = (walk.phase + way_m / walk.cycle_m) % 1.0
    now = figure(thing.family, thing.variant, phase)
    before = centre_m(figure_of_thing(thing))
    ahead, aside = (b - a for a, b in zip(before, centre_m(now)))
    told = (thing.family, thing.variant, thing.category, now.size_m(), thing.group)
    return Walked(Walker(*told, phase=phase), ahead, aside)
