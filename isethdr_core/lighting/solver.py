"""Weights from luminance maps: one unknown at a time, each by a monotone search.

Percentiles are Hazen's (numpy `method="hazen"`, also MATLAB's prctile); they are continuous in
every weight.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

_LARGEST_STEP = 200  # most doublings in a bracket search: 60 decades, more than any light spans


def statistic(luminance: np.ndarray, name: str, percentile: float = 50.0) -> float:
    """Return a statistic of a luminance map, in its unit.

    Parameters
    ----------
    luminance : luminance map, any shape, cd/m2.
    name : `max`, `mean` or `percentile`.
    percentile : percent of the tiles at or below the result; for `percentile` only.
    """
    if name == "max":
        return float(luminance.max())
    if name == "mean":
        return float(luminance.mean())
    return percentile_of(luminance, percentile)


def percentile_of(luminance: np.ndarray, percentile: float) -> float:
    """Return Hazen's percentile of a luminance map; 100 is the maximum, 0 the minimum."""
    return float(np.percentile(luminance, percentile, method="hazen"))


def dynamic_range(luminance: np.ndarray, low_percentile: float, high_percentile: float) -> float:
    """Return the ratio of two percentiles of a luminance map; infinite over black, NaN where all is
    black.

    Parameters
    ----------
    luminance : luminance map, any shape, cd/m2.
    low_percentile, high_percentile : percentiles whose ratio is returned, percent.
    """
    low, high = np.percentile(luminance, [low_percentile, high_percentile], method="hazen")
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.divide(high, low))


def weight_for_mean(other_light: np.ndarray, ambient: np.ndarray, mean: float) -> float:
    """Return w >= 0 so that other_light + w * ambient has the mean `mean`.

    The result is 0 if the mean of the other light alone exceeds `mean`, and 1 without ambient
    light.

    Parameters
    ----------
    other_light : luminance map of all other light groups at their weights, any shape, cd/m2.
    ambient : luminance map of the ambient light at weight 1, same shape, cd/m2.
    mean : mean luminance to reach, cd/m2.
    """
    mean_ambient = ambient.mean()
    return max(0.0, float((mean - other_light.mean()) / mean_ambient)) if mean_ambient > 0 else 1.0


def weight_for_percentile(
    other_light: np.ndarray, ambient: np.ndarray, percentile: float, target_value: float
) -> float:
    """Return w >= 0 so that the percentile of other_light + w * ambient is `target_value`.

    The percentile never falls with w, so that a bracket and Brent's method find w. If no w reaches
    the target: 0 if the other light alone is brighter, 1 if the ambient light is dark in too many
    pixels.

    Parameters
    ----------
    other_light, ambient : luminance maps of one shape, any unit.
    percentile : percent, 0 to 100.
    target_value : percentile to reach, in the unit of the maps.
    """

    def miss(w: float) -> float:
        return percentile_of(other_light + w * ambient, percentile) - target_value

    peak = ambient.max()
    if peak <= 0:
        return 1.0
    if miss(0.0) >= 0:
        return 0.0
    low = 0.0
    high = target_value / peak
    for _ in range(_LARGEST_STEP):
        if miss(high) >= 0:
            return _root(miss, low, high)
        low = high
        high = 2 * high
    return 1.0


def weight_for_dynamic_range(
    other_light: np.ndarray,
    ambient: np.ndarray,
    target_ratio: float,
    low_percentile: float,
    high_percentile: float,
) -> float:
    """Return w >= 0 so that two percentiles of other_light + w * ambient have the ratio
    `target_ratio`.

    More ambient light lifts the dark tiles first: as w falls from 'ambient alone' the ratio grows,
    until the other light alone is left. The search goes down by decades and takes the first
    crossing, the one with most ambient light. If there is none, it returns the w whose ratio comes
    nearest.

    Parameters
    ----------
    other_light : luminance map of all other light groups at their weights, any shape, cd/m2.
    ambient : luminance map of the ambient light at weight 1, same shape, cd/m2.
    target_ratio : ratio of the two percentiles to reach.
    low_percentile, high_percentile : percentiles of the luminance, percent.
    """

    def ratio(w: float) -> float:
        return dynamic_range(other_light + w * ambient, low_percentile, high_percentile)

    bright = other_light.max()
    peak = ambient.max()
    if bright <= 0 or peak <= 0:
        return 1.0
    # 1e6: ambient light outshines every lamp; 1e-24: darker than any dynamic range that float32
    # holds
    grid = bright / peak * 10.0 ** np.arange(6, -25, -1)
    tried = [(float(grid[0]), ratio(grid[0]))]
    for w in (*grid[1:], 0.0):
        upper, at_upper = tried[-1]
        tried.append((float(w), ratio(w)))
        if (at_upper <= target_ratio) != (tried[-1][1] <= target_ratio):
            return _root(lambda v: _log_miss(ratio(v), target_ratio), float(w), upper)
    return min(tried, key=lambda pair: abs(_log_miss(pair[1], target_ratio)))[0]


def _log_miss(reached: float, target_value: float) -> float:
    """Return log(found / wanted), kept finite over black tiles, where the ratio is infinite."""
    return float(np.log(min(reached, 1e300) / target_value))


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    """Return the root between two brackets to the precision of float64, even if it is very
    small.
    """
    if function(low) == 0:
        return low
    from scipy.optimize import brentq  # slow to import

    return float(brentq(function, low, high, xtol=1e-300, rtol=1e-14, maxiter=500))
