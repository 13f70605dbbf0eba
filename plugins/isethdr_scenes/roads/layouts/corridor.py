"""Corridors: one road, straight or curved, level or hilly, with a tunnel, works or a crosswalk."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..ground_height import Land
from ..lane_path import LaneKey
from ..network import Network
from ..profile import Profile
from ..reference_line import ReferenceLine, Stretch
from ..road import Lane, LaneSection, Mark, Road, RoadObject, Structure
from .cross_section import CROWN, CrossSection
from .draw import Draw
from .vertical import Vertex, grades

START_M = 40.0  # distance from the road's beginning at which the camera's car starts
# length and width of lane arrows; their spacing
ARROW_M = (4.0, 0.9)
ARROW_STEP_M = 60.0
TAPER_M = 40.0  # length over which lanes narrow before road works


class Layout:
    """A network, and where the camera's car starts in it."""

    def __init__(self, network: Network, start: LaneKey, start_m: float) -> None:
        self.network = network
        self.start = start
        self.start_m = start_m


def land(draw: Draw) -> Land:
    """Return the land of a kind."""
    material = draw.value("land", "meadow")
    return Land(draw.number("relief_m"), draw.number("ditch_m"), draw.seed, material)


def bare(draw: Draw, name: str, line: ReferenceLine, section: LaneSection) -> Road:
    """Return a road of a kind with lanes and a crown only.

    Parameters
    ----------
    draw : ranges and seed of the kind: type, speed limit and surface come from it.
    name : name of the road in its network.
    line : reference line of the road.
    section : lanes along the whole road.
    """
    return Road(
        name,
        line,
        (section,),
        draw.ranges["type"],
        draw.number("speed_limit_kmh", 50.0),
        crossfall=(Profile.constant(CROWN), Profile.constant(CROWN)),
        surface=draw.value("surface", "asphalt"),
    )


def corridor(draw: Draw) -> Layout:
    """Return one road from the ranges of a kind."""
    length = draw.number("length_m")
    stretches, bends = _plan(draw, length)
    cross = CrossSection.drawn(draw)
    road = bare(draw, "1", ReferenceLine.of(0.0, 0.0, 0.0, stretches), cross.section())
    road = replace(road, elevation=_heights(draw, length))
    if bends:
        road = _banked(draw, road, bends)
    if "tunnel_m" in draw.ranges:
        road = replace(road, structures=(_tunnel(draw),))
    if "works_m" in draw.ranges:
        road = _works(draw, road)
    road = replace(road, objects=(*road.objects, *_painted(draw, road)))
    start_m = draw.number("start_m", START_M)
    network = Network((road,), (), land(draw))
    return Layout(network, own_lane(road, 0), start_m)


def own_lane(road: Road, section: int) -> LaneKey:
    """Return the key of the outermost driving lane along +s."""
    driving = [lane.number for lane in road.sections[section].right if lane.type == "driving"]
    return LaneKey(road.name, section, min(driving))


def _plan(draw: Draw, length: float) -> tuple[list[Stretch], list[tuple[float, ...]]]:
    """Return the stretches and the bends.

    A bend is (start, start of the arc, end of the arc, end, curvature): s, m, and 1/m.
    """
    stretches: list[Stretch] = []
    bends: list[tuple[float, ...]] = []
    at = draw.number("before_m")
    side = draw.side("side")
    for k in range(int(draw.value("curves", 0))):
        ranges = {n: draw.ranges[n] for n in ("radius_m", "arc_m", "spiral_m")}
        radius, arc, spiral = (draw.one(f"{n} {k}", told) for n, told in ranges.items())
        curvature = side * (-1) ** k / radius
        before = at - sum(s.length_m for s in stretches)
        stretches += [Stretch(before)] if before > 0 else []
        stretches += [
            Stretch(spiral, 0.0, curvature),
            Stretch(arc, curvature),
            Stretch(spiral, curvature, 0.0),
        ]
        bends.append((at, at + spiral, at + spiral + arc, at + 2 * spiral + arc, curvature))
        at += 2 * spiral + arc
    rest = length - sum(s.length_m for s in stretches)
    return [*stretches, Stretch(max(rest, 20.0))], bends


def _heights(draw: Draw, length: float) -> Profile:
    """Return the heights of a level road, a grade, a hill or a crest."""
    grade = draw.number("grade")
    radius = draw.number("vertical_radius_m")
    shape = draw.value("vertical", "grade")
    if shape == "hill":
        middle = START_M + 30 + radius * grade / 2
        return grades([0.0, grade, 0.0], [Vertex(middle, radius), Vertex(length - 60, radius)])
    if shape == "crest":
        return grades([grade, -grade], [Vertex(START_M + 45 + radius * grade, radius)])
    return grades([grade], [])


def _banked(draw: Draw, road: Road, bends: list[tuple[float, ...]]) -> Road:
    """Return the road tilted inwards in its bends; in a bend the tilt replaces the crown."""
    tilt = draw.number("superelevation")
    if tilt == 0:
        return road
    banks: list[tuple[float, float]] = []
    crowns: list[tuple[float, float]] = []
    for first, arc, arc_end, last, curvature in bends:
        inward = -float(np.sign(curvature)) * float(np.arctan(tilt))
        banks += [(first, 0.0), (arc, inward), (arc_end, inward), (last, 0.0)]
        crowns += [(first, CROWN), (arc, 0.0), (arc_end, 0.0), (last, CROWN)]
    crown = _eased(crowns)
    return replace(road, superelevation=_eased(banks), crossfall=(crown, crown))


def _eased(nodes: list[tuple[float, float]]) -> Profile:
    """Return the profile through the nodes (s_m, value), with zero slope at each node."""
    rising = [n for k, n in enumerate(nodes) if k == 0 or n[0] > nodes[k - 1][0] + 1e-9]
    return Profile.smooth([(s, value, 0.0) for s, value in rising])


def _tunnel(draw: Draw) -> Structure:
    return Structure("tunnel", draw.number("tunnel_from_m"), draw.number("tunnel_m"))


def _works(draw: Draw, road: Road) -> Road:
    """Return the road with its outer lane closed; the others are narrow and marked in yellow."""
    first = draw.number("works_from_m")
    length = draw.number("works_m")
    narrow = draw.number("works_lane_m")
    before = road.sections[0]
    saved = sum(float(x.width.at(0.0)) - narrow for x in before.right if x.type == "driving")
    tapered = tuple(_linked(_tapered(lane, narrow, first)) for lane in before.right)
    broad = _changing(tapered[-1], saved, first)  # the outer shoulder takes the width lanes lose
    opening = replace(before, right=(*tapered[:-1], broad), left=tuple(map(_linked, before.left)))
    closed = tuple(_in_works(lane, narrow, before.right) for lane in opening.right)
    inside = replace(opening, start_m=first, right=closed)
    after = replace(opening, start_m=first + length, right=_widening(tapered, broad, before))
    outer = min(lane.number for lane in before.right if lane.type == "driving")
    sections = (opening, inside, after)
    road = replace(road, sections=sections)
    s = np.arange(first - 30, first + length + 1, 10.0)
    inner, outer_t = road.borders(1, s)[outer]
    closing = np.clip((s - first + 30) / 30, 0, 1)
    t = outer_t + closing * (inner - 0.35 - outer_t)
    beacons = tuple(
        RoadObject("barrier", float(a), float(b), 0.15, 0.25, 0.0, "beacon") for a, b in zip(s, t)
    )
    return replace(road, objects=beacons)


def _linked(lane: Lane) -> Lane:
    return replace(lane, predecessor=lane.number, successor=lane.number)


def _tapered(lane: Lane, narrow: float, first: float) -> Lane:
    """Return a driving lane that narrows before `first`."""
    if lane.type != "driving":
        return lane
    return _changing(lane, narrow - float(lane.width.at(0.0)), first)


def _changing(lane: Lane, by: float, first: float) -> Lane:
    """Return a lane whose width changes by `by` metres before `first`."""
    wide = float(lane.width.at(0.0))
    nodes = [(first - TAPER_M, wide, 0.0), (first, wide + by, 0.0)]
    return replace(lane, width=Profile.smooth(nodes))


def _widening(tapered: tuple[Lane, ...], broad: Lane, before: LaneSection) -> tuple[Lane, ...]:
    """Return the lanes after the works; they return to their width before the works."""
    lanes = []
    for lane, usual in zip((*tapered[:-1], broad), before.right):
        wide = float(usual.width.at(0.0))
        now = float(lane.width.at(1e6))
        lanes.append(replace(lane, width=Profile.smooth([(0.0, now, 0.0), (TAPER_M, wide, 0.0)])))
    return tuple(lanes)


def _in_works(lane: Lane, narrow: float, lanes: tuple[Lane, ...]) -> Lane:
    outermost = min(x.number for x in lanes if x.type == "driving")
    yellow = (Mark("solid", "yellow", 0.15),)
    if lane.type != "driving":
        return replace(lane, width=Profile.constant(float(lane.width.at(1e6))))
    lane = replace(lane, width=Profile.constant(narrow), marks=yellow)
    return replace(lane, type="none") if lane.number == outermost else lane


def _painted(draw: Draw, road: Road) -> list[RoadObject]:
    """Return crosswalks and lane arrows."""
    found = []
    lanes = road.borders(0, 0.0)
    if draw.value("crosswalk", 0):
        s = float(draw.rng("crosswalk at").uniform(70, 100))
        drivable = [
            t
            for lane in road.sections[0].lanes
            if lane.type in ("driving", "biking", "parking", "shoulder") and not lane.raised_m
            for t in lanes[lane.number]
        ]
        low = float(min(drivable))
        high = float(max(drivable))
        found.append(RoadObject("crosswalk", s, (low + high) / 2, 4.0, high - low - 0.3))
    if draw.value("arrows", False):
        for s in np.arange(30.0, road.length_m - 10, ARROW_STEP_M):
            for lane in road.sections[0].lanes:
                if lane.type == "driving":
                    t = float(np.mean(lanes[lane.number]))
                    turn = 0.0 if lane.number < 0 else float(np.pi)
                    found.append(RoadObject("arrow", float(s), t, *ARROW_M, turn, "straight"))
    return found
