"""Pair medians: the median probability of the pairs of each region, computed with few exact
probabilities.

Each pair gets a quick estimate of its probability with a bound on the error. The exact probability
is computed only for pairs that may decide a median or an end of its interval.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.scores import Score

from ..regions import NAN, median_interval, median_shares
from .expected_picture import SMOOTH, Expected
from .photon_counts import Estimate, Signal, estimated, of_signals
from .pixel_pairs import Pairs, RegionPairs

SCORE = "contrast_detection"
TIE = 1e-9  # probabilities this close count as equal
# number of pairs near each median of a further realisation for which the exact probability is
# computed
NEXT = 32


class Probabilities(NamedTuple):
    """The probabilities of all pairs in one noise realisation."""

    regions: list[RegionPairs]
    pairs: Pairs  # pairs of all regions, one region after the other
    # probability of each pair, exact if it may decide a median or an end of its interval
    value: np.ndarray
    estimate: np.ndarray  # quick estimate of each pair's probability (`photon_counts.estimated`)

    def starts(self) -> np.ndarray:
        """Return the index of the first pair of each region."""
        sizes = [region.pairs.first.size for region in self.regions]
        return np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(int)

    def by_region(self, values: np.ndarray) -> list[np.ndarray]:
        """Return the values of the pairs of each region."""
        return np.split(values, self.starts()[1:])


def probability(model: Expected, pairs: Pairs, interval: float) -> np.ndarray:
    """Return the probability of each pair; 0 if a pixel is not valid.

    Parameters
    ----------
    model : mean and variance of each pixel.
    pairs : pairs of pixels.
    interval : accepted deviation of the measured contrast, as a share of the true contrast.
    """
    value = of_signals(*model.signals(pairs), pairs.contrast, interval)
    return np.where(model.both_valid(pairs), value, 0.0)


def estimated_probability(model: Expected, pairs: Pairs, interval: float) -> Estimate:
    """Return the estimated probability of each pair, and the bound on its error.

    Parameters
    ----------
    model, pairs, interval : as in `probability`.
    """
    found = estimated(*model.signals(pairs), pairs.contrast, interval)
    valid = model.both_valid(pairs)
    return Estimate(*(np.where(valid, values, 0.0) for values in found))


def right_near_medians(
    model: Expected, pairs: Pairs, regions: list[RegionPairs], interval: float
) -> Probabilities:
    """Return the probability of each pair. It is exact for pairs that may decide the median of
    their region, or the ends of its interval if intervals are wanted, and estimated for others.

    Parameters
    ----------
    model : mean and variance of each pixel.
    pairs : pairs of all regions, one region after the other.
    regions : the same pairs by region.
    interval : accepted deviation of the measured contrast, as a share of the true contrast.

    Notes
    -----
    Estimate and bound give a smallest and a largest possible value of each pair. First, the pairs
    that may be the median of the estimates are computed exactly. The true median of the region then
    lies between the median of the smallest and that of the largest possible values of its members
    (pairs, or means of pairs). Of the other pairs, those that may lie between these medians are
    computed as well. The ends of the interval are other quantiles, found in the same way.
    """
    bright, dark = model.signals(pairs)
    estimate, bound = estimated_probability(model, pairs, interval)
    value = estimate.copy()
    for first_guess in (True, False):
        uncertain = np.flatnonzero(_may_be_median(value, bound, regions, first_guess))
        signals = (Signal(*(values[uncertain] for values in of)) for of in (bright, dark))
        value[uncertain] = of_signals(*signals, pairs.contrast[uncertain], interval)
        bound[uncertain] = 0.0
    return Probabilities(regions, pairs, value, estimate)


def scores_of(found: Probabilities) -> list[Score]:
    """Return the median of each region with its interval. State regions without pairs in the
    ledger.
    """
    scores = []
    for region, values in zip(found.regions, found.by_region(found.value), strict=True):
        if not values.size:
            title = f"{SCORE} of {region.name}" if region.name else SCORE
            why = "no two pixels of the reference picture differ by the lowest contrast"
            ledger.left_out(title, why, NAN, "probability")
            continue
        members = region.of_members(values)
        median, low, high = median_interval(members, _independent(region, members.size))
        scores.append(Score(SCORE, median, "", region.name, low, high))
    return scores


def scores_of_further(first: Probabilities, model: Expected, interval: float) -> list[Score]:
    """Return the median of each region in a further noise realisation of the same picture.

    Parameters
    ----------
    first : probabilities of the first realisation.
    model : mean and variance of each pixel of the further realisation.
    interval : accepted deviation of the measured contrast, as a share of the true contrast.

    Notes
    -----
    The probability of a pair is that in the first realisation plus the change of its estimate; the
    errors of the two estimates mostly cancel. The mean of the remaining error is found from exact
    probabilities of a few pairs near each median, and is subtracted from the median.
    """
    changed = estimated_probability(model, first.pairs, interval).value
    values = first.by_region(first.value + changed - first.estimate)
    next_to = [_next_to_median(*both) for both in zip(first.regions, values, strict=True)]
    places = np.concatenate([at + k for at, k in zip(next_to, first.starts(), strict=True)])
    right = probability(model, first.pairs.some(places), interval)
    rights = np.split(right, np.cumsum([at.size for at in next_to])[:-1])
    return [
        Score(SCORE, _corrected_median(region, of_region, at, right_there), "", region.name)
        for region, of_region, at, right_there in zip(
            first.regions, values, next_to, rights, strict=True
        )
        if of_region.size
    ]


def _independent(region: RegionPairs, count: int) -> int:
    """Return the number of members with independent noise, at most `count`: one pixel in each
    `SMOOTH` x `SMOOTH` pixels, because the mean of the picture is averaged over such windows.
    """
    return min(count, region.pixels // SMOOTH**2)


def _next_to_median(region: RegionPairs, values: np.ndarray) -> np.ndarray:
    """Return the indices of about `NEXT` pairs of a region that are nearest to its median. For the
    frame, they are all pairs of the pixels nearest to it.
    """
    if not values.size:
        return np.zeros(0, int)
    members = region.of_members(values)
    distance = np.abs(members - np.median(members))
    count = max(NEXT * members.size // values.size, 1)
    next_to = np.zeros(members.size, bool)
    next_to[np.argsort(distance)[:count]] = True
    return np.flatnonzero(region.of_pairs(next_to))


def _corrected_median(
    region: RegionPairs, values: np.ndarray, at: np.ndarray, right: np.ndarray
) -> float:
    """Return the median of a region, corrected by the mean error of the values near it.

    Parameters
    ----------
    region : the region.
    values : (pair,) approximate probabilities of its pairs.
    at : indices of pairs near the median.
    right : exact probabilities of these pairs.
    """
    median = float(np.median(region.of_members(values)) + np.mean(right - values[at]))
    return min(max(median, 0.0), 1.0)


def _may_be_median(
    value: np.ndarray, bound: np.ndarray, regions: list[RegionPairs], first_guess: bool
) -> np.ndarray:
    """Return which pairs (bool) are not exact and may decide the median of their region, or the
    ends of its interval if intervals are wanted.

    Parameters
    ----------
    value, bound : probability of each pair of all regions, and the bound on its error.
    regions : the same pairs by region.
    first_guess : if True, the medians of `value` are taken as the medians.
    """
    uncertain = bound > 0
    end = 0
    for region in regions:
        start = end
        end = end + region.pairs.first.size
        some = slice(start, end)
        if start == end:
            continue
        least = region.of_members(value[some] - bound[some])
        most = region.of_members(value[some] + bound[some])
        middle = region.of_members(value[some])
        low, high = (middle, middle) if first_guess else (least, most)
        shares = median_shares(_independent(region, len(middle)))
        # slightly wider, because sums in another order are rounded differently
        from_below = _around(low, shares)[0] - TIE
        to_above = _around(high, shares)[1] + TIE
        near = np.zeros(len(middle), bool)
        for at_least, at_most in zip(from_below, to_above, strict=True):
            near |= (most >= at_least) & (least <= at_most)
        uncertain[some] &= region.of_pairs(near)
    return uncertain


def _around(values: np.ndarray, shares: Sequence[float]) -> np.ndarray:
    """Return the two values (2, share) between which the quantile at each of `shares` lies."""
    place = np.asarray(shares) * (len(values) - 1)
    places = np.stack([np.floor(place), np.ceil(place)]).astype(int)
    return np.partition(values, np.unique(places))[places]
