"""Trees, bushes and rocks on fields, verges and the medians of towns; tufts of grass on verges."""

from __future__ import annotations

import numpy as np

from ..things.thing import Thing
from .living import CANDIDATES, in_areas
from .shortage import Shortage
from .site import Foot, Site, drawn_count

APART_M = 0.3
# number of different plants of each group in a scene; each is stored once and placed many times
VARIANTS = {"tree": 6, "bush": 4, "rock": 2}
SHARES = {"tree": 0.5, "bush": 0.42, "rock": 0.08}
SCALE = (0.85, 1.15)
VERGE_SHARE = 0.4  # share of bushes and rocks that stand on a verge, where there is one
MEDIAN_SHARE = 0.5  # share of the other plants of a town that stand on a median, where there is one
FIELD_ACROSS = (0.06, 1.0)  # range of places across a field, which starts 4 m beside the road
TUFTS = ("meadow", "dry grass")  # families of grass beside a road
TUFT_VARIANTS = 3  # number of different tufts of each family
TUFT_REACH_M = 60.0  # largest distance from the camera's car; further tufts are too small to see
TUFT_ACROSS = (0.03, 0.35)  # range of places of tufts across a verge


def place_plants(site: Site, plants_per_km: float) -> Shortage:
    """Place plants, `plants_per_km` of them per km of road."""
    rng = site.rng("plants")
    groups = list(SHARES)
    wanted = drawn_count(plants_per_km * site.length_km, rng)
    if not wanted:
        return Shortage("plants_per_km", "plants", 0, 0, plants_per_km)
    stock = {g: [site.stock.draw(g, rng) for _ in range(VARIANTS[g])] for g in groups}
    share = np.array([SHARES[g] for g in groups])
    feet = []
    verges, fields, medians = (site.areas(kind) for kind in ("verge", "field", "median"))
    count = CANDIDATES * wanted
    stocks = {
        "field": iter(in_areas(fields or verges, rng, count, FIELD_ACROSS, False)),
        "verge": iter(in_areas(verges, rng, count, (0.45, 1.0), False)),
        "median": iter(in_areas(medians, rng, count, (0.4, 0.6), False)),
    }
    drawn = rng.choice(len(groups), count, p=share / share.sum())
    where = rng.random((count, 2))
    for k, group in enumerate(groups[g] for g in drawn):
        kind = "field"
        if group != "tree" and verges and where[k, 0] < VERGE_SHARE:
            kind = "verge"
        elif medians and site.base.urban and where[k, 1] < MEDIAN_SHARE:
            kind = "median"
        place = next(stocks[kind], None)
        if place is not None:
            thing: Thing = stock[group][int(rng.integers(len(stock[group])))]
            scale = float(rng.uniform(*SCALE))
            feet.append(Foot(f"{group} {k}", thing, *place, scale=scale))
    placed = site.put_first(feet, wanted, APART_M)
    return Shortage("plants_per_km", "plants", wanted, placed, plants_per_km)


def place_tufts(site: Site, tufts_per_km: float, height_m: tuple[float, float]) -> int:
    """Place tufts of grass on verges where nothing else stands; return the number of tufts.

    Parameters
    ----------
    site : the road being filled.
    tufts_per_km : tufts per km of each verge.
    height_m : least and greatest height of a tuft, m.
    """
    if not tufts_per_km:
        return 0
    rng = site.rng("tufts")
    things = [site.stock.draw("grass", rng, name) for name in TUFTS for _ in range(TUFT_VARIANTS)]
    verges = site.areas("verge")
    count = drawn_count(tufts_per_km / 1000 * sum(area.length_m for area in verges), rng)
    feet = []
    for k, place in enumerate(in_areas(verges, rng, count, TUFT_ACROSS, False)):
        thing = things[int(rng.integers(len(things)))]
        scale = float(rng.uniform(*height_m)) / thing.size_m[2]
        near = np.hypot(place.x_m - site.middle[0], place.y_m - site.middle[1]) < TUFT_REACH_M
        if near:
            feet.append(Foot(f"tuft {k}", thing, *place, scale=scale))
    return site.put_all(feet)
