"""Guided colour: every channel of a demosaiced picture as a local linear function of their sum.

If no channel is sampled more than the others, a demosaic shifts the channels against each other at
fine detail, which causes coloured fringes. These shifts hardly change the sum of the channels. A
guided filter (He, Sun, Tang 2010) therefore fits each channel to the sum, and keeps the fit.
"""

from __future__ import annotations

import numpy as np

from .local_classes import local_mean

SIDE = 7  # side of the window of a fit, pixels; it contains at least 9 cells of a 2 x 2 array
# Side of the window in which noise is averaged for the weight of a pixel, pixels. With smaller
# windows, weights depend on the noise of the pixels themselves and make dark fields darker: by
# 0.4 % at 3 e with 7 pixels, by 0.06 % with this window.
NOISE_WINDOW = 11
LEAST_VARIANCE_E2 = 1e-6  # smallest variance; keeps the weights finite for captures without noise


def guided_colour(planes: np.ndarray, variance: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """Return planes (channel, y, x), each replaced by a local linear function of the sum of all.

    Parameters
    ----------
    planes : demosaiced electrons (channel, y, x).
    variance : temporal variance of the mosaic (y, x), e^2.
    usable : (y, x) bool. Other pixels keep their values, and do not influence the pixels around
        them.

    Notes
    -----
    In each window, a channel k is fitted to the sum s as k = a s + b, by least squares. The weight
    is the inverse noise variance, so that a bright object does not determine the colour next to it.
    The noise variance of the sum is added to the spread of the sum: if noise explains all change, a
    is 0 and the channel takes its local mean. A pixel takes the mean of the fits of all windows
    that contain it.
    """
    total = planes.sum(axis=0)
    noise = len(planes) * _mean_of_usable(np.asarray(variance, float), usable)
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


def _mean_of_usable(variance: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """Return the mean variance of the usable pixels in `NOISE_WINDOW`."""
    share = _positive(local_mean(usable.astype(float), NOISE_WINDOW))
    return local_mean(np.where(usable, variance, 0.0), NOISE_WINDOW) / share


def _positive(shares: np.ndarray) -> np.ndarray:
    """Return shares to divide by, with 1 in place of values that are not above 0."""
    return np.where(shares > 0, shares, 1.0)
