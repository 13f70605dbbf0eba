"""Triangles on a grid of angles, where their sides are arcs: subdivided until chords are accurate.

On a grid of tangents straight lines stay straight. On a grid of angles they are bent, by about 0.08
of their length squared (radians) at 90 degrees off the axis, and without limit near the point
behind the camera, where the grid ends.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .view import View

LONGEST = 0.2  # rad: longest side that is not subdivided
# each subdivision halves the sides; a triangle that is still bent surrounds the point behind the
# camera, or touches the pinhole
LEVELS = 16


def straightened(triangles: np.ndarray, view: View, off: float) -> tuple[np.ndarray, np.ndarray]:
    """Divide triangles until their sides are nearly straight on the grid of `view`.

    Parameters
    ----------
    triangles : (n, 3, 3) corners in camera axes, m.
    off : largest distance of the middle of a side from its chord, rad.
    view : tiles of the frame.

    Returns
    -------
    parts (m, 3, 3), m, and which (m,): the index of the triangle to which each part belongs. The
    parts of a triangle cover it without overlap. Parts wholly beyond the grid are dropped.
    """
    triangles, which = np.asarray(triangles, float), np.arange(len(triangles))
    reach = np.hypot(np.abs(view.x).max() + view.pitch_x, np.abs(view.y).max() + view.pitch_y)
    done = []
    for level in range(LEVELS + 1):
        flat = view.coordinates(triangles)
        middles = _halves(triangles)
        side = np.roll(flat, -1, 1) - flat
        longest = np.linalg.norm(side, axis=-1)
        middle = view.coordinates(middles) - flat
        # distance from the chord x its length
        area = np.abs(middle[..., 0] * side[..., 1] - middle[..., 1] * side[..., 0])
        straight = ((longest < LONGEST) & (area <= off * longest)).all(1)
        near = np.linalg.norm(flat, axis=-1).min(1) - _widest(triangles) < reach
        done.append((triangles[straight & near], which[straight & near]))
        bent = ~straight & near
        if not bent.any() or level == LEVELS:
            break
        a, b, c = np.moveaxis(triangles[bent], 1, 0)
        ab, bc, ca = np.moveaxis(middles[bent], 1, 0)
        quarters = [np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        triangles = np.concatenate(quarters)
        which = np.tile(which[bent], 4)
    return tuple(np.concatenate(part) for part in zip(*done, strict=True))


def _halves(triangles: np.ndarray) -> np.ndarray:
    """Return the points (n, 3, 3) that halve the angle under which each side is seen (angle
    bisector theorem).
    """
    after = np.roll(triangles, -1, 1)
    length = np.linalg.norm(triangles, axis=-1)
    share = length / np.maximum(length + np.roll(length, -1, 1), 1e-300)
    return triangles + share[..., None] * (after - triangles)


def _widest(triangles: np.ndarray) -> np.ndarray:
    """Return (n,) the largest angle under which a side of each triangle is seen, rad."""
    unit = triangles / np.maximum(np.linalg.norm(triangles, axis=-1, keepdims=True), 1e-300)
    return 2 * np.arcsin(
        np.clip(np.linalg.norm(np.roll(unit, -1, 1) - unit, axis=-1).max(1) / 2, 0, 1)
    )
