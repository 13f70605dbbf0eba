"""Parked vehicles: in bays along the kerb or across it, and stopped ones on hard shoulders."""

from __future__ import annotations

import numpy as np

from ..roads.lane_path import LanePath
from ..things.thing import Thing
from .site import Foot, Site

ALONG_M = 6.2  # length of a bay along the kerb
BAY_M = 2.5  # width of a bay across the kerb
BAY_START_M = 0.1  # distance of the first bay from the start of the lane
ACROSS_FROM_M = 4.0  # least width of a parking lane on which vehicles stand across
LORRIES_FROM_M = 7.5  # least width of a parking lane on which lorries stand across
LORRY_BAY_M = 4.2  # width of a bay of lorries
STOCK = 5  # number of different parked cars of a scene; each is stored once and placed many times
SHOULDER_M = 2.4  # least width of a hard shoulder on which a vehicle may stop
HAZARD = ("position", "tail", "marker", "indicator_front", "indicator_rear")


def place_parked(site: Site, share: float) -> int:
    """Park vehicles on a share of the bays; return the number of vehicles placed."""
    rng = site.rng("parked")
    stock = {
        "car": [site.stock.draw("car", rng) for _ in range(STOCK)],
        "truck": [site.stock.draw("truck", rng)],
    }
    feet = []
    for path in site.base.network.lanes(("parking",)):
        feet += _bays(path, share, stock, rng)
    if share > 0:
        feet += _stopped(site, rng)
    return site.put_all(feet, 0.05)


def _bays(
    path: LanePath, share: float, stock: dict[str, list[Thing]], rng: np.random.Generator
) -> list[Foot]:
    width = float(path.width_m(path.length_m / 2))
    if width >= LORRIES_FROM_M:
        step = LORRY_BAY_M
        group = "truck"
        across = True
    elif width >= ACROSS_FROM_M:
        step = BAY_M
        group = "car"
        across = True
    else:
        step = ALONG_M
        group = "car"
        across = False
    first, last = path.road.span(path.section)
    middles = np.arange(first + BAY_START_M + step / 2, last - step / 2, step)
    feet = []
    for k, s_road in enumerate(middles):
        if rng.random() >= share:
            continue
        thing = _fitting(stock[group], step, width, across, rng)
        if thing is None:
            continue
        s = float(path.along_lane(s_road))
        pose = path.at(s)
        turn = (np.pi / 2 if rng.random() < 0.5 else -np.pi / 2) if across else 0.0
        lamps = HAZARD if rng.random() < 0.03 else ()
        feet.append(
            _foot(
                f"parked {path.road.name} {path.lane.number} {k}",
                thing,
                pose,
                turn,
                lamps,
                path.road.name,
            )
        )
    return feet


def _fitting(
    stock: list[Thing], step: float, width: float, across: bool, rng: np.random.Generator
) -> Thing | None:
    """Return a vehicle that fits into a bay, or None."""
    room = (width, step) if across else (step - 0.8, width + 0.25)
    for _ in range(6):
        thing = stock[int(rng.integers(len(stock)))]
        # mirrors may reach over the line of a bay
        if thing.size_m[0] < room[0] and thing.size_m[1] < room[1]:
            return thing
    return None


def _stopped(site: Site, rng: np.random.Generator) -> list[Foot]:
    """Return at most one vehicle with hazard lights on a hard shoulder."""
    paths = [
        path
        for path in site.base.network.lanes(("shoulder",))
        if float(path.width_m(path.length_m / 2)) >= SHOULDER_M
    ]
    if not paths or rng.random() < 0.5:
        return []
    path = paths[int(rng.integers(len(paths)))]
    thing = site.stock.draw("car", rng)
    pose = path.at(float(rng.uniform(0.2, 0.8)) * path.length_m)
    return [_foot("stopped", thing, pose, 0.0, HAZARD, path.road.name)]


def _foot(
    name: str, thing: Thing, pose: np.ndarray, turn: float, lamps: tuple[str, ...], road: str
) -> Foot:
    heading = float(np.arctan2(pose[1, 0], pose[0, 0])) + turn
    return Foot(
        name,
        thing,
        float(pose[0, 3]),
        float(pose[1, 3]),
        heading,
        "parked",
        lamps,
        lean="surface",
        road=road,
    )
