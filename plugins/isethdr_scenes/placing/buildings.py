"""Buildings along the roads: rows in cities, gardens in villages, farms in the country."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..roads.road import Road
from .boxes import corners
from .site import Foot, Site

FENCES = ("picket_fence", "mesh_fence", "garden_wall")
FENCE_BESIDE_M = 0.35  # distance from the road's edge to the middle of a fence
FLAT_M = 0.9  # largest difference of ground height among the corners of a building


@dataclass(frozen=True)
class Row:
    """Buildings along a kind of road: families, setback, gaps and fences."""

    families: tuple[str, ...]
    setback_m: tuple[float, float]  # least and largest distance from the road's edge to the eaves
    gap_m: tuple[float, float]  # least and largest distance between two buildings
    fenced: float = 0.0  # probability that a side of a road has a fence


CITY = Row(("apartments", "shop", "office", "apartments", "shop"), (1.2, 1.8), (0.1, 1.5))
ROWS = {
    "village": Row(("house", "house", "barn", "shop", "house"), (2.5, 7.0), (4.0, 14.0), 0.5),
    "residential": Row(("house", "house", "apartments"), (3.0, 6.0), (3.0, 9.0), 0.6),
    "cycle_street": Row(("house", "house", "apartments"), (3.0, 6.0), (3.0, 9.0), 0.5),
    "car_park": Row(("shop", "apartments", "office"), (2.0, 6.0), (6.0, 20.0)),
    "yard": Row(("barn", "office", "barn"), (1.5, 4.0), (4.0, 12.0)),
}
COUNTRY = Row(("house", "barn"), (12.0, 30.0), (60.0, 220.0))


def row_of(site: Site) -> Row:
    """Return the row of buildings for the kind of road."""
    return ROWS.get(site.base.name, CITY if site.base.urban else COUNTRY)


def place_buildings(site: Site) -> int:
    """Place buildings, and fences in front of gardens; return the number of buildings."""
    row = row_of(site)
    rng = site.rng("buildings")
    feet = []
    fences = []
    for road in site.open_roads:
        if road.type == "motorway":
            continue
        for side in (1, -1):
            feet += _along(site, road, side, row, rng)
            if rng.random() < row.fenced:
                fences += _fence(site, road, side, rng)
    flat = _flat(site, feet)
    placed = site.put_all([foot for foot, ok in zip(feet, flat, strict=True) if ok], 0.05)
    site.put_all(fences, 0.0)
    return placed


def _along(site: Site, road: Road, side: int, row: Row, rng: np.random.Generator) -> list[Foot]:
    """Return buildings along one side of a road, with their fronts towards it."""
    feet: list[Foot] = []
    s = float(rng.uniform(0, row.gap_m[1]))
    while s < road.length_m:
        thing = site.stock.draw("building", rng, row.families[int(rng.integers(len(row.families)))])
        depth, width, _ = thing.size_m
        middle = s + width / 2
        if middle + width / 2 > road.length_m:
            break
        setback = float(rng.uniform(*row.setback_m))
        place = site.beside(road, side, middle, setback + depth / 2)
        facing = float(road.line.at(middle).heading_rad) - side * np.pi / 2
        name = f"{thing.family} {road.name} {side} {len(feet)}"
        feet.append(Foot(name, thing, place.x_m, place.y_m, facing))
        s += width + float(rng.uniform(*row.gap_m))
    return feet


def _flat(site: Site, feet: list[Foot]) -> np.ndarray:
    """Return which buildings stand on ground that is nearly level."""
    if not feet:
        return np.zeros(0, bool)

    points = corners(np.concatenate([foot.boxes() for foot in feet]))[:, :4]
    z = site.base.network.height(points[..., 0], points[..., 1])
    return np.ptp(z, axis=1) < FLAT_M


def _fence(site: Site, road: Road, side: int, rng: np.random.Generator) -> list[Foot]:
    """Return the panels of a fence, with gaps for gates."""
    family = FENCES[int(rng.integers(len(FENCES)))]
    row = Panels(family, side, FENCE_BESIDE_M, (2.0, road.length_m - 2.0), gaps=0.12)
    return panels(site, road, row, rng)


@dataclass(frozen=True)
class Panels:
    """A row of panels, placed end to end along a road."""

    family: str  # family of the group `barrier`
    side: int  # 1 is left of the road, -1 right
    beside_m: float  # distance from the road's edge to the middle of the panels
    span_m: tuple[float, float]  # places along the road where the row begins and ends
    gaps: float = 0.0  # probability that a panel is left out


def panels(site: Site, road: Road, row: Panels, rng: np.random.Generator) -> list[Foot]:
    """Return the panels of a row.

    Parameters
    ----------
    site : site with the stock and the places beside the road.
    road : road of the row.
    row : family, side, ends along the road, distance from it, and probability of gaps.
    rng : random numbers of the gaps.
    """
    thing = site.stock.draw("barrier", rng, row.family)
    step = thing.size_m[1]
    feet = []
    for k, s in enumerate(np.arange(row.span_m[0] + step / 2, row.span_m[1] - step / 2, step)):
        if rng.random() < row.gaps:
            continue
        ends = [site.beside(road, row.side, float(s + d * step / 2), row.beside_m) for d in (-1, 1)]
        x = (ends[0].x_m + ends[1].x_m) / 2
        y = (ends[0].y_m + ends[1].y_m) / 2
        # the y axis of a panel runs along the road, and its x axis points to the road
        along = np.arctan2(ends[1].y_m - ends[0].y_m, ends[1].x_m - ends[0].x_m)
        facing = float(along) - row.side * np.pi / 2
        name = f"{row.family} {road.name} {row.side} {k}"
        feet.append(Foot(name, thing, x, y, facing, lean="line"))
    return feet
