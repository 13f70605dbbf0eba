"""Blocks: means over 4 x 4 pixels, in which each place of a colour filter array counts equally."""

from __future__ import annotations

import numpy as np

# a block of this many pixels on each side holds whole cells of 1 x 1, 2 x 2 and 4 x 4 filters
SIDE = 4
# largest ratio of the luminances of a pixel and of its block if the block stands for the pixel; a
# steep ramp, which changes by a factor of 2.5 within a block, still counts
ALIKE = 2.0


def block_means(values: np.ndarray, use: np.ndarray) -> np.ndarray:
    """Return for each pixel (y, x) the mean of `values` over those pixels of its block that count.

    Parameters
    ----------
    values : (y, x), any unit.
    use : bool (y, x), pixels that count.

    Notes
    -----
    Blocks have `SIDE` x `SIDE` pixels and lie side by side. Pixels that remain at the lower and
    right border get the mean of the last whole block there, which overlaps its neighbour. The mean
    is 0 where no pixel of a block counts.
    """
    total = _sums(_sums(np.where(use, values, 0.0)).T).T
    count = _sums(_sums(use.astype(np.uint8)).T).T  # 16 at most
    means = np.divide(total, count, out=np.zeros_like(total), where=count > 0)
    rows, columns = (np.arange(n) // SIDE for n in values.shape)
    return means[:, columns][rows]


def alike(values: np.ndarray, means: np.ndarray) -> np.ndarray:
    """Return for which pixels (bool) the mean of the block is within a factor `ALIKE` of the value.

    A block at the border of a lamp has a mean that no part of the scene has.

    Parameters
    ----------
    values, means : values and their `block_means`, (y, x), not negative.
    """
    return (values <= ALIKE * means) & (means <= ALIKE * values)


def _sums(values: np.ndarray) -> np.ndarray:
    """Return the sums of `SIDE` rows each, (row of blocks, column)."""
    side = min(SIDE, len(values))
    whole = len(values) // side * side
    total = values[:whole:side].copy()
    for k in range(1, side):
        total += values[k:whole:side]
    if whole == len(values):
        return total
    return np.concatenate([total, values[-side:].sum(axis=0, keepdims=True, dtype=total.dtype)])
