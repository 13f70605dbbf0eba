"""Strip chords: chords through horizontal strips, for all shapes of a sum."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from .convex import Convex

# Positions of two chords in a strip, as shares of its height, by Gauss's rule with equal weights.
GAUSS = (0.5 - 1 / 12**0.5, 0.5 + 1 / 12**0.5)


def strip_blocks(
    terms: list[tuple[Convex, float]], y0: float, step: float, count: int, most: float
) -> list[slice]:
    """Return blocks of horizontal strips with about `most` chords each, in the order of y.

    The memory of chords then does not grow with the number of shapes and strips.

    Parameters
    ----------
    terms : list of (shape, weight).
    y0 : lower border of the first strip, in the unit of the shapes.
    step : height of a strip, same unit.
    count : number of strips.
    most : number of chords in a block, counted as one per shape and strip.
    """
    bounds = np.array([(shape.low, shape.high) for shape, _ in terms]) - y0
    first, last = np.clip(bounds / step, 0, count).T
    total = float((last - first).sum())
    blocks = min(count, max(1, int(np.ceil(total / most))))
    # borders at which the chords so far are equal shares of all chords
    edges = np.linspace(0, count, 16 * blocks + 1).astype(int)
    above = np.array([np.clip(edge - first, 0, last - first).sum() for edge in edges])
    shares = np.linspace(0, total, blocks + 1)[1:-1]
    borders = [0, *edges[np.searchsorted(above, shares)], count]
    return [slice(int(a), int(b)) for a, b in zip(borders, borders[1:]) if a < b]


def chord_ends(
    terms: list[tuple[Convex, complex]],
    y0: float,
    step: float,
    count: int,
    places: Sequence[float] = (0.5,),
    block: slice | None = None,
) -> Iterator[tuple[slice, np.ndarray, np.ndarray, np.ndarray]]:
    """Yield (strip, left, right, weight) of chords through horizontal strips, for all terms.

    Parameters
    ----------
    terms : list of (shape, weight).
    y0 : lower border of the first strip, in the unit of the shapes.
    step : height of a strip, same unit.
    count : number of strips.
    places : positions of chords within a strip, as shares of its height. All chords of a strip
        have the same weight. If a shape fills only a part of the strip's height, the chords lie in
        that part, and their weights sum to its share: horizontal edges are exact.
    block : strips to take, one of `strip_blocks`; None takes all.
    """
    start, stop = (0, count) if block is None else (block.start, block.stop)
    for shape, weight in terms:
        # one more strip on either side, against rounding; strips that miss the shape are dropped
        first, last = (np.clip((bound - y0) / step, 0, count) for bound in (shape.low, shape.high))
        k = np.arange(max(int(first) - 1, start), min(int(last) + 2, stop))
        if not len(k):
            continue
        top = np.maximum(y0 + k * step, shape.low)
        bottom = np.minimum(y0 + (k + 1) * step, shape.high)
        for place in places:
            left, right = shape.chords(top + place * (bottom - top))
            hit = (left < right) & (top < bottom)
            yield k[hit], left[hit], right[hit], ((bottom - top) / step * weight / len(places))[hit]
