"""Trucks and buses: shapes drawn from the ranges of `data/trucks.yaml`, and their meshes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ...geometry.heavy import buses, trucks
from ...geometry.heavy.shapes import Bus, Truck
from ...geometry.mesh.piece import Assembly
from ..detail import finished
from ..ranges import drawn, generator, one_of, read
from ..thing import Detail, Thing

FILE = "trucks.yaml"
CELL_M: dict[Detail, float] = {"middle": 0.06, "far": 0.15}
LAMP_SHAPES = ("round", "square", "strip")


@dataclass(frozen=True)
class Heavy:
    """A group of the file: trucks or buses."""

    group: str
    key: str  # key of its families in the file
    shape_of: Callable[[str, int], Truck | Bus]

    def shares(self) -> dict[str, float]:
        """Return the families with their shares of the traffic."""
        return {name: family["share"] for name, family in read(FILE)[self.key].items()}

    def thing(self, family: str, variant: int) -> Thing:
        """Return a vehicle; its mesh is not built."""
        shape = self.shape_of(family, variant)
        return Thing(family, variant, self.group, shape.size_m, self.group, shape.paint)

    def build(self, thing: Thing, detail: Detail) -> Assembly:
        """Return the mesh, centred in x and y on z = 0."""
        shape = self.shape_of(thing.family, thing.variant)
        if isinstance(shape, Truck):
            made = trucks.build(shape, thing.family, thing.variant)
        else:
            made = buses.build(shape, thing.family)
        return finished(made, CELL_M.get(detail))


@lru_cache(maxsize=256)
def truck_of(family: str, variant: int) -> Truck:
    """Return the shape of a truck."""
    rng = generator(family, variant)
    given = drawn(read(FILE)["trucks"][family], rng)
    paints = given.pop("load_paints")
    axles = given.pop("rear_axles", (1,))
    fields = _own_fields(given, rng)
    paint = one_of(read(FILE)["truck_paints"], rng)
    return Truck(
        **({"load_length": 0.0} | fields),
        rear_axles=axles[int(rng.integers(len(axles)))],
        grille_bars=int(rng.integers(3, 8)),
        paint=paint,
        load_paint=one_of(paints, rng),
    )


@lru_cache(maxsize=256)
def bus_of(family: str, variant: int) -> Bus:
    """Return the shape of a bus.

    In the file, the places of the joint and of all doors but the first are shares of the length.
    """
    rng = generator(family, variant)
    given = drawn(read(FILE)["buses"][family], rng)
    lower = given.pop("lower_paints", None)
    fields = _own_fields(given, rng)
    length = fields["length"]
    fields["doors"] = tuple(
        u if u > 0.5 and k == 0 else u * length for k, u in enumerate(fields["doors"])
    )
    fields["joint"] = fields.get("joint", 0.0) * length
    paint = one_of(read(FILE)["bus_paints"], rng)
    other = one_of(lower, rng) if lower else one_of(read(FILE)["bus_paints"], rng)
    return Bus(**fields, paint=paint, lower=other if rng.random() < 0.6 else paint)


def _own_fields(given: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return the fields of a shape, without `share` and with the shape of its lamps."""
    given.pop("share")
    return given | {"lamp_shape": LAMP_SHAPES[int(rng.integers(len(LAMP_SHAPES)))]}


TRUCKS = Heavy("truck", "trucks", truck_of)
BUSES = Heavy("bus", "buses", bus_of)
