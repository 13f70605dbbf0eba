"""A piece of a reference line that is a pair of cubic polynomials, as in poly3 and paramPoly3."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicHermiteSpline

from .profile import Floats
from .reference_line import NODES, WEIGHTS, Plan

PANELS = 16  # number of panels of the quadrature of the arc length
NODES_OF_TABLE = 257  # number of arc lengths for which the parameter is tabulated
NEWTON_STEPS = 8
Cubic4 = tuple[float, float, float, float]


@dataclass(frozen=True)
class CubicRecord:
    """A curve u(p), v(p) in the axes of its start, p from 0 to `last`.

    The curve is exact. s is its arc length, scaled so that the curve is `length_m` long: files
    state a length that differs from the arc length by rounding or more.
    """

    start_m: float
    x_m: float
    y_m: float
    heading_rad: float  # heading of the u axis
    length_m: float
    u: Cubic4  # a, b, c, d
    v: Cubic4
    last: float = 1.0

    def _derivative(self, p: Floats) -> tuple[Floats, Floats]:
        return _slope(self.u, p), _slope(self.v, p)

    def _speed(self, p: Floats) -> Floats:
        return np.hypot(*self._derivative(p))

    @cached_property
    def _panels(self) -> tuple[Floats, Floats]:
        """Return the parameters at the ends of panels and the arc lengths up to them."""
        edges = np.linspace(0.0, self.last, PANELS + 1)
        length = self._lengths(edges[:-1], edges[1:])
        return edges, np.concatenate([[0.0], np.cumsum(length)])

    def _lengths(self, first: Floats, last: Floats) -> Floats:
        """Return arc lengths between parameters, by Gauss-Legendre quadrature."""
        half = (last - first) / 2
        p = first[:, None] + half[:, None] * (1 + NODES)
        return half * (self._speed(p) @ WEIGHTS)

    @property
    def arc_length_m(self) -> float:
        """Return the arc length of the curve, m; `length_m` should equal it."""
        return float(self._panels[1][-1])

    @cached_property
    def _parameter(self) -> CubicHermiteSpline:
        """Return the parameter as a function of s."""
        edges, along = self._panels
        target = np.linspace(0.0, along[-1], NODES_OF_TABLE)
        p = np.interp(target, along, edges)
        for _ in range(NEWTON_STEPS):
            k = np.clip(np.searchsorted(edges, p, side="right") - 1, 0, PANELS - 1)
            length = along[k] + self._lengths(edges[k], p)
            p = np.clip(p - (length - target) / self._speed(p), 0.0, self.last)
        s = np.linspace(0.0, self.length_m, NODES_OF_TABLE)
        return CubicHermiteSpline(s, p, along[-1] / self.length_m / self._speed(p))

    def at(self, ds_m: ArrayLike) -> Plan:
        """Return the places `ds_m` after the record's start.

        Beyond its ends the record continues as a straight line.
        """
        ds = np.asarray(ds_m, float)
        inside = np.clip(ds, 0.0, self.length_m)
        p = np.clip(self._parameter(inside), 0.0, self.last)
        du, dv = self._derivative(p)
        speed = np.hypot(du, dv)
        u = _value(self.u, p) + (ds - inside) * du / speed
        v = _value(self.v, p) + (ds - inside) * dv / speed
        cos = np.cos(self.heading_rad)
        sin = np.sin(self.heading_rad)
        return Plan(
            self.x_m + u * cos - v * sin,
            self.y_m + u * sin + v * cos,
            self.heading_rad + np.arctan2(dv, du),
            np.where(ds == inside, self._bend(p), 0.0),
        )

    def _bend(self, p: Floats) -> Floats:
        du, dv = self._derivative(p)
        bend = du * _second(self.v, p) - dv * _second(self.u, p)
        return np.asarray(bend / np.hypot(du, dv) ** 3)

    @property
    def end(self) -> Plan:
        """Return the place of the record's end."""
        return self.at(self.length_m)

    @property
    def largest_per_m(self) -> float:
        """Return the largest curvature at the places of the table."""
        return float(np.abs(self._bend(np.linspace(0, self.last, NODES_OF_TABLE))).max())


def _value(c: Cubic4, p: Floats) -> Floats:
    return np.asarray(c[0] + p * (c[1] + p * (c[2] + p * c[3])))


def _slope(c: Cubic4, p: Floats) -> Floats:
    return np.asarray(c[1] + p * (2 * c[2] + p * 3 * c[3]))


def _second(c: Cubic4, p: Floats) -> Floats:
    return np.asarray(2 * c[2] + 6 * p * c[3])
