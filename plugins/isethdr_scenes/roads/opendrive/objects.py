"""Objects of a road as elements: crosswalks, stop lines, arrows, barriers, bridges, tunnels."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import Literal

import numpy as np

from ..profile import Floats
from ..road import ObjectKind, Road, RoadObject, Structure
from .elements import Node, child

# type and subtype in a file
TYPES: dict[ObjectKind, tuple[str, str]] = {
    "crosswalk": ("crosswalk", ""),
    "stop_line": ("roadMark", "signalLines"),
    "arrow": ("roadMark", "arrow"),
    "parking_line": ("roadMark", "parkingLine"),
    "barrier": ("barrier", "trafficCone"),
}
ARROWS = {
    "straight": "arrowStraight",
    "left": "arrowLeft",
    "right": "arrowRight",
    "straight left": "arrowStraightLeft",
    "straight right": "arrowStraightRight",
}
SHOWN = {name: shows for shows, name in ARROWS.items()}
LEAST_M = 1.0  # least length of a structure
BARS = ("crosswalk", "stop_line", "parking_line")  # painted along and across the road only
PAINTED = (*BARS, "arrow")
SLANTED_RAD = 0.1  # a bar that is turned by more than this from both directions is noted


def read_structures(road: Node, length: float) -> tuple[Structure, ...]:
    """Return the bridges and tunnels of a road, within its length."""
    found = []
    kinds: tuple[Literal["bridge", "tunnel"], ...] = ("bridge", "tunnel")
    for kind in kinds:
        for node in road.all(f"objects/{kind}"):
            first = max(node.number("s"), 0.0)
            span = min(node.number("length"), length - first)
            if span < LEAST_M:
                node.note(f"a {kind} shorter than {LEAST_M:g} m is left out")
                continue
            found.append(Structure(kind, first, span))
    return tuple(found)


def read_objects(road: Node, length: float) -> tuple[RoadObject, ...]:
    """Return the markings and barriers of a road; other objects are noted and left out."""
    found = []
    for node in road.all("objects/object"):
        node = node.named(f"{road.where}, object {node.text('id', '?')}")
        kind = _kind(node)
        if kind is None:
            told = " ".join(filter(None, (node.text("type", ""), node.text("subtype", ""))))
            node.note(f"objects of type {told or 'none'!r} are left out")
            continue
        if not 0 <= node.number("s") <= length:
            node.note("objects beyond their road's end are left out")
            continue
        if node.first("repeat") is not None:
            node.note("of a row of objects (<repeat>) only the first one is kept")
        made = _object(node, kind)
        if kind in PAINTED and not (made.length_m > 0 and made.width_m > 0):
            node.note(f"{kind.replace('_', ' ')}s without length or width are left out")
            continue
        found.append(made)
    for node in road.all("signals/signal"):
        kind_of = "dynamic" if node.text("dynamic", "no") == "yes" else "static"
        road.note(f"{kind_of} signals are left out; signs are placed by the seed")
    return tuple(found)


def _kind(node: Node) -> ObjectKind | None:
    told = node.text("type", "none")
    subtype = node.text("subtype", "")
    if told == "crosswalk" or subtype == "crosswalk":
        return "crosswalk"
    if subtype == "signalLines":
        return "stop_line"
    if subtype in SHOWN:
        return "arrow"
    if subtype == "parkingLine":
        return "parking_line"
    return "barrier" if (told, subtype) == TYPES["barrier"] else None


def _object(node: Node, kind: ObjectKind) -> RoadObject:
    heading = node.number("hdg", 0.0)
    s = node.number("s")
    t = node.number("t")
    length = node.number("length", 0.0)
    width = node.number("width", 0.0)
    outline = _outline(node, s, t, heading)
    if outline is not None:
        low = outline.min(0)
        high = outline.max(0)
        s, t = (low + high) / 2
        length, width = high - low
        heading = np.pi if kind == "arrow" and np.cos(heading) < 0 else 0.0
    elif kind in BARS:
        if abs(np.sin(2 * heading)) > np.sin(2 * SLANTED_RAD):
            node.note(f"a slanted {kind.replace('_', ' ')} is painted square to the road")
        if abs(np.sin(heading)) > np.sqrt(0.5):
            length, width = width, length  # the file states its length across the road
            heading = 0.0
    # of an arrow for traffic against s, some writers state the turn by `hdg`, others do not
    turned = (
        kind == "arrow" and node.text("orientation", "none") == "-" and bool(np.cos(heading) > 0)
    )
    shows = SHOWN.get(node.text("subtype", ""), "")
    if kind == "barrier":
        shows = "beacon"
    return RoadObject(
        kind, float(s), float(t), float(length), float(width), heading + np.pi * turned, shows
    )


def _outline(node: Node, s: float, t: float, heading: float) -> Floats | None:
    """Return the corners (n, 2) of an outline in s and t, as if the road were straight there."""
    corners = [corner.numbers("s", "t") for corner in _corners(node, "cornerRoad")]
    for corner in _corners(node, "cornerLocal"):
        u, v = corner.numbers("u", "v")
        cos = np.cos(heading)
        sin = np.sin(heading)
        corners.append((s + u * cos - v * sin, t + u * sin + v * cos))
    return np.array(corners) if len(corners) > 2 else None


def _corners(node: Node, tag: str) -> list[Node]:
    return [*node.all(f"outline/{tag}"), *node.all(f"outlines/outline/{tag}")]


def write_objects(node: ET.Element, road: Road) -> None:
    """Add objects and structures to an element `road`."""
    if not road.objects and not road.structures:
        return
    objects = child(node, "objects")
    for k, item in enumerate(road.objects):
        kind, subtype = TYPES[item.kind]
        child(
            objects,
            "object",
            type=kind,
            subtype=ARROWS[item.shows] if item.kind == "arrow" else subtype or None,
            id=k,
            name=item.kind,
            s=float(item.s_m),
            t=float(item.t_m),
            zOffset=0.0,
            hdg=float(item.heading_rad),
            orientation="none",
            length=float(item.length_m),
            width=float(item.width_m),
            height=0.0,
        )
    for k, span in enumerate(road.structures):
        kinds = {"bridge": "concrete", "tunnel": "standard"}
        child(
            objects,
            span.kind,
            s=float(span.start_m),
            length=float(span.length_m),
            id=len(road.objects) + k,
            name=span.kind,
            type=kinds[span.kind],
        )
