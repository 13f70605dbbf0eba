"""Shares found against the level of light, and the level at which they reach a limit.

Intervals are by bootstrap over roads.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .shares import FEWEST_ROADS

RESAMPLES = 1000
LOST = 0.5  # share of objects found, below which they count as lost
LOST_APART = 0.75  # share of pairs told apart, below which they count as lost; guessing gives 0.5


class Crossing(NamedTuple):
    """A level of light with its 95 % interval; NaN where there is none.

    Parameters
    ----------
    share : share of the bootstrap samples that cross within the levels.
    """

    level: float
    low: float
    high: float
    share: float


def crossing(
    levels: Sequence[float], values: np.ndarray, roads: Sequence[str], limit: float
) -> Crossing:
    """Return the highest level at which the mean of values over objects rises through `limit`.

    Parameters
    ----------
    levels : increasing, above 0.
    values : (object, level) values; NaN where they are not known.
    roads : road of each object.
    limit : value that the mean crosses.

    Notes
    -----
    Between two levels the mean is interpolated linearly in the logarithm of the level. The interval
    holds the middle 95 % of 1000 samples of the roads, drawn with replacement (Efron and Tibshirani
    1993). Its ends are moved away from the whole by sqrt(R / (R - 1)), because samples of R roads
    vary by the standard deviation with divisor R, not R - 1. All cameras see the same roads, so
    they are paired. There is no interval with fewer than three roads, or if fewer than 95 % of the
    samples cross the limit.
    """
    names = sorted(set(roads))
    places = [np.flatnonzero([road == name for road in roads]) for name in names]

    def level_of(chosen: np.ndarray) -> float:
        return _first(np.log(levels), _mean(values[chosen]) - limit)

    whole = level_of(np.arange(len(values)))
    if len(names) < FEWEST_ROADS:
        return Crossing(_exp(whole), math.nan, math.nan, math.nan)
    random = np.random.default_rng(0)
    drawn = []
    for _ in range(RESAMPLES):
        roads_drawn = random.integers(0, len(names), len(names))
        drawn.append(level_of(np.concatenate([places[k] for k in roads_drawn])))
    crossed = np.array([value for value in drawn if math.isfinite(value)])
    share = len(crossed) / RESAMPLES
    if share < 0.95 or not math.isfinite(whole):
        return Crossing(_exp(whole), math.nan, math.nan, share)
    wider = math.sqrt(len(names) / (len(names) - 1))
    low, high = np.exp(whole + wider * (np.quantile(crossed, (0.025, 0.975)) - whole))
    return Crossing(_exp(whole), float(low), float(high), share)


def _mean(values: np.ndarray) -> np.ndarray:
    """Return the means (level,) over objects; NaN at levels without a known value."""
    known = np.isfinite(values)
    count = known.sum(0)
    total = np.where(known, values, 0.0).sum(0)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _exp(value: float) -> float:
    return math.exp(value) if math.isfinite(value) else math.nan


def _first(logs: np.ndarray, values: np.ndarray) -> float:
    """Return the highest place where values rise through 0; NaN if there is none."""
    for k in range(len(logs) - 1, 0, -1):
        below = values[k - 1]
        above = values[k]
        if below < 0 <= above:
            return float(logs[k - 1] + (logs[k] - logs[k - 1]) * below / (below - above))
    return math.nan


def at_levels(known: Sequence[tuple[float, float]], levels: Sequence[float]) -> np.ndarray:
    """Return values at levels by interpolation between known values, linear in the logarithm of the
    level. Values beyond the known levels are NaN.

    Parameters
    ----------
    known : [(level, value)] in any order; levels are above 0.
    levels : levels at which the value is wanted.
    """
    points = sorted(known)
    logs = np.log([level for level, _ in points])
    values = [value for _, value in points]
    return np.interp(np.log(levels), logs, values, left=math.nan, right=math.nan)
