"""Positions of OpenSCENARIO as places in plan: on a lane, on a road, in the world.

Relative headings count from the direction of the lane's traffic in a LanePosition, and from the
direction of the road's reference line in a RoadPosition. Without an orientation they are 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..roads.lane_path import LaneKey, LanePath
from ..roads.network import Network
from ..roads.opendrive.elements import Node
from ..roads.profile import Floats
from ..roads.road import Road

KNOWN = ("LanePosition", "RoadPosition", "WorldPosition")


class Spot(NamedTuple):
    """A place in plan."""

    x_m: float
    y_m: float
    heading_rad: float
    lane: LanePath | None = None  # lane of the position, if it states one
    road: str = ""  # name of the road, if it states one
    z_m: float | None = None  # height, if it states one

    def ahead(self, x_m: float, y_m: float) -> Spot:
        """Return the place `x_m` ahead and `y_m` to the left of this one."""
        cos = np.cos(self.heading_rad)
        sin = np.sin(self.heading_rad)
        x = float(self.x_m + x_m * cos - y_m * sin)
        y = float(self.y_m + x_m * sin + y_m * cos)
        return self._replace(x_m=x, y_m=y)


def spot(node: Node, network: Network) -> Spot | None:
    """Return the place of a position element; None for a form that is not supported.

    Raises
    ------
    CatalogError : the road file has no such road or lane, or s lies beyond the road.
    """
    form = node.element.tag
    if form == "WorldPosition":
        z = node.number("z") if node.text("z", "") else None
        return Spot(node.number("x"), node.number("y"), node.number("h", 0.0), z_m=z)
    if form not in KNOWN:
        return None
    road = _road(node, network)
    s = node.number("s")
    if not 0 <= s <= road.length_m:
        raise node.error(
            f"its s is {s:g} m, but road {road.name} is {road.length_m:.1f} m long; expected 0 to"
            f" {road.length_m:.1f}"
        )
    if form == "RoadPosition":
        return _placed(node, road, s, node.number("t", 0.0), None)
    lane = _lane(node, network, road, s)
    t = float(lane.offset_m(s)) + node.number("offset", 0.0)
    return _placed(node, road, s, t, lane)


def _placed(node: Node, road: Road, s: float, t: float, lane: LanePath | None) -> Spot:
    x, y = (float(v) for v in road.line.points(s, t))
    if lane is None:
        along = float(road.line.at(s).heading_rad)
    else:
        pose = lane.at(float(lane.along_lane(s)))
        along = float(np.arctan2(pose[1, 0], pose[0, 0]))
    told = node.first("Orientation")
    turn = told.number("h", 0.0) if told else 0.0
    absolute = told is not None and told.text("type", "absolute") == "absolute"
    return Spot(x, y, turn if absolute else along + turn, lane, road.name)


def _road(node: Node, network: Network) -> Road:
    name = node.text("roadId")
    for road in network.roads:
        if road.name == name:
            return road
    raise node.error(
        f"it names road {name}, which the road file does not hold; expected one of its"
        f" {len(network.roads)} roads"
    )


def _lane(node: Node, network: Network, road: Road, s: float) -> LanePath:
    number = node.integer("laneId")
    section = road.section_at(s)
    numbers = [lane.number for lane in road.sections[section].lanes]
    if number not in numbers:
        raise node.error(
            f"it names lane {number}, but road {road.name} has lanes"
            f" {', '.join(map(str, sorted(numbers)))} at s = {s:g} m"
        )
    return network.lane(LaneKey(road.name, section, number))


def lane_below(place: Spot, network: Network) -> LanePath | None:
    """Return the lane at a place; None if the place is on no road.

    Of several lanes, driving lanes come first; among these the lane whose traffic direction is
    nearest to the heading of the place is returned.
    """
    if place.lane is not None:
        return place.lane
    point = np.array([[place.x_m, place.y_m]])
    best: tuple[bool, float] = (False, -np.inf)
    found = None
    for road in network.roads:
        s, t, beyond = (float(v[0]) for v in road.line.beside(point))
        right, left = (float(v) for v in road.edges(s))
        if beyond > 0.5 or not right <= t <= left:
            continue
        section = road.section_at(s)
        for number, (inner, outer) in road.borders(section, s).items():
            if not min(inner, outer) <= t <= max(inner, outer):
                continue
            lane = network.lane(LaneKey(road.name, section, number))
            heading = float(road.line.at(s).heading_rad) + (np.pi if lane.direction < 0 else 0.0)
            rank = lane.type == "driving", float(np.cos(heading - place.heading_rad))
            if rank > best:
                best = rank
                found = lane
    return found


def on_lane(place: Spot, lane: LanePath) -> tuple[float, float, float]:
    """Return the coordinates of a place on a lane: distance along it, m, distance to the left of
    its middle, m, and heading relative to its direction, rad.
    """
    point: Floats = np.array([[place.x_m, place.y_m]])
    s, t, _ = (float(v[0]) for v in lane.road.line.beside(point))
    along = float(lane.along_lane(s))
    aside = lane.direction * (t - float(lane.offset_m(s)))
    pose = lane.at(along)
    turn = place.heading_rad - float(np.arctan2(pose[1, 0], pose[0, 0]))
    return along, aside, float((turn + np.pi) % (2 * np.pi) - np.pi)
