"""Lanes as elements: offset of the middle, sections, types, widths, heights and links."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import pairwise
from typing import cast

import numpy as np

from isethdr_core.errors import did_you_mean

from ..profile import Cubic, Profile
from ..road import LANE_TYPES, Lane, LaneSection, LaneType, Road
from . import words
from .elements import MOST_M, Node, child
from .heights import read_profile, write_profile
from .marks import read_marks, write_marks

WIDEST_M = 1000.0  # greatest width of a lane; wider ones are damaged polynomials
NEGATIVE_M = 5e-3  # widths may be this far below 0, by rounding at the end of a taper
LOOK_M = 0.25  # spacing of the places at which widths are checked
LEAST_SECTION_M = 1e-3  # shorter sections are dropped


def read_sections(road: Node, length: float) -> tuple[LaneSection, ...]:
    """Return the lane sections of a road.

    In a section for a single side, the lanes of the other side go on from the section before.

    Raises
    ------
    CatalogError : the road has no section; lanes are not numbered in order; a type is unknown; a
        width is negative, or greater than `WIDEST_M`.
    """
    nodes = sorted(road.all("lanes/laneSection"), key=lambda node: node.number("s", most=MOST_M))
    if not nodes:
        raise road.error("it has no <laneSection>; expected one or more")
    if road.first("lateralProfile/*") is not None:
        lanes = road.all("lanes/laneSection/*/lane")
        if any(lane.text("level", "false") == "true" for lane in lanes):
            road.note("level lanes follow the tilt and the crossfall of their road")
    starts = [node.number("s") for node in nodes]
    kept: list[LaneSection] = []
    for node, (start, end) in zip(nodes, pairwise([*starts, length])):
        single = node.text("singleSide", "false") == "true"
        if end - start < LEAST_SECTION_M and len(nodes) > 1 and not single:
            road.note("a lane section without length is left out")
            continue
        section = _section(node, start, end)
        if single and kept:
            kept[-1:] = _with_both_sides(kept[-1], section)
        else:
            kept.append(section)
    if not kept:
        raise road.error(f"no <laneSection> starts before its end at {length:g} m")
    return (replace(kept[0], start_m=0.0), *kept[1:])


def _with_both_sides(before: LaneSection, after: LaneSection) -> list[LaneSection]:
    """Return two sections that follow each other; a side that the second one lacks goes on from the
    first one. If both start at the same place, they are one section.
    """
    skip = after.start_m - before.start_m
    if skip < LEAST_SECTION_M:
        left = after.left or before.left
        right = after.right or before.right
        return [replace(after, left=left, right=right, centre=after.centre or before.centre)]
    lefts = (before.left, after.left) if after.left else _continued(before.left, skip)
    rights = (before.right, after.right) if after.right else _continued(before.right, skip)
    return [
        replace(before, left=lefts[0], right=rights[0]),
        replace(after, left=lefts[1], right=rights[1]),
    ]


def _continued(lanes: tuple[Lane, ...], skip: float) -> tuple[tuple[Lane, ...], tuple[Lane, ...]]:
    """Return the lanes of one side before and after the first `skip` metres of their section."""
    before = tuple(replace(lane, successor=lane.number) for lane in lanes)
    after = tuple(
        replace(
            lane,
            predecessor=lane.number,
            width=lane.width.between(skip, np.inf),
            marks=tuple(m._replace(offset_m=m.offset_m - skip) for m in lane.marks),
        )
        for lane in lanes
    )
    return before, after


def _section(node: Node, start: float, end: float) -> LaneSection:
    sides = {}
    for side, sign in (("left", 1), ("right", -1)):
        lanes = sorted(node.all(f"{side}/lane"), key=lambda lane: abs(lane.integer("id")))
        lanes = [n.named(f"{node.where}, s = {start:g} m, lane {n.text('id')}") for n in lanes]
        for k, lane in enumerate(lanes, 1):
            if lane.integer("id") != sign * k:
                raise lane.error(f"expected lane {sign * k} as number {k} on the {side} side")
        sides[side] = _lanes(lanes, end - start)
    if not any(sides.values()):
        raise node.error(f"the section at s = {start:g} m has no lanes; expected one or more")
    centre = node.first("center/lane")
    marks = read_marks(centre) if centre is not None else ()
    return LaneSection(start, sides["left"], sides["right"], marks)


def _lanes(nodes: list[Node], length: float) -> tuple[Lane, ...]:
    inner = Profile()
    lanes = []
    for node in nodes:
        width = read_profile(node.all("width"), "sOffset")
        if not width.pieces:
            outer = read_profile(node.all("border"), "sOffset")
            width = _difference(outer, inner, np.sign(node.integer("id")))
            inner = outer
        _check_width(node, width, length)
        lanes.append(_lane(node, width))
    return tuple(lanes)


def _difference(outer: Profile, inner: Profile, sign: float) -> Profile:
    """Return the width between two borders; `sign` is 1 on the left side, -1 on the right."""
    starts = sorted({0.0, *(p.start_m for profile in (outer, inner) for p in profile.pieces)})
    pieces = []
    for start in starts:
        a, b = (profile.between(start, start + 1.0).pieces[:1] for profile in (outer, inner))
        far = np.array(a[0][1:] if a else (0.0,) * 4)
        near = np.array(b[0][1:] if b else (0.0,) * 4)
        pieces.append(Cubic(start, *(sign * (far - near)).tolist()))
    return Profile(tuple(pieces))


def _check_width(node: Node, width: Profile, length: float) -> None:
    ds = np.linspace(0.0, length, max(2, int(np.ceil(length / LOOK_M)) + 1))
    ds = np.union1d(ds, [p.start_m for p in width.pieces if 0 <= p.start_m <= length])
    values = width.at(ds)
    worst = int(np.argmin(values))
    if values[worst] < -NEGATIVE_M:
        raise node.error(
            f"its width is {values[worst]:.3f} m {ds[worst]:.2f} m behind the section's start;"
            " expected 0 or more"
        )
    widest = int(np.argmax(values))
    if values[widest] > WIDEST_M:
        raise node.error(
            f"its width is {values[widest]:.3g} m {ds[widest]:.2f} m behind the section's start;"
            f" expected {WIDEST_M:g} m or less"
        )


def _lane(node: Node, width: Profile) -> Lane:
    links = []
    for name in ("predecessor", "successor"):
        told = list(node.all(f"link/{name}"))
        if len(told) > 1:
            node.note(f"of several lanes as {name} the first one is taken")
        # lane 0 is no lane; some writers use it to state that there is no link
        links.append((told[0].integer("id") or None) if told else None)
    direction = node.text("direction", "standard")
    if direction != "standard":
        node.note(f"the lane direction {direction!r} is left out; traffic drives as on its side")
    heights = list(node.all("height"))
    inner, outer = heights[0].numbers("inner", "outer") if heights else (0.0, 0.0)
    if len(heights) > 1 or inner != outer:
        node.note("a lane whose height changes is taken as level at its mean")
    return Lane(
        node.integer("id"),
        _type(node),
        width,
        read_marks(node),
        (inner + outer) / 2,
        *links,
    )


def _type(node: Node) -> LaneType:
    told = node.text("type", "none")
    if told in LANE_TYPES:
        return cast(LaneType, told)
    if told not in words.LANE_TYPES:
        known = (*LANE_TYPES, *words.LANE_TYPES)
        raise node.error(f"the lane type {told!r} is not known{did_you_mean(told, known)}")
    node.note(f"the lane type {told!r} is taken as {words.LANE_TYPES[told]!r}")
    return words.LANE_TYPES[told]


def write_lanes(node: ET.Element, road: Road) -> None:
    """Add the offset of lane 0 and all lane sections to an element `road`."""
    lanes = child(node, "lanes")
    write_profile(lanes, "laneOffset", road.lane_offset.between(0.0, road.length_m))
    for k, section in enumerate(road.sections):
        first, last = road.span(k)
        told = child(lanes, "laneSection", s=float(first))
        # the schema requires the order from left to right
        if section.left:
            left = child(told, "left")
            for lane in section.left[::-1]:
                _write_lane(left, _known(lane, road, k), road.surface, last - first)
        centre = child(child(told, "center"), "lane", id=0, type="none", level=False)
        write_marks(centre, section.centre)
        if section.right:
            right = child(told, "right")
            for lane in section.right:
                _write_lane(right, _known(lane, road, k), road.surface, last - first)


def _known(lane: Lane, road: Road, section: int) -> Lane:
    """Return a lane without links to lanes that the neighbouring sections do not have."""
    has = [{x.number for x in s.lanes} for s in road.sections]
    if section > 0 and lane.predecessor not in has[section - 1]:
        lane = replace(lane, predecessor=None)
    if section + 1 < len(has) and lane.successor not in has[section + 1]:
        lane = replace(lane, successor=None)
    return lane


def _write_lane(side: ET.Element, lane: Lane, surface: str, length: float) -> None:
    node = child(side, "lane", id=lane.number, type=lane.type, level=False)
    link = child(node, "link")
    for name, number in (("predecessor", lane.predecessor), ("successor", lane.successor)):
        if number is not None:
            child(link, name, id=number)
    width = lane.width.between(0.0, length)
    write_profile(node, "width", width if width.pieces else Profile.constant(0.0), "sOffset")
    write_marks(node, lane.marks)
    child(node, "material", sOffset=0.0, surface=surface, friction=1.0)
    if lane.raised_m:
        raised = float(lane.raised_m)
        child(node, "height", sOffset=0.0, inner=raised, outer=raised)
