"""Animals of `data/animals.yaml`, drawn and built."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from ...geometry.mesh.piece import Assembly
from ..ranges import drawn, generator, read
from ..shapes import Figure
from ..thing import Detail, Thing
from . import quadruped

FILE = "animals.yaml"
GROUP = "animal"
# largest number of triangles of any animal; they are stored once per model
TRIANGLES: dict[Detail, int] = {"near": 45_000, "middle": 10_000, "far": 5_000}


def shares() -> dict[str, float]:
    """Return the animals, each with its share."""
    return {family: ranges["share"] for family, ranges in read(FILE).items()}


def thing(family: str, variant: int) -> Thing:
    """Return an animal of a family. The same variant gives the same animal."""
    size = _figure(family, variant).size_m()
    return Thing(family, variant, read(FILE)[family]["category"], size, GROUP)


def build(thing: Thing, detail: Detail) -> Assembly:
    """Return the mesh, centred in x and y on z = 0."""
    return _figure(thing.family, thing.variant).assembly(detail)


def animal(family: str, variant: int) -> quadruped.Animal:
    """Return the proportions and the coat of an animal."""
    ranges: dict[str, Any] = read(FILE)[family]
    rng = generator(family, variant)
    parts = drawn({key: ranges[key] for key in ranges if key != "coats"}, rng)
    coats = ranges["coats"]
    coat = coats[int(rng.integers(len(coats)))]
    return quadruped.Animal(
        family,
        parts["shoulder_m"],
        parts,
        coat,
        grazes=bool(rng.random() < parts["grazing"]),
        turn=float(rng.uniform(-1, 1)),
        gait=float(rng.random()),
        seed=int(rng.integers(2**31)),
    )


@lru_cache(maxsize=64)
def _figure(family: str, variant: int) -> Figure:
    return quadruped.figure(animal(family, variant))
