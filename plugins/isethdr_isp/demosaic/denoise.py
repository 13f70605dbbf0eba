"""Denoise: non-local means of a mosaic, before it is demosaiced.

Pixels at the same position of the filter array are averaged where their surroundings, in all
channels, are similar (Buades, Coll, Morel 2005; on the mosaic as Danielyan et al. 2009). Similarity
is judged on variance-stabilised values. The averages are of electrons, so no inverse transformation
is needed, which could leave a bias (docs/explanation/isp.md compares the two).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from isethdr_core import ledger

from ..readout.combine import Merged
from ..readout.noise_propagation import SampleNoise

REACH = 10  # pixels to each side in which like ones are looked for
PATCH = 5  # pixels, side of the surroundings
# mean squared difference of stabilised patches, of which noise makes 2 +- 0.6; below it the weight
# is 1
ALIKE = 2.5
SOFTNESS = 0.6  # beyond it, what costs 1 - 1/e of the weight
BINS = 512


def denoised(merged: Merged, cell_shape: tuple[int, int]) -> Merged:
    """Return the mosaic averaged over similar pixels, with the temporal variance of every average.
    No fixed pattern is stated.

    Parameters
    ----------
    merged : electrons and variance (y, x) of independent samples. Samples that are not valid stay
        unchanged.
    cell_shape : rows and columns after which the filter array repeats.

    Notes
    -----
    The variance is the larger of sum w^2 Var and sum w^2 (x - mean)^2: from the stated variance of
    the samples, and from their scatter. The scatter is larger where faint texture was averaged as
    noise. It does not include that the weights follow the noise: see docs/explanation/isp.md.
    """
    x, variance, good = merged.signal_e, merged.variance_e2, merged.valid
    level = stabilised(x, variance, good)
    own = good.astype(float)
    x = np.where(good, x, 0.0)
    square = x**2
    total, weight, spread = x.copy(), own, np.where(good, variance, 0.0)
    weight2, first2, second2 = own.copy(), x.copy(), square.copy()  # sums of w^2, w^2 x, w^2 x^2
    for dy, dx in shifts(cell_shape, x.shape):
        here, there = pair(x.shape[0], dy), pair(x.shape[1], dx)
        p, q = (here[0], there[0]), (here[1], there[1])
        w = likeness(level[p], level[q]) * (good[p] & good[q])
        w2 = w**2
        for one, other in ((p, q), (q, p)):
            total[one] += w * x[other]
            weight[one] += w
            spread[one] += w2 * variance[other]
            weight2[one] += w2
            first2[one] += w2 * x[other]
            second2[one] += w2 * square[other]
    safe = np.where(good, weight, 1.0)
    mean = total / safe
    apart = second2 - 2 * mean * first2 + mean**2 * weight2
    ledger.left_out(
        "variance of the denoised picture",
        "the weights follow the noise; the picture states no variance",
        np.nan,
        "",
    )
    signal = np.where(good, mean, merged.signal_e)
    variance = np.where(good, np.maximum(spread, apart) / safe**2, variance)
    return replace(merged, signal_e=signal, variance_e2=variance, fixed=SampleNoise())


def stabilised(x, variance, good):
    """Return values (y, x) with a noise of 1: the integral of dx / sqrt(Var(x) + 3/8).

    Parameters
    ----------
    x : electrons (y, x).
    variance : temporal variance of the electrons (y, x), e^2, as the readout states it: Var(x).
    good : (y, x) bool, the samples that are valid.

    Notes
    -----
    For one capture, Var = x + v, this is the generalised Anscombe transformation 2 sqrt(x + 3/8 +
    v) (Murtagh, Starck, Bijaoui 1995).
    """
    order = np.argsort(x[good], axis=None)
    if not len(order):
        return np.zeros(x.shape)
    parts = [part for part in np.array_split(order, min(BINS, len(order))) if len(part)]
    values, spreads = x[good].ravel(), variance[good].ravel()
    place = np.array([values[part].mean() for part in parts])
    spread = np.array([spreads[part].mean() for part in parts])
    # values below 0 are noise around 0; the variance stated for them is too small
    spread = np.maximum(
        spread, np.interp(min(0.0, place[-1]), place, spread) if place[0] < 0 else 0.0
    )
    slope = 1 / np.sqrt(spread + 0.375)
    height = np.concatenate([[0.0], np.cumsum(np.diff(place) * (slope[1:] + slope[:-1]) / 2)])
    beyond = np.minimum(x - place[0], 0.0) * slope[0] + np.maximum(x - place[-1], 0.0) * slope[-1]
    return np.interp(x, place, height) + beyond


def likeness(one, other):
    """Return weights (y, x) in (0, 1] by the mean squared difference of stabilised surroundings; 1
    where noise explains it.
    """
    from scipy.ndimage import uniform_filter

    difference = uniform_filter((one - other) ** 2, PATCH, mode="mirror")
    return np.exp(-np.maximum(difference - ALIKE, 0.0) / SOFTNESS)


def shifts(cell_shape, shape):
    """Return half of the shifts (rows, columns) that keep the filter array, column by column. The
    other half are their opposites.
    """
    dy, dx = (np.arange(-(REACH // period), REACH // period + 1) * period for period in cell_shape)
    return [
        (int(a), int(b))
        for b in dx
        for a in dy
        if (b, a) > (0, 0) and abs(a) < shape[0] and b < shape[1]
    ]


def pair(count: int, shift: int):
    """Return the two slices of an axis that lie `shift` apart."""
    return slice(max(-shift, 0), count - max(shift, 0)), slice(max(shift, 0), count + min(shift, 0))
