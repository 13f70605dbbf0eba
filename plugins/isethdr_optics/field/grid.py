"""Field grid: the field points at which the point spread is computed, and the weights that share
the light of each tile among them.

The grid is polar: one point on the axis, and rings of points around it. Weights are linear in the
radius and in the azimuth, never negative, and sum to 1 in every tile. A wavefront is known along +x
of the field, and is rotated about the axis for all other points.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from isethdr_core.physics.optics.zernike import order

# Number of field points on the first ring for an asymmetric wavefront. The number on other rings is
# proportional to the ring's radius.
AROUND = 8


@dataclass(frozen=True)
class Place:
    """One point of the field grid."""

    ring: int
    radius: float  # distance from the axis, in field coordinates
    azimuth_rad: float  # counter-clockwise from +x, y up
    count: int  # number of points on its ring


def thinned(
    rings: int,
    radius: float,
    symmetric: bool,
    between: Callable[..., Any],
    around: Callable[..., Any],
    allowed: float,
) -> list[tuple[Place, tuple[float, float]]]:
    """Return [(point, step), ...]: the grid of `places` without the rings and points that are not
    needed for the allowed error. `step` is the argument of `weight`.

    Parameters
    ----------
    rings, radius, symmetric : as in `places`.
    between : function(inner radius, outer radius) -> error half way between two points on +x.
    around : function(radius, angle between points in rad) -> error half way between two points on
        one ring.
    allowed : the largest allowed error.
    """
    nodes = [0.0, *_nodes_between(between, 0, rings, radius / rings, allowed)]
    out = []
    for ring, at in enumerate(nodes):
        step = (
            at - nodes[ring - 1] if ring else nodes[1],
            nodes[ring + 1] - at if ring + 1 < len(nodes) else at - nodes[ring - 1],
        )
        most = 1 if symmetric or not ring else AROUND * max(1, round(at / radius * rings))
        count = next(
            (n for n in range(AROUND, most, AROUND) if around(at, 2 * np.pi / n) <= allowed), most
        )
        out += [(Place(ring, at, 2 * np.pi * k / count, count), step) for k in range(count)]
    return out


def _nodes_between(
    between: Callable[..., Any], first: int, last: int, step: float, allowed: float
) -> list[float]:
    """Return the radii of the rings that are needed beyond ring `first`, up to `last`.

    The range is halved as long as its middle is a ring of the grid and the error is not allowed. A
    range that cannot be halved keeps all its rings.
    """
    if (last - first) % 2 or between(first * step, last * step) <= allowed:
        return (
            [ring * step for ring in range(first + 1, last + 1)]
            if (last - first) % 2
            else [last * step]
        )
    middle = (first + last) // 2
    return [
        *_nodes_between(between, first, middle, step, allowed),
        *_nodes_between(between, middle, last, step, allowed),
    ]


def places(rings: int, radius: float, symmetric: bool) -> list[Place]:
    """Return the polar grid of field points.

    Parameters
    ----------
    rings : number of rings around the axis.
    radius : radius of the outermost ring, field coordinates.
    symmetric : whether the wavefront is rotationally symmetric; each ring then has one point.
    """
    out = [Place(0, 0.0, 0.0, 1)]
    for ring in range(1, rings + 1):
        count = 1 if symmetric else AROUND * ring
        out += [
            Place(ring, radius * ring / rings, 2 * np.pi * k / count, count) for k in range(count)
        ]
    return out


def weight(
    place: Place, step: float | tuple[float, float], x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """Return the share of each tile's light, (y, x), that the point spread of one point spreads.

    Parameters
    ----------
    place : point of the polar grid.
    step : distance between rings; or the distances to the next ring inside and to the next outside.
    x, y : (x,) and (y,) tile centres, in the unit of the grid.
    """
    u = np.asarray(x, float)[None, :]
    v = np.asarray(y, float)[:, None]
    inside, outside = step if np.ndim(step) else (step, step)
    beyond = np.hypot(u, v) - place.radius
    radial = np.maximum(1 - np.where(beyond < 0, -beyond / inside, beyond / outside), 0.0)
    if place.count == 1:
        return radial
    turns = (np.arctan2(-v, u) - place.azimuth_rad) / (2 * np.pi) * place.count
    around = np.abs(turns - place.count * np.rint(turns / place.count))
    return radial * np.maximum(1 - around, 0.0)


def first_quadrant(place: Place) -> tuple[Place, tuple[int, ...]]:
    """Return a point between +x and +y, and the axes (0: y, 1: x) along which it must be mirrored
    to give `place`.
    """
    turn = place.azimuth_rad % (2 * np.pi)
    flips = ((0,) if turn > np.pi + 1e-9 else ()) + ((1,) if np.cos(turn) < -1e-9 else ())
    return replace(
        place, azimuth_rad=float(np.arctan2(abs(np.sin(turn)), abs(np.cos(turn))).round(12))
    ), flips


def is_mirrored(wavefronts: Sequence[dict[int, float]]) -> bool:
    """Return whether every wavefront {OSA index: um} is symmetric about the x axis. The wavefronts
    of a rotationally symmetric lens along +x have this symmetry.
    """
    return all(order(int(j))[1] >= 0 for w in wavefronts for j, value in w.items() if value != 0)


def is_symmetric(wavefronts: Sequence[dict[Any, Any] | dict[int, float]]) -> bool:
    """Return whether every wavefront {OSA index: um} is rotationally symmetric."""
    return all(order(int(j))[1] == 0 for w in wavefronts for j, value in w.items() if value != 0)
