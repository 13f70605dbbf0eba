"""Groups of families, and the module that serves each."""

from __future__ import annotations

from typing import Protocol

from ..geometry.mesh.piece import Assembly
from .animals import families as animals
from .furniture import barriers, buildings, signs, small, street_lamps, traffic_lights
from .people import families as people
from .people.riders import Ridden, Riders
from .plants import bushes, ground_cover, trees
from .thing import Detail, Thing
from .vehicles import bicycles, cars, heavy, motorcycles


class Families(Protocol):
    """The functions that a module of families offers."""

    def shares(self) -> dict[str, float]:
        """Return the families, each with its share of the group; shares may have any scale."""

    def thing(self, family: str, variant: int) -> Thing:
        """Return a member of a family. The same variant gives the same thing."""

    def build(self, thing: Thing, detail: Detail) -> Assembly:
        """Return the mesh, centred in x and y on z = 0."""


# groups of two-wheelers with riders; `motorcycle` includes scooters
RIDDEN: dict[str, Ridden] = {
    "bicycle": bicycles,
    "motorcycle": motorcycles,
}
RIDERS = Riders(RIDDEN)
GROUPS: dict[str, Families] = {
    "car": cars,
    "truck": heavy.TRUCKS,
    "bus": heavy.BUSES,
    **RIDDEN,
    "rider": RIDERS,
    "animal": animals,
    "person": people,
    "tree": trees.SUMMER,
    "spring tree": trees.SPRING,
    "autumn tree": trees.AUTUMN,
    "winter tree": trees.WINTER,
    "bush": bushes,
    "grass": ground_cover.Grasses(),
    "rock": ground_cover.Rocks(),
    "street lamp": street_lamps,
    "traffic light": traffic_lights,
    "sign": signs,
    "building": buildings,
    "barrier": barriers,
    "furniture": small,
}
# names for several groups
COLLECTIONS: dict[str, tuple[str, ...]] = {
    "vehicles": ("car", "truck", "bus", "motorcycle", "bicycle"),
    "living": ("person", "rider", "animal"),
    "plants": ("tree", "spring tree", "autumn tree", "winter tree", "bush", "grass", "rock"),
}


def group_named(name: str) -> Families:
    """Return the module of a group.

    Raises
    ------
    ValueError
        If there is no such group.
    """
    if name not in GROUPS:
        raise ValueError(f"no group of things {name!r}; expected {', '.join(GROUPS)}")
    return GROUPS[name]
