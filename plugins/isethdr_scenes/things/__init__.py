"""Things of driving scenes: families of vehicles, people, animals and plants as ranges in data.

| module    | content                                                                  |
|-----------|--------------------------------------------------------------------------|
| thing     | `Thing`: data of a thing that are known before its mesh is built         |
| ranges    | files of `data`, and numbers drawn from their ranges                     |
| registry  | the groups, and the module that serves each                              |
| stock     | things that may be drawn: the bundled families, and those of asset packs |
| fleets    | vehicles with silhouettes that all differ                                |
| packs     | folders of users' own meshes                                             |
| detail    | coarser meshes for things that are far away                              |
| furniture | street lamps, signs, traffic lights, barriers, buildings, small things   |
| riding    | `RidingPosition`: where a rider touches a two-wheeler                    |
| shapes    | limbs, lofts, rods, balls and blocks, of which living things are made    |
| animals   | four-legged animals by their proportions                                 |
| people    | people by build, age, clothes and pose                                   |
| plants    | trees through the seasons, bushes, hedges, grass and rocks               |
| vehicles  | cars, trucks, buses, motorcycles and bicycles                            |

`draw` a thing, place it by its `size_m`, and `build` its mesh at the detail that its distance
requires. A module of families offers `shares()`, `thing(family, variant)` and
`build(thing, detail)`, and has an entry in `registry.GROUPS`.
"""

from __future__ import annotations

import numpy as np

from ..geometry.mesh.piece import Assembly
from .fleets import fleet
from .packs.asset import AssetThing
from .people.riders import Rider
from .registry import RIDDEN, RIDERS, group_named
from .riding import RidingPosition
from .stock import BUNDLED
from .thing import Detail, Thing

__all__ = [
    "Detail",
    "Rider",
    "Thing",
    "build",
    "draw",
    "fleet",
    "names",
    "rider_of",
    "riding_position",
]


def names(group: str) -> tuple[str, ...]:
    """Return the bundled families of a group."""
    return BUNDLED.names(group)


def draw(group: str, rng: np.random.Generator, family: str | None = None) -> Thing:
    """Return a random bundled thing of a group or a family.

    Parameters
    ----------
    group : car, truck, person, tree, ... (`isethdr things list`).
    rng : random numbers; a draw takes several.
    family : family of the group; None: drawn by the shares of the families.

    Raises
    ------
    ValueError
        If there is no such group, or no such family in it.
    """
    return BUNDLED.draw(group, rng, family)


def riding_position(thing: Thing) -> RidingPosition:
    """Return where the rider of a two-wheeler touches it."""
    return thing.riding or RIDDEN[thing.group].riding_position(thing)


def rider_of(vehicle: Thing, rng: np.random.Generator) -> Rider:
    """Return a rider for a two-wheeler, as a thing of its own that takes the vehicle's place.

    `draw("rider", rng)` returns rider and vehicle as one thing instead.

    Raises
    ------
    ValueError
        If things of the vehicle's group have no riders.
    """
    return RIDERS.rider_of(vehicle, int(rng.integers(2**31)))


def build(thing: Thing, detail: Detail = "near") -> Assembly:
    """Return the mesh of a thing, with separate parts for its materials and lamps.

    The same thing gives the same arrays. `near` serves up to a distance of 20 m, `middle` up to
    60 m, and `far` beyond.
    """
    if isinstance(thing, AssetThing):
        return thing.built(detail)
    return group_named(thing.group).build(thing, detail)
