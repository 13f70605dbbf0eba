"""Cross-section of a road: lanes with drawn widths, and the lines between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from ..profile import Profile
from ..road import Lane, LaneSection, LaneType, Mark, MarkKind
from .draw import Draw

CROWN = 0.025  # fall of a carriageway outwards, m per m
BROAD_M = 0.25  # width of the line beside a cycle lane


class Strip(NamedTuple):
    """One lane of a cross-section."""

    type: LaneType
    width_m: float
    raised_m: float = 0.0


@dataclass(frozen=True)
class Lines:
    """How a kind of road is marked."""

    centre: MarkKind = "broken"
    edges: bool = True
    dash_m: float = 3.0
    gap_m: float = 6.0
    width_m: float = 0.12

    def mark(self, kind: MarkKind, width_m: float | None = None) -> tuple[Mark, ...]:
        """Return the marks of one border."""
        if kind == "none":
            return ()
        return (Mark(kind, "white", width_m or self.width_m, 0.0, self.dash_m, self.gap_m),)


@dataclass(frozen=True)
class CrossSection:
    """Lanes from the middle outwards on both sides, and their lines."""

    right: tuple[Strip, ...]
    left: tuple[Strip, ...]
    lines: Lines

    @classmethod
    def drawn(cls, draw: Draw, name: str = "right") -> CrossSection:
        """Return the cross-section of a kind: widths drawn from the ranges of each lane."""
        right = strips(draw, name, draw.ranges[name])
        told = draw.ranges.get("left", "mirror")
        left = right if told == "mirror" or name != "right" else strips(draw, "left", told)
        lines = Lines(
            draw.value("centre", "broken"),
            bool(draw.value("edge_lines", True)),
            draw.number("dash_m", 3.0),
            draw.number("gap_m", 6.0),
            draw.number("line_m", 0.12),
        )
        return cls(right, left, lines)

    def section(self, start_m: float = 0.0, linked: bool = False) -> LaneSection:
        """Return the section with these lanes; `linked` links each lane to the lanes of the same
        number before and after the section.
        """
        left, right = (self._lanes(side, linked) for side in (1, -1))
        two_ways = all(any(s.type == "driving" for s in side) for side in (self.left, self.right))
        centre = self.lines.mark(self.lines.centre) if two_ways else ()
        if not two_ways and self.left[0].type == "parking":
            centre = self.lines.mark("solid")
        return LaneSection(start_m, left, right, centre)

    def _lanes(self, side: int, linked: bool) -> tuple[Lane, ...]:
        strips = self.left if side > 0 else self.right
        lanes = []
        for k, strip in enumerate(strips):
            number = side * (k + 1)
            outside = strips[k + 1] if k + 1 < len(strips) else None
            lanes.append(
                Lane(
                    number,
                    strip.type,
                    Profile.constant(strip.width_m),
                    self.lines.mark(*self._between(strip, outside)),
                    strip.raised_m,
                    number if linked else None,
                    number if linked else None,
                )
            )
        return tuple(lanes)

    def _between(self, inner: Strip, outer: Strip | None) -> tuple[MarkKind, float | None]:
        """Return the kind and the width of the line between two lanes."""
        if outer is None:
            return "none", None
        types = {inner.type, outer.type}
        if types == {"driving"}:
            return "broken", None
        if types == {"driving", "biking"} and inner.raised_m == outer.raised_m:
            return "solid", BROAD_M
        if types == {"driving", "parking"} or types == {"biking", "parking"}:
            return "solid", None
        if "driving" in types and types & {"shoulder", "border"} and self.lines.edges:
            return "solid", None
        return "none", None

    def changed(self, change: Callable[[Strip], Strip]) -> CrossSection:
        """Return the cross-section with `change` applied to every lane."""
        right = tuple(map(change, self.right))
        left = tuple(map(change, self.left))
        return replace(self, right=right, left=left)

    @property
    def half_m(self) -> float:
        """Return the width of the wider side."""
        return max(sum(s.width_m for s in side) for side in (self.right, self.left))


def strips(draw: Draw, name: str, told: Sequence[Sequence[Any]]) -> tuple[Strip, ...]:
    """Return lanes with widths drawn from [type, least, greatest, raised by].

    Parameters
    ----------
    draw : seed of the widths.
    name : name of the draw; the number of the lane is appended to it.
    told : for each lane, from the middle outwards: type, least and greatest width in m, and
        optionally the height by which it is raised, m.
    """
    return tuple(
        Strip(lane[0], draw.one(f"{name} {k}", [float(lane[1]), float(lane[2])]), *lane[3:])
        for k, lane in enumerate(told)
    )
