"""Structural similarity of two planes, computed in strips that fit into the processor's cache."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from isethdr_core import ledger

REACH = 5  # pixels on each side of the centre of the window
SIGMA = 1.5  # standard deviation of the window, pixels
WINDOW = 2 * REACH + 1  # pixels across the window
STRIP = 24  # number of rows computed together
# weights of the window from its end to its centre
TAPS = np.exp(-0.5 * (np.arange(REACH + 1) - REACH) ** 2 / SIGMA**2)
TAPS /= 2 * TAPS.sum() - TAPS[-1]


def window_fits(shape: tuple[int, ...], score: str) -> bool:
    """Return whether the window fits into a picture. If not, state in the ledger that `score` is
    left out.

    Parameters
    ----------
    shape : rows and columns of the picture.
    score : name of the score, for the ledger.
    """
    if min(shape) >= WINDOW:
        return True
    why = (
        f"a picture of {' x '.join(map(str, shape))} pixels is smaller than the window, which has "
        f"{WINDOW} rows and columns"
    )
    ledger.left_out(score, why, float("nan"), "1")
    return False


def similarity(first: np.ndarray, second: np.ndarray, data_range: float) -> np.ndarray:
    """Return the map (y, x) of structural similarity (Wang, Bovik, Sheikh, Simoncelli 2004, eq. 13)
    of two planes of the same floating-point type.

    Parameters
    ----------
    first, second : (y, x), float32 or float64, mirrored beyond their borders.
    data_range : difference between the largest and the smallest possible value.

    Notes
    -----
    Window and constants are those of the paper: a Gaussian, 0.01 and 0.03. Only the sum of both
    variances is needed, so four windowed means suffice. Half of the range is subtracted first,
    which reduces the rounding error of the squares to a quarter.
    """
    return similarity_to(reference(first, data_range), second, data_range)


class Reference(NamedTuple):
    """The first of two planes, prepared for comparison with several others."""

    padded: np.ndarray  # minus half of the range, and mirrored beyond the borders
    mean: np.ndarray  # windowed means (y, x) of `padded`


def reference(plane: np.ndarray, data_range: float) -> Reference:
    """Return a plane (y, x) prepared for `similarity_to`."""
    padded = _padded(plane, data_range)
    mean = np.empty_like(plane)
    for top in range(0, len(plane), STRIP):
        mean[top : top + STRIP] = windowed(padded[top : top + STRIP + 2 * REACH])
    return Reference(padded, mean)


def _padded(plane: np.ndarray, data_range: float) -> np.ndarray:
    return np.pad(plane - plane.dtype.type(data_range / 2), REACH, mode="symmetric")


def similarity_to(first: Reference, second: np.ndarray, data_range: float) -> np.ndarray:
    """Return `similarity` of two planes, the first of which is prepared.

    Parameters
    ----------
    first : the first plane.
    second : the second plane (y, x), of the same floating-point type.
    data_range : difference between the largest and the smallest possible value.
    """
    middle = data_range / 2
    of_means = (0.01 * data_range) ** 2
    of_variances = (0.03 * data_range) ** 2
    out = np.empty(second.shape, second.dtype)
    other = _padded(second, data_range)
    for top in range(0, len(out), STRIP):
        rows = slice(top, top + STRIP + 2 * REACH)
        a = first.padded[rows]
        b = other[rows]
        mean_a = first.mean[top : top + STRIP]
        mean_b, squares, product = (windowed(values) for values in (b, a * a + b * b, a * b))
        covariance = product - mean_a * mean_b
        variances = squares - (mean_a * mean_a + mean_b * mean_b)
        mean_a = mean_a + middle
        mean_b += middle
        out[top : top + STRIP] = (
            (2 * mean_a * mean_b + of_means)
            * (2 * covariance + of_variances)
            / ((mean_a * mean_a + mean_b * mean_b + of_means) * (variances + of_variances))
        )
    return out


def windowed(values: np.ndarray) -> np.ndarray:
    """Return the weighted means of `values` (y, x) over the window. The result is smaller by
    `REACH` on each side, where the window would extend beyond the values.
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
