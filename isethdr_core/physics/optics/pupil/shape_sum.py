"""Shape sum: the transmission of a pupil as a sum of shapes and of their intersections.

The transmission is the aperture times the product of (1 - loss) over all dirt. Expanded, it is a
sum over every set of shapes that overlap: their intersection, times the product of their -loss.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import prod
from typing import Any

import numpy as np

from .convex import Convex

MOST_TERMS = 20000  # largest number of terms of a sum; to compute so many takes seconds


def opening(aperture: Convex, losses: list[Any]) -> list[tuple[Convex, float]]:
    """Return the transmission of an aperture with dirt as a sum of (shape, weight).

    Each term has the value `weight` inside its shape, and 0 outside.

    Parameters
    ----------
    aperture : the open pupil, mm.
    losses : list of (shape, loss) of the dirt; the loss is 1 - amplitude transmission. It is
        complex, 1 - a exp(i phase), for a grain that passes the amplitude a and delays it.

    Raises
    ------
    ValueError : so much dirt overlaps that the sum has more than `MOST_TERMS` terms.
    """
    return weighted(
        overlaps(aperture, [shape for shape, _ in losses]), [loss for _, loss in losses]
    )


def overlaps(aperture: Convex, dirt: Sequence[Any]) -> list[tuple[Convex, tuple[int, ...]]]:
    """Return the intersection of every set of shapes of dirt that overlap within the aperture.

    Parameters
    ----------
    aperture : the open pupil, mm.
    dirt : shapes of the dirt, mm.

    Returns
    -------
    list of (intersection, indices of the set in `dirt`); the first is the aperture itself, ().

    Raises
    ------
    ValueError : there are more than `MOST_TERMS` sets.
    """
    return list(_overlaps(aperture, tuple(dirt)))


@lru_cache(maxsize=16)
def _overlaps(aperture: Convex, dirt: tuple[Convex, ...]) -> list:
    """Return `overlaps`.

    To save time, pairs of shapes whose bounding boxes do not overlap are not intersected. An
    intersection leaves out those borders of one shape that lie beyond the other one: they would
    cost time in every chord.
    """
    overlaps: list[tuple[Convex, tuple[int, ...]]] = [(aperture, ())]
    bounds = np.array([[aperture.low, aperture.high, -np.inf, np.inf]])
    for index, shape in enumerate(dirt):
        if len(overlaps) > MOST_TERMS:
            raise ValueError(
                f"the aperture's dirt overlaps in more than {MOST_TERMS} ways; expected less or"
                " smaller dirt"
            )
        own = np.array([shape.low, shape.high, *shape.sides()])
        near = np.ones(len(overlaps), bool)
        for low, high in ((0, 1), (2, 3)):
            near &= (bounds[:, low] < own[high]) & (own[low] < bounds[:, high])
        shared = []
        for place in np.flatnonzero(near):
            part, shapes_inside = overlaps[place]
            both = part.within(own) & shape
            if both.is_empty():
                continue
            overlaps.append((both, (*shapes_inside, index)))
            inner = np.maximum(bounds[place], own)
            inner[1::2] = np.minimum(bounds[place], own)[1::2]
            shared.append(inner)
        if shared:
            bounds = np.concatenate([bounds, shared])
    return overlaps


def weighted(
    overlapping: list[tuple[Convex, tuple[Any, ...]]], losses: list[Any]
) -> list[tuple[Convex, float]]:
    """Return the sum of (shape, weight) of `opening` for intersections that are known.

    Parameters
    ----------
    overlapping : list of (intersection, indices), as `overlaps` returns.
    losses : the loss of every shape of dirt, 1 - amplitude transmission.
    """
    return [
        (part, prod((-losses[i] for i in covering), start=1.0)) for part, covering in overlapping
    ]
