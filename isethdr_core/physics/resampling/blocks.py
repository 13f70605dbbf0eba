"""Blocks: means over the cells of a colour filter array, in which each of its filters counts
equally.
"""

from __future__ import annotations

from math import isqrt
from typing import NamedTuple

import numpy as np

# largest ratio of the luminances of a pixel and of its block if the block stands for the pixel; a
# steep ramp, which changes by a factor of 2.5 within a block, still counts
ALIKE = 2.0


class Block(NamedTuple):
    """The size of a block of pixels."""

    rows: int
    columns: int

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return self.rows * self.columns


# whole cells of 1 x 1, 2 x 2 and 4 x 4 filters, for arrays that are not known
UNKNOWN_ARRAY = Block(4, 4)


def block_of(pattern: str | None) -> Block:
    """Return the cell of a colour filter array as a block; `UNKNOWN_ARRAY` if it is not known.

    Parameters
    ----------
    pattern : rows of letters parted by `/`, such as RG/WB, or a square, such as RGGB; None if a
        picture does not state its array.
    """
    if not pattern:
        return UNKNOWN_ARRAY
    rows = pattern.split("/")
    if len(rows) > 1:
        return Block(len(rows), len(rows[0]))
    side = isqrt(len(pattern))
    return Block(side, side) if side**2 == len(pattern) else UNKNOWN_ARRAY


def block_means(values: np.ndarray, use: np.ndarray, block: Block) -> np.ndarray:
    """Return for each pixel (y, x) the mean of `values` over those pixels of its block that count.

    Parameters
    ----------
    values : (y, x), any unit.
    use : bool (y, x), pixels that count.
    block : size of a block.

    Notes
    -----
    Blocks lie side by side. Pixels that remain at the lower and right border get the mean of the
    last whole block there, which overlaps its neighbour. The mean is 0 where no pixel of a block
    counts.
    """
    total = _sums(_sums(np.where(use, values, 0.0), block.rows).T, block.columns).T
    count = _sums(_sums(use.astype(np.uint32), block.rows).T, block.columns).T
    means = np.divide(total, count, out=np.zeros_like(total), where=count > 0)
    of_row = np.arange(values.shape[0]) // block.rows
    of_column = np.arange(values.shape[1]) // block.columns
    return means[:, of_column][of_row]


def alike(values: np.ndarray, means: np.ndarray) -> np.ndarray:
    """Return for which pixels (bool) the mean of the block is within a factor `ALIKE` of the value.

    A block at the border of a lamp has a mean that no part of the scene has.

    Parameters
    ----------
    values, means : values and their `block_means`, (y, x), not negative.
    """
    return (values <= ALIKE * means) & (means <= ALIKE * values)


def _sums(values: np.ndarray, count: int) -> np.ndarray:
    """Return the sums of `count` rows each, (row of blocks, column)."""
    side = max(min(count, len(values)), 1)
    whole = len(values) // side * side
    total = values[:whole:side].copy()
    for k in range(1, side):
        total += values[k:whole:side]
    if whole == len(values):
        return total
    return np.concatenate([total, values[-side:].sum(axis=0, keepdims=True, dtype=total.dtype)])
