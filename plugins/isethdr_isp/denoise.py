"""Denoise: non-local means of a mosaic, before it is demosaiced, with the variance that is left.

Pixels at one place of the filter array are averaged where their surroundings, all channels of them, look alike (Buades, Coll, Morel
2005, on the mosaic as Danielyan et al. 2009). Likeness is judged on stabilised values, whose noise is the same everywhere; the
averages are of electrons, so that there is no inverse to be taken and none to leave a bias (docs/isp.md compares the two).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from isethdr_core import ledger

from .combine import Merged
from .propagation import NoisePart, SampleNoise

REACH = 10          # pixels to each side in which like ones are looked for
PATCH = 5           # pixels, side of the surroundings
ALIKE = 2.5         # mean squared difference of stabilised patches, of which noise makes 2 +- 0.6; below it the weight is 1
SOFTNESS = 0.6      # beyond it, what costs 1 - 1/e of the weight
BINS = 512


class Denoised(NamedTuple):
    """A mosaic of averages, and the noise they have left."""

    merged: Merged          # averages in `signal_e`, their variances in `variance_e2` and `fixed`
    alike: np.ndarray       # (y, x) of how many samples each is the mean


def denoised(merged: Merged, cell_shape: tuple[int, int]) -> Denoised:
    """Return the mosaic averaged over alike pixels.

    Parameters
    ----------
    merged : electrons and variance (y, x), samples independent of each other; those that are not valid stay as they are.
    cell_shape : rows and columns after which the filter array repeats.

    Notes
    -----
    Var is the larger of sum w^2 Var and sum w^2 (x - mean)^2: what is stated of the samples, and how far they are apart. They are further
    apart where faint texture was taken for noise, and which of it is averaged differs from shot to shot.
    The fixed pattern is averaged with the same weights; a column or row deviates alike in all its pixels.
    """
    x, variance, good = merged.signal_e, merged.variance_e2, merged.valid
    level = stabilised(x, variance, good)
    own = good.astype(float)
    x = np.where(good, x, 0.0)
    square = x**2
    total, weight, spread = x.copy(), own, np.where(good, variance, 0.0)
    weight2, first2, second2 = own.copy(), x.copy(), square.copy()    # sums of w^2, w^2 x, w^2 x^2
    patterns = [_AveragedPart(part, own) for part in merged.fixed.parts]
    for dy, dx in shifts(cell_shape, x.shape):
        here, there = pair(x.shape[0], dy), pair(x.shape[1], dx)
        p, q = (here[0], there[0]), (here[1], there[1])
        w = likeness(level[p], level[q]) * (good[p] & good[q])
        w2 = w**2
        for one, other, sign in ((p, q, 1), (q, p, -1)):
            total[one] += w * x[other]
            weight[one] += w
            spread[one] += w2 * variance[other]
            weight2[one] += w2
            first2[one] += w2 * x[other]
            second2[one] += w2 * square[other]
            for pattern in patterns:
                pattern.add(one, other, w, (sign * dy, sign * dx))
    safe, safe2 = np.where(good, weight, 1.0), np.where(good, weight2, 1.0)
    mean = total / safe
    apart = second2 - 2 * mean * first2 + mean**2 * weight2
    ledger.left_out("noise in the weights of the denoiser", "variance is that of fixed weights, or the scatter of what they average", 0.2,
                    "of the variance")
    signal = np.where(good, mean, merged.signal_e)
    alike = safe**2 / safe2
    fixed = SampleNoise(tuple(part for pattern in patterns for part in pattern.parts(safe, good, alike)))
    out = replace(merged, signal_e=signal, variance_e2=np.where(good, np.maximum(spread, apart) / safe**2, variance), fixed=fixed)
    return Denoised(out, alike)


class _AveragedPart:
    """A part of the fixed pattern while its samples are averaged: sums of weight x deviation over samples that deviate alike."""

    def __init__(self, part: NoisePart, own):
        self._part = part
        self._samples = part.variance_e2 if part.alone() else np.sqrt(part.variance_e2)
        self._squares = np.zeros(own.shape)
        self._sums: dict[int, np.ndarray] = {}
        every = (slice(None), slice(None))
        self.add(every, every, own, (0, 0))

    def add(self, one, other, weight, shift: tuple[int, int]) -> None:
        """Add the samples `other` to the means `one`, views of the picture that lie `shift` rows and columns apart."""
        if self._part.alone():
            self._squares[one] += weight**2 * self._samples[other]
            return
        axis = 1 if self._part.rows == "any" else 0
        if axis == 1 and abs(shift[1]) not in map(abs, self._sums):
            self._close()   # shifts come column by column, so the sums of other columns are complete
        if shift[axis] not in self._sums:
            self._sums[shift[axis]] = np.zeros(self._squares.shape)
        self._sums[shift[axis]][one] += weight * self._samples[other]

    def _close(self) -> None:
        for total in self._sums.values():
            self._squares += total**2
        self._sums.clear()

    def parts(self, weight, good, alike) -> list[NoisePart]:
        """Return the part after the mean, split into what a pixel has alone and what its like neighbours share."""
        self._close()
        variance = np.where(good, self._squares / weight**2, self._part.variance_e2)
        if self._part.alone():
            alone, shared = 1 / alike, NoisePart(variance, "place", "place")
        else:
            before = self._part.variance_e2
            alone = np.divide(variance, before, out=np.ones_like(variance), where=before > 0)
            rows, columns = ("place" if rule == "same" else "any" for rule in (self._part.rows, self._part.columns))
            shared = NoisePart(variance, rows, columns)
        alone = np.clip(alone, 0.0, 1.0)
        return [self._part._replace(variance_e2=alone * variance), shared._replace(variance_e2=(1 - alone) * variance)]


def averaged(variance_e2, alike) -> SampleNoise:
    """Return the noise of samples that were averaged before, by what they have in common.

    Parameters
    ----------
    variance_e2, alike : (y, x) variance of the samples, and how many each is the mean of.

    Notes
    -----
    Like neighbours at one place of the filter array are means of much the same samples and deviate alike; a sample that
    nothing is like deviates alone. Two means of n that share all but their own sample are correlated by 1 - 1 / n.
    """
    alone = np.clip(1 / alike, 0.0, 1.0)
    return SampleNoise((NoisePart(alone * variance_e2), NoisePart((1 - alone) * variance_e2, "place", "place")))


def stabilised(x, variance, good):
    """Return values (y, x) with a noise of 1: the integral of dx / sqrt(Var(x) + 3/8), Var(x) as reported.

    For one capture, Var = x + v, this is the generalised Anscombe transformation 2 sqrt(x + 3/8 + v) (Murtagh, Starck, Bijaoui 1995).
    """
    order = np.argsort(x[good], axis=None)
    if not len(order):
        return np.zeros(x.shape)
    parts = [part for part in np.array_split(order, min(BINS, len(order))) if len(part)]
    values, spreads = x[good].ravel(), variance[good].ravel()
    place = np.array([values[part].mean() for part in parts])
    spread = np.array([spreads[part].mean() for part in parts])
    # below 0 there is only noise around 0: what is reported there, from a pixel's own sample, is too small
    spread = np.maximum(spread, np.interp(min(0.0, place[-1]), place, spread) if place[0] < 0 else 0.0)
    slope = 1 / np.sqrt(spread + 0.375)
    height = np.concatenate([[0.0], np.cumsum(np.diff(place) * (slope[1:] + slope[:-1]) / 2)])
    beyond = np.minimum(x - place[0], 0.0) * slope[0] + np.maximum(x - place[-1], 0.0) * slope[-1]
    return np.interp(x, place, height) + beyond


def likeness(one, other):
    """Return weights (y, x) in (0, 1] by the mean squared difference of stabilised surroundings; 1 where noise explains it."""
    from scipy.ndimage import uniform_filter

    difference = uniform_filter((one - other) ** 2, PATCH, mode="mirror")
    return np.exp(-np.maximum(difference - ALIKE, 0.0) / SOFTNESS)


def shifts(cell_shape, shape):
    """Return every second one of the shifts (rows, columns) that keep the filter array, column by column.

    The other half are their opposites.
    """
    dy, dx = (np.arange(-(REACH // period), REACH // period + 1) * period for period in cell_shape)
    return [(int(a), int(b)) for b in dx for a in dy if (b, a) > (0, 0) and abs(a) < shape[0] and b < shape[1]]


def pair(count: int, shift: int):
    """Return the two slices of an axis that lie `shift` apart."""
    return slice(max(-shift, 0), count - max(shift, 0)), slice(max(shift, 0), count + min(shift, 0))
