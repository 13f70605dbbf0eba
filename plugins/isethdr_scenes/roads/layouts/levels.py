"""Roads that cross or leave others: a bridge over a road, an exit ramp, a railway crossing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..lane_path import LaneKey
from ..network import Connection, Junction, Network
from ..profile import Profile
from ..reference_line import ReferenceLine, Stretch
from ..road import Lane, LaneSection, Link, Mark, Road, RoadObject, Structure
from .corridor import Layout, bare, land, own_lane
from .cross_section import CROWN, CrossSection, Strip, strips
from .draw import Draw
from .vertical import Vertex, grades

DECK_M = 1.0  # height of the carriageway of a bridge above its underside
EMBANKMENT = 1.7  # horizontal run of an embankment per metre of height
APPROACH_GRADE = 0.05  # grade of the road that climbs to a bridge
CREST_RADIUS_M = 1100.0
RAIL_DEPTH_M = 0.17  # depth of the ballast beside a crossing below its carriageway
EXIT_LANE_M = 3.5
GORE_M = 70.0  # length over which a ramp separates from the main road
SPIRAL_M = 50.0


def overpass(draw: Draw) -> Layout:
    """Return two roads of which one crosses the other on a bridge."""
    upper_strips = strips(draw, "right", draw.ranges["right"])
    lower_strips = strips(draw, "below", draw.ranges["below"])
    if draw.ranges["camera"] == "below":
        upper_strips, lower_strips = lower_strips, upper_strips
    lines = CrossSection.drawn(draw).lines
    above = CrossSection(upper_strips, upper_strips, lines)
    below = CrossSection(lower_strips, lower_strips, lines)
    half = draw.number("half_m")
    angle = np.radians(draw.number("angle_deg"))
    top = draw.number("clearance_m") + DECK_M
    opening = (below.half_m + 1.5 + EMBANKMENT * top) / np.sin(angle)
    opening += abs(above.half_m / np.tan(angle))
    lower = bare(draw, "below", _line_through(half, 0.0), below.section())
    upper = bare(draw, "above", _line_through(half, float(angle)), above.section())
    bridge = Structure("bridge", half - opening, 2 * opening)
    upper = replace(upper, elevation=_over(half, top), structures=(bridge,))
    network = Network((lower, upper), (), land(draw))
    camera = upper if draw.ranges["camera"] == "above" else lower
    start = half - draw.number("approach_m")
    return Layout(network, own_lane(camera, 0), start)


def _line_through(half: float, angle: float) -> ReferenceLine:
    """Return a straight line whose middle is the origin."""
    x = -half * np.cos(angle)
    y = -half * np.sin(angle)
    return ReferenceLine.of(float(x), float(y), angle, [Stretch(2 * half)])


def _over(half: float, top: float) -> Profile:
    """Return the heights of a road that climbs to `top` at its middle and comes down again."""
    g = APPROACH_GRADE
    r = CREST_RADIUS_M
    # the parabola of the crest lies r g^2 / 2 below the tip at which both grades would meet
    foot = 600.0
    climb = (top + r * g * g / 2) / g  # distance from the foot's vertex to the tip
    vertices = [Vertex(half - climb, foot), Vertex(half, r), Vertex(half + climb, foot)]
    return grades([0.0, g, -g, 0.0], vertices)


def railway(draw: Draw) -> Layout:
    """Return a road with a level crossing of a railway track."""
    cross = CrossSection.drawn(draw)
    half = draw.number("half_m")
    angle = np.radians(draw.number("angle_deg"))
    road = bare(draw, "1", _line_through(half, 0.0), cross.section())
    fade = [(-35.0, CROWN), (-8.0, 0.0), (8.0, 0.0), (35.0, CROWN)]
    crown = Profile.smooth([(half + s, fall, 0.0) for s, fall in fade])
    driving = road.sections[0].right[0]
    width = float(driving.width.at(0.0))
    stops = tuple(
        RoadObject(
            "stop_line", half + side * 6.0 / np.sin(angle), side * width / 2, 0.5, width - 0.2
        )
        for side in (-1, 1)
    )
    road = replace(road, crossfall=(crown, crown), objects=stops)
    track = (Strip("rail", 1.6), Strip("border", 1.2))
    section = CrossSection(track, track, replace(cross.lines, edges=False, centre="none")).section()
    edge = (cross.half_m + 0.4) / np.sin(angle) + abs(2.8 / np.tan(angle))
    away = edge + 2.5
    depth = [(half - away, 1.0), (half - edge, 0.0), (half + edge, 0.0), (half + away, 1.0)]
    rail = Road(
        "rail",
        _line_through(half, float(angle)),
        (replace(section, centre=()),),
        "rural",
        100.0,
        elevation=Profile.straight([(s, -RAIL_DEPTH_M * share) for s, share in depth]),
        surface="gravel",
    )
    network = Network((road, rail), (), land(draw))
    return Layout(network, own_lane(road, 0), half - draw.number("approach_m"))


def ramp(draw: Draw) -> Layout:
    """Return a motorway with an exit; the camera's car drives on the lane next to the exit lane."""
    cross = CrossSection.drawn(draw)
    ahead = draw.number("ahead_m")
    taper = draw.number("taper_m")
    lane_m = ahead - 130.0  # place at which the exit lane begins
    plain = cross.section(0.0, linked=True)
    with_exit, number = _with_exit_lane(plain, lane_m, taper)
    line = ReferenceLine.of(0.0, 0.0, 0.0, [Stretch(ahead)])
    main = at_gore(bare(draw, "1", line, plain), "end")
    main = replace(main, sections=(plain, with_exit))
    straight = ReferenceLine.of(ahead, 0.0, 0.0, [Stretch(GORE_M)])
    through = replace(
        bare(draw, "j.through", straight, plain),
        junction="j",
        predecessor=Link("road", "1", "end"),
        successor=Link("road", "2", "start"),
    )
    beyond = ReferenceLine.of(ahead + GORE_M, 0.0, 0.0, [Stretch(draw.number("beyond_m"))])
    after = at_gore(bare(draw, "2", beyond, plain), "start")
    leaving, off = _ramp_roads(draw, main, number)
    through = replace(through, sections=(_without_edge_line(plain),))
    ways = (
        Connection("1", "j.through", "start", _pairs(plain.right, number)),
        Connection("2", "j.through", "end", tuple((x.number, x.number) for x in plain.left)),
        Connection("1", "j.exit", "start", ((number, -1), (number - 1, -2))),
    )
    junction = Junction("j", ways)
    network = Network((main, after, off, through, leaving), (junction,), land(draw))
    return Layout(network, LaneKey("1", 0, number + 1), 40.0)


def at_gore(road: Road, end: str) -> Road:
    """Return the main road linked to the junction at which the ramp leaves."""
    link = Link("junction", "j")
    return replace(road, successor=link) if end == "end" else replace(road, predecessor=link)


def _with_exit_lane(plain: LaneSection, start: float, taper: float) -> tuple[LaneSection, int]:
    """Return the section with an exit lane inside the outer shoulder, and its number."""
    *inner, shoulder = plain.right
    number = shoulder.number
    width = Profile.smooth([(0.0, 0.0, 0.0), (taper, EXIT_LANE_M, 0.0)])
    exit_lane = Lane(number, "driving", width, shoulder_mark(inner[-1]), 0.0, None, -1)
    last = replace(inner[-1], marks=tuple(_blocks(m) for m in inner[-1].marks))
    shoulder = replace(shoulder, number=number - 1, predecessor=number, successor=-2)
    return replace(plain, start_m=start, right=(*inner[:-1], last, exit_lane, shoulder)), number


def shoulder_mark(lane: Lane) -> tuple[Mark, ...]:
    """Return the edge line of an outer driving lane."""
    return lane.marks


def _blocks(mark: Mark) -> Mark:
    """Return the line between main and exit lanes: broad and short dashes."""
    return mark._replace(kind="broken", dash_m=3.0, gap_m=3.0, width_m=0.30)


def _without_edge_line(plain: LaneSection) -> LaneSection:
    """Return the section whose outer edge line begins where the ramp has left."""
    *inner, last, shoulder = plain.right
    marks = tuple(m._replace(offset_m=18.0) for m in last.marks)
    return replace(plain, right=(*inner, replace(last, marks=marks), shoulder))


def _pairs(lanes: tuple[Lane, ...], exit_number: int) -> tuple[tuple[int, int], ...]:
    """Return the pairs of lanes that go straight on, without the outer shoulder: next to the exit
    lane it has another number.
    """
    return tuple((x.number, x.number) for x in lanes if x.number > exit_number)


def _ramp_roads(draw: Draw, main: Road, number: int) -> tuple[Road, Road]:
    """Return the connecting road that leaves the main road, and the ramp that continues it."""
    s = main.length_m
    inner, _ = main.borders(1, s)[number]
    x, y = main.line.points(s, inner)
    curvature = -1 / draw.number("ramp_radius_m")
    parts = [Stretch(GORE_M - SPIRAL_M + 10.0, 0.0, -0.0022), Stretch(SPIRAL_M, -0.0022, curvature)]
    line = ReferenceLine.of(float(x), float(y), 0.0, parts)
    at = np.linspace(0.0, line.length_m, 9)
    # the connecting road lies in the plane of the main road
    z = -CROWN * np.abs(line.points(at)[:, 1])
    slope = CROWN * np.sin(line.at(at).heading_rad)
    nodes = [(float(a), float(b), float(c)) for a, b, c in zip(at, z, slope)]
    edge = Mark("solid", "white", 0.15)
    shoulder = float(main.sections[1].right[-1].width.at(0.0))
    lanes = (
        Lane(-1, "driving", Profile.constant(EXIT_LANE_M), (edge,), 0.0, number, -1),
        Lane(-2, "shoulder", Profile.constant(shoulder), (), 0.0, number - 1, -2),
    )
    kerbless = Lane(1, "shoulder", Profile.smooth([(0, 0, 0), (line.length_m, 0.75, 0)]))
    centre = (edge._replace(offset_m=18.0),)
    section = LaneSection(0.0, (replace(kerbless, successor=1),), lanes, centre)
    leaving = Road(
        "j.exit",
        line,
        (section,),
        "motorway",
        draw.number("ramp_speed_limit_kmh"),
        elevation=Profile.smooth(nodes),
        crossfall=(Profile(), Profile.constant(CROWN)),
        junction="j",
        predecessor=Link("road", "1", "end"),
        successor=Link("road", "ramp", "start"),
    )
    end = line.at(line.length_m)
    on = [Stretch(draw.number("ramp_arc_m"), curvature), Stretch(40.0, curvature, 0.0), Stretch(60)]
    off_line = ReferenceLine.of(float(end.x_m), float(end.y_m), float(end.heading_rad), on)
    last = nodes[-1]
    down = [(0.0, last[1], last[2]), (60.0, last[1] - 0.8, 0.0)]
    off = replace(
        leaving,
        name="ramp",
        line=off_line,
        junction="",
        elevation=Profile.smooth(down),
        sections=(_ramp_section(section, line.length_m),),
        predecessor=Link("road", "j.exit", "end"),
        successor=None,
    )
    return leaving, off


def _ramp_section(leaving: LaneSection, length: float) -> LaneSection:
    left = replace(
        leaving.left[0],
        width=Profile.constant(float(leaving.left[0].width.at(length))),
        predecessor=1,
        successor=None,
    )
    right = tuple(replace(x, predecessor=x.number, successor=None) for x in leaving.right)
    centre = tuple(m._replace(offset_m=0.0) for m in leaving.centre)
    return LaneSection(0.0, (left,), right, centre)
