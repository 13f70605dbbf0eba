"""Means with 95 % intervals over roads. Scenes of a road are alike, so roads are the independent
samples.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t

LEVEL = 0.95


@dataclass(frozen=True)
class Mean:
    """A mean with its interval; NaN where they are not known."""

    value: float
    low: float
    high: float
    count: int  # number of values
    roads: int  # number of roads


def mean_over_roads(
    values: Sequence[float],
    roads: Sequence[Hashable],
    limits: tuple[float, float] = (-math.inf, math.inf),
) -> Mean:
    """Return the mean of values, and its 95 % interval for new roads of the same recipe.

    Parameters
    ----------
    values : values in any unit; values that are not finite are left out.
    roads : road of each value.
    limits : smallest and largest possible mean; the interval is cut there.

    Notes
    -----
    The mean is the ratio of two sums over roads: the sum of the values and the sum of their
    numbers. With e the sum of a road's deviations from the mean m, R roads and n values, the
    variance of m is R / (R - 1) sum(e^2) / n^2 (Cochran 1977, Sampling Techniques, chapter 6, the
    ratio estimator). The interval is Student's with R - 1 degrees of freedom. With one value per
    road it is the ordinary Student interval. A single road gives no interval.
    """
    kept = [(v, r) for v, r in zip(values, roads, strict=True) if math.isfinite(v)]
    if not kept:
        return Mean(math.nan, math.nan, math.nan, 0, 0)
    number: dict[Hashable, int] = {}
    place = np.array([number.setdefault(road, len(number)) for _, road in kept])
    numbers = np.array([value for value, _ in kept], float)
    count = len(numbers)
    of_roads = len(number)
    mean = float(numbers.mean())
    if of_roads < 2:
        return Mean(mean, math.nan, math.nan, count, of_roads)
    deviations = np.bincount(place, numbers - mean, of_roads)
    error = math.sqrt(of_roads / (of_roads - 1) * float(deviations @ deviations)) / count
    half = float(t.ppf(0.5 + LEVEL / 2, of_roads - 1)) * error
    low = max(mean - half, limits[0])
    high = min(mean + half, limits[1])
    return Mean(mean, low, high, count, of_roads)
