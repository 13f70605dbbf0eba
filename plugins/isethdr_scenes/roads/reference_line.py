"""Reference line of a road in plan: straight lines, arcs, spirals (clothoids) and other curves,
joined end to end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from .profile import Floats

STRAIGHT_PER_M = 1e-12  # curvature below which a record is a straight line
PANEL_RAD = 1.0  # largest change of heading in one panel of the quadrature
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
STEP_M = 1.0  # spacing of the samples from which a projection starts
PROJECTION_STEPS = 6  # steps of Newton's method; it converges quadratically from 1 m


class Plan(NamedTuple):
    """Places on a line in plan, arrays of one shape."""

    x_m: Floats
    y_m: Floats
    heading_rad: Floats
    curvature_per_m: Floats  # positive curves to the left


class Beside(NamedTuple):
    """Points in the coordinates of a line: `t_m` to its left at `s_m`, `beyond_m` past an end."""

    s_m: Floats
    t_m: Floats
    beyond_m: Floats


class Stretch(NamedTuple):
    """A part of a line: its length, and the curvatures at its start and end."""

    length_m: float
    curvature_per_m: float = 0.0
    end_per_m: float | None = None  # None: the same as at the start


class Curve(Protocol):
    """One piece of a reference line, of any form."""

    @property
    def start_m(self) -> float:
        """Return the s of its start."""

    @property
    def x_m(self) -> float:
        """Return the x of its start."""

    @property
    def y_m(self) -> float:
        """Return the y of its start."""

    @property
    def heading_rad(self) -> float:
        """Return the direction of the curve's own x axis."""

    @property
    def length_m(self) -> float:
        """Return its length."""

    def at(self, ds_m: ArrayLike, /) -> Plan:
        """Return the places `ds_m` after its start."""

    @property
    def end(self) -> Plan:
        """Return the place of its end."""

    @property
    def largest_per_m(self) -> float:
        """Return the largest curvature, without its sign."""


@dataclass(frozen=True)
class Record:
    """One piece of a reference line; its curvature changes linearly (line, arc or spiral)."""

    start_m: float
    x_m: float
    y_m: float
    heading_rad: float
    length_m: float
    curvature_per_m: float = 0.0
    end_per_m: float = 0.0

    @property
    def rate_per_m2(self) -> float:
        """Return the change of curvature per metre."""
        return (self.end_per_m - self.curvature_per_m) / self.length_m

    def at(self, ds_m: ArrayLike) -> Plan:
        """Return the places `ds_m` after the record's start."""
        ds = np.asarray(ds_m, float)
        heading = self.heading_rad + ds * (self.curvature_per_m + ds * self.rate_per_m2 / 2)
        curvature = self.curvature_per_m + ds * self.rate_per_m2
        if self.end_per_m != self.curvature_per_m:
            x, y = self._spiral(ds)
        elif abs(self.curvature_per_m) < STRAIGHT_PER_M:
            x = ds * np.cos(self.heading_rad)
            y = ds * np.sin(self.heading_rad)
        else:
            radius = 1 / self.curvature_per_m
            x = radius * (np.sin(heading) - np.sin(self.heading_rad))
            y = radius * (np.cos(self.heading_rad) - np.cos(heading))
        return Plan(self.x_m + x, self.y_m + y, heading, curvature)

    def _spiral(self, ds: Floats) -> tuple[Floats, Floats]:
        """Return the integrals of cos and sin of the heading.

        Gauss-Legendre quadrature in panels of one radian is exact to rounding, also where
        differences of Fresnel integrals cancel.
        """
        largest = max(abs(self.curvature_per_m), abs(self.end_per_m))
        panels = int(np.ceil(largest * self.length_m / PANEL_RAD)) or 1
        nodes = ((np.arange(panels)[:, None] + (NODES + 1) / 2) / panels).ravel()
        weights = np.tile(WEIGHTS / 2 / panels, panels)
        u = ds[..., None] * nodes
        heading = self.heading_rad + u * (self.curvature_per_m + u * self.rate_per_m2 / 2)
        return ds * (np.cos(heading) @ weights), ds * (np.sin(heading) @ weights)

    @property
    def end(self) -> Plan:
        """Return the place of the record's end."""
        return self.at(self.length_m)

    @property
    def largest_per_m(self) -> float:
        """Return the largest curvature: that of one of its ends."""
        return max(abs(self.curvature_per_m), abs(self.end_per_m))


class Gap(NamedTuple):
    """A place at which a record does not start at the end of the record before."""

    s_m: float
    x_m: float
    y_m: float
    gap_m: float
    turn_rad: float


@dataclass(frozen=True)
class ReferenceLine:
    """Records that follow each other from s = 0."""

    records: tuple[Curve, ...]

    @classmethod
    def of(
        cls, x_m: float, y_m: float, heading_rad: float, stretches: Sequence[Stretch]
    ) -> ReferenceLine:
        """Return the line that starts at a place and consists of `stretches`.

        Parameters
        ----------
        x_m, y_m : place of the start in plan, m.
        heading_rad : direction at the start, radians from +x to the left.
        stretches : lengths in m with their curvature in 1/m at start and end, one after the other.
        """
        records: list[Record] = []
        start = 0.0
        for length, first, last in stretches:
            record = Record(
                start, x_m, y_m, heading_rad, length, first, first if last is None else last
            )
            records.append(record)
            x_m, y_m, heading_rad = (float(v) for v in record.end[:3])
            start += length
        return cls(tuple(records))

    @property
    def length_m(self) -> float:
        """Return the length of the line."""
        last = self.records[-1]
        return last.start_m + last.length_m

    def at(self, s_m: ArrayLike) -> Plan:
        """Return the places at `s_m`; outside the line its first and last records continue."""
        s = np.asarray(s_m, float)
        starts = self._starts
        which = np.maximum(np.searchsorted(starts, s, side="right") - 1, 0)
        first = int(which.min(initial=len(starts)))
        out = np.empty((4, *s.shape))
        if first == which.max(initial=0):  # all places are on one record
            for row, values in zip(
                out.reshape(4, -1), self.records[first].at(s.ravel() - starts[first])
            ):
                row[...] = values
            return Plan(*out)
        for k in np.unique(which):
            here = which == k
            out[:, here] = self.records[k].at(s[here] - starts[k])
        return Plan(*out)

    def points(self, s_m: ArrayLike, t_m: ArrayLike = 0.0) -> Floats:
        """Return the plan points (..., 2) that lie `t_m` to the left of the line at `s_m`."""
        s, t = np.broadcast_arrays(np.asarray(s_m, float), np.asarray(t_m, float))
        x, y, heading, _ = self.at(s)
        return np.stack([x - t * np.sin(heading), y + t * np.cos(heading)], -1)

    @cached_property
    def _starts(self) -> Floats:
        return np.array([r.start_m for r in self.records])

    @cached_property
    def _samples(self) -> tuple[Floats, cKDTree]:
        s = np.linspace(0, self.length_m, max(2, int(np.ceil(self.length_m / STEP_M)) + 1))
        return s, cKDTree(self.points(s))

    def beside(self, points: ArrayLike) -> Beside:
        """Return plan points (n, 2) in the coordinates of the nearest place of the line.

        A point past an end has the s of that end; `beyond_m` is its distance along the tangent.
        """
        p = np.asarray(points, float)
        samples, tree = self._samples
        s = samples[tree.query(p)[1]]
        for _ in range(PROJECTION_STEPS):
            along, aside, curvature = self._seen(p, s)
            step = along / np.maximum(1 - curvature * aside, 0.1)
            s = np.clip(s + np.clip(step, -STEP_M, STEP_M), 0, self.length_m)
        along, aside, _ = self._seen(p, s)
        ends = (s <= 0) | (s >= self.length_m)
        return Beside(s, aside, np.where(ends, np.abs(along), 0.0))

    def _seen(self, p: Floats, s: Floats) -> tuple[Floats, Floats, Floats]:
        x, y, heading, curvature = self.at(s)
        dx = p[:, 0] - x
        dy = p[:, 1] - y
        cos = np.cos(heading)
        sin = np.sin(heading)
        return dx * cos + dy * sin, dy * cos - dx * sin, curvature

    def gaps(self, gap_m: float, turn_rad: float) -> list[Gap]:
        """Return the places where successive records differ by more than `gap_m` (in s or in plan)
        or by more than `turn_rad` in heading.
        """
        found = []
        for before, after in zip(self.records, self.records[1:]):
            x, y, heading, _ = (float(v) for v in before.end)
            start = after.at(0.0)
            apart = float(np.hypot(start.x_m - x, start.y_m - y))
            apart = max(apart, abs(after.start_m - before.start_m - before.length_m))
            turn = abs((float(start.heading_rad) - heading + np.pi) % (2 * np.pi) - np.pi)
            if apart > gap_m or turn > turn_rad:
                found.append(Gap(after.start_m, x, y, apart, turn))
        return found
