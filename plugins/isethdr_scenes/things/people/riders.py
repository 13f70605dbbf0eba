"""Riders of `data/riders.yaml`, for a given bicycle, motorcycle or scooter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol

import numpy as np

from ...geometry.mesh.piece import Assembly, shift
from ..ranges import generator, one_of, read
from ..riding import RidingPosition
from ..shapes import Figure
from ..thing import Detail, Thing
from .families import TRIANGLES, figure_of, look_of
from .mounted import seated

FILE = "riders.yaml"
GROUP = "rider"
STOOP_DEG = 4.0  # stoop of the upper back, in addition to the lean towards the handlebar
__all__ = ["GROUP", "TRIANGLES", "Rider", "Riders"]


class Ridden(Protocol):
    """The functions that a module of two-wheelers offers."""

    def shares(self) -> dict[str, float]:
        """Return the families, each with its share."""

    def thing(self, family: str, variant: int) -> Thing:
        """Return a two-wheeler."""

    def build(self, thing: Thing, detail: Detail) -> Assembly:
        """Return the mesh of a two-wheeler, centred in x and y, standing on z = 0."""

    def riding_position(self, thing: Thing) -> RidingPosition:
        """Return the points where the rider touches it."""


@dataclass(frozen=True)
class Rider(Thing):
    """A person on a two-wheeler.

    The mesh of a rider alone is in the coordinates of the vehicle and has the pose of the vehicle.
    `centre_m` is the middle of its box in these coordinates. With `vehicle_shown` rider and vehicle
    are one mesh.
    """

    vehicle: Thing | None = None
    vehicle_shown: bool = False
    centre_m: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Riders:
    """The riders of some groups of two-wheelers."""

    ridden: Mapping[str, Ridden]

    def shares(self) -> dict[str, float]:
        """Return the families of all two-wheelers, each with its share."""
        return {
            family: share
            for families in self.ridden.values()
            for family, share in families.shares().items()
        }

    def thing(self, family: str, variant: int) -> Rider:
        """Return a rider together with a vehicle of a family, as one mesh."""
        group = next(g for g, families in self.ridden.items() if family in families.shares())
        vehicle = self.ridden[group].thing(family, variant)
        alone = self.rider_of(vehicle, variant)
        low, high = self._both(alone)
        length, width, height = (round(float(v), 3) for v in high - low)
        return replace(alone, size_m=(length, width, height), vehicle_shown=True)

    def rider_of(self, vehicle: Thing, variant: int) -> Rider:
        """Return the rider of a vehicle. The same variant gives the same rider.

        Raises
        ------
        ValueError
            If things of the vehicle's group have no riders.
        """
        if vehicle.group not in self.ridden:
            expected = ", ".join(self.ridden)
            raise ValueError(
                f"a thing of the group {vehicle.group!r} has no rider; expected one of {expected}"
            )
        low, high = self._figure(vehicle, variant).extent()
        x, y, z = (float(v) for v in (low + high) / 2)
        length, width, height = (round(float(v), 3) for v in high - low)
        return Rider(
            vehicle.family,
            variant,
            "person",
            (length, width, height),
            GROUP,
            vehicle=vehicle,
            centre_m=(x, y, z),
        )

    def build(self, thing: Thing, detail: Detail) -> Assembly:
        """Return the mesh of a rider alone, in the vehicle's coordinates, or of both, centred."""
        if not isinstance(thing, Rider) or thing.vehicle is None:
            raise ValueError(f"the thing is of the group {thing.group!r}; expected a rider")
        person = self._figure(thing.vehicle, thing.variant).assembly(detail, standing=False)
        if not thing.vehicle_shown:
            return person
        vehicle = self.ridden[thing.vehicle.group].build(thing.vehicle, detail)
        low, high = self._both(thing)
        x, y, _ = -(low + high) / 2
        return Assembly(thing.family, [*vehicle.parts, *person.parts]).moved(shift(x, y, 0.0))

    def _both(self, rider: Rider) -> tuple[np.ndarray, np.ndarray]:
        """Return the box around vehicle and rider, in the vehicle's coordinates."""
        vehicle = rider.vehicle
        assert vehicle is not None
        half = np.array(vehicle.size_m) / 2
        low, high = self._figure(vehicle, rider.variant).extent()
        low = np.minimum(low, [-half[0], -half[1], 0.0])
        return low, np.maximum(high, [half[0], half[1], vehicle.size_m[2]])

    def _figure(self, vehicle: Thing, variant: int) -> Figure:
        position = vehicle.riding or self.ridden[vehicle.group].riding_position(vehicle)
        kind = read(FILE)["kinds"].get(vehicle.family, vehicle.group)
        return _figure(kind, vehicle.family, position, variant)


@lru_cache(maxsize=128)
def _figure(kind: str, family: str, position: RidingPosition, variant: int) -> Figure:
    """Return the shapes of a rider, in the coordinates of the vehicle."""
    rng = generator(f"rider of {family}", variant)
    ranges = read(FILE)[kind]
    look = look_of(one_of(ranges["people"], rng), rng, one_of(ranges["outfits"], rng))
    hat = one_of(ranges["hats"], rng)
    colour = one_of(ranges["hat_colours"], rng)
    if hat in ("cap", "beanie"):
        colour = look.head.hat_material
    head = replace(look.head, hat=hat, hat_material=colour)
    carried = one_of(ranges["carried"], rng)
    body, joints = seated(replace(look.body, stoop_deg=STOOP_DEG), position)
    return figure_of(replace(look, body=body, head=head, carried=carried), joints, family)
