"""Things on pavements: bus stops, benches, bins, bollards, stands for bicycles."""

from __future__ import annotations

import numpy as np

from ..roads.free_areas import FreeArea
from .site import Foot, Site

LEAST_M = 1.7  # least width of a pavement on which things stand
DEEP_M = 3.2  # least width of a pavement with a bus stop
OUTER = 0.06  # gap between a thing and the outer edge of the pavement, m
KERB_M = 0.35  # distance from the kerb to the middle of a bollard
PER_KM = {
    "litter_bin": 14.0,
    "bench": 8.0,
    "bicycle_stand": 5.0,
    "wheeled_bin": 10.0,
    "bollard": 12.0,
}
BOLLARDS = 5
BOLLARD_STEP_M = 1.6


def place_pavement_things(site: Site) -> int:
    """Place things on the pavements of a town; return the number of things placed."""
    if not site.base.urban:
        return 0
    rng = site.rng("pavement")
    areas = [
        area
        for area in site.areas("pavement")
        if area.length_m > 8 and not area.road.junction and area.width_m(0.0) > LEAST_M
    ]
    feet: list[Foot] = []
    deep = [area for area in areas if area.width_m(0.0) > DEEP_M and area.length_m > 40]
    if deep and rng.random() < 0.7:
        area = deep[int(rng.integers(len(deep)))]
        feet.append(
            _at(site, area, ("bus_stop", 0), float(rng.uniform(15, area.length_m - 15)), rng)
        )
    for area in areas:
        for family, per_km in PER_KM.items():
            count = int(np.floor(per_km * area.length_m / 1000 + rng.random()))
            for k in range(count):
                s = float(rng.uniform(3, area.length_m - 3))
                if family == "bollard":
                    feet += _bollards(site, area, s, rng)
                else:
                    feet.append(_at(site, area, (family, k), s, rng))
    return site.put_all(feet, 0.1)


def _at(
    site: Site, area: FreeArea, what: tuple[str, int], s: float, rng: np.random.Generator
) -> Foot:
    """Return a thing at the outer edge of a pavement that faces the road.

    `what` is its family and its number, and `s` its place along the area, m.
    """
    family, number = what
    thing = site.stock.draw("furniture", rng, family)
    depth = thing.size_m[0]
    width = area.width_m(s)
    across = 1 - (depth / 2 + OUTER) / width
    x, y = area.plan(np.array(s), np.array(across))
    facing = float(area.road.line.at(area.first_m + s).heading_rad) - area.side * np.pi / 2
    name = f"{family} {area.road.name} {area.side} {area.first_m:.0f} {number}"
    return Foot(name, thing, float(x), float(y), facing)


def _bollards(site: Site, area: FreeArea, s: float, rng: np.random.Generator) -> list[Foot]:
    thing = site.stock.draw("furniture", rng, "bollard")
    feet = []
    for k in range(BOLLARDS):
        at = s + BOLLARD_STEP_M * k
        if at > area.length_m - 1:
            break
        x, y = area.plan(np.array(at), np.array(KERB_M / area.width_m(at)))
        name = f"bollard {area.road.name} {area.side} {area.first_m:.0f} {at:.0f}"
        feet.append(Foot(name, thing, float(x), float(y), 0.0))
    return feet
