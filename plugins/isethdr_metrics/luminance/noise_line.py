"""Noise line: read noise and shot noise of a picture, from how its variance grows with
luminance.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

GROUPS = 20  # of dark pixels; two unknowns need a few, and each group enough pixels for a median
REACH = 12.0  # times the noise of the darkest pixels: levels up to which the line is fitted
DEPTH = 1e3  # ratio of luminances over which groups are laid; what is darker is one group
FEW = 16  # pixels of a group, at least
DARKEST_SHARE = 0.2  # of the pixels: their noise is that of the dark


class NoiseLine(NamedTuple):
    """Variance of luminance: `read` + `step` times the luminance."""

    read: float  # (cd/m2)^2
    step: float  # cd/m2: the effective luminance of one electron


def noise_line(luminance, variance, darkest_share: float = DARKEST_SHARE) -> NoiseLine:
    """Return the line through the variances of the darker pixels.

    Parameters
    ----------
    luminance, variance : numbers or flat arrays, cd/m2 and (cd/m2)^2, without fixed pattern.
    darkest_share : share of the pixels whose noise sets up to which level the line is fitted.

    Notes
    -----
    A luminance that is the sum of Poisson counts N_i of weight w_i has a variance of sum(w_i^2
    N_i), which
    is sum(w_i^2 N_i) / sum(w_i N_i) times its mean. That ratio is `step`; for one count it is its
    weight.
    """
    luminance, variance = (np.atleast_1d(np.asarray(v, float)) for v in (luminance, variance))
    if not luminance.size:
        return NoiseLine(0.0, 0.0)
    return line_through(*dark_medians(luminance, variance, darkest_share))


def dark_medians(luminance, variance, darkest_share: float) -> tuple:
    """Return median luminance and variance of groups of dark pixels, the darkest first."""
    dark = luminance <= np.quantile(luminance, darkest_share)
    noise = float(np.sqrt(np.median(variance[dark])))
    return medians(luminance, variance, max(REACH * noise, float(luminance[dark].max())))


def medians(luminance, variance, reach: float) -> tuple:
    """Return median luminance and variance of groups of pixels up to `reach`, the darkest first."""
    below = luminance <= reach
    luminance, variance = luminance[below], variance[below]
    level = np.maximum(luminance / (reach or 1.0), 1 / DEPTH)
    group = np.ceil(GROUPS * (1 + np.log(level) / np.log(DEPTH))).astype(np.uint8)
    order = np.argsort(group, kind="stable")  # one byte: sorted by counting
    parts = np.split(order, np.cumsum(np.bincount(group))[:-1])
    enough = [part for part in parts if len(part) >= FEW]
    if len(enough) < 3:  # so few luminances, or pixels, that groups of equal numbers serve better
        order = np.argsort(luminance, kind="stable")
        enough = np.array_split(order, min(GROUPS, len(luminance)))
    return tuple(np.array([np.median(v[part]) for part in enough]) for v in (luminance, variance))


def line_through(luminance, variance) -> NoiseLine:
    """Return the line through points by relative least squares, neither term negative."""
    from scipy.optimize import nnls

    luminance, variance = (np.atleast_1d(np.asarray(v, float)) for v in (luminance, variance))
    level, noisy = luminance.mean() or 1.0, variance > 0
    if not noisy.any():
        return NoiseLine(0.0, 0.0)
    terms = np.stack([np.ones(noisy.sum()), luminance[noisy] / level], 1)
    (read, shot), _ = nnls(terms / variance[noisy, None], np.ones(noisy.sum()))
    return NoiseLine(float(read), float(shot / level))
