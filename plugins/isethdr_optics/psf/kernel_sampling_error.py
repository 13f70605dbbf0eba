"""Kernel sampling error: error of a kernel beyond its exact core, from the difference between its
two independent estimates.

It is stated per octave of the distance to the axis: 1 to 2 tiles, 2 to 4, and so on.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

OCTAVES = 13  # number of octaves; the last holds 4096 tiles and more
ROWS = 256  # number of rows of a kernel from which errors per tile are computed
BLOCKS = (2, 4, 8)  # sides of the blocks of tiles over which errors are compared, tiles
LEAST_BLOCKS = 16  # least number of blocks of an octave for which the comparison is used


@lru_cache(maxsize=4)
def octaves(shape: tuple[int, int]) -> np.ndarray:
    """Return the octave (y, x), int8, of every tile of a kernel with the axis in its middle."""
    y, x = (np.arange(n) - n // 2 for n in shape)
    return octave_of(y[:, None], x)


def octave_of(y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return the octave, int8, of tiles `y` and `x` from the axis."""
    squares = np.maximum(np.square(y, dtype=np.float32) + np.square(x, dtype=np.float32), 1.0)
    # the exponent of a float is log2, rounded down
    exponent = np.frexp(squares)[1] - 1
    return np.minimum(exponent // 2, OCTAVES - 1).astype(np.int8)


def core(wrong: np.ndarray) -> int:
    """Return the largest number of tiles from the axis, along both y and x, within which `wrong` is
    0 everywhere.
    """
    y, x = (np.abs(np.arange(n) - n // 2) for n in wrong.shape)
    return int(np.maximum(y[:, None], x)[wrong != 0].min(initial=max(wrong.shape))) - 1


def by_octave(wrong: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Return the relative L1 error (octave,): the sum of the magnitudes of `wrong` divided by the
    sum of the kernel, over tiles where `wrong` is not 0.

    Parameters
    ----------
    wrong : (y, x) error of the kernel.
    kernel : (y, x) kernel.
    """
    rows = slice(None, None, max(1, len(kernel) // ROWS))
    wrong = np.abs(wrong[rows])
    light = kernel[rows]
    octave = octaves(kernel.shape)[rows]
    nonzero = wrong > 0
    return _ratio(*(np.bincount(octave[nonzero], a[nonzero], OCTAVES) for a in (wrong, light)))


def deviation(wrong: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Return the relative standard deviation d (octave,) of the image of any light pattern.

    The variance of the image of light L is the sum of (d k L)^2 for the kernel k. d is the root
    mean square of `wrong` over that of the kernel, times the root of the number of tiles with
    correlated errors. With the covariance C_st of the errors of tiles s and t, the sum of
    L_s L_t C_st is at most the sum over s of L_s^2 times the sum over t of C_st, because
    2 L_s L_t <= L_s^2 + L_t^2.

    Parameters
    ----------
    wrong : (y, x) error of the kernel.
    kernel : (y, x) kernel.
    """
    octave = octaves(kernel.shape)
    rows = slice(None, None, max(1, len(kernel) // (2 * ROWS)))
    nonzero = wrong[rows] != 0
    error, light = (
        np.bincount(octave[rows][nonzero], a[rows][nonzero].astype(float) ** 2, OCTAVES)
        for a in (wrong, kernel)
    )
    return np.sqrt(_ratio(error, light) * _alike(wrong, octave))


def _alike(wrong: np.ndarray, octave: np.ndarray) -> np.ndarray:
    """Return the effective number of tiles with correlated errors (octave,).

    It is the variance of the sum over a block, divided by the sum of the variances in the block,
    for the block size where it is largest.
    """
    ny, nx = wrong.shape
    y = np.arange(ny - ny // 2)  # rows from the axis on
    # of a large kernel, only stripes as high as the largest block are used farther out
    y = y[(y < ROWS // 2) | (y // BLOCKS[-1] % max(1, ny // (2 * ROWS)) == 0)]
    # kernels fall as r^-3: with this factor all tiles of an octave have about the same weight
    level = wrong[y + ny // 2] * np.hypot(y[:, None], np.arange(nx) - nx // 2) ** 3
    octave = octave[y + ny // 2]
    out = np.ones(OCTAVES)
    for m in BLOCKS:
        rows, columns = (n // m for n in level.shape)
        if not rows or not columns:
            break

        def blocks(
            a: np.ndarray, m: int = m, rows: int = rows, columns: int = columns
        ) -> np.ndarray:
            return a[: rows * m, : columns * m].reshape(rows, m, columns, m)

        first = blocks(octave)[:, 0, :, 0]
        uniform_blocks = (blocks(octave) == first[:, None, :, None]).all((1, 3)) & (
            blocks(level) != 0
        ).all((1, 3))
        of_sum = blocks(level).sum((1, 3)) ** 2
        of_parts = (blocks(level) ** 2).sum((1, 3))
        enough = np.bincount(first[uniform_blocks], minlength=OCTAVES) >= LEAST_BLOCKS
        alike = _ratio(
            *(
                np.bincount(first[uniform_blocks], a[uniform_blocks], OCTAVES)
                for a in (of_sum, of_parts)
            )
        )
        out = np.where(enough, np.maximum(out, alike), out)
    return out


def _ratio(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.divide(a, b, out=np.zeros(OCTAVES), where=b > 0)


class ColumnErrors:
    """Estimates of `by_octave` and `deviation` from the errors of a few columns of tiles."""

    def __init__(self) -> None:
        self._sums = np.zeros((5, OCTAVES))  # |wrong|, wrong, light, wrong^2, light^2
        # per block size: number of blocks, sum of squared sums, sum of squares
        self._blocks = np.zeros((len(BLOCKS), 3, OCTAVES))

    def add(self, wrong: np.ndarray, light: np.ndarray, first: int, core: tuple[int, int]) -> None:
        """Add columns of tiles.

        Parameters
        ----------
        wrong : (y, column) error of the light of tiles, with the axis in the middle of y.
        light : (y, column) light of the tiles.
        first : first column, tiles from the axis.
        core : (y, x) tiles from the axis within which tiles do not count.
        """
        y = np.arange(len(wrong)) - len(wrong) // 2
        x = first + np.arange(wrong.shape[1])
        radius = np.hypot(y[:, None], x)
        octave = np.minimum(np.log2(radius), OCTAVES - 1).astype(np.int8)
        beyond = (np.abs(y)[:, None] > core[0]) | (x > core[1])
        parts = np.abs(wrong), wrong, light, wrong**2, light**2
        self._sums += [np.bincount(octave[beyond], a[beyond], OCTAVES) for a in parts]
        octave = np.where(beyond, octave, -1)
        # kernels fall as r^-3: with this factor all tiles of an octave have about the same weight
        level = wrong * radius**3
        for m, into in zip(BLOCKS, self._blocks):
            rows, columns = (n // m for n in level.shape)
            if not (rows and columns):
                break
            shape = (rows, m, columns, m)
            cut = (slice(rows * m), slice(columns * m))
            own = octave[cut].reshape(shape)
            blocks = level[cut].reshape(shape)
            place = own[:, 0, :, 0]
            uniform_blocks = (own == place[:, None, :, None]).all((1, 3)) & (place >= 0)
            of_sum = blocks.sum((1, 3)) ** 2
            of_parts = (blocks**2).sum((1, 3))
            parts = np.ones(uniform_blocks.shape), of_sum, of_parts
            into += [np.bincount(place[uniform_blocks], a[uniform_blocks], OCTAVES) for a in parts]

    def relative(self) -> np.ndarray:
        """Return the sum of the magnitudes of the error divided by the sum of the light,
        (octave,).
        """
        return _ratio(self._sums[0], self._sums[2])

    def mean(self) -> np.ndarray:
        """Return the sum of the error divided by the sum of the light, (octave,)."""
        return _ratio(self._sums[1], self._sums[2])

    def deviation(self) -> np.ndarray:
        """Return the relative standard deviation of the image of any light pattern, (octave,); see
        the function `deviation`.
        """
        alike = np.ones(OCTAVES)
        for count, of_sum, of_parts in self._blocks:
            largest = np.maximum(alike, _ratio(of_sum, of_parts))
            alike = np.where(count >= LEAST_BLOCKS, largest, alike)
        return np.sqrt(_ratio(self._sums[3], self._sums[4]) * alike)
