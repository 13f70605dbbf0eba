"""Count sums: the probability that the measured contrast of two counts with normal noise lies in an
interval.

At each end of the interval, a weighted difference of both levels is 0. The probability is therefore
that of one difference above 0 (`count_differences`) minus that of the other.

If the normal noise is so small that these need many terms, sums over counts are used instead. For
each count of the brighter pixel, the contrast lies in the interval if the level of the darker pixel
lies between two limits. Normal noise blurs the steps of a Poisson distribution over a few counts
only. The probability below each limit therefore follows from a table of the cumulative distribution
and a short sum.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import gammaln, ndtr, xlogy

from . import count_differences
from .count_differences import Differences
from .wedge import Wedges, measured_negative

# standard deviations beyond which normal noise is neglected; the probability is 1e-9
REACH_SD = 6.0
# smallest standard deviation of the noise, counts; with less, a limit could lie exactly on a step
SHARPEST = 1e-3
# Probability below which two counts that are both measured negative are neglected. All such counts
# together change the result by 1e-9.
NO_WEIGHT = 1e-11
MOST_TERMS = 400  # largest number of terms of a difference; beyond it, sums over counts are as fast
HELD = 25.0  # approximate amount of numbers that differences keep in memory for each pair
LOW_PIECE = 1024  # number of pairs with low counts computed together
TILTS = (0.5, 1.0, 2.0, 3.5, 5.0)  # parameters of a Chernoff bound; the smallest result is used


class Counts(NamedTuple):
    """Counts of one pixel of each pair, as flat arrays."""

    mean: np.ndarray  # electrons
    step: np.ndarray  # luminance of one electron, above 0

    def some(self, pairs: np.ndarray) -> Counts:
        """Return the counts of some pairs."""
        return Counts(self.mean[pairs], self.step[pairs])


class Table(NamedTuple):
    """Poisson distributions of pairs, each over its own range of counts."""

    first: np.ndarray  # (pair,) count of the first column
    share: np.ndarray  # (pair, count) probability; the sum over counts is 1


def table_of(mean: np.ndarray) -> Table:
    """Return Poisson distributions over five standard deviations to each side, which leaves out
    1e-6 of the probability.

    Parameters
    ----------
    mean : mean electrons (pair,). They should be similar, because all pairs get the number of
        columns that the largest mean needs.
    """
    first = np.maximum(0, (mean - 5 * np.sqrt(mean)).astype(int))
    width = int((mean + 5 * np.sqrt(mean) + 6 - first).max())
    share = _law(mean[:, None], first[:, None] + np.arange(width))
    return Table(first, share / share.sum(axis=1, keepdims=True))


def sharp(wedges: Wedges, dark: Counts) -> np.ndarray:
    """Return for which pairs (bool) the noise is too small for `of_counts`."""
    least = np.minimum(*(_blur(wedges, dark, end) for end in (0, 1)))
    return wedges.noise_free | (least < SHARPEST)


def terms_of(wedges: Wedges, bright: Counts, dark: Counts) -> np.ndarray:
    """Return the approximate amount of numbers that `of_counts` keeps in memory for each pair.

    Parameters
    ----------
    wedges : wedge of each pair for its normal noise.
    bright, dark : counts of the brighter and of the darker pixel (pair,).
    """
    blur = np.maximum(*(_blur(wedges, dark, end) for end in (0, 1)))
    summed = (10 * np.sqrt(bright.mean) + 6) * (2 * REACH_SD * blur + 2)
    return np.where(_quick(wedges, bright, dark), HELD, summed)


def of_counts(wedges: Wedges, bright: Counts, dark: Counts) -> np.ndarray:
    """Return the probability (pair,) that counts with normal noise lie in a wedge.

    Parameters
    ----------
    wedges : wedge of each pair for its normal noise; none is `sharp`.
    bright, dark : counts of the brighter and of the darker pixel.
    """
    out = np.empty(len(bright.mean))
    quick = _quick(wedges, bright, dark)
    for some, between in ((quick, _by_differences), (~quick, _by_sums)):
        at = np.flatnonzero(some)
        if at.size:
            out[at] = between(wedges.some(at), *(of.some(at) for of in (bright, dark)))
    # Read noise can make the sum of two low levels negative. The probability of the opposite wedge
    # was then subtracted, and is added again.
    bounds = (_negative_at_most(of, sd) for of, sd in zip((bright, dark), wedges.scale))
    low = np.flatnonzero(np.prod(list(bounds), axis=0) > NO_WEIGHT)
    for start in range(0, len(low), LOW_PIECE):
        some = low[start : start + LOW_PIECE]
        out[some] += _both_negative(wedges.some(some), *(of.some(some) for of in (bright, dark)))
    return np.clip(out, 0.0, 1.0)


def _differences(wedges: Wedges, bright: Counts, dark: Counts, end: int) -> Differences:
    """Return the differences of levels that are 0 at one end (0 or 1) of the interval."""
    contrast = wedges.ends[end]
    steps = (1 - contrast) * bright.step, (1 + contrast) * dark.step
    return Differences(bright.mean, dark.mean, *steps, wedges.sd[end])


def _quick(wedges: Wedges, bright: Counts, dark: Counts) -> np.ndarray:
    """Return for which pairs (bool) differences need few terms."""
    both = (_differences(wedges, bright, dark, end) for end in (0, 1))
    return np.maximum(*map(count_differences.terms_of, both)) <= MOST_TERMS


def _by_differences(wedges: Wedges, bright: Counts, dark: Counts) -> np.ndarray:
    """Return the probability (pair,) that both levels lie in the wedge, as if no level were
    measured below 0.
    """
    above = (_differences(wedges, bright, dark, end) for end in (0, 1))
    low, high = map(count_differences.above_zero, above)
    return low - high


def _by_sums(wedges: Wedges, bright: Counts, dark: Counts) -> np.ndarray:
    """Return the same as `_by_differences`, computed from sums over counts."""
    first = table_of(bright.mean)
    second = table_of(dark.mean)
    at = first.first[:, None] + np.arange(first.share.shape[1])
    level = at * bright.step[:, None]
    inside = _below(wedges, 0, level, dark, second) - _below(wedges, 1, level, dark, second)
    return np.einsum("pn,pn->p", first.share, inside)


def _both_negative(wedges: Wedges, bright: Counts, dark: Counts) -> np.ndarray:
    """Return the probability (pair,) of the opposite wedge: both levels are measured below 0."""
    weights = [_negative(of, sd, wedges.far) for of, sd in zip((bright, dark), wedges.scale)]
    largest = [weight.max(axis=1) for weight in weights]
    low = np.flatnonzero(largest[0] * largest[1] > NO_WEIGHT)
    first, second = (weight[low] for weight in weights)
    place, i, j = np.nonzero(first[:, :, None] * second[:, None, :] > NO_WEIGHT)
    pair = low[place]
    levels = i * bright.step[pair], j * dark.step[pair]
    shares = (_law(of.mean[pair], count) for of, count in ((bright, i), (dark, j)))
    more = measured_negative(wedges, pair, *levels) * np.prod(list(shares), axis=0)
    return np.bincount(pair, more, minlength=len(bright.mean))


def _negative(of: Counts, sd: np.ndarray, far: np.ndarray) -> np.ndarray:
    """Return bounds (pair, count) on the joint probability of each count and of measuring its level
    below 0. Counts with a level beyond `far` are not included.
    """
    count = np.arange(int(np.max(far / of.step)) + 1)
    level = count * (of.step / sd)[:, None]
    # the probability of a normal deviate beyond x is at most exp(-x^2 / 2) / 2
    return _law(of.mean[:, None], count) * np.exp(-0.5 * level * level) / 2


def _negative_at_most(of: Counts, sd: np.ndarray) -> np.ndarray:
    """Return a bound (pair,) on all values of `_negative`, without computing each of them.

    Notes
    -----
    With x = count step / sd, exp(-x^2 / 2) is at most exp(-t x + t^2 / 2) for every t. The sum of
    that over the Poisson law is exp(mean (exp(-t step / sd) - 1) + t^2 / 2).
    """
    step = of.step / sd
    exponents = [of.mean * np.expm1(-t * step) + t * t / 2 for t in TILTS]
    least: np.ndarray = np.minimum(np.exp(np.minimum.reduce(exponents)), 1.0) / 2
    return least


def _law(mean: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Return the Poisson probability of counts."""
    share: np.ndarray = np.exp(xlogy(count, mean) - mean - gammaln(count + 1))
    return share


def _blur(wedges: Wedges, dark: Counts, end: int) -> np.ndarray:
    """Return the standard deviation of the noise at one end of the interval, in counts of the
    darker pixel.
    """
    return wedges.sd[end] / ((1 + wedges.ends[end]) * dark.step)


def _below(wedges: Wedges, end: int, level: np.ndarray, dark: Counts, law: Table) -> np.ndarray:
    """Return the probability (pair, count) that a measured contrast is above one end of the
    interval, for each level (pair, count) of the brighter pixel.
    """
    contrast = wedges.ends[end][:, None]
    blur = _blur(wedges, dark, end)[:, None]
    # largest count of the darker pixel with enough contrast, counted from the first one in the
    # table
    reach = (1 - contrast) / (1 + contrast) * level / dark.step[:, None] - law.first[:, None]
    start = np.ceil(reach - REACH_SD * blur)
    wide = int(np.ceil(2 * REACH_SD * blur.max())) + 1
    count = law.share.shape[1]
    # zeros on both sides of the table, for limits outside it
    share = np.pad(law.share, ((0, 0), (wide, wide + 1)))
    total = np.pad(np.cumsum(share, axis=1), ((0, 0), (1, 0)))
    place = np.clip(start, -wide, count).astype(int) + wide
    row = np.arange(len(share))[:, None]
    out = total[row, place]
    flat = share.ravel()
    place = place + row * share.shape[1]
    distance = (reach - np.clip(start, -wide, count)) / blur
    for _ in range(wide):
        out += flat[place] * ndtr(distance)
        place += 1
        distance -= 1 / blur
    return out
