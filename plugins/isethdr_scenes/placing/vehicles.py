"""Vehicles in the lanes: gaps by density and speed, brake lights, indicators, queues at signals."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..placement import BRAKING, DRIVING
from ..roads.lane_path import LanePath
from ..roads.road import RoadType
from ..things import rider_of
from ..things.registry import RIDDEN
from ..things.stock import Stock
from ..things.thing import Thing
from .shortage import Shortage
from .site import Foot, OnLane, Site, drawn_count

EGO_M = (4.6, 1.9)  # length and width of the camera's car
# free length of its lane ahead of it, measured from 2 m behind its front end
EGO_AHEAD_M = 8.0
EGO_BEHIND_M = 4.0  # free length of its lane behind its rear end
STANDSTILL_M = 2.0  # distance between two standing vehicles
HEADWAY_S = 1.2  # time gap of dense traffic
VEHICLE_GAP_M = 0.25  # least distance between any two vehicles
# distance from the end of a lane to vehicles that wait for green, behind crosswalk and stop line
STOP_M = 6.5
NEAR_JUNCTION_M = 30.0
TRIES = 30
LONG = ("truck", "bus")  # groups of long vehicles
LEAST_LANE_M = 20.0  # least free length of a lane that is filled
# shares of the groups by type of road
MIX: dict[str, dict[str, float]] = {
    "rural": {"car": 0.84, "truck": 0.10, "bus": 0.02, "motorcycle": 0.04},
    "town": {"car": 0.84, "truck": 0.05, "bus": 0.05, "motorcycle": 0.06},
    "motorway": {"car": 0.80, "truck": 0.17, "bus": 0.02, "motorcycle": 0.01},
    "lowSpeed": {"car": 0.95, "motorcycle": 0.05},
}


@dataclass(frozen=True)
class Flow:
    """The traffic of one lane."""

    path: LanePath
    first_m: float  # place along the lane where the filled part begins
    last_m: float  # place where it ends
    speed_m_s: float
    red: bool = False  # whether a signal at its end is red
    ends: bool = False  # whether it ends at a junction

    @property
    def length_m(self) -> float:
        """Return the length of the filled part of the lane, m."""
        return self.last_m - self.first_m


def place_vehicles(site: Site, vehicles_per_km: float, red: frozenset[str]) -> Shortage:
    """Place the moving vehicles on all lanes outside junctions, and a few inside them.

    Parameters
    ----------
    site : the road.
    vehicles_per_km : vehicles per km of each lane.
    red : names of the roads with a red signal.
    """
    rng = site.rng("vehicles")
    wanted = placed = 0
    inside = []
    for path in site.base.network.lanes():
        reach = _reach(site, path)
        if reach is None:
            continue
        if path.road.junction:
            inside.append((path, *reach))
            continue
        successors = site.base.network.successors(path.key)
        ends = any(site.base.network.lane(key).road.junction for key in successors)
        limit = path.road.speed_limit_kmh / 3.6
        speed = min(limit, dense_speed_m_s(vehicles_per_km))
        flow = Flow(path, *reach, speed, path.road.name in red and ends, ends)
        room = sum(b - a for a, b in _free_stretches(site, flow))
        count = drawn_count(vehicles_per_km * room / 1000, rng) if room > LEAST_LANE_M else 0
        wanted += count
        placed += _fill(site, flow, count, limit, rng)
    for path, first, last in inside:
        incoming = path.road.predecessor
        if (incoming is not None and incoming.name in red) or last - first < 8.0:
            continue
        if rng.random() < 0.5 * vehicles_per_km * (last - first) / 1000:
            s = float(rng.uniform(first, last))
            thing = drawn_vehicle(site.stock, path.road.type, float(path.width_m(s)), rng)
            _put(site, _foot(site, path, _InTraffic(thing, DRIVING), s, rng), rng)
    return Shortage("vehicles_per_km", "vehicles", wanted, placed, vehicles_per_km)


def dense_speed_m_s(vehicles_per_km: float) -> float:
    """Return the speed, m/s, at which vehicles of a lane keep the time gap of dense traffic.

    The formula assumes vehicles of 6 m length, and the gap of standing vehicles in addition.
    """
    return max(1000 / max(vehicles_per_km, 1e-6) - 6.0 - STANDSTILL_M, 0.5) / HEADWAY_S


def _reach(site: Site, path: LanePath) -> tuple[float, float] | None:
    """Return the first and the last place along a lane within reach, m; None if there is none."""
    s = np.arange(0.0, path.length_m + 1e-9, 2.0)
    near = np.flatnonzero(site.near(path.points(s)[:, :2]))
    if len(near) < 2:
        return None
    return float(s[near[0]]), float(s[near[-1]])


def _free_stretches(site: Site, flow: Flow) -> list[tuple[float, float]]:
    """Return the stretches of a lane that the camera's car leaves free, m along the lane."""
    first = flow.first_m
    last = flow.last_m
    if flow.path.key != site.base.start:
        return [(first, last)]
    own = site.base.start_m
    ahead = own + EGO_M[0] / 2 + EGO_AHEAD_M - 2.0
    behind = own - EGO_M[0] / 2 - EGO_BEHIND_M
    return [(a, b) for a, b in ((first, behind), (ahead, last)) if b - a > 3.0]


def _fill(site: Site, flow: Flow, count: int, limit: float, rng: np.random.Generator) -> int:
    """Place `count` vehicles on a lane; return how many were placed."""
    stretches = _free_stretches(site, flow)
    total = sum(b - a for a, b in stretches)
    placed = left = 0
    for k, (a, b) in enumerate(stretches):
        share = count - left if k == len(stretches) - 1 else round(count * (b - a) / total)
        left += share
        end = b - (STOP_M if flow.red and b == flow.last_m else 0.0)
        placed += _line_up(site, flow, (a, end), share, limit, rng)
    return placed


def _line_up(
    site: Site,
    flow: Flow,
    stretch: tuple[float, float],
    count: int,
    limit: float,
    rng: np.random.Generator,
) -> int:
    """Place vehicles one behind the other on a stretch; return the number of vehicles placed.

    Two vehicles are at least as far apart as standing vehicles. The remaining length is divided at
    random, as for random arrivals.
    """
    first, last = stretch
    width = float(flow.path.width_m((first + last) / 2))
    draw = lambda: drawn_vehicle(site.stock, flow.path.road.type, width, rng)
    things = [draw() for _ in range(count)]
    lengths = [thing.size_m[0] for thing in things]
    while things and sum(lengths) + STANDSTILL_M * len(things) > last - first:
        longest = int(np.argmax(lengths))
        if things[longest].group in LONG:  # in dense traffic a car replaces a long vehicle
            things[longest] = site.stock.draw("car", rng)
            lengths[longest] = things[longest].size_m[0]
            continue
        things.pop(longest)
        lengths.pop(longest)
    if not things:
        return 0
    slack = last - first - sum(lengths) - STANDSTILL_M * len(things)
    moving = min(0.6 * HEADWAY_S * flow.speed_m_s, slack / (len(things) + 1))
    random = rng.dirichlet(np.ones(len(things) + 1)) * (slack - moving * len(things))
    queued = int(rng.integers(1, len(things) + 1)) if flow.red else 0
    gaps = random[:-1] + moving + STANDSTILL_M
    if queued:
        gaps[:queued] = STANDSTILL_M + rng.uniform(0, 1.5, queued).clip(max=slack / queued)
    s = last
    placed = 0
    for k, (thing, gap) in enumerate(zip(things, gaps, strict=True)):
        front = s - (gap if k or not queued else 0.3)
        middle = front - thing.size_m[0] / 2
        s = front - thing.size_m[0]
        lamps = _lamps(flow, middle, k < queued, limit, rng)
        vehicle = _InTraffic(thing, lamps)
        placed += _try(site, flow.path, vehicle, middle, stretch, rng)
    return placed


@dataclass(frozen=True)
class _InTraffic:
    """A vehicle in traffic."""

    thing: Thing
    lamps: tuple[str, ...]  # kinds of the lamps that are on


def _try(
    site: Site,
    path: LanePath,
    vehicle: _InTraffic,
    s: float,
    stretch: tuple[float, float],
    rng: np.random.Generator,
) -> bool:
    """Place a vehicle at `s`, m, or else at a random place of its stretch; return whether."""
    half = vehicle.thing.size_m[0] / 2
    for _ in range(TRIES):
        s = float(np.clip(s, stretch[0] + half, max(stretch[1] - half, stretch[0] + half)))
        if _put(site, _foot(site, path, vehicle, s, rng), rng):
            return True
        s = float(rng.uniform(*stretch))
    return False


def _put(site: Site, foot: Foot, rng: np.random.Generator) -> bool:
    """Place a vehicle, or a two-wheeler with its rider; return whether it was placed."""
    if foot.thing.group not in RIDDEN:
        return site.put(foot, VEHICLE_GAP_M)
    return site.put_pair(foot, rider_foot(foot, rng), VEHICLE_GAP_M)


def rider_foot(foot: Foot, rng: np.random.Generator) -> Foot:
    """Return the rider of a two-wheeler, at the place of the two-wheeler."""
    rider = rider_of(foot.thing, rng)
    name = f"rider of {foot.name}"
    return replace(foot, name=name, thing=rider, lamps=(), partner=foot.name, lane=None)


def _lamps(
    flow: Flow, s: float, stands: bool, limit: float, rng: np.random.Generator
) -> tuple[str, ...]:
    """Return the kinds of the lamps that are on.

    The lamps of driving are always on. Brake lights and indicators are random. Brake lights are
    more likely in slow traffic and near a junction, indicators near a junction.
    """
    near = flow.ends and flow.last_m - s < NEAR_JUNCTION_M
    slow = 1 - min(flow.speed_m_s / limit, 1.0)
    braking = stands or rng.random() < 0.06 + 0.5 * slow + 0.35 * near
    turning = rng.random() < (0.35 if near else 0.04)
    side = ("left", "right")[int(rng.integers(2))]
    indicators = (f"indicator_front:{side}", f"indicator_rear:{side}") if turning else ()
    return (*DRIVING, *(BRAKING if braking else ()), *indicators)


def drawn_vehicle(
    stock: Stock, road_type: RoadType, width_m: float, rng: np.random.Generator
) -> Thing:
    """Return a vehicle for a lane, drawn from the mix of a type of road.

    Up to four vehicles are drawn until one is narrow enough for the lane.

    Parameters
    ----------
    stock : vehicles that may be drawn.
    road_type : type of the road, which sets the shares of the groups.
    width_m : width of the lane, m.
    rng : random numbers of the draw.
    """
    mix = MIX[road_type]
    share = np.array(list(mix.values()))
    thing = stock.draw("car", rng)
    for _ in range(4):
        group = list(mix)[int(rng.choice(len(mix), p=share / share.sum()))]
        thing = stock.draw(group, rng)
        if thing.size_m[1] < width_m + 0.1:
            break
    return thing


def _foot(
    site: Site, path: LanePath, vehicle: _InTraffic, s: float, rng: np.random.Generator
) -> Foot:
    """Return a vehicle on a lane, at a random offset from the lane's middle."""
    thing = vehicle.thing
    room = max(0.0, float(path.width_m(s)) - thing.size_m[1]) / 2
    aside = float(rng.uniform(-1, 1)) * min(room, 0.15)
    pose = path.at(s, aside)
    on_bridge = bool(path.road.on_structure("bridge", float(path.along_road(s))))
    return Foot(
        f"{thing.group} {len(site.feet)}",
        thing,
        float(pose[0, 3]),
        float(pose[1, 3]),
        float(np.arctan2(pose[1, 0], pose[0, 0])),
        "driving",
        vehicle.lamps,
        lean="surface",
        road=path.road.name,
        level=int(on_bridge),
        lane=OnLane(path.key, s, aside),
    )
