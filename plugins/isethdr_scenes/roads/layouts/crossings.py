"""Crossings: three or four arms, a roundabout, the lanes of a car park."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..lane_path import LaneKey
from ..network import Connection, Junction, Network
from ..profile import Profile
from ..reference_line import ReferenceLine, Stretch
from ..road import Lane, LaneSection, Mark, Road, RoadObject
from .corridor import ARROW_M, Layout, bare, land
from .cross_section import CROWN, CrossSection, Strip
from .draw import Draw
from .junction import Mouth, Movement, at_junction, connecting_road, join

CROWN_FADE_M = 25.0  # length over which the crown of an arm flattens towards a junction
STOP_M = 0.5  # breadth of a stop line
WALK_M = 3.5  # breadth of a crosswalk
RING_ANGLE_DEG = 38.0  # angle at the ring's centre between an arm and its junctions with the ring
BAY_M = 2.5  # width of a parking bay


def arm(
    draw: Draw, name: str, cross: CrossSection, place: tuple[float, float], length: float
) -> Road:
    """Return a road that leads away from a junction at the origin.

    Parameters
    ----------
    draw : ranges and seed of the kind.
    name : name of the road in its network.
    cross : lanes of the road.
    place : distance of its start from the origin, m, and the direction in which it leads away,
        radians from +x to the left.
    length : length of the road, m.
    """
    distance, angle = place
    x = distance * np.cos(angle)
    y = distance * np.sin(angle)
    line = ReferenceLine.of(float(x), float(y), angle, [Stretch(length)])
    crown = Profile.smooth([(0.0, 0.0, 0.0), (CROWN_FADE_M, CROWN, 0.0)])
    road = replace(bare(draw, name, line, cross.section()), crossfall=(crown, crown))
    return at_junction(road, "start", "j")


def crossing(draw: Draw) -> Layout:
    """Return a crossing or a T-junction; the camera's car comes along the first arm."""
    cross = CrossSection.drawn(draw)
    minor = cross.changed(_without_shoulder) if draw.ranges["type"] == "rural" else cross
    skew = np.radians(draw.number("angle_deg"))
    sine = np.sin(skew)
    reach = (cross.half_m + draw.number("corner_m")) / sine + abs(np.cos(skew)) * cross.half_m
    angles = [np.pi, np.pi + skew, 0.0, skew][: int(draw.value("arms"))]
    if len(angles) == 3 and draw.side("side") > 0:
        angles[1] = skew  # the minor road joins from the left
    length = draw.number("arm_m")
    roads = []
    for k, angle in enumerate(angles):
        section = cross if k in (0, 2) else minor
        road = arm(draw, str(k + 1), section, (reach, float(angle)), length)
        stops = bool(draw.value("signals", False)) or k in (1, 3)
        roads.append(_approach(road, stops, bool(draw.value("signals", False))))
    edge = Mark("solid", "white", 0.12) if cross.lines.edges else None
    inside, junction = join("j", [Mouth(road, "start") for road in roads], edge)
    network = Network((*roads, *inside), (junction,), land(draw))
    # the arm leads outwards: its left lanes lead to the junction
    entry = max(lane.number for lane in roads[0].sections[0].left if lane.type == "driving")
    start = network.lane(LaneKey("1", 0, entry))
    return Layout(network, start.key, start.length_m - draw.number("approach_m"))


def _without_shoulder(strip: Strip) -> Strip:
    return strip if strip.type != "shoulder" else Strip("shoulder", 0.3)


def _approach(road: Road, stops: bool, walk: bool) -> Road:
    """Return an arm with its stop line, crosswalk and lane arrows before the junction."""
    lanes = road.borders(0, 0.0)
    entries = [lanes[x.number] for x in road.sections[0].left if x.type == "driving"]
    exits = [lanes[x.number] for x in road.sections[0].right if x.type == "driving"]
    low = float(min(e[0] for e in entries))
    high = float(max(e[1] for e in entries))
    objects = []
    ahead = 1.2
    if walk:
        outer = float(min(e[1] for e in exits))
        middle = (outer + high) / 2
        breadth = high - outer
        objects.append(RoadObject("crosswalk", ahead + WALK_M / 2, middle, WALK_M, breadth - 0.3))
        ahead += WALK_M + 1.0
    if stops:
        at = ahead + STOP_M / 2
        objects.append(RoadObject("stop_line", at, (low + high) / 2, STOP_M, high - low - 0.2))
    if walk and len(entries) > 1:
        for k, borders in enumerate(entries):
            shows = "straight left" if k == 0 else "straight right"
            t = float(np.mean(borders))
            for s in (14.0, 34.0):
                objects.append(RoadObject("arrow", s, t, *ARROW_M, np.pi, shows))
    return replace(road, objects=tuple(objects))


def roundabout(draw: Draw) -> Layout:
    """Return a roundabout of one lane; the camera's car comes along the first arm."""
    cross = CrossSection.drawn(draw)
    radius = draw.number("island_m")
    breadth = draw.number("ring_m")
    beta = np.radians(RING_ANGLE_DEG)
    reach = radius / np.cos(beta) + radius * np.tan(beta) + 4.0
    angles = np.array([np.pi, 1.5 * np.pi, 2 * np.pi, 2.5 * np.pi][: int(draw.value("arms"))])
    length = draw.number("arm_m")
    arms = [
        at_junction(arm(draw, str(k + 1), cross, (reach, a), length), "start", f"j{k}")
        for k, a in enumerate(angles)
    ]
    outer = tuple(
        replace(lane, number=-2 - k, marks=(), predecessor=None, successor=None)
        for k, lane in enumerate(x for x in arms[0].sections[0].right if x.type != "driving")
    )
    edge = Mark("solid", "white", 0.12)
    ring_lane = Lane(-1, "driving", Profile.constant(breadth), (edge,))
    ring_lanes = LaneSection(0.0, (), (ring_lane, *outer), (edge,))
    rings = []
    inside = []
    junctions = []
    for k, angle in enumerate(angles):
        after = angles[(k + 1) % len(angles)] + (2 * np.pi if k + 1 == len(angles) else 0.0)
        line = _ring_line(radius, angle + beta, after - beta)
        ring = bare(draw, f"ring{k}", line, ring_lanes)
        ring = replace(ring, crossfall=(Profile(), Profile()))
        ring = at_junction(ring, "start", f"j{k}")
        rings.append(at_junction(ring, "end", f"j{(k + 1) % len(angles)}"))
    for k in range(len(angles)):
        before = Mouth(rings[k - 1], "end")
        behind = Mouth(rings[k], "start")
        mouth = Mouth(arms[k], "start")
        ways = [
            Movement(before, behind, ring_lane, ring_lane, False),
            Movement(before, mouth, ring_lane, mouth.driving(False)[0], True),
            Movement(mouth, behind, mouth.driving(True)[0], ring_lane, True),
        ]
        connections = []
        for n, move in enumerate(ways):
            road = connecting_road(f"j{k}.{n}", f"j{k}", move, edge)
            inside.append(road)
            pair = (move.entry.number, -1)
            connections.append(_connection(move.incoming.road.name, road.name, pair))
        junctions.append(Junction(f"j{k}", tuple(connections)))
    network = Network((*arms, *rings, *inside), tuple(junctions), land(draw))
    start = network.lane(LaneKey("1", 0, 1))
    return Layout(network, start.key, start.length_m - draw.number("approach_m"))


def _connection(incoming: str, road: str, pair: tuple[int, int]) -> Connection:
    return Connection(incoming, road, "start", (pair,))


def _ring_line(radius: float, first_rad: float, last_rad: float) -> ReferenceLine:
    """Return an arc about the origin, counter-clockwise."""
    x = radius * np.cos(first_rad)
    y = radius * np.sin(first_rad)
    arc = Stretch(radius * (last_rad - first_rad), 1 / radius)
    return ReferenceLine.of(float(x), float(y), first_rad + np.pi / 2, [arc])


def car_park(draw: Draw) -> Layout:
    """Return a car park: a lane, and aisles off it with perpendicular bays on both sides. The
    camera's car drives along the first aisle.
    """
    cross = CrossSection.drawn(draw)
    cross = replace(cross, left=tuple(s for s in cross.left if s.type == "driving"))
    corner = draw.number("corner_m")
    bay = draw.number("bay_m")
    half = next(s.width_m for s in cross.right if s.type == "driving")
    reach = half + corner
    pitch = 2 * (half + bay) + 0.5
    pitch = max(pitch, 2 * reach + 2.0)
    count = int(draw.value("aisles"))
    ends = [-draw.number("approach_m") - reach, *(k * pitch for k in range(count))]
    ends.append(ends[-1] + reach + 25.0)
    lanes: list[Road] = []
    junctions: list[Junction] = []
    inside: list[Road] = []
    for k, (first, last) in enumerate(zip(ends, ends[1:])):
        start = first if k == 0 else first + reach
        end = last if k == count else last - reach
        line = ReferenceLine.of(start, 0.0, 0.0, [Stretch(end - start)])
        lane = replace(bare(draw, f"lane{k}", line, cross.section()), crossfall=(Profile(),) * 2)
        lane = at_junction(lane, "start", f"j{k - 1}") if k else lane
        lanes.append(at_junction(lane, "end", f"j{k}") if k < count else lane)
    aisles = [_aisle(draw, k, k * pitch, reach, (half, bay)) for k in range(count)]
    for k, aisle in enumerate(aisles):
        mouths = [Mouth(lanes[k], "end"), Mouth(lanes[k + 1], "start"), Mouth(aisle, "start")]
        roads, junction = join(f"j{k}", mouths)
        inside += roads
        junctions.append(junction)
    network = Network((*lanes, *aisles, *inside), tuple(junctions), land(draw))
    return Layout(network, LaneKey("aisle0", 1, -1), 3.0)


def _aisle(draw: Draw, k: int, x: float, y: float, widths: tuple[float, float]) -> Road:
    """Return an aisle with a short part without bays, then with bays on both sides."""
    half, bay = widths
    length = draw.number("aisle_m")
    mouth_m = 2.0
    bays = int((length - mouth_m - 1.0) / BAY_M)

    def section(start: float, strips: tuple[Strip, ...]) -> LaneSection:
        lines = replace(CrossSection.drawn(draw).lines, centre="none")
        return CrossSection(strips, strips, lines).section(start, linked=True)

    driving = Strip("driving", half)
    sections = (
        section(0.0, (driving,)),
        section(mouth_m, (driving, Strip("parking", bay))),
    )
    line = ReferenceLine.of(x, y, np.pi / 2, [Stretch(length)])
    road = replace(
        bare(draw, f"aisle{k}", line, sections[0]), sections=sections, crossfall=(Profile(),) * 2
    )
    lines = tuple(
        RoadObject("parking_line", mouth_m + 0.1 + n * BAY_M, side * (half + bay / 2), 0.12, bay)
        for n in range(bays + 1)
        for side in (1, -1)
    )
    return at_junction(replace(road, objects=lines), "start", f"j{k}")
