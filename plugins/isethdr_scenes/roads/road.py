"""One road as OpenDRIVE describes it: reference line, heights, sections of lanes, objects.

s runs along the reference line, t to its left, metres. Lane 0 is the line between the two
directions; lanes left of it have positive numbers, lanes right of it negative ones. In right-hand
traffic the right lanes run along +s. t is measured in plan: with a superelevation of 5 % it differs
by 0.1 % from the width along the tilted surface.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .lateral_shape import LateralShape
from .profile import Floats, Profile
from .reference_line import ReferenceLine

LaneType = Literal[
    "driving",
    "shoulder",
    "sidewalk",
    "biking",
    "parking",
    "border",
    "median",
    "curb",
    "rail",
    "none",
]
LANE_TYPES: tuple[str, ...] = get_args(LaneType)
MarkKind = Literal[
    "none", "solid", "broken", "solid solid", "solid broken", "broken solid", "broken broken"
]
MARK_KINDS: tuple[str, ...] = get_args(MarkKind)
MarkColour = Literal["white", "yellow"]
RoadType = Literal["rural", "town", "motorway", "lowSpeed"]
ObjectKind = Literal["crosswalk", "stop_line", "arrow", "parking_line", "barrier"]
End = Literal["start", "end"]
Flags = NDArray[np.bool_]
SLOPE_STEP_M = 0.05  # step of the differences from which the slopes of the surface are computed


class Mark(NamedTuple):
    """A line on the outer border of a lane; it begins `offset_m` after the section's start."""

    kind: MarkKind = "none"
    colour: MarkColour = "white"
    width_m: float = 0.12
    offset_m: float = 0.0
    # dashes and gaps of a broken line
    dash_m: float = 3.0
    gap_m: float = 6.0


@dataclass(frozen=True)
class Lane:
    """A lane of one section; the profile of its width begins at the section's start."""

    number: int  # never 0
    type: LaneType
    width: Profile
    marks: tuple[Mark, ...] = ()
    raised_m: float = 0.0  # height above the carriageway, as of a pavement behind a kerb
    predecessor: int | None = None  # number of the lane that it continues
    successor: int | None = None


@dataclass(frozen=True)
class LaneSection:
    """Lanes that exist together from `start_m`, along s, to the start of the next section."""

    start_m: float
    left: tuple[Lane, ...] = ()  # 1, 2, ... from the middle outwards
    right: tuple[Lane, ...] = ()  # -1, -2, ...
    centre: tuple[Mark, ...] = ()  # marks on lane 0

    @property
    def lanes(self) -> tuple[Lane, ...]:
        """Return all lanes, left ones first."""
        return self.left + self.right


@dataclass(frozen=True)
class Structure:
    """A bridge or a tunnel that carries or covers a stretch of a road."""

    kind: Literal["bridge", "tunnel"]
    start_m: float
    length_m: float

    @property
    def end_m(self) -> float:
        """Return the s at which the structure ends."""
        return self.start_m + self.length_m


@dataclass(frozen=True)
class RoadObject:
    """Something painted or standing on a road: a rectangle around (s, t), and what it shows."""

    kind: ObjectKind
    s_m: float
    t_m: float
    length_m: float  # along the road
    width_m: float  # across it
    heading_rad: float = 0.0  # angle to the left of the road's direction
    shows: str = ""  # for an arrow: "straight", "left", "right", or two with a space between


@dataclass(frozen=True)
class Link:
    """Neighbour of a road at one of its ends: the end of another road, or a junction."""

    kind: Literal["road", "junction"]
    name: str
    end: End | None = None  # end of the neighbouring road


@dataclass(frozen=True)
class Road:
    """A road, or a road that connects two others within a junction."""

    name: str
    line: ReferenceLine
    sections: tuple[LaneSection, ...]
    type: RoadType = "rural"
    speed_limit_kmh: float = 50.0
    elevation: Profile = field(default_factory=Profile)
    superelevation: Profile = field(default_factory=Profile)  # radians; positive: left side up
    # fall from the reference line outwards, m per m, on the left and on the right
    crossfall: tuple[Profile, Profile] = (Profile(), Profile())
    shape: LateralShape | None = None  # height across the road beyond tilt and crossfall
    lane_offset: Profile = field(default_factory=Profile)  # offset of lane 0 to the left, m
    junction: str = ""  # name of the junction that a connecting road crosses
    predecessor: Link | None = None
    successor: Link | None = None
    structures: tuple[Structure, ...] = ()
    objects: tuple[RoadObject, ...] = ()
    right_hand: bool = True  # traffic keeps to the right
    surface: str = "asphalt"  # material of its carriageway

    @property
    def length_m(self) -> float:
        """Return the length of the reference line."""
        return self.line.length_m

    def section_at(self, s_m: float) -> int:
        """Return the index of the section at `s_m`."""
        starts = [section.start_m for section in self.sections]
        return max(int(np.searchsorted(starts, s_m + 1e-9, side="right")) - 1, 0)

    def span(self, section: int) -> tuple[float, float]:
        """Return the s at which a section starts and ends."""
        ends = [*(s.start_m for s in self.sections[1:]), self.length_m]
        return self.sections[section].start_m, ends[section]

    def borders(self, section: int, s_m: ArrayLike) -> dict[int, tuple[Floats, Floats]]:
        """Return the t of the inner and the outer border of every lane of a section, by the number
        of the lane.
        """
        s = np.asarray(s_m, float)
        ds = s - self.sections[section].start_m
        found = {}
        for lanes, side in ((self.sections[section].left, 1), (self.sections[section].right, -1)):
            inner = self.lane_offset.at(s)
            for lane in lanes:
                outer = inner + side * lane.width.at(ds)
                found[lane.number] = (inner, outer)
                inner = outer
        return found

    @cached_property
    def _edges(self) -> tuple[Floats, ...]:
        """Return s, t of the right edge and t of the left edge, finely sampled per section."""
        parts = []
        for k in range(len(self.sections)):
            first, last = self.span(k)
            s = np.linspace(first, last, max(2, int(np.ceil((last - first) / 0.5)) + 1))
            t = [self.lane_offset.at(s), *(b[1] for b in self.borders(k, s).values())]
            parts.append(np.stack([s, np.min(t, 0), np.max(t, 0)]))
        return tuple(np.concatenate(parts, 1))

    def edges(self, s_m: ArrayLike) -> tuple[Floats, Floats]:
        """Return the t of the right and of the left edge of the road with all its lanes."""
        s, right, left = self._edges
        at = np.asarray(s_m, float)
        return np.interp(at, s, right), np.interp(at, s, left)

    def height(self, s_m: ArrayLike, t_m: ArrayLike) -> Floats:
        """Return the height of the carriageway's surface, m; it continues beyond both edges.

        It is the sum of the elevation of the reference line, the tilt by the superelevation, the
        fall to both sides, and the shape.
        """
        s = np.asarray(s_m, float)
        t = np.asarray(t_m, float)
        left, right = (profile.at(s) for profile in self.crossfall)
        fall = np.where(t > 0, left, right) * np.abs(t)
        tilt = t * np.tan(self.superelevation.at(s))
        shape = 0.0 if self.shape is None else self.shape.at(s, t)
        return np.asarray(self.elevation.at(s) + tilt - fall + shape)

    def points(self, s_m: ArrayLike, t_m: ArrayLike, above_m: ArrayLike = 0.0) -> Floats:
        """Return the points (..., 3) at (s, t), `above_m` over the surface.

        Parameters
        ----------
        s_m : place along the reference line, m.
        t_m : distance to its left, m; broadcasts with `s_m`.
        above_m : height over the surface, m; broadcasts with both.
        """
        plan = self.line.points(s_m, t_m)
        z = self.height(s_m, t_m) + np.asarray(above_m, float)
        return np.concatenate([plan, np.broadcast_to(z, plan.shape[:-1])[..., None]], -1)

    def pose(self, s_m: float, t_m: float, turn_rad: float = 0.0, above_m: float = 0.0) -> Floats:
        """Return the (4, 4) pose of a thing that stands on the surface at (s, t).

        Its x axis is turned by `turn_rad` from the direction of +s to the left, within the
        surface; its z axis is the surface's normal.

        Parameters
        ----------
        s_m : place along the reference line, m.
        t_m : distance to its left, m.
        turn_rad : turn to the left of the direction of +s, radians.
        above_m : height over the surface, m.
        """
        h = SLOPE_STEP_M
        at = self.points(s_m, t_m, above_m)
        _, _, heading, curvature = self.line.at(s_m)
        stretch = 1 - curvature * t_m  # metres along the offset line per metre of s
        ahead = float(np.diff(self.height([s_m - h, s_m + h], t_m))[0]) / (2 * h * stretch)
        aside = float(np.diff(self.height(s_m, [t_m - h, t_m + h]))[0]) / (2 * h)
        cos = np.cos(heading)
        sin = np.sin(heading)
        forward = np.array([cos, sin, ahead])
        left = np.array([-sin, cos, aside])
        x = np.cos(turn_rad) * forward + np.sin(turn_rad) * left
        z = np.cross(forward, left)  # upwards
        x = x / np.linalg.norm(x)
        z = z / np.linalg.norm(z)
        pose = np.eye(4)
        pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = x, np.cross(z, x), z, at
        return pose

    def on_structure(self, kind: str, s_m: ArrayLike) -> Flags:
        """Return where `s_m` lies on a structure of a kind: "bridge" or "tunnel"."""
        s = np.asarray(s_m, float)
        inside = np.zeros(s.shape, bool)
        for structure in self.structures:
            if structure.kind == kind:
                inside |= (s >= structure.start_m) & (s <= structure.end_m)
        return inside
