"""Intervals of scores by drawing roads again, and the number of roads needed to tell two scores
apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

DRAWS = 1000
LEVEL = 0.95
SEED = 20
FEWEST_ROADS = 3  # fewest roads for an interval; draws of two roads have only three outcomes
ANY = (-math.inf, math.inf)  # limits of a difference
SHARE = (0.0, 1.0)  # limits of a score
# difference in standard errors that 80 % of studies detect at a level of 5 %, two-sided: the sum of
# the normal quantiles of 0.975 and 0.8
TOLD = 1.959964 + 0.841621


@dataclass(frozen=True)
class Estimate:
    """A score and its 95 % interval; NaN where they are not known."""

    value: float
    low: float
    high: float
    error: float  # standard error


def road_weights(roads: int) -> np.ndarray:
    """Return how often each road is drawn, (1 + DRAWS, roads). The first row is the data itself.

    Each draw takes as many roads as there are, with replacement (Efron 1979). Cameras that share
    these weights are compared on the same roads.
    """
    random = np.random.default_rng(SEED)
    drawn = random.multinomial(roads, np.full(roads, 1 / roads), DRAWS)
    return np.concatenate([np.ones((1, roads)), drawn])


def over_detectors(values: np.ndarray, picked: np.ndarray | None) -> np.ndarray:
    """Return the mean over detectors of each draw, with the detectors drawn again as well.

    This is the second level of the bootstrap, because training again from another seed gives
    another detector. The deviations of the drawn detectors from the mean of all D are widened by
    sqrt(D / (D - 1)), because draws of D detectors vary by the standard deviation with divisor D,
    not D - 1.

    Parameters
    ----------
    values : (detectors, draws) scores; the first draw is the data itself.
    picked : (draws, detectors) numbers of the drawn detectors; the first row is ignored. None: the
        detectors are not drawn again.
    """
    of_all = values.mean(0)
    count = len(values)
    if picked is None or count == 1:
        return of_all
    drawn = np.take_along_axis(values.T, picked, 1).mean(1)
    widened = of_all + math.sqrt(count / (count - 1)) * (drawn - of_all)
    widened[0] = of_all[0]
    return widened


def picked_detectors(detectors: int, draws: int, seed: int) -> np.ndarray:
    """Return the numbers of the drawn detectors, (1 + draws, detectors).

    Parameters
    ----------
    detectors : number of detectors.
    draws : number of draws.
    seed : seed of the draws.
    """
    return np.random.default_rng(seed).integers(0, detectors, (1 + draws, detectors))


def estimate(values: np.ndarray, roads: int, limits: tuple[float, float] = ANY) -> Estimate:
    """Return the score and its interval, from the percentiles 2.5 and 97.5 of the draws.

    The deviations of the draws are widened by sqrt(R / (R - 1)), because draws of R roads vary by
    the standard deviation with divisor R, not R - 1. Fewer than three roads give no interval.

    Parameters
    ----------
    values : (1 + draws,) scores; the first one is the data itself. Draws without any object are
        NaN.
    roads : number R of roads that were drawn and hold an object.
    limits : smallest and largest possible score, at which the widened interval is cut.
    """
    value = float(values[0])
    drawn = values[1:][np.isfinite(values[1:])]
    if roads < FEWEST_ROADS or not math.isfinite(value) or len(drawn) < 2:
        return Estimate(value, math.nan, math.nan, math.nan)
    wider = math.sqrt(roads / (roads - 1))
    ends = np.percentile(drawn, [50 - 50 * LEVEL, 50 + 50 * LEVEL])
    low, high = (float(np.clip(value + wider * (end - value), *limits)) for end in ends)
    return Estimate(value, low, high, float(wider * drawn.std(ddof=1)))


def roads_to_tell(error: float, roads: int, difference: float) -> float:
    """Return the number of roads needed to detect a difference of two scores with a power of 80 %.

    Parameters
    ----------
    error : standard error of the difference, unit of the scores.
    roads : number of roads from which the error was found.
    difference : difference of two scores to detect, same unit.

    Notes
    -----
    A standard error falls with the square root of the number of roads. With the error e from R
    roads, R (2.8 e / difference)^2 roads are needed (level 5 %, two-sided). The result is NaN if
    the error is not known or 0.
    """
    if not error > 0:
        return math.nan
    return math.ceil(roads * (TOLD * error / difference) ** 2)


def mean_of_known(values: Sequence[np.ndarray]) -> np.ndarray:
    """Return the mean over classes for each draw. Classes without an object in the draw are left
    out; the mean is NaN if no class has one.

    Parameters
    ----------
    values : (draws,) scores of each class, NaN in draws without an object.
    """
    table = np.stack(values)
    known = np.isfinite(table)
    count = known.sum(0)
    total = np.where(known, table, 0.0).sum(0)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
