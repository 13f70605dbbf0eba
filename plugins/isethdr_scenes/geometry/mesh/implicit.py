"""Implicit surfaces: smooth unions of tapered capsules, meshed by marching cubes.

A field is a function of points (n, 3), negative inside, with `lo` and `hi`: the corners of a box
around its surface.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from isethdr_core.extras import needed

from .piece import Piece, unit


def cone(a: np.ndarray, b: np.ndarray, ra: float, rb: float) -> Callable[..., Any]:
    """Return the field of a capsule from `a` to `b` whose radius runs from `ra` to `rb`, m.

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
    size2 = max(((b - a) ** 2).sum(), 1e-12)

    def distance(p: np.ndarray) -> np.ndarray:
        w = p - a
        t = np.clip((w @ along) / size2, 0, 1)
        x, y, z = (w[:, k] - t * along[k] for k in range(3))
        return np.sqrt(x * x + y * y + z * z) - ra - t * (rb - ra)

    distance.lo = np.minimum(a, b) - max(ra, rb)
    distance.hi = np.maximum(a, b) + max(ra, rb)
    return distance


def blend(
    fields: Sequence[Callable[..., Any]], k: float = 0.03, folds: float = 0.0, seed: int = 0
) -> Callable[..., Any]:
    """Return the smooth union of `fields`; they melt together where they differ by less than `k`
    metres.

    The union is the quadratic smooth minimum. `folds` adds cloth-like waves of that height, m,
    drawn from `seed`.

    Parameters
    ----------
    fields : fields to unite, as those of `cone`.
    k : difference below which fields melt together, m.
    folds : height of cloth-like waves, m.
    seed : of the waves.
    """
    rng = np.random.default_rng(seed)
    # radians per metre: folds hang down, so they are closer vertically
    waves = rng.normal(size=(5, 3)) * [
        18,
        18,
        30,
    ]
    phase = rng.uniform(0, 2 * np.pi, 5)

    def distance(p: np.ndarray) -> np.ndarray:
        distance = fields[0](p)
        for field in fields[1:]:
            d = field(p)
            difference = np.abs(distance - d)
            close = np.flatnonzero(difference < k)
            near = (k - difference[close]) / k
            distance = np.minimum(distance, d)
            distance[close] -= near * near * k / 4
        if folds:
            distance = distance + folds * np.abs(np.sin(p @ waves.T + phase)).mean(1) - folds * 0.5
        return distance

    distance.lo = np.min([f.lo for f in fields], 0)
    distance.hi = np.max([f.hi for f in fields], 0)
    return distance


def skin_of(field: Callable[..., Any], step: float, name: str, material: str) -> Piece:
    """Return the zero surface of a field, sampled every `step` metres; normals are the field's own
    gradient.

    Parameters
    ----------
    field : field whose zero surface is taken, with its bounds `lo` and `hi`, m.
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
    slope = np.stack([field(vertices + e) - field(vertices - e) for e in ends], -1)
    return Piece(name, vertices, faces, material, unit(slope))


def _sampled(field: Callable[..., Any], axes: Sequence[np.ndarray], step: float) -> np.ndarray:
    """Return the field on a grid: exact near its surface, elsewhere the value in the middle of a
    block of 4 x 4 x 4.

    No field here is steeper than 1.5, so a block whose middle is further away than 1.5 half
    diagonals has no surface.
    """
    block = 4
    middles = [a[np.minimum(np.arange(0, len(a), block) + block // 2, len(a) - 1)] for a in axes]
    coarse = np.stack(np.meshgrid(*middles, indexing="ij"), -1)
    values = field(coarse.reshape(-1, 3)).reshape(coarse.shape[:3])
    for k, axis in enumerate(axes):
        values = np.repeat(values, block, axis=k).take(np.arange(len(axis)), axis=k)
    near = np.abs(values) < 1.5 * np.sqrt(3) * block / 2 * step + step
    i, j, k = np.nonzero(near)
    values[near] = field(np.stack([axes[0][i], axes[1][j], axes[2][k]], 1))
    return values
