"""Random telegraph noise: a trap in a pixel's source follower is filled or empty in each of two
samples, and the reading is their difference.

If both states are equally likely and the samples independent, the difference is plus the step of
the trap, minus the step, or 0, with probabilities 1/4, 1/4 and 1/2. These are the three peaks of
published histograms of correlated double sampling. The steps of the pixels are assumed to be
exponentially distributed.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from isethdr_core.physics.detector import random_words

from .fixed_pattern import below


def steps_e(step_e: float, percent: float, stream: tuple, rows: range, columns: int) -> np.ndarray:
    """Return the (y, x) float32 step of every pixel's trap in `rows`, electrons; 0 without a trap.

    Parameters
    ----------
    step_e : mean step over the pixels with a trap, electrons.
    percent : share of pixels with a trap, 0 to 100.
    stream : key of the device's random numbers.
    rows : range of rows, counted from the sensor's upper left pixel.
    columns : number of columns.
    """
    out = np.zeros((len(rows), columns), np.float32)
    words = random_words.words(stream, rows.start, rows.stop, 0, columns)
    trapped = words < below(percent / 100)
    depth = random_words.words((*stream, "depth"), rows.start, rows.stop, 0, columns)
    p, upper = random_words.tail(depth[trapped])
    out[trapped] = -step_e * np.log(np.where(upper, p, 1.0 - p))
    return out


def telegraph_noise(steps: np.ndarray, stream: tuple, first_row: int) -> np.ndarray:
    """Return the noise of the traps of a block of rows in one reading, (y, x) electrons.

    Parameters
    ----------
    steps : (y, x) step of each pixel's trap, electrons.
    stream : key of the random numbers of the reading.
    first_row : first row of the block.
    """
    rows, columns = steps.shape
    words = random_words.words(stream, first_row, first_row + rows, 0, columns)
    first_state = words & 1
    second_state = (words >> 1) & 1
    return steps * (first_state - second_state).astype(np.float32)


def rms_e(step_e: float, percent: float) -> float:
    """Return the rms over all pixels and readings, electrons. Half of the readings of a pixel with
    a trap are off by its step. Steps are exponentially distributed, with the mean square
    2 `step_e`^2.

    Parameters
    ----------
    step_e : mean step over the pixels with a trap, electrons.
    percent : share of pixels with a trap, 0 to 100.
    """
    return step_e * sqrt(percent / 100)
