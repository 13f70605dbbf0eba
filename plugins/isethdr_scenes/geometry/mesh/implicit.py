"""Implicit surfaces: smooth unions of tapered capsules, meshed by marching cubes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from isethdr_core.extras import needed

from .piece import Piece, squared_length, unit

BLOCK = 16384  # number of points whose field is computed at a time
YXZ = [1, 0, 2]

Values = Callable[[np.ndarray], np.ndarray]  # maps points (n, 3), m, to values (n,)


@dataclass(frozen=True, eq=False)
class Field:
    """A function of points (n, 3), m, that is negative inside a surface."""

    values: Values
    lo: np.ndarray  # (3,) corners of a box around the surface, m
    hi: np.ndarray
    # centre (3,) and radius of a ball, m; the field is nowhere less than the distance to the ball
    ball: tuple[np.ndarray, float] | None = None
    # the field without its folds, which are slow to compute; None: the field has no folds
    plain: Values | None = None
    folds_m: float = 0.0  # largest change of the field by its folds

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Return the values (n,), m, at points (n, 3)."""
        return self.values(points)

    def without_folds(self, points: np.ndarray) -> np.ndarray:
        """Return the values (n,), m, with an error of at most `folds_m`."""
        return (self.plain or self.values)(points)

    def within(self, other: Values) -> Field:
        """Return the field of the part of this body where `other` is negative."""
        outside = lambda p: other(np.ascontiguousarray(p))
        both = lambda p: np.maximum(self(p), outside(p))
        plain = lambda p: np.maximum(self.without_folds(p), outside(p))
        return Field(both, self.lo, self.hi, self.ball, plain, self.folds_m)


def cone(a: np.ndarray, b: np.ndarray, ra: float, rb: float) -> Field:
    """Return the field of a tapered capsule from `a` to `b`, with radii from `ra` to `rb`, m.

    Parameters
    ----------
    a : (3,) first end of the axis, m.
    b : (3,) last end of the axis, m.
    ra : radius at `a`, m.
    rb : radius at `b`, m.
    """
    a = np.asarray(a, float)
    b = np.asarray(b, float)

    along = b - a
    # Two equal rows, with y before x: this matrix product has the same rounding as `w @ along` of a
    # C-ordered array, and takes half the time.
    rows = np.stack([along, along])[:, YXZ]
    size2 = max(((b - a) ** 2).sum(), 1e-12)

    def distance(p: np.ndarray) -> np.ndarray:
        w = p - a
        t = (rows @ w.T[YXZ])[0]  # place of the nearest point on the axis, from 0 to 1
        t /= size2
        np.maximum(t, 0, out=t)
        np.minimum(t, 1, out=t)
        out = np.zeros(len(p))
        for k in range(3):
            side = t * along[k]
            np.subtract(w[:, k], side, out=side)
            side *= side
            out += side
        np.sqrt(out, out=out)
        out -= ra
        t *= rb - ra
        out -= t
        return out

    widest = max(ra, rb)
    ball = (a + b) / 2, float(np.sqrt(size2)) / 2 + widest
    return Field(distance, np.minimum(a, b) - widest, np.maximum(a, b) + widest, ball)


def blend(fields: Sequence[Field], k: float = 0.03, folds: float = 0.0, seed: int = 0) -> Field:
    """Return the smooth union of `fields`: their quadratic smooth minimum.

    Parameters
    ----------
    fields : fields to unite, such as those of `cone`.
    k : difference of two fields below which they melt together, m.
    folds : height of cloth-like waves that are added, m.
    seed : seed of the waves.
    """
    lo = np.min([f.lo for f in fields], 0)
    hi = np.max([f.hi for f in fields], 0)
    half = (hi - lo) / 2
    radius = float(np.linalg.norm(half)) + (len(fields) - 1) * k / 4 + folds / 2
    ball = (lo + half, radius) if all(f.ball for f in fields) else None
    folds_m = folds / 2 + max(f.folds_m for f in fields)
    balls = [f.ball for f in fields]
    plain = lambda p: _united([f.without_folds for f in fields], balls, k, p)
    smooth = lambda p: _united([f.values for f in fields], balls, k, p)
    if not folds:
        return Field(smooth, lo, hi, ball, plain if folds_m else None, folds_m)
    rng = np.random.default_rng(seed)
    # radians per metre: folds hang down, so they are closer vertically
    waves = rng.normal(size=(5, 3)) * [18, 18, 30]
    phase = rng.uniform(0, 2 * np.pi, 5)

    def folded(p: np.ndarray) -> np.ndarray:
        heights = np.abs(np.sin(waves @ p.T + phase[:, None])).mean(0)
        return smooth(p) + folds * heights - folds * 0.5

    return Field(folded, lo, hi, ball, plain, folds_m)


def _united(
    fields: Sequence[Values],
    balls: Sequence[tuple[np.ndarray, float] | None],
    k: float,
    points: np.ndarray,
) -> np.ndarray:
    """Return the smooth minimum (n,) of fields, m.

    Each field is computed only at the points where it may change the result.

    Parameters
    ----------
    fields : distances to unite.
    balls : centre and radius, m, of the ball of each field; None: it is computed everywhere.
    k : difference below which they melt together, m.
    points : (n, 3) m.
    """
    out = fields[0](points)
    size2 = squared_length(points)
    for field, ball in zip(fields[1:], balls[1:]):
        if ball is None:
            out = _melted(out, field(points), k)
            continue
        # a field is at least the distance to its ball, so it does not change points further away
        centre, radius = ball
        reach = np.maximum(out + (radius + k + 1e-6), 0)
        reach *= reach
        reach -= size2
        reach += points @ (2 * centre)
        some = np.flatnonzero(reach > centre @ centre)
        if len(some):
            out[some] = _melted(out.take(some), field(points.T.take(some, 1).T), k)
    return out


def _melted(a: np.ndarray, b: np.ndarray, k: float) -> np.ndarray:
    """Return the quadratic smooth minimum (n,) of two distances, m.

    Parameters
    ----------
    a : (n,) distance, m.
    b : (n,) the other distance, m.
    k : difference below which they melt together, m.
    """
    difference = np.abs(a - b)
    close = np.flatnonzero(difference < k)
    near = (k - difference.take(close)) / k
    out = np.minimum(a, b)
    out[close] -= near * near * k / 4
    return out


def skin_of(field: Field, step: float, name: str, material: str) -> Piece:
    """Return the zero surface of a field as a mesh. Its normals are the gradient of the field.

    Parameters
    ----------
    field : field, with its bounds `lo` and `hi`, m.
    step : spacing of the samples, m.
    name : name of the piece.
    material : name of the material.
    """
    with needed("a surface of a level set", extra="mitsuba"):
        from skimage.measure import marching_cubes

    margin = 2.5 * step
    axes = [np.arange(a - margin, b + margin + step, step) for a, b in zip(field.lo, field.hi)]
    values = _sampled(field, axes, step)
    vertices, faces, _, _ = marching_cubes(
        values, 0.0, spacing=(step,) * 3, gradient_direction="descent"
    )
    vertices = vertices + np.array([a[0] for a in axes])
    ends = 0.7 * step * np.eye(3)
    at = lambda points: _in_blocks(field.values, points)
    slope = np.stack([at(vertices + e) - at(vertices - e) for e in ends], -1)
    return Piece(name, vertices, faces, material, unit(slope))


def _sampled(field: Field, axes: Sequence[np.ndarray], step: float) -> np.ndarray:
    """Return the field on a grid.

    Values near the surface are exact. Elsewhere all points of a block of 4 x 4 x 4 get the value in
    its middle. The gradient of these fields is at most 1.5. So a block holds no surface if the
    value in its middle exceeds 1.5 times half its diagonal.
    """
    block = 4
    middles = [a[np.minimum(np.arange(0, len(a), block) + block // 2, len(a) - 1)] for a in axes]
    coarse = np.stack(np.meshgrid(*middles, indexing="ij"), -1)
    rough = _in_blocks(field.without_folds, coarse.reshape(-1, 3))
    values = rough.reshape(coarse.shape[:3])
    for k, axis in enumerate(axes):
        values = np.repeat(values, block, axis=k).take(np.arange(len(axis)), axis=k)
    near = np.abs(values) < 1.5 * np.sqrt(3) * block / 2 * step + step + field.folds_m
    i, j, k = np.nonzero(near)
    points = np.stack([axes[0].take(i), axes[1].take(j), axes[2].take(k)], 1)
    found = _in_blocks(field.without_folds, points)
    if field.folds_m:
        # at the corners of a cell that holds surface, the field is at most 1.5 diagonals
        crossed = np.abs(found) < 1.5 * np.sqrt(3) * step + field.folds_m
        exact = np.flatnonzero(crossed)
        found[exact] = _in_blocks(field.values, points.take(exact, 0))
    values[near] = found
    return values


def _in_blocks(values: Values, points: np.ndarray) -> np.ndarray:
    """Return a field (n,), m, at points (n, 3), in blocks that fit the processor's cache.

    Each coordinate of a block is contiguous in memory, because fields compute coordinate by
    coordinate.
    """
    out = np.empty(len(points))
    for first in range(0, len(points), BLOCK):
        out[first : first + BLOCK] = values(np.asfortranarray(points[first : first + BLOCK]))
    return out
