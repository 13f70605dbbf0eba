"""Photon counts: the probability that two noisy pixels show approximately their true contrast, down
to 0 electrons.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.special import gammaln, xlogy

from .count_sums import Counts, of_counts, sharp, terms_of
from .wedge import cube, probability_between, skewness_effect, wedges_between

# Weight below which a pair of components is neglected. All such pairs together change the result by
# less than 1e-8.
NO_WEIGHT = 1e-11
# share of the variance below which read noise counts as 0, because it is rounding of the shot noise
NO_READ_NOISE = 1e-12

# Limits between the three representations of a pixel, from the errors listed in `representation`
SMALL_SKEWNESS = 0.06
SMOOTH_READ_NOISE_E = 1.5
FEW_ELECTRONS = 20.0
LATTICE_READ_NOISE_E = 0.3
SOME_ELECTRONS = 300.0
NORMAL = 0
TWO_NORMALS = 1
COUNTS = 2

ESTIMATED_READ_NOISE_E = 0.2  # smallest read noise for which the bound of an estimate was measured

# number of pairs computed together, so that intermediate results stay in the processor's cache
PIECE = 8192
LARGEST_PIECE = 200_000  # largest number of terms of sums over counts, for the same reason
LARGEST_SUM = 2_000_000  # largest number of pairs of counts in memory


class Signal(NamedTuple):
    """Signals of pixels, as flat arrays in one unit of luminance."""

    mean: np.ndarray
    variance: np.ndarray
    step: np.ndarray  # luminance of one electron; 0 if the noise is normal


class Mixture(NamedTuple):
    """Each signal as a mixture of normal distributions with the same variance."""

    weight: np.ndarray  # (signal, component); the sum over components is 1
    mean: np.ndarray  # (signal, component)
    variance: np.ndarray  # (signal,)


def of_signals(bright: Signal, dark: Signal, contrast: np.ndarray, interval: float) -> np.ndarray:
    """Return `pair_probability` for flat arrays; each signal has its own step.

    Parameters
    ----------
    bright, dark : signals of the truly brighter pixel and of the other pixel of each pair.
    contrast : true Michelson contrast (pair,), above 0.
    interval : accepted deviation as a share of the contrast, below 1.

    Notes
    -----
    Every signal becomes a mixture of normal distributions, see `representation`. The probability
    of a pair is the weighted sum over the components of both.
    """
    bright = _limited(bright)
    dark = _limited(dark)
    kinds = representation(bright), representation(dark)
    out = np.empty(len(contrast))
    for kind in (NORMAL, TWO_NORMALS, COUNTS):
        for other in (NORMAL, TWO_NORMALS, COUNTS):
            pairs = np.flatnonzero((kinds[0] == kind) & (kinds[1] == other))
            if kind == other == COUNTS:
                pairs = _of_counts(out, pairs, (bright, dark), contrast, interval)
            for some in _pieces(pairs, bright, dark, COUNTS in (kind, other)):
                first = _mixture(Signal(*(v[some] for v in bright)), kind)
                second = _mixture(Signal(*(v[some] for v in dark)), other)
                out[some] = _sum(first, second, contrast[some], interval)
    return out


class Estimate(NamedTuple):
    """Estimated probabilities of pairs, and bounds on their errors."""

    value: np.ndarray
    bound: np.ndarray


def estimated(bright: Signal, dark: Signal, contrast: np.ndarray, interval: float) -> Estimate:
    """Return the probability of each pair for normal noise, corrected for its skewness.

    Parameters
    ----------
    bright, dark : signals of the truly brighter pixel and of the other pixel of each pair.
    contrast : true Michelson contrast (pair,), above 0.
    interval : largest accepted deviation, as a share of the contrast, below 1.

    Notes
    -----
    The correction is the first term of Edgeworth's series at both ends of the interval. For means
    of 0.03 to 10 000 electrons, 0.2 to 50 e of read noise, contrasts of 0.05 to 1 with and without
    flare, and steps that differ by a factor of two, the difference from `of_signals` is at most 0.6
    of the bound. The bound is 0 if both signals are represented as NORMAL; otherwise it is 1 below
    0.2 e of read noise.
    """
    found = Estimate(np.empty(len(contrast)), np.empty(len(contrast)))
    for start in range(0, len(contrast), PIECE):
        some = slice(start, start + PIECE)
        signals = (Signal(*(values[some] for values in of)) for of in (bright, dark))
        found.value[some], found.bound[some] = _estimated(*signals, contrast[some], interval)
    return found


def _estimated(bright: Signal, dark: Signal, contrast: np.ndarray, interval: float) -> Estimate:
    """Return `estimated` for a few pairs."""
    bright = _limited(bright)
    dark = _limited(dark)
    first = _shape(bright)
    second = _shape(dark)
    normal = (first.kind == NORMAL) & (second.kind == NORMAL)
    wedges = wedges_between(bright.variance, dark.variance, contrast, interval)
    value = probability_between(wedges, bright.mean, dark.mean)
    if not normal.all():
        thirds = (shape.counts * cube(of.step) for shape, of in ((first, bright), (second, dark)))
        skewed = skewness_effect(wedges, bright.mean, dark.mean, *thirds)
        value = value + np.where(normal, 0.0, skewed)
    largest = np.maximum(first.skewness, second.skewness)
    bound = np.where(largest < 0.4, 0.007 + 0.06 * largest, 0.18 * largest)
    noisy_enough = np.minimum(first.read_e2, second.read_e2) >= ESTIMATED_READ_NOISE_E**2
    return Estimate(
        np.clip(value, 0.0, 1.0), np.where(normal, 0.0, np.where(noisy_enough, bound, 1.0))
    )


def representation(signal: Signal) -> np.ndarray:
    """Return which of NORMAL, TWO_NORMALS and COUNTS represents each signal.

    Notes
    -----
    Errors relative to the sum over all counts, for means of 0.1 to 300 electrons and contrasts of
    0.06 to 1, are at most: 0.002 for a normal distribution, if the skewness is below 0.06; 0.004
    for two normal distributions with the same first four cumulants, from 1.5 e of read noise on, or
    from 20 electrons and 0.3 e of read noise on.
    """
    return _shape(signal).kind


class _Shape(NamedTuple):
    """Representation and shape of the distributions of signals."""

    kind: np.ndarray  # NORMAL, TWO_NORMALS or COUNTS
    counts: np.ndarray  # mean electrons
    skewness: np.ndarray
    read_e2: np.ndarray  # variance of the normal noise, electrons squared


def _shape(signal: Signal) -> _Shape:
    counts, read_e2 = _electrons(signal)
    sd = np.sqrt(counts + read_e2)
    skewness = np.divide(counts, cube(sd), out=np.zeros_like(sd), where=sd > 0)
    out = np.where(skewness < SMALL_SKEWNESS, NORMAL, TWO_NORMALS)
    few = (read_e2 < SMOOTH_READ_NOISE_E**2) & (counts < FEW_ELECTRONS) & (out == TWO_NORMALS)
    lattice = (read_e2 < LATTICE_READ_NOISE_E**2) & (counts < SOME_ELECTRONS) & (counts > 0)
    return _Shape(np.where(few | lattice, COUNTS, out), counts, skewness, read_e2)


def _limited(signal: Signal) -> Signal:
    """Return the signals with means of at least 0, and with steps limited so that the shot noise
    does not exceed the variance.
    """
    mean = np.maximum(signal.mean, 0.0)
    most = np.divide(signal.variance, mean, out=np.full(mean.shape, np.inf), where=mean > 0)
    return signal._replace(step=np.minimum(signal.step, most))


def _electrons(signal: Signal) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean counts, and the variance of the normal noise in electrons squared."""
    lit = (signal.step > 0) & (signal.mean > 0)
    step = np.where(lit, signal.step, 1.0)
    counts = np.where(lit, signal.mean / step, 0.0)
    excess_variance = signal.variance / step**2 - counts
    return counts, np.where(excess_variance > NO_READ_NOISE * (counts + 1), excess_variance, 0.0)


def _mixture(signal: Signal, kind: int) -> Mixture:
    if kind == NORMAL:
        return Mixture(np.ones((len(signal.mean), 1)), signal.mean[:, None], signal.variance)
    counts, read_e2 = _electrons(signal)
    if kind == TWO_NORMALS:
        weight, electrons, own_e2 = _two_points(counts)
        rest_e2 = read_e2 + counts - own_e2
    else:
        n = _range(counts)
        at = n[0] + np.arange(n[1])[None]
        weight = np.exp(xlogy(at, counts[:, None]) - counts[:, None] - gammaln(at + 1))
        weight /= weight.sum(axis=1, keepdims=True)
        electrons = at
        rest_e2 = read_e2
    return Mixture(weight, signal.step[:, None] * electrons, rest_e2 * signal.step**2)


def _range(counts: np.ndarray) -> tuple[int, int]:
    """Return the first count and the number of counts that contain all but 1e-6 of these Poisson
    distributions.
    """
    low = float(counts.min())
    high = float(counts.max())
    first = max(0, int(low - 5 * np.sqrt(low)))
    return first, int(high + 5 * np.sqrt(high) + 6) - first


def _two_points(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return weights (signal, 2), positions (signal, 2) and variance (signal,) of two points with
    the third and fourth cumulants of a Poisson distribution.

    Notes
    -----
    Two points with variance t and skewness g have the third cumulant g t^1.5 and the fourth
    cumulant (g^2 - 2) t^2. Both equal the mean m if 2 t^3 + m t = m^2. The only real root t is
    below m; normal noise has the rest of the variance, m - t.
    """
    # Cardano's formula divided by m, in a form that loses no digits for small m
    u = np.cbrt(counts * (np.sqrt(counts**2 / 16 + counts / 216) + counts / 4))
    t = np.clip(counts**2 / (2 * (u**2 + counts / 6 + (counts / (6 * u)) ** 2)), 0.0, counts)
    skewness = counts / t**1.5
    half = np.sqrt(1 + skewness**2 / 4)
    places = np.sqrt(t)[:, None] * (skewness[:, None] / 2 + np.stack([-half, half], 1))
    upper = (1 - skewness / (2 * half)) / 2
    return np.stack([1 - upper, upper], 1), counts[:, None] + places, t


def _pieces(
    pairs: np.ndarray, bright: Signal, dark: Signal, of_counts: bool
) -> Iterator[np.ndarray]:
    """Yield groups of `pairs` with similar counts that are small enough for memory."""
    if not len(pairs):
        return
    if not of_counts:
        for start in range(0, len(pairs), PIECE):
            yield pairs[start : start + PIECE]
        return
    counts = [_electrons(Signal(*(v[pairs] for v in signal)))[0] for signal in (bright, dark)]
    counts = [np.minimum(c, SOME_ELECTRONS) for c in counts]
    order = np.argsort(counts[0] + counts[1], kind="stable")
    start = 0
    while start < len(order):
        size = 1024
        while size > 1:
            some = order[start : start + size]
            terms = len(some) * _range(counts[0][some])[1] * _range(counts[1][some])[1]
            if terms <= LARGEST_SUM:
                break
            size //= 2
        yield pairs[order[start : start + size]]
        start += size


def _of_counts(
    out: np.ndarray,
    pairs: np.ndarray,
    signals: tuple[Signal, Signal],
    contrast: np.ndarray,
    interval: float,
) -> np.ndarray:
    """Write the probabilities of `pairs`, with COUNTS for both pixels, into `out`. Return the pairs
    that were not computed, because they have hardly any noise except shot noise.
    """
    bright, dark = (Signal(*(v[pairs] for v in signal)) for signal in signals)
    counts, noise_e2 = zip(_electrons(bright), _electrons(dark), strict=True)
    noise = [e2 * of.step**2 for e2, of in zip(noise_e2, (bright, dark))]
    first, second = (Counts(n, of.step) for n, of in zip(counts, (bright, dark)))
    wedges = wedges_between(*noise, contrast[pairs], interval)
    left = sharp(wedges, second)
    size = terms_of(wedges, first, second)
    # similar pairs together, because all pairs of a piece get the number of terms that the largest
    # needs
    order = np.lexsort((first.mean, np.log2(size).astype(int)))
    order = order[~left[order]]
    start = 0
    while start < len(order):
        piece = order[start : start + max(int(LARGEST_PIECE / size[order[start]]), 1)]
        some = [Counts(*(v[piece] for v in of)) for of in (first, second)]
        out[pairs[piece]] = of_counts(wedges.some(piece), *some)
        start += len(piece)
    return pairs[left]


def _sum(bright: Mixture, dark: Mixture, contrast: np.ndarray, interval: float) -> np.ndarray:
    """Return the probability of mixtures: the weighted sum of the probabilities of components."""
    weight = bright.weight[:, :, None] * dark.weight[:, None, :]
    between = wedges_between(bright.variance, dark.variance, contrast, interval)
    if weight.size == len(contrast):
        return np.clip(probability_between(between, bright.mean[:, 0], dark.mean[:, 0]), 0.0, 1.0)
    # only pairs of components with enough weight; most pairs of counts have less
    pair, i, j = np.nonzero(weight > NO_WEIGHT)
    out = np.empty(len(pair))
    for start in range(0, len(pair), PIECE):
        some = slice(start, start + PIECE)
        b = bright.mean[pair[some], i[some]]
        d = dark.mean[pair[some], j[some]]
        out[some] = probability_between(between, b, d, pair[some])
    out *= weight[pair, i, j]
    return np.clip(np.bincount(pair, out, minlength=len(contrast)), 0.0, 1.0)
