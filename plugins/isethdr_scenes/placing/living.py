"""People on pavements, crosswalks and shoulders, riders, and animals beside the road."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..roads.free_areas import FreeArea
from ..roads.lane_path import LanePath
from ..roads.road import Road, RoadObject
from ..things.thing import Thing
from .shortage import Shortage
from .site import Foot, OnLane, Place, Site, drawn_count
from .vehicles import rider_foot

APART_M = 0.15  # least distance between people and everything else
CANDIDATES = 12  # number of candidate places for each thing
CROSSING_SHARE = 0.2  # share of people on crosswalks, where there are any
PETS = ("dog", "cat")  # beginnings of the names of families that walk on pavements
HERDS = ("cow", "horse", "sheep")  # beginnings of the names of families that graze on fields
# distance from a lane's edge to the middle of a rider; least length of a cycle lane
CYCLE_LANE_M = (0.75, 8.0)
LOOK_M = 0.2  # distance over which the heading of a lane is measured
FACING = 0.7  # share of people on a shoulder who face the traffic next to them
WALKING_LANE_M = 0.45  # least width of a shoulder on which people walk
Maker = Callable[[np.random.Generator], Thing]


def place_people(
    site: Site, people_per_km: float, crossing_share: float = CROSSING_SHARE
) -> Shortage:
    """Place people, a share of them on crosswalks.

    Parameters
    ----------
    site : the road being filled.
    people_per_km : people per km of road, both sides together.
    crossing_share : share of people on crosswalks, 0 to 1.
    """
    rng = site.rng("people")
    wanted = drawn_count(people_per_km * site.length_km, rng)
    placed = site.put_each(_crossing(site, rng, round(crossing_share * wanted)), APART_M)
    choices = []
    for k in range(wanted - placed):
        thing = site.stock.draw("person", rng)
        places = walking_places(site, rng, 3 * CANDIDATES)
        choices.append([Foot(f"person {k}", thing, *place, role="walking") for place in places])
    placed += site.put_each(choices, APART_M)
    return Shortage("people_per_km", "people", wanted, placed, people_per_km)


def walking_places(site: Site, rng: np.random.Generator, count: int) -> list[Place]:
    """Return places on pavements, or on shoulders and verges where there are no pavements.

    Parameters
    ----------
    site : the road being filled.
    rng : random numbers of the places.
    count : number of places to propose.
    """
    areas = site.areas("pavement")
    if areas:
        return in_areas(areas, rng, count, (0.2, 0.8), True)
    shoulders = [
        path
        for path in site.base.network.lanes(("shoulder", "border"))
        if path.road.type != "motorway"
        and not path.road.junction
        and float(path.width_m(path.length_m / 2)) >= WALKING_LANE_M
    ]
    places = in_areas(site.areas("verge"), rng, count // 2, (0.02, 0.9), True)
    if shoulders:
        places += _on_lanes(shoulders, rng, count - len(places))
    order = rng.permutation(len(places))
    return [places[k] for k in order]


def _on_lanes(paths: list[LanePath], rng: np.random.Generator, count: int) -> list[Place]:
    """Return places in the middle of lanes. A share `FACING` of them faces the traffic."""
    places = []
    for k, number in enumerate(np.bincount(rng.integers(len(paths), size=count))):
        if not number:
            continue
        path = paths[k]
        s = rng.uniform(0, path.length_m - LOOK_M, number)
        here = path.points(s)[:, :2]
        ahead = path.points(s + LOOK_M)[:, :2]
        heading = np.arctan2(*(ahead - here).T[::-1])
        heading += np.pi * (rng.random(number) < FACING)
        places += [Place(*map(float, row)) for row in np.column_stack([here, heading])]
    return places


def in_areas(
    areas: tuple[FreeArea, ...],
    rng: np.random.Generator,
    count: int,
    across: tuple[float, float],
    along: bool,
) -> list[Place]:
    """Return random places in areas. An area's share of the places is proportional to its length.

    Parameters
    ----------
    areas : free areas.
    rng : random numbers of the places.
    count : number of places.
    across : least and greatest place across an area, as shares of its width.
    along : whether the headings are along the road, either way; else they are random.
    """
    if not areas or count <= 0:
        return []
    share = np.array([a.length_m for a in areas])
    chosen = rng.choice(len(areas), count, p=share / share.sum())
    along_m = rng.uniform(0, share[chosen])
    beside = rng.uniform(*across, count)
    heading = rng.uniform(0, 2 * np.pi, count)
    if along:
        heading = np.pi * rng.integers(0, 2, count) + rng.normal(0, 0.15, count)
    out = np.empty((count, 3))
    for k in np.unique(chosen):
        here = chosen == k
        area = areas[int(k)]
        out[here, :2] = area.plan(along_m[here], beside[here])
        road = area.road.line.at(area.first_m + along_m[here]).heading_rad if along else 0.0
        out[here, 2] = heading[here] + road
    return [Place(*map(float, row)) for row in out]


def crosswalks(site: Site) -> list[tuple[Road, RoadObject]]:
    """Return a pair of road and crosswalk for each crosswalk."""
    return [
        (road, mark)
        for road in site.base.network.roads
        for mark in road.objects
        if mark.kind == "crosswalk"
    ]


def _crossing(site: Site, rng: np.random.Generator, wanted: int) -> list[list[Foot]]:
    """Return candidate places on crosswalks for each of `wanted` people."""
    walks = crosswalks(site)
    choices = []
    for k in range(wanted if walks else 0):
        thing = site.stock.draw("person", rng)
        feet = []
        for _ in range(CANDIDATES):
            road, mark = walks[int(rng.integers(len(walks)))]
            s = mark.s_m + rng.uniform(-0.4, 0.4) * mark.length_m
            t = mark.t_m + rng.uniform(-0.47, 0.47) * mark.width_m
            x, y = road.line.points(s, t)
            across = float(road.line.at(s).heading_rad) + np.pi / 2 * rng.choice([-1.0, 1.0])
            heading = across + rng.normal(0, 0.1)
            feet.append(Foot(f"crossing {k}", thing, float(x), float(y), heading, "crossing"))
        choices.append(feet)
    return choices


def place_riders(site: Site, riders_per_km: float) -> Shortage:
    """Place bicycles with riders, on cycle lanes or else at the outer edge of outermost lanes.

    Parameters
    ----------
    site : the road being filled.
    riders_per_km : riders per km of road.
    """
    rng = site.rng("riders")
    network = site.base.network
    paths = [p for p in network.lanes(("biking",)) if not p.road.junction]
    paths = [p for p in paths if p.length_m > CYCLE_LANE_M[1]]
    beside = 0.0
    if not paths:
        paths = [p for p in network.lanes() if _for_bicycles(p)]
        beside = 1.0
    wanted = drawn_count(riders_per_km * site.length_km, rng) if paths else 0
    placed = 0
    for k in range(wanted):
        thing = site.stock.draw("bicycle", rng)
        feet = [_riding(f"bicycle {k}", thing, paths, beside, rng) for _ in range(CANDIDATES)]
        fine = site.allowed(feet)
        placed += any(
            ok and site.put_pair(foot, rider_foot(foot, rng), APART_M)
            for foot, ok in zip(feet, fine)
        )
    return Shortage("riders_per_km", "riders", wanted, placed, riders_per_km)


def _riding(
    name: str, thing: Thing, paths: list[LanePath], beside: float, rng: np.random.Generator
) -> Foot:
    """Return a bicycle on one of the lanes, in its middle (`beside` 0) or at its outer edge (1),
    which is the right one, or the left one in left-hand traffic.
    """
    path = paths[int(rng.integers(len(paths)))]
    s = float(rng.uniform(2.0, path.length_m - 2.0))
    room = float(path.width_m(s)) / 2 - CYCLE_LANE_M[0]
    outwards = -1.0 if path.road.right_hand else 1.0
    aside = outwards * beside * max(room, 0.0) + float(rng.uniform(-0.1, 0.1))
    pose = path.at(s, aside)
    return Foot(
        name,
        thing,
        float(pose[0, 3]),
        float(pose[1, 3]),
        float(np.arctan2(pose[1, 0], pose[0, 0])),
        "riding",
        ("bike_front", "bike_tail"),
        lean="surface",
        road=path.road.name,
        level=int(path.road.on_structure("bridge", float(path.along_road(s)))),
        lane=OnLane(path.key, s, aside),
    )


def _for_bicycles(path: LanePath) -> bool:
    """Return whether bicycles ride on a lane: the outermost of its direction, not on a motorway."""
    if path.road.type == "motorway" or path.road.junction or path.length_m < 10.0:
        return False
    side = path.lane.number > 0
    driving = [
        abs(lane.number)
        for lane in path.road.sections[path.section].lanes
        if lane.type == "driving" and (lane.number > 0) == side
    ]
    return abs(path.lane.number) == max(driving)


def place_animals(site: Site, animals_per_km: float) -> Shortage:
    """Place animals: wild animals on verges and fields, herds on fields, pets on pavements.

    Parameters
    ----------
    site : the road being filled.
    animals_per_km : animals per km of road.
    """
    rng = site.rng("animals")
    wanted = drawn_count(animals_per_km * site.length_km, rng)
    families = site.stock.names("animal")
    pets = [f for f in families if f.startswith(PETS)]
    herds = [f for f in families if f.startswith(HERDS)]
    wild = [f for f in families if f not in pets and f not in herds]
    pavements, verges, fields = (site.areas(k) for k in ("pavement", "verge", "field"))
    groups = [(pets, pavements, (0.2, 0.8), 1.0)] if pavements else []
    if not site.base.urban:
        groups += [(wild, verges, (0.3, 0.95), 2.0), (wild, fields, (0.0, 0.4), 1.0)]
        groups += [(herds, fields, (0.15, 0.9), 1.0)]
    groups = [g for g in groups if g[0] and g[1]]
    if not groups:
        # a town without pets has no animals, which is not a shortage
        return Shortage("animals_per_km", "animals", 0, 0, animals_per_km)
    weights = np.array([g[3] for g in groups])
    choices = []
    for k in range(wanted):
        kinds, areas, across, _ = groups[int(rng.choice(len(groups), p=weights / weights.sum()))]
        thing = site.stock.draw("animal", rng, kinds[int(rng.integers(len(kinds)))])
        places = in_areas(areas, rng, CANDIDATES, across, areas is pavements)
        choices.append([Foot(f"animal {k}", thing, *place, role="walking") for place in places])
    placed = site.put_each(choices, APART_M)
    return Shortage("animals_per_km", "animals", wanted, placed, animals_per_km)
