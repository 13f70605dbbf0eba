"""Transmitted light: the amplitude at points of a pupil, and the energy that it passes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .convex import Convex
from .shape_sum import opening


def transmission(
    aperture: Convex, losses: list[tuple[Convex, float]], x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """Return the amplitude transmission at points: 0 outside, the product of (1 - loss) inside.

    Parameters
    ----------
    aperture : the open pupil, mm.
    losses : list of (shape, loss) of the dirt; loss is 1 - amplitude transmission.
    x, y : points of the pupil plane, mm; any shapes that broadcast.
    """
    a = aperture.contains(x, y).astype(float)
    for shape, loss in losses:
        a = a * (1 - loss * shape.contains(x, y))
    return a


def energy(aperture: Convex, losses: Sequence[Any], strips: int = 4000) -> float:
    """Return the integral of the squared amplitude over the pupil, mm2.

    The square of a product of transmissions is the product of their squares. The integral is
    therefore a sum of areas of shapes and of their intersections.

    Parameters
    ----------
    aperture : the open pupil, mm.
    losses : list of (shape, loss) of the dirt; loss is 1 - amplitude transmission.
    strips : number of level lines per shape, over which the lengths of chords are integrated.
    """
    # Levels lie at the cosines of evenly spaced angles. This is exact for discs, whose chords grow
    # with the root of the distance to the end.
    total = 0.0
    angle = (np.arange(strips) + 0.5) * np.pi / strips
    for shape, weight in opening(aperture, [(s, 1 - (1 - loss) ** 2) for s, loss in losses]):
        left, right = shape.chords(
            (shape.high + shape.low - (shape.high - shape.low) * np.cos(angle)) / 2
        )
        total += (
            weight
            * (shape.high - shape.low)
            / 2
            * float(np.maximum(right - left, 0.0) @ np.sin(angle))
            * np.pi
            / strips
        )
    return total
