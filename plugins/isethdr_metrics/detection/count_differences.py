"""Count differences: the probability that a weighted difference of two counts with normal noise is
above 0, from its characteristic function.

The characteristic functions of Poisson and normal distributions are known in closed form, and so is
that of the difference. With normal noise of about one count, it vanishes after a few tens of terms,
while a sum over counts needs a thousand.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# probability of values beyond the range of a difference, and relative size of terms left out
RARE = 1e-9
LOG_RARE = -np.log(RARE)
PIECE = 2048  # number of differences computed together, so that they stay in the processor's cache


class Differences(NamedTuple):
    """Differences a N - b M + normal noise of two Poisson counts N and M, flat arrays."""

    bright_mean: np.ndarray  # mean of N
    dark_mean: np.ndarray  # mean of M
    bright_step: np.ndarray  # a; below 0 at an end of the interval beyond a contrast of 1
    dark_step: np.ndarray  # b, above 0
    sd: np.ndarray  # standard deviation of the normal noise, above 0, in the unit of the steps

    def some(self, at: np.ndarray) -> Differences:
        """Return some of the differences."""
        return Differences(*(values[at] for values in self))


def terms_of(differences: Differences) -> np.ndarray:
    """Return the number of terms that `above_zero` needs for each difference.

    Notes
    -----
    The noise makes terms vanish as exp(-(sd t)^2 / 2). The distance of terms in t is 2 pi / range,
    where the difference leaves the range only with the probability `RARE`, by Bernstein's
    inequality (Boucheron, Lugosi, Massart 2013, eq. 2.10).
    """
    return np.ceil(np.sqrt(2 * LOG_RARE) / differences.sd / _distance(differences)).astype(int)


def above_zero(differences: Differences) -> np.ndarray:
    """Return the probability that each difference is above 0, with an error below 1e-8.

    Notes
    -----
    The characteristic function is inverted from its values at odd multiples of half a distance
    (Davies 1973, Biometrika 60, 415, eq. 5).
    """
    count = terms_of(differences)
    out = np.empty(len(differences.sd))
    order = np.argsort(count, kind="stable")  # a piece needs as many terms as its last difference
    for start in range(0, len(order), PIECE):
        at = order[start : start + PIECE]
        out[at] = _piece(differences.some(at), int(count[at[-1]]))
    return out


def _piece(differences: Differences, count: int) -> np.ndarray:
    bright, dark, bright_step, dark_step, sd = differences
    distance = _distance(differences)
    # N exp(i a t) and M exp(-i b t), from one term to the next
    half_turns = np.exp(0.5j * bright_step * distance), np.exp(-0.5j * dark_step * distance)
    first = bright * half_turns[0]
    second = dark * half_turns[1]
    first_ratio, second_ratio = (half_turn * half_turn for half_turn in half_turns)
    square = -0.5 * (sd * distance) ** 2
    mean = bright + dark
    total = np.zeros(len(sd))
    for k in range(count):
        exponent = first + second
        size = square * (k + 0.5) ** 2
        size += exponent.real
        size -= mean
        np.exp(size, out=size)
        size *= np.sin(exponent.imag)
        size /= k + 0.5
        total += size
        first *= first_ratio
        second *= second_ratio
    return 0.5 + total / np.pi


def _distance(differences: Differences) -> np.ndarray:
    """Return the distance of two terms in t: 2 pi / range of each difference."""
    bright, dark, bright_step, dark_step, sd = differences
    mean = bright_step * bright - dark_step * dark
    variance = bright_step**2 * bright + dark_step**2 * dark + sd**2
    jump = LOG_RARE * np.maximum(np.abs(bright_step), dark_step) / 3
    reach = jump + np.sqrt(jump**2 + 2 * LOG_RARE * variance)
    return 2 * np.pi / (np.abs(mean) + reach)
