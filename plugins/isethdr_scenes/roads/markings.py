"""Markings: lines, crosswalks, stop lines, arrows and parking bays as painted patches of a road."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .profile import Floats
from .road import Mark, MarkColour, Road, RoadObject
from .stations import stations

BETWEEN_M = 0.12  # gap between the two lines of a double line
STRIPE_M = 0.5  # width of the painted and of the bare stripes of a crosswalk
SHAFT_M = 0.15  # width of an arrow's shaft
HEAD = 0.4  # share of the head in an arrow's length
SHORT_M = 2.0  # longest chord of a patch; a longer one could cut through a crest


class Patch(NamedTuple):
    """A painted patch of a road as quads between two sides: (s, t) at n places, (n, 2, 2), m."""

    st_m: Floats
    colour: MarkColour
    name: str


@dataclass(frozen=True)
class _Border:
    """A border of a lane with one mark."""

    road: Road
    section: int
    number: int  # number of the lane that has this outer border; 0: the middle line
    mark: Mark
    end_m: float = np.inf  # distance from the section's start at which the next mark begins

    def t(self, s: Floats) -> Floats:
        if self.number == 0:
            return self.road.lane_offset.at(s)
        return self.road.borders(self.section, s)[self.number][1]


def patches(road: Road) -> list[Patch]:
    """Return everything that is painted on a road."""
    found = []
    for k, section in enumerate(road.sections):
        marked = [(0, section.centre), *((lane.number, lane.marks) for lane in section.lanes)]
        for number, marks in marked:
            for mark in marks:
                later = [m.offset_m for m in marks if m.offset_m > mark.offset_m]
                found += _lines(_Border(road, k, number, mark, min(later, default=np.inf)))
    for painted in road.objects:
        found += _object(painted)
    return found


def _lines(border: _Border) -> list[Patch]:
    kinds = border.mark.kind.split()
    if kinds == ["none"]:
        return []
    apart = border.mark.width_m + BETWEEN_M if len(kinds) == 2 else 0.0
    shifts = (apart / 2, -apart / 2) if len(kinds) == 2 else (0.0,)
    found = []
    for kind, shift in zip(kinds, shifts):
        for s in _spans(border, kind == "broken"):
            middle = border.t(s) + shift
            half = border.mark.width_m / 2
            sides = np.stack([middle - half, middle + half], 1)
            st = np.stack([np.stack([s, s], 1), sides], -1)
            found.append(Patch(st, border.mark.colour, "line"))
    return found


def _spans(border: _Border, broken: bool) -> list[Floats]:
    """Return the stations of each dash, or of the whole line."""
    road = border.road
    mark = border.mark
    start, last = road.span(border.section)
    begun = start + mark.offset_m
    # in a section that was cut, a mark may begin before its start; then only its dashes count there
    first = max(begun, start)
    last = min(last, start + border.end_m)
    if last - first < 0.05:
        return []
    if not broken:
        return [_fine(stations(road, first, last))]
    period = mark.dash_m + mark.gap_m
    starts = np.arange(begun + mark.gap_m / 2, last - 0.2, period)
    starts = starts[starts + mark.dash_m > first + 0.2]
    return [_fine(stations(road, max(s, first), min(s + mark.dash_m, last))) for s in starts]


def _fine(s: Floats) -> Floats:
    """Return the stations with more of them where they are farther apart than `SHORT_M`."""
    parts = [np.linspace(a, b, int(np.ceil((b - a) / SHORT_M)) + 1)[:-1] for a, b in zip(s, s[1:])]
    return np.concatenate([*parts, s[-1:]])


def _object(painted: RoadObject) -> list[Patch]:
    if painted.kind == "crosswalk":
        return _crosswalk(painted)
    if painted.kind in ("stop_line", "parking_line"):
        half = painted.width_m / 2
        return [_bar(painted, -half, half, painted.kind)]
    if painted.kind == "arrow":
        return _arrow(painted)
    return []


def _bar(painted: RoadObject, low: float, high: float, name: str) -> Patch:
    """Return a bar along the road between two t relative to the object's middle."""
    count = max(2, int(np.ceil(painted.length_m / SHORT_M)) + 1)
    s = painted.s_m + np.linspace(-0.5, 0.5, count) * painted.length_m
    t = np.broadcast_to([painted.t_m + low, painted.t_m + high], (count, 2))
    return Patch(np.stack([np.stack([s, s], 1), t], -1), "white", name)


def _crosswalk(painted: RoadObject) -> list[Patch]:
    count = int((painted.width_m / STRIPE_M + 1) / 2)
    first = -(2 * count - 1) * STRIPE_M / 2
    lows = first + 2 * STRIPE_M * np.arange(count)
    return [_bar(painted, float(low), float(low) + STRIPE_M, "crosswalk") for low in lows]


def _arrow(painted: RoadObject) -> list[Patch]:
    """Return the shaft and the heads of an arrow."""
    length = painted.length_m
    width = painted.width_m
    half = SHAFT_M / 2
    neck = length * (0.5 - HEAD)
    rows: list[list[tuple[float, float]]] = []  # each quad: two corners behind, two ahead
    rows.append([(-length / 2, -half), (-length / 2, half), (neck, -half), (neck, half)])
    for way in painted.shows.split():
        if way == "straight":
            tip = length / 2
            rows.append([(neck, -width / 2), (neck, width / 2), (tip, 0.0), (tip, 0.0)])
            continue
        side = 1.0 if way == "left" else -1.0
        low = -0.1 * length
        high = 0.1 * length
        reach = side * width * 0.55
        shaft = 0.12 * length
        rows.append([(low - shaft / 2, 0), (low + shaft / 2, 0), (0.0, reach), (shaft, reach)])
        middle = shaft / 2
        tip_t = side * width
        rows.append(
            [(middle - high, reach), (middle + high, reach), (middle, tip_t)] + [(middle, tip_t)]
        )
    cos = float(np.cos(painted.heading_rad))
    sin = float(np.sin(painted.heading_rad))
    if abs(sin) < 1e-3:  # along the road or against it
        cos = float(round(cos))
        sin = 0.0
    turn = np.array([[cos, sin], [-sin, cos]])
    found = []
    for quad in rows:
        st = np.array(quad, float).reshape(2, 2, 2) @ turn + [painted.s_m, painted.t_m]
        found.append(Patch(st, "white", "arrow"))
    return found
