"""Triangles on a grid of angles, subdivided until the chords of their curved sides are accurate.

On a grid of tangents, straight lines stay straight. On a grid of angles they are curved. At 90
degrees off the axis, the deviation from the chord is about 0.08 times the square of the length, in
radians. It grows without limit near the direction opposite to the axis, where the grid ends.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .view import View

LONGEST = 0.2  # longest side that is not subdivided, rad
# Largest number of subdivisions, each of which halves the sides. A triangle that is still curved
# after them surrounds the direction opposite to the axis, or touches the pinhole.
LEVELS = 16


def straightened(triangles: np.ndarray, view: View, off: float) -> tuple[np.ndarray, np.ndarray]:
    """Divide triangles until their sides are nearly straight on the grid of `view`.

    Parameters
    ----------
    triangles : (n, 3, 3) corners in camera axes, m.
    view : tiles of the frame.
    off : largest distance of the middle of a side from its chord, rad.

    Returns
    -------
    parts (m, 3, 3), m, and which (m,): the index of the triangle to which each part belongs. The
    parts of a triangle cover it without overlap. Parts wholly outside the grid are dropped, and
    triangles that are still curved after `LEVELS` subdivisions are dropped.
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
        # product of the distance from the chord and the length of the chord
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
    """Return the points (n, 3, 3) on the sides that halve the angle between the ends of each side
    as seen from the pinhole (angle bisector theorem).
    """
    after = np.roll(triangles, -1, 1)
    length = np.linalg.norm(triangles, axis=-1)
    share = length / np.maximum(length + np.roll(length, -1, 1), 1e-300)
    return triangles + share[..., None] * (after - triangles)


def _widest(triangles: np.ndarray) -> np.ndarray:
    """Return (n,) the largest angle, rad, between the ends of a side as seen from the pinhole."""
    unit = triangles / np.maximum(np.linalg.norm(triangles, axis=-1, keepdims=True), 1e-300)
    return 2 * np.arcsin(
        np.clip(np.linalg.norm(np.roll(unit, -1, 1) - unit, axis=-1).max(1) / 2, 0, 1)
    )
