"""Field grid: where in the field the point spread is computed, and the weights by which a tile's
light is shared by those places.

The grid is polar: one place on the axis, rings of places around it. Weights are linear along the
radius and around the axis, never negative, and sum to 1 in every tile. A wavefront is known along
+x of the field; anywhere else it is turned about the axis.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from isethdr_core.physics.optics.zernike import order

# places on the first ring of an asymmetric wavefront; rings farther out have as many more as they
# are longer
AROUND = 8


@dataclass(frozen=True)
class Place:
    """A place of the field grid."""

    ring: int
    radius: float  # field coordinate
    azimuth_rad: float  # counter-clockwise from +x, y up
    count: int  # places on its ring


def thinned(
    rings: int, radius: float, symmetric: bool, between, around, allowed: float
) -> list[tuple[Place, tuple[float, float]]]:
    """Return the grid without the rings and the places around the axis that it can do without, and
    each place's `step` for `weight`.

    Parameters
    ----------
    between : function(inner radius, outer radius), error half way between two places. `around` :
        function(radius, angle between places).
    allowed : the largest error.
    """
    known = [0.0, *_kept(between, 0, rings, radius / rings, allowed)]
    out = []
    for ring, at in enumerate(known):
        step = (
            at - known[ring - 1] if ring else known[1],
            known[ring + 1] - at if ring + 1 < len(known) else at - known[ring - 1],
        )
        most = 1 if symmetric or not ring else AROUND * max(1, round(at / radius * rings))
        count = next(
            (n for n in range(AROUND, most, AROUND) if around(at, 2 * np.pi / n) <= allowed), most
        )
        out += [(Place(ring, at, 2 * np.pi * k / count, count), step) for k in range(count)]
    return out


def _kept(between, first, last, step, allowed) -> list[float]:
    """Return the radii beyond ring `first` up to `last` whose rings are needed; halves are asked
    for where they are whole rings.
    """
    if (last - first) % 2 or between(first * step, last * step) <= allowed:
        return (
            [ring * step for ring in range(first + 1, last + 1)]
            if (last - first) % 2
            else [last * step]
        )
    middle = (first + last) // 2
    return [
        *_kept(between, first, middle, step, allowed),
        *_kept(between, middle, last, step, allowed),
    ]


def places(rings: int, radius: float, symmetric: bool) -> list[Place]:
    """Return the grid with `rings` rings up to `radius`; one place per ring where the wavefront is
    the same all around.
    """
    out = [Place(0, 0.0, 0.0, 1)]
    for ring in range(1, rings + 1):
        count = 1 if symmetric else AROUND * ring
        out += [
            Place(ring, radius * ring / rings, 2 * np.pi * k / count, count) for k in range(count)
        ]
    return out


def weight(place: Place, step, x, y) -> np.ndarray:
    """Return the share of each tile's light, (y, x), that is spread as at `place`.

    `step` : from ring to ring; or the distances to the next ring inside and to the next outside.
    """
    u, v = np.asarray(x, float)[None, :], np.asarray(y, float)[:, None]
    inside, outside = step if np.ndim(step) else (step, step)
    beyond = np.hypot(u, v) - place.radius
    radial = np.maximum(1 - np.where(beyond < 0, -beyond / inside, beyond / outside), 0.0)
    if place.count == 1:
        return radial
    turns = (np.arctan2(-v, u) - place.azimuth_rad) / (2 * np.pi) * place.count
    around = np.abs(turns - place.count * np.rint(turns / place.count))
    return radial * np.maximum(1 - around, 0.0)


def first_quadrant(place: Place) -> tuple[Place, tuple[int, ...]]:
    """Return the place among those from +x to +y that mirrors into `place`, and the axes (0: y, 1:
    x) along which to mirror.
    """
    turn = place.azimuth_rad % (2 * np.pi)
    flips = ((0,) if turn > np.pi + 1e-9 else ()) + ((1,) if np.cos(turn) < -1e-9 else ())
    return replace(
        place, azimuth_rad=float(np.arctan2(abs(np.sin(turn)), abs(np.cos(turn))).round(12))
    ), flips


def is_mirrored(wavefronts) -> bool:
    """Return whether every wavefront is its own mirror image, up and down, as those of a round lens
    are along +x.
    """
    return all(order(int(j))[1] >= 0 for w in wavefronts for j, value in w.items() if value != 0)


def is_symmetric(wavefronts) -> bool:
    """Return whether every wavefront {OSA index: um} is the same all around the axis."""
    return all(order(int(j))[1] == 0 for w in wavefronts for j, value in w.items() if value != 0)
