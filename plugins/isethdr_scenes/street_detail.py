"""Levels of detail of a street: by distance, and coarser if a scene exceeds its triangle budget."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import numpy as np

from .placing.plan import Standing
from .things.packs.asset import AssetThing
from .things.thing import Thing

Level = Literal["near", "middle", "far", "distant"]
LEVELS: tuple[Level, ...] = ("near", "middle", "far", "distant")
ENDS_M = (16.0, 45.0, 90.0)  # distances at which the next coarser level begins
BUDGET = 900_000  # number of stored triangles above which more things of a scene become coarser
SPARE = 60_000  # triangles of the budget reserved for the ground and for small things
# greatest number of triangles of a model of each group at each level; groups that are not listed
# are `SMALL`
TRIANGLES: dict[str, tuple[int, int, int, int]] = {
    "car": (125_000, 50_000, 16_000, 7_000),
    "truck": (76_000, 40_000, 16_000, 8_000),
    "bus": (125_000, 66_000, 30_000, 13_000),
    "motorcycle": (25_000, 18_000, 10_000, 10_000),
    "bicycle": (8_000, 6_000, 3_000, 3_000),
    "person": (40_000, 9_000, 4_500, 4_500),
    "rider": (45_000, 10_000, 4_500, 4_500),
    "animal": (45_000, 10_000, 5_000, 5_000),
    "tree": (42_000, 12_000, 3_200, 3_200),
    "bush": (40_000, 12_000, 3_000, 3_000),
    "grass": (9_000, 3_000, 1_200, 1_200),
    "rock": (7_000, 2_200, 800, 800),
    "building": (5_500, 3_000, 400, 400),
}
SMALL = (1_500, 800, 500, 500)


def levels(standing: Iterable[Standing], position_m: np.ndarray) -> dict[Thing, Level]:
    """Return the level of each thing: that of its nearest place, or a coarser one to keep the
    budget.

    While the scene exceeds the budget, the thing with the largest number of saved triangles per
    solid angle is made coarser by one level.

    Parameters
    ----------
    standing : things and their poses.
    position_m : (3,) position of the camera, m.
    """
    nearest: dict[Thing, float] = {}
    for one in standing:
        distance = float(np.linalg.norm(one.pose[:3, 3] - position_m))
        distance -= 0.5 * max(one.foot.thing.size_m[:2])
        nearest[one.foot.thing] = min(distance, nearest.get(one.foot.thing, np.inf))
    things = list(nearest)
    level = np.array([int(np.searchsorted(ENDS_M, nearest[t], side="right")) for t in things], int)
    cost = np.array([_triangles(t) for t in things]).reshape(-1, len(LEVELS))
    away = np.array([max(nearest[t], 0.5) for t in things])
    every = np.arange(len(things))
    while cost[every, level].sum() > BUDGET - SPARE:
        coarser = np.minimum(level + 1, len(LEVELS) - 1)
        saved = cost[every, level] - cost[every, coarser]
        if not (saved > 0).any():
            break
        # proportional to the triangles saved per solid angle of the thing
        worth = np.where(saved > 0, saved * away**2, -1.0)
        level[int(np.argmax(worth))] += 1
    return {thing: LEVELS[k] for thing, k in zip(things, level, strict=True)}


def _triangles(thing: Thing) -> tuple[int, int, int, int]:
    """Return the greatest number of triangles of a thing at each level."""
    if isinstance(thing, AssetThing) and thing.asset is not None:
        return thing.asset.triangles()
    return TRIANGLES.get(thing.group, SMALL)
