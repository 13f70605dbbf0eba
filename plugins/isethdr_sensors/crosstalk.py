"""Crosstalk: light and electrons that a neighbour collects. It moves means; nothing is gained or lost.

A photon or electron that goes astray does so on its own, so the counts of all pixels stay independent Poisson counts:
crosstalk acts on the mean charge, before the shot noise, and correlates no noise.
"""

from __future__ import annotations

import numpy as np

from .colour_filter_array import channels, filter_map
from .sensor_model import SensorModel

OPTICAL = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]]) / 4      # through the side walls: edge neighbours
ELECTRICAL = np.array([[1, 4, 1], [4, 0, 4], [1, 4, 1]]) / 20  # diffusion: corners are sqrt(2) away (assumption)


def kernel(optical_percent: float, electrical_percent: float) -> np.ndarray:
    """Return the (5, 5) share of a pixel's electrons that each pixel about it collects; the sum is 1."""
    from scipy.signal import convolve2d

    centre = np.zeros((3, 3))
    centre[1, 1] = 1.0
    parts = [centre + share / 100 * (around - centre) for share, around in ((optical_percent, OPTICAL), (electrical_percent, ELECTRICAL))]
    return convolve2d(*parts)


def spread(mean_e, model: SensorModel) -> np.ndarray:
    """Return mean light electrons after crosstalk, (y, x); the border mirrors, so that the sum stays."""
    if not model.optical_crosstalk_percent and not model.electrical_crosstalk_percent:
        return mean_e
    around = kernel(model.optical_crosstalk_percent, model.electrical_crosstalk_percent)
    wide = np.pad(mean_e, 2, mode="symmetric")
    height, width = mean_e.shape
    out = np.zeros(mean_e.shape)
    for dy, dx in np.ndindex(around.shape):  # a plain sum of positive terms: never negative, whatever lies beside a lamp
        if around[dy, dx]:
            out += around[dy, dx] * wide[dy:dy + height, dx:dx + width]
    return out


def mixed_efficiency(qe, model: SensorModel) -> np.ndarray:
    """Return the (channel, wavelength) electrons per photon of an evenly lit sensor, crosstalk between filters included.

    Pixels of one channel with unlike neighbours are averaged.
    """
    if not model.optical_crosstalk_percent and not model.electrical_crosstalk_percent:
        return qe
    around = kernel(model.optical_crosstalk_percent, model.electrical_crosstalk_percent)
    filters = filter_map(model.cfa, 40, 40)  # whole periods of 1, 2, 4, 5, 8, 10 pixels, far from the border in the middle
    share = np.zeros((len(channels(model.cfa)),) * 2)  # [channel, neighbour's channel]
    for y, x in np.ndindex(filters.shape):
        for dy, dx in np.ndindex(around.shape):
            share[filters[y, x], filters[(y + dy - 2) % 40, (x + dx - 2) % 40]] += around[dy, dx]
    return share / share.sum(1, keepdims=True) @ qe
