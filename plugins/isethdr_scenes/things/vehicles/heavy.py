"""Trucks and buses: one model of each for now, as `geometry.vehicles` builds them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...geometry.mesh.piece import Assembly
from ...geometry.vehicles import bus, truck
from ..detail import centred, clean, coarser
from ..thing import Detail, Thing

CELL_M: dict[Detail, float] = {"middle": 0.06, "far": 0.15}


@dataclass(frozen=True)
class Heavy:
    """A group with one family."""

    family: str
    group: str
    size_m: tuple[float, float, float]
    make: Callable[[], Assembly]

    def shares(self) -> dict[str, float]:
        """Return the family."""
        return {self.family: 1.0}

    def thing(self, family: str, variant: int) -> Thing:
        """Return the vehicle; nothing is built. All variants are alike."""
        return Thing(family, 0, self.group, self.size_m, self.group)

    def build(self, thing: Thing, detail: Detail) -> Assembly:
        """Return the mesh, centred in x and y on z = 0."""
        model = centred(clean(self.make()))
        return coarser(model, CELL_M[detail]) if detail in CELL_M else model


TRUCKS = Heavy("box_truck", "truck", (8.83, 3.10, 3.48), truck.truck)
BUSES = Heavy("city_bus", "bus", (11.89, 2.88, 3.28), bus.bus)
