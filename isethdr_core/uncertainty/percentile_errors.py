"""Percentile errors: how far noise moves a percentile of the values of a picture.

A percentile is no mean: it depends on the few values around it, and noise moves it far where the
values have a gap there. The share of values below a number is a mean, and scatters as a mean does.
So the error of that share is measured, and the ends of its interval are looked up among the values
(Woodruff 1952, section 3). The interval is therefore as long as the gap requires.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from .score_intervals import student_factor


class PercentileError(NamedTuple):
    """How far noise moves a percentile, in the unit of the values."""

    standard_error: float  # half of the 95 % interval, divided by Student's factor
    degrees_of_freedom: float
    shift: float  # change of the percentile by values that more noise moves across it


NO_ERROR = PercentileError(0.0, math.inf, 0.0)


def percentile_error(
    values: np.ndarray,
    counts: np.ndarray,
    share: float,
    changes: Iterable[np.ndarray],
    block_pixels: int,
) -> PercentileError:
    """Return the error of a percentile of noisy values.

    Parameters
    ----------
    values : (y, x), any unit.
    counts : (y, x) bool, the values of which the percentile is taken; at least one.
    share : share of these values that lie below the percentile, between 0 and 1.
    changes : at least one array (y, x) of noise, with the variance of the noise in `values`, an
        independent sign in each place, and the unit of `values`.
    block_pixels : side of a block: many times the distance within which values share their noise.

    Notes
    -----
    A change and its opposite move values across the percentile. Half of the difference of their
    numbers is, in each block, a sample of its noise; blocks are independent, so the variance of
    the share is the sum of the squares. Its degrees of freedom are those of Satterthwaite 1946,
    eq. 17, with one for each block. What a change and its opposite have in common is the shift.
    """
    of_percentile = values[counts]
    middle = float(np.quantile(of_percentile, share))
    before = _blocks(counts & (values < middle), block_pixels)
    variances = []
    shifts = []
    for change in changes:
        more, less = (
            _blocks(counts & (values + sign * change < middle), block_pixels) for sign in (1, -1)
        )
        variances.append(((more - less) / 2) ** 2)
        shifts.append(float((more + less).sum() / 2 - before.sum()))
    of_blocks = np.mean(variances, axis=0) / of_percentile.size**2
    variance = float(of_blocks.sum())
    shift = abs(math.fsum(shifts)) / len(shifts)
    freedom = math.inf
    if variance > 0:
        weights = of_blocks / variance
        freedom = 1 / float((weights**2).sum())
    half = student_factor(freedom) * math.sqrt(variance)
    reach = half
    shift = shift / of_percentile.size
    ends = np.clip([share - reach, share + reach, share - shift, share + shift], 0.0, 1.0)
    low, high, *shifted = np.abs(np.quantile(of_percentile, ends) - middle).tolist()
    return PercentileError(max(low, high) / student_factor(freedom), freedom, max(shifted))


def _blocks(flags: np.ndarray, side: int) -> np.ndarray:
    """Return the number of flags (y, x) that are set in each block of `side` x `side` pixels."""
    starts = [np.arange(0, size, side) for size in flags.shape]
    across = np.add.reduceat(flags, starts[1], axis=1, dtype=np.int32)
    return np.add.reduceat(across, starts[0], axis=0).astype(float)
