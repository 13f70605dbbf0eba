"""Score movements: how the renderer's noise moves a score, from its changes in changed pictures."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import gammainc

from .changed_scenes import PARTS_ACROSS
from .score_intervals import degrees_of_freedom

SURE = 0.9  # share of runs for which the stated factor holds
MANY = 1e6  # degrees of freedom, as good as infinite
# least number of tiles that a score depends on: each tile has one difference of half buffers
FEW_TILES = 8


class Movement(NamedTuple):
    """How renderer noise moves one score, in the unit of the score."""

    scatter: float  # standard error of one rendering
    freedom: float  # degrees of freedom of `scatter`, without those of the tiles
    shift: float  # mean change of the score by more noise; 0 if it is within its scatter
    rms: float  # root mean square of the changes: scatter and shift together
    rms_freedom: int  # degrees of freedom of `rms`
    how: str  # how the movement was measured, for people
    tiles: float = FEW_TILES  # number of tiles that limit `scatter`, in addition to `freedom`


def known_within(count: int) -> float:
    """Return the factor within which the rms of `count` normal changes agrees with their standard
    deviation with the probability `SURE`, from the chi-squared distribution.
    """
    from scipy.optimize import brentq

    def missing_share(factor: float) -> float:
        low, high = gammainc(count / 2, np.array([factor**-2, factor**2]) * count / 2)
        return float(high - low) - SURE

    # the share within a factor rises from 0 at factor 1; with one change it is 0.99 at factor 100
    return float(brentq(missing_share, 1.0, 100.0))


def movement_of_lots(changes: np.ndarray) -> Movement:
    """Return the movement from the changes of a score by independent lots."""
    count = len(changes)
    variance = variance_of(changes)
    shift = beyond_scatter(float(changes.mean()), variance / count)
    rms = math.sqrt(float(np.mean(np.square(changes))))
    how = f"{count} changes of the scene"
    return Movement(math.sqrt(variance), count - 1, shift, rms, count, how)


def variance_of(values: np.ndarray) -> float:
    """Return the unbiased variance of values; 0 for a single value."""
    return float(values.var(ddof=1)) if len(values) > 1 else 0.0


def movement_of_blocks(changes: np.ndarray) -> Movement:
    """Return the movement from the changes of a score in pictures composed of blocks of two
    opposite lots.

    Notes
    -----
    The linear part of a change is a sum over the blocks. Each block has either sign in half of the
    pictures. The linear part therefore cancels in the mean, which is the shift. Its mean square
    about the mean is the variance of one lot.
    """
    freedom = len(changes) - 1
    scatter = float(changes.std())
    shift = float(changes.mean())
    how = f"{len(changes)} pictures of two opposite changes of the scene"
    return Movement(scatter, freedom, shift, math.hypot(scatter, shift), freedom, how)


def movement_of_parts(changes: np.ndarray) -> Movement:
    """Return the movement of the frame's score from the changes of the scores of its parts, which
    have independent noise.

    Parts scatter more than the frame, which is their mean. The shift of the parts is that of the
    frame.
    """
    freedom = len(changes) - 1
    variance = variance_of(changes)
    scatter = math.sqrt(variance) / PARTS_ACROSS
    shift = beyond_scatter(float(changes.mean()), variance / len(changes))
    how = f"changes of {len(changes)} parts of the picture"
    return Movement(scatter, freedom, shift, math.hypot(scatter, shift), freedom, how)


def beyond_scatter(mean: float, variance: float) -> float:
    """Return the part of a mean that its own scatter, of this variance, does not explain."""
    return math.copysign(math.sqrt(max(mean**2 - variance, 0.0)), mean)


def beside_white(movement: Movement, slope: float, white: Movement) -> Movement:
    """Return how renderer noise moves a score that also depends on the reference white.

    Parameters
    ----------
    movement : movement of the score at a constant white.
    slope : change of the score per change of the white.
    white : movement of the white. Few tiles decide it, so it is independent of `movement`.
    """
    if not (slope and white.rms and movement.freedom):  # a single change has no known scatter
        return movement
    by_white = abs(slope) * white.scatter
    variances = movement.scatter**2, by_white**2
    freedom = degrees_of_freedom(variances, (movement.freedom, white.freedom))
    scatter = math.hypot(movement.scatter, by_white)
    shift = math.copysign(math.hypot(movement.shift, slope * white.shift), movement.shift)
    rms = math.hypot(scatter, shift)
    known = max(round(min(freedom, MANY)), 1)
    how = f"{movement.how} and of the white"
    return Movement(scatter, freedom, shift, rms, known, how)
