"""Window: the part of a network around a place, with the links inside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..lateral_shape import LateralShape, ShapeRow
from ..network import Junction, Network
from ..profile import Floats, Profile
from ..reference_line import Curve, Record, ReferenceLine
from ..road import Lane, LaneSection, Road

STEP_M = 2.0  # spacing of the places at which distances are computed
LEAST_CUT_M = 30.0  # shorter ends are not cut off


def window(network: Network, centre: Floats, reach_m: float) -> Network:
    """Return the roads within `reach_m` of a plan point; long roads are cut at this distance.

    Roads inside a junction are kept whole. Links to roads and junctions left out are removed.

    Parameters
    ----------
    network : all roads.
    centre : (2,) plan point, m.
    reach_m : distance from `centre` in plan, m.
    """
    kept: dict[str, Road] = {}
    for road in network.roads:
        s = np.linspace(0.0, road.length_m, max(2, int(road.length_m / STEP_M) + 1))
        away = np.linalg.norm(road.line.points(s) - centre, axis=1)
        near = np.flatnonzero(away < reach_m)
        if len(near):
            span = float(s[near[0]]), float(s[near[-1]])
            kept[road.name] = road if road.junction else _cut(road, *span)
    return _linked(network, kept)


def moved(network: Network, by_m: Floats) -> Network:
    """Return a network shifted in plan by (x, y), m."""
    roads = tuple(replace(road, line=_moved_line(road.line, by_m)) for road in network.roads)
    return replace(network, roads=roads)


def _moved_line(line: ReferenceLine, by_m: Floats) -> ReferenceLine:
    x, y = (float(v) for v in by_m)
    return ReferenceLine(tuple(_moved(r, r.x_m + x, r.y_m + y) for r in line.records))


def _moved(record: Curve, x: float, y: float) -> Curve:
    return replace(record, x_m=x, y_m=y)  # type: ignore[type-var]


def _linked(network: Network, kept: dict[str, Road]) -> Network:
    junctions = []
    for junction in network.junctions:
        ways = [c for c in junction.connections if {c.incoming, c.connecting} <= set(kept)]
        if ways or any(road.junction == junction.name for road in kept.values()):
            junctions.append(Junction(junction.name, tuple(ways)))
    names = {"road": set(kept), "junction": {junction.name for junction in junctions}}
    roads = []
    for road in kept.values():
        for end in ("predecessor", "successor"):
            link = road.predecessor if end == "predecessor" else road.successor
            if link is not None and link.name not in names[link.kind]:
                road = replace(road, **{end: None})
        roads.append(road)
    return Network(tuple(roads), tuple(junctions), network.land)


def _cut(road: Road, first: float, last: float) -> Road:
    """Return a stretch of a road; ends shorter than `LEAST_CUT_M` are not cut off."""
    first = 0.0 if first < LEAST_CUT_M else first
    last = road.length_m if road.length_m - last < LEAST_CUT_M else last
    if first == last:  # a single sampled place is near; a road needs a length
        first = max(first - STEP_M, 0.0)
        last = min(last + STEP_M, road.length_m)
    # curves other than lines, arcs and spirals are not cut
    for record in road.line.records:
        if not isinstance(record, Record):
            end = record.start_m + record.length_m
            first = record.start_m if record.start_m < first < end else first
            last = end if record.start_m < last < end else last
    if first == 0.0 and last == road.length_m:
        return road
    inside = lambda s: first <= s <= last
    return replace(
        road,
        line=ReferenceLine(tuple(_records(road.line, first, last))),
        sections=_sections(road, first, last),
        elevation=road.elevation.between(first, last),
        superelevation=road.superelevation.between(first, last),
        crossfall=tuple(profile.between(first, last) for profile in road.crossfall),
        shape=_shape(road.shape, first),
        lane_offset=road.lane_offset.between(first, last),
        predecessor=road.predecessor if first == 0.0 else None,
        successor=road.successor if last == road.length_m else None,
        structures=tuple(
            replace(
                x,
                start_m=max(x.start_m, first) - first,
                length_m=min(x.end_m, last) - max(x.start_m, first),
            )
            for x in road.structures
            if x.start_m < last and x.end_m > first
        ),
        objects=tuple(replace(x, s_m=x.s_m - first) for x in road.objects if inside(x.s_m)),
    )


def _records(line: ReferenceLine, first: float, last: float) -> list[Curve]:
    found: list[Curve] = []
    for record in line.records:
        start = max(record.start_m, first)
        end = min(record.start_m + record.length_m, last)
        if end - start < 1e-6:
            continue
        if not isinstance(record, Record):
            found.append(replace(record, start_m=start - first))  # type: ignore[type-var]
            continue
        x, y, heading, bend = (float(v) for v in record.at(start - record.start_m))
        last_bend = float(record.at(end - record.start_m).curvature_per_m)
        if record.curvature_per_m == record.end_per_m:
            bend = last_bend = record.curvature_per_m
        found.append(Record(start - first, x, y, heading, end - start, bend, last_bend))
    return found


def _shape(shape: LateralShape | None, first: float) -> LateralShape | None:
    if shape is None:
        return None
    return LateralShape(tuple(ShapeRow(row.s_m - first, row.height) for row in shape.rows))


def _sections(road: Road, first: float, last: float) -> tuple[LaneSection, ...]:
    found = []
    for k, section in enumerate(road.sections):
        start, end = road.span(k)
        if end <= first or start >= last:
            continue
        skip = max(first - start, 0.0)
        change = lambda lane, skip=skip, end=end, start=start: _lane(lane, skip, end - start)
        found.append(
            LaneSection(
                max(start - first, 0.0),
                tuple(map(change, section.left)),
                tuple(map(change, section.right)),
                tuple(m._replace(offset_m=m.offset_m - skip) for m in section.centre),
            )
        )
    return tuple(found)


def _lane(lane: Lane, skip: float, length: float) -> Lane:
    if not skip:
        return lane
    marks = tuple(m._replace(offset_m=m.offset_m - skip) for m in lane.marks)
    return replace(lane, width=_rest(lane.width, skip, length), marks=marks)


def _rest(width: Profile, skip: float, length: float) -> Profile:
    return width.between(skip, length)
