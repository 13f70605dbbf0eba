"""Field grid: the field points at which the point spread is computed, and the weights that share
the light of each tile among them.

The grid is polar: one point on the axis, and rings of points around it. Weights are linear along
the radius and around the axis, never negative, and sum to 1 in every tile. A wavefront is known
along +x of the field, and is rotated about the axis for all other points.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from isethdr_core.physics.optics.zernike import order

# field points on the first ring for an asymmetric wavefront; their number grows with the length of
# the ring
AROUND = 8


@dataclass(frozen=True)
class Place:
    """One point of the field grid."""

    ring: int
    radius: float  # in field coordinates
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
    """Return the grid without the rings and points that the error allowed does not need, and the
    `step` of each point for `weight`.

    Parameters
    ----------
    rings, radius, symmetric : as `places`.
    between : function(inner radius, outer radius) -> error half way between two points.
    around : function(radius, angle between points) -> the same around the axis.
    allowed : the largest error.
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
    """Return the radii beyond ring `first` up to `last` whose rings are needed. A ring between two
    others is tested half way, where that is a whole ring.
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
    symmetric : whether the wavefront is rotationally symmetric; one point per ring then serves.
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
    """Return the share of each tile's light, (y, x), that is spread by the point spread of one
    point.

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
    """Return the point between +x and +y whose mirror image is `place`, and the axes (0: y, 1: x)
    along which to mirror.
    """
    turn = place.azimuth_rad % (2 * np.pi)
    flips = ((0,) if turn > np.pi + 1e-9 else ()) + ((1,) if np.cos(turn) < -1e-9 else ())
    return replace(
        place, azimuth_rad=float(np.arctan2(abs(np.sin(turn)), abs(np.cos(turn))).round(12))
    ), flips


def is_mirrored(wavefronts: Sequence[dict[int, float]]) -> bool:
    """Return whether every wavefront is symmetric about its x axis, as the wavefronts of a round
    lens along +x are.
    """
    return all(order(int(j))[1] >= 0 for w in wavefronts for j, value in w.items() if value != 0)


def is_symmetric(wavefronts: Sequence[dict[Any, Any] | dict[int, float]]) -> bool:
    """Return whether every wavefront {OSA index: um} is rotationally symmetric."""
    return all(order(int(j))[1] == 0 for w in wavefronts for j, value in w.items() if value != 0)
