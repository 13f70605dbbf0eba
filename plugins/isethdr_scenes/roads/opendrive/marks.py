"""Road marks as elements `roadMark`, in both directions."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import cast

from ..road import MARK_KINDS, Mark, MarkKind
from .elements import Node, child
from .words import COLOURS, MARKS, UNPAINTED, WEIGHTS_M


def read_marks(lane: Node) -> tuple[Mark, ...]:
    """Return the marks of a lane's outer border, in their order along the road."""
    found = [_mark(node) for node in lane.all("roadMark")]
    found.sort(key=lambda mark: mark.offset_m)
    painted = any(mark.kind != "none" for mark in found)
    return tuple(found) if painted else ()


def _mark(node: Node) -> Mark:
    usual = Mark()
    weight = node.text("weight", "standard")
    width = node.number("width", 0.0) or WEIGHTS_M.get(weight, usual.width_m)
    line = node.first("type/line")
    dash = line.number("length", 0.0) if line else 0.0
    gap = line.number("space", 0.0) if line else 0.0
    return Mark(
        _kind(node),
        COLOURS.get(_colour(node), "white"),
        width,
        node.number("sOffset", 0.0),
        dash or usual.dash_m,
        gap or usual.gap_m,
    )


def _kind(node: Node) -> MarkKind:
    told = node.text("type", "none")
    if told in MARK_KINDS:
        return cast(MarkKind, told)
    if told in UNPAINTED:
        return "none"
    node.note(f"the road mark {told!r} is painted as {MARKS.get(told, 'none')!r}")
    return MARKS.get(told, "none")


def _colour(node: Node) -> str:
    told = node.text("color", "standard")
    if told not in COLOURS:
        node.note(f"marks in {told} are painted white")
    return told


def write_marks(lane: ET.Element, marks: tuple[Mark, ...]) -> None:
    """Add marks to an element `lane`; a border without marks gets a mark of type none."""
    for mark in marks or (Mark(),):
        told = child(
            lane,
            "roadMark",
            sOffset=float(mark.offset_m),
            type=mark.kind,
            weight="standard",
            color=mark.colour,
            width=float(mark.width_m),
            laneChange="both" if mark.kind in ("broken", "broken broken", "none") else "none",
        )
        if mark.kind == "broken":
            form = child(told, "type", name=mark.kind, width=float(mark.width_m))
            child(
                form,
                "line",
                length=float(mark.dash_m),
                space=float(mark.gap_m),
                tOffset=0.0,
                sOffset=float(mark.gap_m / 2),
                width=float(mark.width_m),
            )
