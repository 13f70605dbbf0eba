"""Heights of a road as elements: elevation, superelevation, crossfall and shape, both ways."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np

from ..lateral_shape import LateralShape, ShapeRow
from ..profile import Cubic, Profile
from ..road import Road
from .elements import MOST_COEFFICIENT, MOST_M, Node, child

SHAPE_M = 1e-4  # largest error of a crossfall that is written as rows of shape
STEEP_RAD = 0.15  # a tilt at which widths in plan differ by 1 % from widths along the surface


def read_profile(nodes: Iterable[Node], offset: str = "s") -> Profile:
    """Return elements with a, b, c, d as a profile, in the order of their start.

    Before the first element the value at its start holds; its cubic would run away there.
    """
    pieces = [
        Cubic(node.number(offset, 0.0, most=MOST_M), *node.numbers(*"abcd", most=MOST_COEFFICIENT))
        for node in nodes
    ]
    pieces.sort(key=lambda piece: piece.start_m)
    if pieces and pieces[0].start_m > 0 and any(pieces[0][2:]):
        pieces.insert(0, Cubic(0.0, pieces[0].a))
    return Profile(tuple(pieces))


def write_profile(parent: ET.Element, tag: str, profile: Profile, offset: str = "s") -> None:
    """Add a profile as elements with a, b, c, d.

    Parameters
    ----------
    parent : element that receives one element for each piece of the profile.
    tag : name of these elements.
    profile : cubic pieces over s, m.
    offset : name of the attribute with the start of a piece, m: s or sOffset.
    """
    for start, a, b, c, d in profile.pieces:
        told = {offset: float(start), "a": float(a), "b": float(b), "c": float(c), "d": float(d)}
        child(parent, tag, **told)


def read_tilt(road: Node) -> Profile:
    """Return the superelevation of a road, radians."""
    tilt = read_profile(road.all("lateralProfile/superelevation"))
    if any(abs(piece.a) > STEEP_RAD for piece in tilt.pieces):
        road.note("widths of a road tilted by more than 0.15 rad are taken in plan")
    return tilt


def read_crossfall(road: Node) -> tuple[Profile, Profile]:
    """Return the falls to the left and to the right, as in OpenDRIVE 1.4; angles become slopes."""
    sides = []
    for side in ("left", "right"):
        nodes = [
            node
            for node in road.all("lateralProfile/crossfall")
            if node.text("side", "both") in (side, "both")
        ]
        sides.append(read_profile(nodes))
    return sides[0], sides[1]


def read_shape(road: Node) -> LateralShape | None:
    """Return the shape of a road across it, or None."""
    rows: dict[float, list[Cubic]] = {}
    for node in road.all("lateralProfile/shape"):
        start = node.number("t", most=MOST_M)
        piece = Cubic(start, *node.numbers(*"abcd", most=MOST_COEFFICIENT))
        rows.setdefault(node.number("s", most=MOST_M), []).append(piece)
    if road.first("lateralProfile/crossSectionSurface") is not None:
        road.note("crossSectionSurface is left out; the road is flat across there")
    if not rows:
        return None
    return LateralShape(tuple(ShapeRow(s, Profile(tuple(sorted(rows[s])))) for s in sorted(rows)))


def as_crossfall(shape: LateralShape) -> tuple[Profile, Profile] | None:
    """Return a shape that falls straight to both sides of t = 0 as a crossfall; None for others.

    Shape and crossfall both change linearly between two places, so the result is exact.
    """
    left = []
    right = []
    for s, height in shape.rows:
        if len(height.pieces) > 2 or any(piece.c or piece.d for piece in height.pieces):
            return None
        if len(height.pieces) == 2 and height.pieces[1].start_m != 0:
            return None
        if abs(float(height.at(0.0))) > 1e-9 or abs(float(height.at(-1e-12))) > 1e-9:
            return None
        left.append((s, -float(height.slope(0.0))))
        right.append((s, float(height.slope(-1.0))))
    return Profile.straight(left), Profile.straight(right)


def write_heights(node: ET.Element, road: Road) -> None:
    """Add elevation and lateral profile to an element `road`."""
    length = road.length_m
    up = child(node, "elevationProfile")
    write_profile(up, "elevation", road.elevation.between(0.0, length))
    across = child(node, "lateralProfile")
    write_profile(across, "superelevation", road.superelevation.between(0.0, length))
    for s, height in _shape_rows(road):
        for t, a, b, c, d in height.pieces:
            told = {"a": float(a), "b": float(b), "c": float(c), "d": float(d)}
            child(across, "shape", s=float(s), t=float(t), **told)


def _shape_rows(road: Road) -> list[ShapeRow]:
    """Return crossfall and shape as rows, which keep the crossfall within `SHAPE_M`."""
    falls = [profile.between(0.0, road.length_m) for profile in road.crossfall]
    if not any(profile.pieces for profile in falls):
        return list(road.shape.rows) if road.shape else []
    s = _places(road, falls)
    right_m = float(road.edges(s)[0].min()) - 1.0
    rows = []
    for at in s:
        left, right = (float(profile.at(at)) for profile in falls)
        pieces = [Cubic(right_m, -right * abs(right_m), right), Cubic(0.0, 0.0, -left)]
        if road.shape is not None:
            pieces = _sum(road.shape, float(at), pieces)
        rows.append(ShapeRow(float(at), Profile(tuple(pieces))))
    return rows


def _places(road: Road, falls: list[Profile]) -> np.ndarray:
    """Return the places between which both falls are linear within `SHAPE_M` at the edges."""
    reach = max(float(np.abs(edge).max()) for edge in road.edges(np.linspace(0, road.length_m, 99)))
    found = {0.0, road.length_m}
    if road.shape is not None:
        found |= {row.s_m for row in road.shape.rows}
    for profile in falls:
        found |= {piece.start_m for piece in profile.pieces}
    ends = np.array(sorted(found))
    places = [ends]
    for first, last in zip(ends, ends[1:]):
        fine = np.linspace(first, last, 17)[:-1]
        bend = max(float(np.abs(profile.bend(fine)).max()) for profile in falls)
        count = int(np.ceil((last - first) * np.sqrt(bend * reach / 8 / SHAPE_M)))
        places.append(np.linspace(first, last, max(count, 1) + 1))
    return np.unique(np.concatenate(places))


def _sum(shape: LateralShape, s: float, falls: list[Cubic]) -> list[Cubic]:
    """Return the pieces over t of the sum of a shape and a fall."""
    k = max(int(np.searchsorted([row.s_m for row in shape.rows], s, side="right")) - 1, 0)
    starts = {piece.start_m for row in shape.rows[k : k + 2] for piece in row.height.pieces}
    starts |= {piece.start_m for piece in falls}
    fall = Profile(tuple(falls))
    pieces = []
    for t in sorted(starts):
        # the sum is a cubic between two starts, so that four values determine it
        step = 1e-2 + np.arange(4) * 0.1
        values = shape.at(np.full(4, s), t + step) + fall.at(t + step)
        d, c, b, a = np.polyfit(step, values, 3)
        pieces.append(Cubic(t, float(a), float(b), float(c), float(d)))
    return pieces
