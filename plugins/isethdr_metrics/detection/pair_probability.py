"""Pair probability: the probability that the contrast of two noisy pixels is measured nearly
correctly.
"""

from __future__ import annotations

import numpy as np

from .photon_counts import Signal, of_signals


def pair_probability(  # noqa: PLR0913 - means and variances of two pixels, each an array
    bright: float | np.ndarray,
    bright_variance: float | np.ndarray,
    dark: float | np.ndarray,
    dark_variance: float | np.ndarray,
    contrast: float | np.ndarray,
    interval: float = 0.5,
    step: float | None = None,
) -> float | np.ndarray:
    """Return the probability that the measured contrast is within `contrast` (1 +- `interval`).

    Parameters
    ----------
    bright, dark : numbers or arrays, means of the truly brighter pixel and of the other, any unit.
    bright_variance, dark_variance : variances of the two independent pixels, in that unit squared.
    contrast : true Michelson contrast, above 0.
    interval : accepted deviation as a share of the contrast, below 1.
    step : signal of one electron, in the unit of the means. None: the difference of the variances
        divided by the difference of the means, which is the step if both pixels have the same read
        noise.

    Returns
    -------
    float for numbers, else an array of their broadcast shape.

    Notes
    -----
    A pixel is a Poisson count times `step`, plus normal noise with the rest of its variance. The
    sum over both counts is exact. If counts are large or read noise covers the steps, normal
    distributions replace the counts, with an error below 0.005 (`photon_counts.representation`). A
    pair without any signal, 0 and 0, has no contrast and counts as not detected. The definition
    follows Geese, Seger, Paolillo 2018 and IEEE Std 2020-2024. The measured contrast must have the
    sign of the true contrast.
    """
    values = np.broadcast_arrays(bright, bright_variance, dark, dark_variance, contrast)
    b, b_variance, d, d_variance, k = (np.asarray(v, float).ravel() for v in values)
    if step is None:
        one_electron = _growth(b, b_variance, d, d_variance)
    else:
        one_electron = np.broadcast_to(np.asarray(step, float), values[0].shape).ravel()
    probability = of_signals(
        Signal(b, b_variance, one_electron), Signal(d, d_variance, one_electron), k, interval
    )
    if values[0].ndim == 0:
        return float(probability[0])
    return probability.reshape(values[0].shape)


def _growth(
    bright: np.ndarray, bright_variance: np.ndarray, dark: np.ndarray, dark_variance: np.ndarray
) -> np.ndarray:
    """Return the growth of the variance per unit of the mean; 0 if it does not grow."""
    apart = bright - dark
    slope = (bright_variance - dark_variance) / np.where(apart > 0, apart, 1.0)
    return np.where(apart > 0, np.maximum(slope, 0.0), 0.0)
