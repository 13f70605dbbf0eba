"""Noise line: read noise and shot noise of a picture, from a line fitted to variance over
luminance.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# number of groups of dark pixels: enough for two unknowns, and few enough for medians over many
# pixels
GROUPS = 20
# largest luminance of the fit / noise of the darkest pixels
REACH = 12.0
# ratio of the luminances of the brightest and the darkest group; all darker pixels are in one group
DEPTH = 1e3
FEW = 16  # smallest number of pixels in a group
DARKEST_SHARE = 0.2  # share of the pixels that count as dark


class NoiseLine(NamedTuple):
    """Variance of luminance: `read` + `step` times the luminance."""

    read: float  # (cd/m2)^2
    step: float  # cd/m2: the effective luminance of one electron


def noise_line(
    luminance: np.ndarray, variance: np.ndarray, darkest_share: float = DARKEST_SHARE
) -> NoiseLine:
    """Return the line through the variances of the darker pixels.

    Parameters
    ----------
    luminance : number or flat array, cd/m2.
    variance : number or flat array, (cd/m2)^2, without fixed pattern.
    darkest_share : share of the pixels that count as dark; their noise sets the range of the fit.

    Notes
    -----
    A luminance that is the sum of Poisson counts N_i with weights w_i has the variance
    sum(w_i^2 N_i). Divided by the mean luminance, this is sum(w_i^2 N_i) / sum(w_i N_i), the
    `step`. For a single count it is the weight of that count.
    """
    luminance, variance = (np.atleast_1d(np.asarray(v, float)) for v in (luminance, variance))
    if not luminance.size:
        return NoiseLine(0.0, 0.0)
    return line_through(*dark_medians(luminance, variance, darkest_share))


def dark_medians(luminance: np.ndarray, variance: np.ndarray, darkest_share: float) -> tuple:
    """Return median luminance and variance of groups of dark pixels, the darkest first.

    Parameters
    ----------
    luminance : flat array, cd/m2.
    variance : flat array, (cd/m2)^2.
    darkest_share : share of the pixels that count as dark; their noise sets the largest luminance.
    """
    dark = luminance <= np.quantile(luminance, darkest_share)
    noise = float(np.sqrt(np.median(variance[dark])))
    return medians(luminance, variance, max(REACH * noise, float(luminance[dark].max())))


def medians(luminance: np.ndarray, variance: np.ndarray, reach: float) -> tuple:
    """Return median luminance and variance of groups of pixels, the darkest first.

    Parameters
    ----------
    luminance : flat array, cd/m2.
    variance : flat array, (cd/m2)^2.
    reach : largest luminance, cd/m2.
    """
    below = luminance <= reach
    luminance = luminance[below]
    variance = variance[below]
    level = np.maximum(luminance / (reach or 1.0), 1 / DEPTH)
    group = np.ceil(GROUPS * (1 + np.log(level) / np.log(DEPTH))).astype(np.uint8)
    order = np.argsort(group, kind="stable")  # radix sort, as the keys have one byte
    parts = np.split(order, np.cumsum(np.bincount(group))[:-1])
    enough = [part for part in parts if len(part) >= FEW]
    if len(enough) < 3:  # few distinct luminances or few pixels: use groups of equal size
        order = np.argsort(luminance, kind="stable")
        enough = np.array_split(order, min(GROUPS, len(luminance)))
    return tuple(np.array([np.median(v[part]) for part in enough]) for v in (luminance, variance))


def line_through(luminance: np.ndarray, variance: np.ndarray) -> NoiseLine:
    """Return the line by relative least squares; its read noise and shot noise are not negative."""
    from scipy.optimize import nnls

    luminance, variance = (np.atleast_1d(np.asarray(v, float)) for v in (luminance, variance))
    level = luminance.mean() or 1.0
    noisy = variance > 0
    if not noisy.any():
        return NoiseLine(0.0, 0.0)
    terms = np.stack([np.ones(noisy.sum()), luminance[noisy] / level], 1)
    (read, shot), _ = nnls(terms / variance[noisy, None], np.ones(noisy.sum()))
    return NoiseLine(float(read), float(shot / level))
