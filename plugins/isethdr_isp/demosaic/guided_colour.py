"""Guided colour: every channel of a demosaiced picture as a local linear function of their sum.

Where no channel is sampled more than the others, a demosaic shifts the channels against each other
at fine detail, which shows as coloured fringes. The sum of the channels is hardly touched by these
shifts. A guided filter (He, Sun, Tang 2010) therefore fits each channel to the sum, and keeps what
follows it.
"""

from __future__ import annotations

import numpy as np

from .local_classes import local_mean

SIDE = 7  # pixels, window of a fit: holds 9 cells or more of a 2 x 2 array
# pixels, window of the noise that weighs a pixel. Weights of smaller windows follow the noise of
# the pixels themselves and make dark fields darker: by 0.4 % at 3 e with 7 pixels, by 0.06 % here.
NOISE_WINDOW = 11
LEAST_VARIANCE_E2 = 1e-6  # of captures without noise; keeps the weights finite


def guided_colour(planes: np.ndarray, variance: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """Return planes (channel, y, x) whose colour follows their sum.

    Parameters
    ----------
    planes : demosaiced electrons (channel, y, x).
    variance : temporal variance of the mosaic (y, x), e^2.
    usable : (y, x) bool. Other pixels keep their values, and have no part in the values around
        them.

    Notes
    -----
    In each window the fit is k = a s + b of a channel k to the sum s, by least squares with the
    inverse noise variance as weight, so that a bright object does not decide the colour beside it.
    The noise variance of the sum is added to its spread: where noise explains all change, a is 0
    and the channel takes its local mean. A pixel takes the mean of the fits of all windows that
    hold it.
    """
    total = planes.sum(axis=0)
    noise = len(planes) * local_mean(np.asarray(variance, float), NOISE_WINDOW)
    noise = np.maximum(noise, LEAST_VARIANCE_E2)
    weight = usable / noise
    weight_in_window = _positive(local_mean(weight, SIDE))
    usable_in_window = _positive(local_mean(usable.astype(float), SIDE))

    def weighted(values: np.ndarray) -> np.ndarray:
        return local_mean(weight * values, SIDE) / weight_in_window

    def over_windows(fit: np.ndarray) -> np.ndarray:
        return local_mean(np.where(usable, fit, 0.0), SIDE) / usable_in_window

    centre = weighted(total)
    spread = np.maximum(weighted(total**2) - centre**2, 0.0) + noise
    guided = np.empty_like(planes)
    for channel, plane in enumerate(planes):
        level = weighted(plane)
        slope = (weighted(total * plane) - centre * level) / spread
        offset = level - slope * centre
        fitted = over_windows(slope) * total + over_windows(offset)
        guided[channel] = np.where(usable, fitted, plane)
    return guided


def _positive(shares: np.ndarray) -> np.ndarray:
    """Return shares to divide by: 1 where rounding or an empty window leaves nothing."""
    return np.where(shares > 0, shares, 1.0)
