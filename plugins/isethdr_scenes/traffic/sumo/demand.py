"""Demand: vehicles for a density, the lanes on which they start, and their routes."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, field

import numpy as np

from ...placing.site import drawn_count
from ...placing.vehicles import EGO_M, dense_speed_m_s, drawn_vehicle
from ...roads.kinds import BaseRoad
from ...roads.opendrive.elements import child
from ...roads.opendrive.road_file import numbered
from ...things.stock import Stock
from ...things.thing import Thing
from .net import SumoEdge, SumoLane, SumoNet, along, edge_of, lane_types

OWN = "own"  # the vehicle of the camera
OWN_THING = Thing("own", 0, "own vehicle", (*EGO_M, 1.5), "car")
# least gap of the camera's car to a standing vehicle ahead, so that the view in front stays free
OWN_GAP_M = 5.0
# time after the start of the scene for which vehicles enter: the longest sequence, and a frame
AFTER_S = 75.0
BICYCLE_M_S = 5.0
LORRY_M_S = 25.0  # 90 km/h
# distance from a lane's start within which entering vehicles would meet the camera's car
NEAR_START_M = 60.0
CLEAR_S = 2.5  # no vehicle enters there within this time before and after the camera's car
MOST_EDGES = 60  # greatest number of edges of a route
LEAST_LANE_M = 15.0  # shorter lanes get no vehicles at the start of the simulation
EVEN = 0.5  # least gap between two entering vehicles over the mean gap
ROOM_M = 8.0  # least length of lane per vehicle at the start of the simulation
SHARES = (0.93, 1.0)  # range of the ratio of a driver's speed to the limit
MODEL = "IDM"  # car following model; the placer's traffic uses the same one
CLASSES = {
    "car": "passenger",
    "truck": "truck",
    "bus": "bus",
    "motorcycle": "motorcycle",
    "bicycle": "bicycle",
}


@dataclass(frozen=True)
class Wanted:
    """Wanted densities of traffic, and the insertion of the camera's car."""

    vehicles_per_km: float  # vehicles per km of each lane
    riders_per_km: float  # riders per km of road, both sides together
    second_s: float  # second of the simulation at which the camera's car is at the road's start
    lead_s: float = 3.0  # time before that second at which the camera's car enters the road
    forced: bool = False  # whether the camera's car enters even if others are in its place
    flow: float = 1.0  # flow of entering vehicles over that of free traffic
    stop_gap_m: float = 0.0  # distance from a junction at which the first vehicle stops at a light


@dataclass
class Demand:
    """Vehicles and their routes, as a file for SUMO."""

    things: dict[str, Thing] = field(default_factory=dict)  # things by the name of the vehicle
    types: list[ET.Element] = field(default_factory=list)
    vehicles: list[ET.Element] = field(default_factory=list)
    wanted: int = 0  # number of vehicles on all lanes at one time, without the camera's car
    wanted_riders: int = 0

    def content(self) -> bytes:
        """Return the content of the route file."""
        top = ET.Element("routes")
        top.extend(self.types)
        top.extend(sorted(self.vehicles, key=lambda node: float(node.get("depart", "0"))))
        return ET.tostring(top)


@dataclass(frozen=True, eq=False)
class _Stream:
    """The vehicles of one lane."""

    edge: SumoEdge
    lane: SumoLane
    group: str  # "" draws from all motor vehicles
    per_m: float
    speed_m_s: float


class Maker:
    """Generator of vehicles and routes."""

    def __init__(self, net: SumoNet, base: BaseRoad, stock: Stock, seed: int) -> None:
        self._net = net
        self._base = base
        self._stock = stock
        self._rng = np.random.default_rng([seed, 0x5CC0])
        self._types = lane_types(net, base.network)
        ids = numbered(base.network).items()
        self._names = {str(number): name for (kind, name), number in ids if kind == "road"}
        self._entered = {way for edge in net.edges.values() for way in edge.ways}
        self._made = Demand()

    def demand(self, wanted: Wanted) -> Demand:
        """Return the vehicles of a density until `second_s`, and for `AFTER_S` after it."""
        self._made = Demand()
        for stream in self._streams(wanted):
            self._fill(stream)
            if stream.edge.name not in self._entered:
                self._flow(stream, wanted)
        self._own(wanted)
        if wanted.stop_gap_m:
            for node in self._made.types:
                node.set("jmStoplineGap", f"{wanted.stop_gap_m:.2f}")
        return self._made

    def _streams(self, wanted: Wanted) -> list[_Stream]:
        dense = dense_speed_m_s(wanted.vehicles_per_km)
        lanes = [(edge, lane) for edge in self._net.edges.values() for lane in edge.lanes]
        ridden_km = sum(lane.length_m for edge, lane in lanes if self._type(edge, lane) == "biking")
        roads_km = sum(road.length_m for road in self._base.network.roads if not road.junction)
        found = []
        for edge, lane in lanes:
            if self._type(edge, lane) == "driving":
                speed = min(lane.speed_m_s, dense)
                found.append(_Stream(edge, lane, "", wanted.vehicles_per_km / 1000, speed))
            elif self._type(edge, lane) == "biking":
                per_m = wanted.riders_per_km / 1000 * roads_km / ridden_km
                found.append(_Stream(edge, lane, "bicycle", per_m, BICYCLE_M_S))
        motor = sum(s.per_m * s.lane.length_m for s in found if not s.group)
        riders = sum(s.per_m * s.lane.length_m for s in found if s.group)
        self._made.wanted = drawn_count(motor, self._rng)
        self._made.wanted_riders = drawn_count(riders, self._rng)
        return found

    def _type(self, edge: SumoEdge, lane: SumoLane) -> str:
        return self._types[edge.name, lane.index]

    def _fill(self, stream: _Stream) -> None:
        """Place the vehicles of a lane at the start of the simulation."""
        room = stream.lane.length_m
        count = drawn_count(stream.per_m * room, self._rng) if room > LEAST_LANE_M else 0
        count = min(count, int(room / ROOM_M))
        step = room / max(count, 1)
        for k in range(count):
            at = (k + 0.5 + self._rng.uniform(-0.4, 0.4)) * step
            self._vehicle(stream, 0.0, f"{max(at, 1.0):.2f}")

    def _flow(self, stream: _Stream, wanted: Wanted) -> None:
        """Let vehicles enter at the start of a lane at random times.

        They keep a least gap, so that waiting drivers find gaps.
        """
        if stream.per_m <= 0:
            return
        gap_s = 1 / (wanted.flow * stream.per_m * stream.speed_m_s)
        depart_s = -gap_s * self._rng.random()
        while depart_s < wanted.second_s + AFTER_S:
            depart_s += gap_s * (EVEN + (1 - EVEN) * self._rng.exponential())
            if depart_s > 0:
                self._vehicle(stream, depart_s, "base")

    def _vehicle(self, stream: _Stream, depart_s: float, at: str) -> None:
        route = self._route(stream.edge, stream.lane)
        if stream.group:
            thing = self._stock.draw(stream.group, self._rng)
        else:
            road = self._base.network.road(self._names[stream.lane.original.rpartition("_")[0]])
            thing = drawn_vehicle(self._stock, road.type, stream.lane.width_m, self._rng)
        name = f"{thing.group}.{len(self._made.things)}"
        self._made.things[name] = thing
        speed = stream.speed_m_s if thing.group != "truck" else min(stream.speed_m_s, LORRY_M_S)
        share = self._rng.uniform(*SHARES)
        self._made.types.append(vehicle_type(name, thing, share * speed, share))
        self._add(name, route, depart_s, (str(stream.lane.index), at))

    def _add(
        self, name: str, route: list[str], depart_s: float, place: tuple[str, str]
    ) -> ET.Element:
        node = ET.Element("vehicle")
        told = {
            "id": name,
            "type": name,
            "depart": f"{depart_s:.2f}",
            "departLane": place[0],
            "departPos": place[1],
            # at the start as fast as is safe; a vehicle that enters slowly later is in the way
            "departSpeed": "max" if depart_s == 0 else "desired",
        }
        for key, value in told.items():
            node.set(key, value)
        child(node, "route", edges=" ".join(route))
        self._made.vehicles.append(node)
        return node

    def _route(self, edge: SumoEdge, lane: SumoLane) -> list[str]:
        """Return the edges of a route that starts on a lane.

        At each junction the next edge is drawn among those that the lane leads to. The route ends
        where the net ends or all edges would repeat.
        """
        route = [edge.name]
        ways = lane.ways or edge.ways
        while len(route) < MOST_EDGES:
            onward = [way for way in ways if way not in route and self._same(edge, way)]
            if not onward:
                break
            route.append(onward[int(self._rng.integers(len(onward)))])
            ways = self._net.edges[route[-1]].ways
        return route

    def _same(self, edge: SumoEdge, way: str) -> bool:
        """Return whether two edges have a type of lane in common."""
        kinds = {self._type(edge, lane) for lane in edge.lanes}
        return bool(
            kinds & {self._type(self._net.edges[way], x) for x in self._net.edges[way].lanes}
        )

    def _own(self, wanted: Wanted) -> None:
        """Let the camera's car enter the road `lead_s` before it is at the road's start."""
        found = edge_of(self._net, self._base.network, self._base.start)
        if found is None:
            return
        edge, lane = found
        share = 0.97
        speed = min(lane.speed_m_s, dense_speed_m_s(wanted.vehicles_per_km))
        front = along(lane, self._base.pose()[:2, 3]) + EGO_M[0] / 2
        at = max(front - wanted.lead_s * share * speed, EGO_M[0])
        own = vehicle_type(OWN, OWN_THING, share * speed, share)
        own.set("minGap", f"{OWN_GAP_M:g}")
        self._made.types.append(own)
        depart = max(wanted.second_s - wanted.lead_s, 0.0)
        place = (str(lane.index), f"{min(at, lane.length_m):.2f}")
        node = self._add(OWN, self._route(edge, lane), depart, place)
        node.set("insertionChecks", "none" if wanted.forced else "collision")
        self._made.vehicles = [
            one for one in self._made.vehicles if one is node or not _before(one, node)
        ]


def _before(one: ET.Element, own: ET.Element) -> bool:
    """Return whether a vehicle enters at the place and time at which the camera's car enters near
    the start of a lane.
    """
    first = lambda node: (node.find("route").get("edges").split()[0], node.get("departLane"))
    near = float(own.get("departPos", "0")) < NEAR_START_M and one.get("departPos") == "base"
    apart = abs(float(one.get("depart", "0")) - float(own.get("depart", "0")))
    return near and first(one) == first(own) and apart < CLEAR_S


def vehicle_type(name: str, thing: Thing, speed_m_s: float, share: float) -> ET.Element:
    """Return SUMO's type of vehicle for a thing.

    Parameters
    ----------
    name : name of the type.
    thing : thing with the size and group of the vehicle.
    speed_m_s : greatest speed of the vehicle, m/s.
    share : ratio of its driver's speed to the limit of each lane.
    """
    length, width, height = thing.size_m
    node = ET.Element("vType")
    told = {
        "id": name,
        "vClass": CLASSES[thing.group],
        "length": f"{length:.3f}",
        "width": f"{width:.3f}",
        "height": f"{height:.3f}",
        "maxSpeed": f"{speed_m_s:.3f}",
        "speedFactor": f"{share:.4f}",
        "speedDev": "0",
        # waiting drivers accept gaps for which others must slow down a little
        "jmTimegapMinor": "0.3",
        "impatience": "0.5",
        "carFollowModel": MODEL,
    }
    for key, value in told.items():
        node.set(key, value)
    return node
