"""Passenger cars and vans: shapes drawn from the ranges of `data/cars.yaml`, and their meshes."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...geometry.mesh.piece import Assembly
from ...geometry.vehicles import car
from ...geometry.vehicles.car_shapes import Car, Front
from ..detail import finished
from ..ranges import drawn, generator, one_of, read
from ..thing import Detail, Thing

FILE = "cars.yaml"
PLATE_M = 0.0425  # length by which plates extend beyond either end of the body
MIRROR_M = 0.165  # width by which mirrors extend beyond either side of the body
CELL_M: dict[Detail, float] = {"middle": 0.05, "far": 0.10}


def shares() -> dict[str, float]:
    """Return the families with their shares of the traffic."""
    return {name: family["share"] for name, family in read(FILE)["families"].items()}


@lru_cache(maxsize=256)
def thing(family: str, variant: int) -> Thing:
    """Return a car; its mesh is not built."""
    shape = shape_of(family, variant)
    top = max(z for _, z in shape.roof)
    size = (shape.length + 2 * PLATE_M, shape.width + 2 * MIRROR_M, top)
    return Thing(family, variant, "car", size, "car", shape.paint)


@lru_cache(maxsize=256)
def shape_of(family: str, variant: int) -> Car:
    """Return the shape of a car.

    In the file, u is a share of the length and z a share of the height. `tail_lamp` is in shares of
    half the width and of the height.
    """
    rng = generator(family, variant)
    given = drawn(read(FILE)["families"][family], rng)
    length = given["length_m"]
    width = given["width_m"]
    height = given["height_m"]
    along = lambda points: tuple((u * length, z * height) for u, z in points)
    return Car(
        length=length,
        width=width,
        wheelbase=given["wheelbase"] * length,
        overhang=given["overhang"] * length,
        tyre=given["tyre_m"],
        clearance=given["clearance_m"],
        roof=along(given["roof"]),
        belt=along(given["belt"]),
        doors=tuple(u * length for u in given["doors"]),
        glass_end=given["glass_end"] * length,
        tail_lamp=tuple((y * width / 2, z * height) for y, z in given["tail_lamp"]),
        crown=given["crown"],
        lean=given["lean"],
        cladding=given.get("cladding_m", 0.0),
        rails=given.get("rails", False),
        panel=given.get("panel", False),
        aerial=False,
        two_doors=given.get("two_doors", False),
        open_roof=given.get("open_roof", False),
        bed=given.get("bed_m", 0.0),
        rows=given.get("rows", 2),
        grille=given.get("grille_m", (0.43, 0.13)),
        paint=one_of(given.get("paints", read(FILE)["paints"]), rng),
        spokes=int(rng.integers(5, 11)),
        front=_front(given.get("front", {}), rng),
    )


def _front(given: dict[str, dict[str, float]], rng: np.random.Generator) -> Front:
    """Return the shapes of a front, drawn by the shares of the family or else of all cars."""
    usual: dict[str, dict[str, float]] = read(FILE)["front"]
    chosen = {part: one_of(given.get(part, shares), rng) for part, shares in usual.items()}
    return Front(**chosen)


def build(thing: Thing, detail: Detail) -> Assembly:
    """Return the mesh of a car."""
    shape = shape_of(thing.family, thing.variant)
    built = car.build(shape, thing.family, coarse=detail == "far")
    return finished(built, CELL_M.get(detail))
