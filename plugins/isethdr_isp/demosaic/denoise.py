"""Denoise: non-local means of a mosaic, before it is demosaiced.

Pixels at the same position of the filter array are averaged where their surroundings, in all
channels, are similar (Buades, Coll, Morel 2005; on the mosaic as Danielyan et al. 2009). Similarity
is judged on variance-stabilised values. The averages are of electrons, so no inverse transformation
is needed, which could leave a bias (docs/explanation/isp.md compares the two).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from isethdr_core import ledger

from ..readout.combine import Merged
from ..readout.noise_propagation import SampleNoise

REACH = 10  # pixels to each side that are searched for similar ones
PATCH = 5  # pixels, side of the surroundings
# mean squared difference of stabilised patches, of which noise makes 2 +- 0.6; below it the weight
# is 1
ALIKE = 2.5
SOFTNESS = 0.6  # beyond this difference, the further difference that costs 1 - 1/e of the weight
BINS = 512
STRIP = 160  # rows at a time, with those around them: they stay in the cache of the processor


def denoised(merged: Merged, cell_shape: tuple[int, int], with_variance: bool = True) -> Merged:
    """Return the mosaic averaged over similar pixels, with the temporal variance of every average;
    no fixed pattern is stated.

    Parameters
    ----------
    merged : electrons and variance (y, x), samples independent of each other. Invalid samples do
        not change.
    cell_shape : rows and columns after which the filter array repeats.
    with_variance : False leaves the variances NaN, in two thirds of the time.

    Notes
    -----
    Var is the larger of sum w^2 Var, from the stated variance of the samples, and sum w^2 (x -
    mean)^2, from their differences. The second is larger if faint texture was taken for noise; the
    part of the texture that is averaged then differs from shot to shot. The weights also depend on
    the noise, which is not included: see docs/explanation/isp.md.
    """
    valid = merged.valid
    level = stabilised(merged.signal_e, merged.variance_e2, valid).astype(np.float32)
    noisy = _Samples(
        np.where(valid, merged.signal_e, 0.0).astype(np.float32),
        np.where(valid, merged.variance_e2, 0.0).astype(np.float32),
        level,
        valid,
    )
    change, variance = np.empty_like(level), np.full_like(level, np.nan)
    rows = len(level)
    for first in range(0, rows, STRIP):
        last, halo = min(first + STRIP, rows), REACH + PATCH // 2
        with_halo = slice(max(first - halo, 0), min(last + halo, rows))
        inner = slice(first - with_halo.start, last - with_halo.start)
        sums = _sums(noisy.rows(with_halo), cell_shape, with_variance)
        change[first:last] = sums.mean[inner]
        if with_variance:
            variance[first:last] = sums.variance[inner]
    ledger.left_out(
        "variance of the denoised picture",
        "the weights follow the noise; the picture states no variance",
        np.nan,
        "",
    )
    signal = np.where(valid, merged.signal_e + change, merged.signal_e)
    variance = np.where(valid, variance, merged.variance_e2)
    return replace(merged, signal_e=signal, variance_e2=variance, fixed=SampleNoise())


class _Samples(NamedTuple):
    """Samples of some rows (y, x); invalid samples are 0."""

    signal_e: np.ndarray
    variance_e2: np.ndarray
    level: np.ndarray  # stabilised
    good: np.ndarray

    def rows(self, rows: slice) -> _Samples:
        """Return some of the rows."""
        return _Samples(*(values[rows] for values in self))


class _Averages(NamedTuple):
    """Weighted means of the samples' neighbours (y, x)."""

    mean: np.ndarray  # less the sample: small, so that float32 holds all of it
    variance: np.ndarray | None


def _sums(samples: _Samples, cell_shape: tuple[int, int], with_variance: bool) -> _Averages:
    x, spread, level, valid = samples
    total, weight = np.zeros_like(x), np.ones_like(x)
    # sums of w^2 Var, of w^2, and of w^2 times the difference and its square
    variance, weight2, first2, second2 = spread.copy(), *np.zeros((3, *x.shape), np.float32)
    weight2 += 1.0
    all_good = bool(valid.all())
    for dy, dx in shifts(cell_shape, x.shape):
        rows, columns = pair(x.shape[0], dy), pair(x.shape[1], dx)
        p, q = (rows[0], columns[0]), (rows[1], columns[1])
        w = likeness(level[p], level[q])
        if not all_good:
            w *= valid[p] & valid[q]
        difference = x[q] - x[p]
        weighted = w * difference
        total[p] += weighted
        total[q] -= weighted
        weight[p] += w
        weight[q] += w
        if not with_variance:
            continue
        weighted *= w
        first2[p] += weighted
        first2[q] -= weighted
        weighted *= difference
        second2[p] += weighted
        second2[q] += weighted
        w *= w
        weight2[p] += w
        weight2[q] += w
        variance[p] += w * spread[q]
        variance[q] += w * spread[p]
    mean = total / weight
    if not with_variance:
        return _Averages(mean, None)
    scatter = second2 - 2 * mean * first2 + mean**2 * weight2
    return _Averages(mean, np.maximum(variance, scatter) / weight**2)


def stabilised(x, variance, valid):
    """Return values (y, x) with a noise of 1: the integral of dx / sqrt(Var(x) + 3/8).

    Parameters
    ----------
    x : electrons (y, x).
    variance : temporal variance of the electrons (y, x), e^2, as the readout states it: Var(x).
    valid : (y, x) bool, the samples that are valid.

    Notes
    -----
    For one capture, Var = x + v, this is the generalised Anscombe transformation 2 sqrt(x + 3/8 +
    v) (Murtagh, Starck, Bijaoui 1995).
    """
    order = np.argsort(x[valid], axis=None)
    if not len(order):
        return np.zeros(x.shape)
    parts = [part for part in np.array_split(order, min(BINS, len(order))) if len(part)]
    values, spreads = x[valid].ravel(), variance[valid].ravel()
    means = np.array([values[part].mean() for part in parts])
    spread = np.array([spreads[part].mean() for part in parts])
    # values below 0 are noise around 0; the variance stated for them is too small
    spread = np.maximum(
        spread, np.interp(min(0.0, means[-1]), means, spread) if means[0] < 0 else 0.0
    )
    slope = 1 / np.sqrt(spread + 0.375)
    height = np.concatenate([[0.0], np.cumsum(np.diff(means) * (slope[1:] + slope[:-1]) / 2)])
    outside_table = (
        np.minimum(x - means[0], 0.0) * slope[0] + np.maximum(x - means[-1], 0.0) * slope[-1]
    )
    return np.interp(x, means, height) + outside_table


def likeness(first, second):
    """Return weights (y, x) in (0, 1] by the mean squared difference of stabilised surroundings; 1
    where noise explains it.
    """
    difference = first - second
    difference *= difference
    # exp(-max(mean - ALIKE, 0) / SOFTNESS) in place
    weights = _box_sums(difference)
    weights *= -1 / (SOFTNESS * PATCH**2)
    weights += ALIKE / SOFTNESS
    np.minimum(weights, 0.0, out=weights)
    return np.exp(weights, out=weights)


def _box_sums(values):
    """Return sums over squares of `PATCH` values a side, mirrored at the border."""
    half = PATCH // 2
    for axis in (0, 1):
        sides = [(half, half) if a == axis else (0, 0) for a in (0, 1)]
        padded = np.pad(values, sides, mode="reflect")
        count = values.shape[axis]
        cuts = [slice(k, k + count) for k in range(PATCH)]
        parts = [padded[cut] if axis == 0 else padded[:, cut] for cut in cuts]
        values = parts[0] + parts[1]
        for part in parts[2:]:
            values += part
    return values


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
