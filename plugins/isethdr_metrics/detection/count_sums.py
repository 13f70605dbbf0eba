"""Count sums: the probability that two counts with normal noise show a ratio within an interval.

The sum over all pairs of counts falls apart. For one count of the brighter pixel, the wedge of
`wedge` lets the darker one lie up to one level and not up to another. That is a difference of two
cumulative probabilities of a Poisson law with normal noise. Normal noise blurs the steps of the law
over a few counts only, so each of the two takes its table and a short sum.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import gammaln, ndtr, xlogy

from .wedge import Wedges, measured_negative

REACH_SD = 6.0  # beyond it normal noise changes nothing: 1e-9
SHARPEST = 1e-3  # counts: deviation of the noise below which a level could lie on a step
NO_WEIGHT = 1e-11  # of a pair of counts: all such pairs together change nothing by 1e-8


class Counts(NamedTuple):
    """Counts of one pixel of each pair: flat arrays."""

    mean: np.ndarray  # electrons
    step: np.ndarray  # luminance of one electron, above 0


class Table(NamedTuple):
    """Poisson laws of some pairs, each over a range of counts of its own."""

    first: np.ndarray  # (pair,) count of the first column
    share: np.ndarray  # (pair, count), adds up to 1


def table_of(mean: np.ndarray) -> Table:
    """Return Poisson laws over five deviations to each side: all but 1e-6 of them.

    Parameters
    ----------
    mean : electrons (pair,), similar ones: all have as many columns as the widest needs.
    """
    first = np.maximum(0, (mean - 5 * np.sqrt(mean)).astype(int))
    width = int((mean + 5 * np.sqrt(mean) + 6 - first).max())
    at = first[:, None] + np.arange(width)
    share = np.exp(xlogy(at, mean[:, None]) - mean[:, None] - gammaln(at + 1))
    return Table(first, share / share.sum(axis=1, keepdims=True))


def sharp(wedges: Wedges, dark: Counts) -> np.ndarray:
    """Return for which pairs (bool) the noise is so small that `of_counts` does not hold."""
    least = np.minimum(*(_blur(wedges, dark, end) for end in (0, 1)))
    return wedges.noise_free | (least < SHARPEST)


def terms_of(wedges: Wedges, bright: Counts, dark: Counts) -> np.ndarray:
    """Return about how many numbers `of_counts` holds for each pair."""
    blur = np.maximum(*(_blur(wedges, dark, end) for end in (0, 1)))
    return (10 * np.sqrt(bright.mean) + 6) * (2 * REACH_SD * blur + 2)


def of_counts(wedges: Wedges, bright: Counts, dark: Counts) -> np.ndarray:
    """Return the probability (pair,) that counts with normal noise lie in a wedge.

    Parameters
    ----------
    wedges : of the normal noise of each pair, none of them `sharp`.
    bright, dark : counts of the brighter and of the darker pixel.
    """
    first, second = table_of(bright.mean), table_of(dark.mean)
    at = first.first[:, None] + np.arange(first.share.shape[1])
    level = at * bright.step[:, None]
    inside = _below(wedges, 0, level, dark, second) - _below(wedges, 1, level, dark, second)
    out = np.einsum("pn,pn->p", first.share, inside)
    # read noise can make the sum of two low levels negative; then the opposite wedge counts, too
    few = [int(np.max(wedges.far / of.step)) + 1 for of in (bright, dark)]
    low = np.flatnonzero((first.first < few[0]) & (second.first < few[1]))
    if low.size:
        weight = first.share[low, : few[0], None] * second.share[low, None, : few[1]]
        place, i, j = np.nonzero(weight > NO_WEIGHT)
        pair = low[place]
        b = (first.first[pair] + i) * bright.step[pair]
        d = (second.first[pair] + j) * dark.step[pair]
        close = np.flatnonzero(b + d < wedges.far[pair])
        place, i, j, pair = (values[close] for values in (place, i, j, pair))
        more = measured_negative(wedges, pair, b[close], d[close]) * weight[place, i, j]
        out += np.bincount(pair, more, minlength=len(out))
    return np.clip(out, 0.0, 1.0)


def _blur(wedges: Wedges, dark: Counts, end: int) -> np.ndarray:
    """Return the deviation of the noise at one end of the interval, in counts of the darker."""
    return wedges.sd[end] / ((1 + wedges.ends[end]) * dark.step)


def _below(wedges: Wedges, end: int, level: np.ndarray, dark: Counts, law: Table) -> np.ndarray:
    """Return the probability (pair, count) that a measured contrast is above one end of the
    interval, for each level (pair, count) of the brighter pixel.
    """
    contrast, blur = wedges.ends[end][:, None], _blur(wedges, dark, end)[:, None]
    # the darker count up to which the contrast is high enough, from the first one of the table
    reach = (1 - contrast) / (1 + contrast) * level / dark.step[:, None] - law.first[:, None]
    start = np.ceil(reach - REACH_SD * blur)
    wide = int(np.ceil(2 * REACH_SD * blur.max())) + 1
    count = law.share.shape[1]
    # without weight on both sides of the table, for what lies beside it
    share = np.pad(law.share, ((0, 0), (wide, wide + 1)))
    total = np.pad(np.cumsum(share, axis=1), ((0, 0), (1, 0)))
    place = np.clip(start, -wide, count).astype(int) + wide
    row = np.arange(len(share))[:, None]
    out = total[row, place]
    flat, place = share.ravel(), place + row * share.shape[1]
    distance = (reach - np.clip(start, -wide, count)) / blur
    for _ in range(wide):
        out += flat[place] * ndtr(distance)
        place += 1
        distance -= 1 / blur
    return out
