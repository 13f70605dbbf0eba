"""Junctions: roads that connect the lanes of several road ends, with kerbs around the corners.

Traffic is right-hand. A driver who comes in from one road end has the next end, counted
counter-clockwise, on the right. The connecting road between these two ends carries the pavement of
the corner.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from isethdr_core.errors import ConfigError

from ..network import Connection, Junction
from ..profile import Profile
from ..reference_line import ReferenceLine, Stretch
from ..road import End, Lane, LaneSection, Link, Mark, Road

STRAIGHT_RAD = 0.3  # a movement that turns less counts as straight on
PARALLEL_RAD = 1e-6  # directions that differ by less are parallel
MOST_TURN_RAD = np.pi / 2  # largest turn of one of the two arcs of a movement straight on
TINY_M = 1e-6


class Pose(NamedTuple):
    """A place in plan, and the direction of the traffic there."""

    x_m: float
    y_m: float
    heading_rad: float


@dataclass(frozen=True)
class Mouth:
    """An end of a road at a junction. Inward traffic runs towards the junction."""

    road: Road
    end: End

    @property
    def s_m(self) -> float:
        """Return the place of the end along the road's reference line."""
        return 0.0 if self.end == "start" else self.road.length_m

    @property
    def section(self) -> LaneSection:
        """Return the section of lanes at the end."""
        return self.road.sections[0 if self.end == "start" else -1]

    @property
    def outward_rad(self) -> float:
        """Return the direction away from the junction."""
        heading = float(self.road.line.at(self.s_m).heading_rad)
        return heading if self.end == "start" else heading + np.pi

    def side(self, inward: bool) -> tuple[Lane, ...]:
        """Return the lanes, from the middle outwards, on the side of the traffic towards the
        junction or away from it.
        """
        # right lanes run along +s: at the start of a road they lead away from the junction
        left = inward == (self.end == "start")
        return self.section.left if left else self.section.right

    def driving(self, inward: bool) -> list[Lane]:
        """Return the driving lanes of one direction from the middle outwards."""
        return [lane for lane in self.side(inward) if lane.type == "driving"]

    def width(self, lane: Lane) -> float:
        """Return the width of a lane at the end, m."""
        at = len(self.road.sections) - 1 if self.end == "end" else 0
        return float(lane.width.at(self.s_m - self.road.span(at)[0]))

    def inner_border(self, lane: Lane, inward: bool) -> Pose:
        """Return the end of a lane's inner border, with the direction of its traffic."""
        at = len(self.road.sections) - 1 if self.end == "end" else 0
        inner, _ = self.road.borders(at, self.s_m)[lane.number]
        x, y = self.road.line.points(self.s_m, inner)
        return Pose(float(x), float(y), self.outward_rad + (np.pi if inward else 0.0))


def turn_rad(start: float, end: float) -> float:
    """Return the turn from one heading to another, -pi to pi."""
    return float((end - start + np.pi) % (2 * np.pi) - np.pi)


def way(start: Pose, end: Pose) -> ReferenceLine:
    """Return the path from one pose to another: a straight line, an arc and a straight line. A
    movement straight on consists of two arcs if the straight lines through its poses do not meet
    between them.

    Raises
    ------
    ConfigError : the straight lines through the poses of a turn do not meet ahead of the start and
        before the end, or the end of a movement straight on lies far to the side or behind the
        start.
    """
    turn = turn_rad(start.heading_rad, end.heading_rad)
    dx = end.x_m - start.x_m
    dy = end.y_m - start.y_m
    cos = np.cos(start.heading_rad)
    sin = np.sin(start.heading_rad)
    ahead = dx * cos + dy * sin
    aside = dy * cos - dx * sin
    stretches = _line_and_arc(ahead, aside, turn) if abs(turn) >= PARALLEL_RAD else None
    if stretches is None and abs(turn) < STRAIGHT_RAD:
        stretches = _two_arcs(ahead, aside, turn)
    if stretches is None:
        raise ConfigError(
            "a junction cannot be built: two of its roads end beyond the point where their"
            " lanes meet; expected roads that end before it; type another scene.seed"
        )
    kept = [s for s in stretches if s.length_m > TINY_M]
    return ReferenceLine.of(*start, kept)


def _line_and_arc(ahead: float, aside: float, turn: float) -> list[Stretch] | None:
    """Return a straight line, an arc and a straight line; None if the straight lines do not meet
    ahead of the start and before the end.

    Parameters
    ----------
    ahead, aside : place of the end from the start, m, along its direction and to the left of it.
    turn : direction of the end from that of the start, rad; not 0.
    """
    # distances from the start and from the end to the point where both straight lines meet
    second = aside / np.sin(turn)
    first = ahead - second * np.cos(turn)
    # the arc is as wide as possible: it begins or ends at the nearer of the two poses
    tangent = min(first, second)
    if tangent <= 0:
        return None
    curvature = np.tan(abs(turn) / 2) / tangent * np.sign(turn)
    arc = Stretch(abs(turn / curvature), curvature)
    return [Stretch(first - tangent), arc, Stretch(second - tangent)]


def _two_arcs(ahead: float, aside: float, turn: float) -> list[Stretch] | None:
    """Return two arcs with one tangent where they meet (a biarc with control points at equal
    distances from both ends). Return None if the end does not lie ahead of the start, or if an
    arc would turn by more than `MOST_TURN_RAD`.

    Parameters
    ----------
    ahead, aside, turn : as in `_line_and_arc`; the turn may be 0.
    """
    if abs(aside) < TINY_M and abs(turn) < PARALLEL_RAD:
        return [Stretch(ahead)]
    if ahead <= 0:
        return None
    end = complex(ahead, aside)
    direction = complex(np.cos(turn), np.sin(turn))
    # distance d of the control points: |end - d (1 + direction)| = 2 d. This form of the root has
    # no difference of nearly equal numbers if the ends are almost parallel.
    along = 2 * (end * (1 + direction).conjugate()).real
    square = abs(end) ** 2
    root = np.sqrt(along**2 + 8 * (1 - direction.real) * square)
    distance = 2 * square / (along + root)
    middle = (end + distance * (1 - direction)) / 2
    first = float(np.angle(middle))  # an arc turns by twice the angle of its chord
    second = turn_rad(2 * first, float(np.angle(end - middle)))
    if 2 * max(abs(first), abs(second)) > MOST_TURN_RAD:
        return None
    return [_arc(abs(middle), first), _arc(abs(end - middle), second)]


def _arc(chord_m: float, angle: float) -> Stretch:
    """Return the arc with a chord of `chord_m` at `angle`, rad, to its direction at the start."""
    return Stretch(chord_m / np.sinc(angle / np.pi), 2 * np.sin(angle) / chord_m)


@dataclass(frozen=True)
class Movement:
    """A movement through a junction: from a lane of an incoming road to a lane of an outgoing
    road.
    """

    incoming: Mouth
    outgoing: Mouth
    entry: Lane
    exit: Lane
    corner: bool  # the connecting road carries the shoulder and the pavement of a corner


def connecting_road(name: str, junction: str, move: Movement, edge_line: Mark | None) -> Road:
    """Return the road that leads one lane through a junction.

    Its reference line is the inner border of the lane, so that all of its lanes lie on the right.

    Parameters
    ----------
    name : name of the new road.
    junction : name of the junction that the road belongs to.
    move : lanes that the road connects.
    edge_line : mark at the outer border of a turn at a corner; None: no mark.
    """
    start = move.incoming.inner_border(move.entry, True)
    line = way(start, move.outgoing.inner_border(move.exit, False))
    length = line.length_m
    widths = move.incoming.width(move.entry), move.outgoing.width(move.exit)
    lanes = [
        Lane(
            -1,
            "driving",
            _between(*widths, length),
            (edge_line,) if edge_line and move.corner else (),
            0.0,
            move.entry.number,
            move.exit.number,
        )
    ]
    if move.corner:
        lanes += _outside(move, length)
    template = move.incoming.road
    return Road(
        name,
        line,
        (LaneSection(0.0, (), tuple(lanes)),),
        template.type,
        template.speed_limit_kmh,
        junction=junction,
        predecessor=Link("road", move.incoming.road.name, move.incoming.end),
        successor=Link("road", move.outgoing.road.name, move.outgoing.end),
        surface=template.surface,
    )


def _between(first: float, last: float, length: float) -> Profile:
    """Return a width that changes smoothly from `first` to `last` over a length, all in m."""
    if abs(first - last) < 1e-9:
        return Profile.constant(first)
    return Profile.smooth([(0.0, first, 0.0), (length, last, 0.0)])


def _outside(move: Movement, length: float) -> list[Lane]:
    """Return the lanes beyond the outermost driving lane, such as shoulder and pavement.

    Lanes of the two roads are paired by type, from the middle outwards. A lane without a partner
    ends at the junction.

    Parameters
    ----------
    move : movement at a corner.
    length : length of the connecting road, m.
    """
    ins = _outer(move.incoming.side(True))
    outs = _outer(move.outgoing.side(False))
    lanes: list[Lane] = []
    for lane in ins:
        partner = next((o for o in outs if o.type == lane.type), None)
        if partner is None:
            continue
        outs = outs[outs.index(partner) + 1 :]
        widths = move.incoming.width(lane), move.outgoing.width(partner)
        lanes.append(
            Lane(
                -2 - len(lanes),
                lane.type,
                _between(*widths, length),
                (),
                lane.raised_m,
                lane.number,
                partner.number,
            )
        )
    return lanes


def _outer(lanes: Sequence[Lane]) -> list[Lane]:
    """Return the lanes beyond the last driving lane, from the middle outwards."""
    last = max((k for k, lane in enumerate(lanes) if lane.type == "driving"), default=-1)
    return list(lanes[last + 1 :])


def movements(mouths: Sequence[Mouth]) -> list[Movement]:
    """Return all movements through a junction: left turns from the innermost lane, right turns from
    the outermost lane. Straight on, lanes are paired from the middle outwards; a lane without a
    partner has no movement.
    """
    order = sorted(mouths, key=lambda m: m.outward_rad % (2 * np.pi))
    found = []
    for k, incoming in enumerate(order):
        for j in range(1, len(order)):
            outgoing = order[(k + j) % len(order)]
            entries = incoming.driving(True)
            exits = outgoing.driving(False)
            if not entries or not exits:
                continue
            turn = turn_rad(incoming.outward_rad + np.pi, outgoing.outward_rad)
            if turn > STRAIGHT_RAD:
                pairs = [(entries[0], exits[0])]
            elif turn < -STRAIGHT_RAD:
                pairs = [(entries[-1], exits[-1])]
            else:
                pairs = list(zip(entries, exits))
            for entry, exit_ in pairs:
                corner = j == 1 and entry is entries[-1]
                found.append(Movement(incoming, outgoing, entry, exit_, corner))
    return found


def join(
    name: str, mouths: Sequence[Mouth], edge_line: Mark | None = None
) -> tuple[tuple[Road, ...], Junction]:
    """Return the connecting roads of a junction, and the junction.

    Parameters
    ----------
    name : name of the junction; the connecting roads are named after it, with a number.
    mouths : ends of the roads that meet there.
    edge_line : mark at the outer border of turns at corners; None: no mark.
    """
    roads = []
    connections = []
    for k, move in enumerate(movements(mouths)):
        road = connecting_road(f"{name}.{k}", name, move, edge_line)
        roads.append(road)
        lanes = tuple(
            (lane.predecessor, lane.number) for lane in road.sections[0].right if lane.predecessor
        )
        connections.append(Connection(move.incoming.road.name, road.name, "start", lanes))
    return tuple(roads), Junction(name, tuple(connections))


def at_junction(road: Road, end: End, name: str) -> Road:
    """Return the road linked to a junction at one of its ends.

    Parameters
    ----------
    road : any road.
    end : start or end of its reference line.
    name : name of the junction.
    """
    link = Link("junction", name)
    return replace(road, predecessor=link) if end == "start" else replace(road, successor=link)
