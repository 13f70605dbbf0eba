"""Signs: at crosswalks, stops, curves and road works, and at random places along the road."""

from __future__ import annotations

import numpy as np

from ..roads.road import Road
from ..things import names
from ..things.furniture.sign_faces import sign_data
from .living import crosswalks
from .site import Foot, Site

BESIDE_M = 0.9  # least distance from the road's edge to the middle of a sign
MOTORWAY_BESIDE_M = 2.6  # the same distance on a motorway
STEP_M = (60.0, 110.0)  # least and largest distance between signs along the road
# stretch of the road, from the place of the speed limit, that is examined for a curve
CURVE_AHEAD_M = (40.0, 90.0)
CURVE_RAD = 0.45  # least turn of the road on this stretch for a warning of a curve


def place_signs(site: Site) -> int:
    """Place the signs of a road; return the number of signs placed."""
    rng = site.rng("signs")
    feet = [*_of_marks(site, rng), *_of_kind(site, rng)]
    for road in site.open_roads:
        for side in (1, -1):
            if any(_drives(road, side)):
                feet += _along(site, road, side, rng)
    return site.put_all(feet, 0.05)


def _drives(road: Road, side: int) -> list[bool]:
    lanes = road.sections[0].left if side > 0 else road.sections[0].right
    return [lane.type == "driving" for lane in lanes]


def _sign(site: Site, name: str, where: tuple[Road, int, float], rng: np.random.Generator) -> Foot:
    """Return a sign on one side of a road. It faces the traffic of that side."""
    road, side, s = where
    thing = site.stock.draw("sign", rng, name)
    beyond = MOTORWAY_BESIDE_M if road.type == "motorway" else BESIDE_M
    place = site.beside(road, side, s, max(beyond, thing.size_m[1] / 2 + 0.4))
    label = f"sign {name} {road.name} {side} {s:.0f}"
    return Foot(label, thing, place.x_m, place.y_m, place.heading_rad + np.pi)


def _along(site: Site, road: Road, side: int, rng: np.random.Generator) -> list[Foot]:
    """Return a speed limit, warnings of curves, and signs of the kind of road."""
    forward = (side < 0) == road.right_hand
    where = lambda ahead: ahead if forward else road.length_m - ahead
    kind = "motorway" if road.type == "motorway" else "urban" if site.base.urban else "rural"
    usual = [n for n in names("sign") if kind in sign_data(n)["roads"].split()]
    feet = []
    limit = f"limit_{road.speed_limit_kmh:.0f}"
    at = float(rng.uniform(48, 75))
    if limit in names("sign"):
        feet.append(_sign(site, limit, (road, side, where(at)), rng))
    turn = _turn(road, where(at + CURVE_AHEAD_M[0]), where(at + CURVE_AHEAD_M[1]))
    if not site.base.urban and abs(turn) > CURVE_RAD:
        name = "curve_left" if turn > 0 else "curve_right"
        feet.append(_sign(site, name, (road, side, where(at + 12)), rng))
    usual = [n for n in usual if not n.startswith("curve_")]
    at += float(rng.uniform(*STEP_M))
    while usual and at < road.length_m - 10:
        name = usual[int(rng.integers(len(usual)))]
        feet.append(_sign(site, name, (road, side, where(at)), rng))
        at += float(rng.uniform(*STEP_M))
    return feet


def _turn(road: Road, first_m: float, last_m: float) -> float:
    """Return the angle by which a driver turns left between two places on a road, radians.

    If the second place lies before the first, the driver goes against the reference line.
    """
    ends = road.line.at(np.clip([first_m, last_m], 0, road.length_m)).heading_rad
    return float(ends[1] - ends[0])


def _of_marks(site: Site, rng: np.random.Generator) -> list[Foot]:
    """Return signs at crosswalks, and at stop lines without signals."""
    feet = []
    signals = site.base.name == "city_crossing"
    for road, _mark in crosswalks(site):
        if road.junction or signals:
            continue
        for side in (1, -1):
            ahead = 1 if (side < 0) == road.right_hand else -1
            s = _mark.s_m - ahead * (_mark.length_m / 2 + 0.6)
            feet.append(_sign(site, "crossing_here", (road, side, s), rng))
    for road in site.open_roads:
        for mark in road.objects:
            if mark.kind == "stop_line" and not signals:
                against = mark.s_m < road.length_m / 2
                side = 1 if against == road.right_hand else -1
                name = "stop" if rng.random() < 0.5 else "yield"
                feet.append(_sign(site, name, (road, side, mark.s_m), rng))
    return feet


def _of_kind(site: Site, rng: np.random.Generator) -> list[Foot]:
    """Return the signs that belong to a kind of road, ahead of the camera's car."""
    road = site.base.lane.road
    direction = site.base.lane.direction
    side = -1 if (direction > 0) == road.right_hand else 1
    own = float(site.base.lane.along_road(site.base.start_m))
    ahead = lambda metres: (road, side, own + direction * metres)
    told = {
        "village": (("town", 16.0),),
        "road_works": (("road_works", 14.0), ("no_overtaking", 26.0)),
        "railway_crossing": (("railway", 12.0),),
        "motorway": (("motorway_exit", 70.0),),
        "motorway_ramp": (("motorway_exit", 55.0),),
        "one_way": (("one_way", 14.0), ("ahead_only", 90.0)),
        "roundabout": (("roundabout", 20.0),),
    }
    return [
        _sign(site, name, ahead(metres), rng)
        for name, metres in told.get(site.base.name, ())
        if 2.0 < own + direction * metres < road.length_m - 2.0
    ]
