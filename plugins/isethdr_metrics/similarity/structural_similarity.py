"""Structural similarity of two planes, computed in strips that fit into the processor's cache."""

from __future__ import annotations

import numpy as np

REACH = 5  # pixels to each side of the middle of the window, 11 in all
SIGMA = 1.5  # pixels: standard deviation of the window
STRIP = 24  # rows worked out together
# from the end of the window to its middle
TAPS = np.exp(-0.5 * (np.arange(REACH + 1) - REACH) ** 2 / SIGMA**2)
TAPS /= 2 * TAPS.sum() - TAPS[-1]


def similarity(first: np.ndarray, second: np.ndarray, data_range: float) -> np.ndarray:
    """Return the map (y, x) of structural similarity (Wang, Bovik, Sheikh, Simoncelli 2004, eq. 13)
    of two planes of one kind of float.

    Parameters
    ----------
    first, second : (y, x), float32 or float64; beyond its borders a plane goes on as its mirror
        image.
    data_range : largest value less the smallest that there can be.

    Notes
    -----
    Window and constants of the paper: Gaussian, 0.01 and 0.03. Only the sum of both variances is
    needed, so four windowed means suffice. Half of the range is subtracted first, which reduces the
    rounding of the squares to a quarter.
    """
    middle = data_range / 2
    of_means = (0.01 * data_range) ** 2
    of_variances = (0.03 * data_range) ** 2
    out = np.empty(first.shape, first.dtype)
    one, other = (
        np.pad(plane - first.dtype.type(middle), REACH, mode="symmetric")
        for plane in (first, second)
    )
    for top in range(0, len(out), STRIP):
        rows = slice(top, top + STRIP + 2 * REACH)
        a = one[rows]
        b = other[rows]
        mean_a, mean_b, squares, product = (
            windowed(values) for values in (a, b, a * a + b * b, a * b)
        )
        covariance = product - mean_a * mean_b
        variances = squares - (mean_a * mean_a + mean_b * mean_b)
        mean_a += middle
        mean_b += middle
        out[top : top + STRIP] = (
            (2 * mean_a * mean_b + of_means)
            * (2 * covariance + of_variances)
            / ((mean_a * mean_a + mean_b * mean_b + of_means) * (variances + of_variances))
        )
    return out


def windowed(values: np.ndarray) -> np.ndarray:
    """Return the means of `values` (y, x) over the window, for the (y, x) less `REACH` on each side
    where all of it lies within.
    """
    for turn in (np.asarray, np.transpose):  # down, then across
        values = turn(values)
        count = len(values) - 2 * REACH
        out = values[REACH : REACH + count] * values.dtype.type(TAPS[REACH])
        for k in range(REACH):
            pair = values[k : k + count] + values[2 * REACH - k : 2 * REACH - k + count]
            pair *= values.dtype.type(TAPS[k])
            out += pair
        values = turn(out)
    return values
