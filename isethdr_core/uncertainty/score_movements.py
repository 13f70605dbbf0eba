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
    shift: float  # mean change of the score by more noise; 0 where it is within its scatter
    rms: float  # of scatter and shift
    rms_freedom: int  # degrees of freedom of `rms`
    how: str  # for people
    tiles: float = FEW_TILES  # on which `scatter` rests beside its `freedom`


def known_within(count: int) -> float:
    """Return the factor within which the rms of `count` normal changes is their standard deviation,
    `SURE` of the times: a chi-squared share.
    """
    from scipy.optimize import brentq

    def share_beyond(factor: float) -> float:
        low, high = gammainc(count / 2, np.array([factor**-2, factor**2]) * count / 2)
        return float(high - low) - SURE

    # the share rises from 0; with one change it is 0.99 at 100
    return float(brentq(share_beyond, 1.0, 100.0))


def movement_of_lots(changes: np.ndarray) -> Movement:
    """Return the movement from changes of a score by lots of their own."""
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
    """Return the movement from changes of a score in pictures joined of blocks of two opposite
    lots.

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
    """Return the movement of the frame's score from changes of that of its parts, each with noise
    of its own.

    Parts scatter more than the frame, the mean of all of them; their shift is its own.
    """
    freedom = len(changes) - 1
    variance = variance_of(changes)
    scatter = math.sqrt(variance) / PARTS_ACROSS
    shift = beyond_scatter(float(changes.mean()), variance / len(changes))
    how = f"changes of {len(changes)} parts of the picture"
    return Movement(scatter, freedom, shift, math.hypot(scatter, shift), freedom, how)


def beyond_scatter(mean: float, variance: float) -> float:
    """Return what a mean is more than its own scatter, of this variance, explains."""
    return math.copysign(math.sqrt(max(mean**2 - variance, 0.0)), mean)


def beside_white(movement: Movement, slope: float, white: Movement) -> Movement:
    """Return how renderer noise moves a score that also depends on the reference white.

    Parameters
    ----------
    movement : of the score, where the white stays as it is.
    slope : change of the score over the change of the white.
    white : movement of the white; few tiles decide it, so it is independent of the others.
    """
    if not (slope and white.rms):
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
