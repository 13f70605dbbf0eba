"""Denoise: non-local means of a mosaic, before it is demosaiced.

Pixels at the same position of the filter array are averaged if their surroundings, in all channels,
are similar (Buades, Coll, Morel 2005; on the mosaic as in Danielyan et al. 2009). Similarity is
measured on variance-stabilised values, but electrons are averaged. No inverse transformation is
therefore needed, which could cause a bias (docs/explanation/isp.md compares both).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from isethdr_core import ledger

from ..readout.combine import Merged
from ..readout.noise_propagation import SampleNoise

REACH = 10  # number of pixels to each side that are searched for similar ones
PATCH = 5  # side of the surroundings (patches) of a pixel, pixels
# Mean squared difference of stabilised patches up to which the weight is 1; noise alone gives
# 2 +- 0.6
ALIKE = 2.5
SOFTNESS = 0.6  # further difference that reduces the weight by the factor 1/e
BINS = 512  # largest number of entries of the table of stabilised values
SAMPLED = 2**16  # approximate number of pixels from which that table is made
STRIP = 32  # rows computed at a time; they and the rows compared with them stay in the cache


def denoised(
    merged: Merged,
    cell_shape: tuple[int, int],
    with_variance: bool = True,
    strength: float = 1.0,
) -> Merged:
    """Return the mosaic averaged over similar pixels, with the temporal variance of every average.
    No variance of the fixed pattern is stated.

    Parameters
    ----------
    merged : electrons and variance (y, x) of independent samples. Invalid samples do not change.
    cell_shape : rows and columns after which the filter array repeats.
    with_variance : if False, variances are NaN, and the run time is two thirds.
    strength : noise that surroundings may differ by, as a multiple of the stated standard
        deviation. Above 1, more texture counts as noise.

    Notes
    -----
    The variance is the larger of sum w^2 Var, from the stated variance of the samples, and
    sum w^2 (x - mean)^2, from their differences. The second is larger if faint texture counted as
    noise, because a different part of the texture is then averaged in each shot. The weights also
    depend on the noise; this is not included, see docs/explanation/isp.md.
    """
    valid = merged.valid
    level = stabilised(merged.signal_e, merged.variance_e2, valid).astype(np.float32)
    level /= np.float32(strength)
    noisy = _Samples(
        np.where(valid, merged.signal_e, 0.0).astype(np.float32),
        np.where(valid, merged.variance_e2, 0.0).astype(np.float32),
        level,
        valid,
    )
    averages = _averages(noisy, cell_shape, with_variance)
    variance = averages.variance
    if variance is None:
        variance = np.full_like(level, np.nan)
    ledger.left_out(
        "variance of the denoised picture",
        "the weights depend on the noise, so the picture states no variance",
        np.nan,
        "",
    )
    signal = np.where(valid, merged.signal_e + averages.mean, merged.signal_e)
    variance = np.where(valid, variance, merged.variance_e2)
    return replace(merged, signal_e=signal, variance_e2=variance, fixed=SampleNoise())


class _Samples(NamedTuple):
    """The samples (y, x); invalid samples are 0."""

    signal_e: np.ndarray
    variance_e2: np.ndarray
    level: np.ndarray  # variance-stabilised values
    good: np.ndarray  # bool, valid samples


class _Averages(NamedTuple):
    """Weighted means of the samples' neighbours (y, x)."""

    mean: np.ndarray  # mean minus the sample; small, so that float32 is accurate
    variance: np.ndarray | None  # None if it was not wanted


class _Totals:
    """Weighted sums over the neighbours of each sample (y, x), with weights w."""

    def __init__(self, samples: _Samples, with_variance: bool) -> None:
        self.samples = samples
        shape = samples.level.shape
        self.difference = np.zeros(shape, np.float32)
        self.weight = np.ones(shape, np.float32)
        self.with_variance = with_variance
        if with_variance:
            # sums of w^2 Var, of w^2, and of w^2 times the difference and its square
            self.variance = samples.variance_e2.copy()
            self.weight2 = self.weight.copy()
            self.first2, self.second2 = np.zeros((2, *shape), np.float32)

    def add(self, p: Any, q: Any, w: np.ndarray) -> None:
        """Add the samples at `q` to the sums of the samples at `p`, and vice versa.

        Parameters
        ----------
        p, q : slices of rows and columns.
        w : weights, which are overwritten.
        """
        x = self.samples.signal_e
        spread = self.samples.variance_e2
        difference = x[q] - x[p]
        weighted = np.multiply(w, difference, out=None if self.with_variance else difference)
        self.difference[p] += weighted
        self.difference[q] -= weighted
        self.weight[p] += w
        self.weight[q] += w
        if not self.with_variance:
            return
        weighted *= w
        self.first2[p] += weighted
        self.first2[q] -= weighted
        weighted *= difference
        self.second2[p] += weighted
        self.second2[q] += weighted
        w *= w
        self.weight2[p] += w
        self.weight2[q] += w
        self.variance[p] += w * spread[q]
        self.variance[q] += w * spread[p]

    def averages(self) -> _Averages:
        """Return the weighted means."""
        mean = self.difference / self.weight
        if not self.with_variance:
            return _Averages(mean, None)
        scatter = self.second2 - 2 * mean * self.first2 + mean**2 * self.weight2
        return _Averages(mean, np.maximum(self.variance, scatter) / self.weight**2)


def _averages(samples: _Samples, cell_shape: tuple[int, int], with_variance: bool) -> _Averages:
    level = samples.level
    valid = samples.good
    totals = _Totals(samples, with_variance)
    good_rows = valid.all(axis=1)
    height, width = level.shape
    both = [(dy, pair(width, dx)) for dy, dx in shifts(cell_shape, level.shape)]
    for start in range(0, height, STRIP):
        for dy, columns in both:
            # rows with a partner `dy` below inside the picture
            end = min(start + STRIP, height - dy)
            if end <= start:
                continue
            above = min(start, PATCH // 2)
            below = min(height - dy - end, PATCH // 2)
            wide = slice(start - above, end + below)
            first, second = (
                (slice(wide.start + d, wide.stop + d), c) for d, c in zip((0, dy), columns)
            )
            w = likeness(level[first], level[second], (above, below))
            p, q = ((slice(start + d, end + d), c) for d, c in zip((0, dy), columns))
            if not (good_rows[p[0]].all() and good_rows[q[0]].all()):
                w *= valid[p] & valid[q]
            totals.add(p, q, w)
    return totals.averages()


def stabilised(x: np.ndarray, variance: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Return values (y, x) with noise of standard deviation 1: the integral of
    dx / sqrt(Var(x) + 3/8).

    Parameters
    ----------
    x : electrons (y, x).
    variance : Var(x), temporal variance (y, x) of the electrons that the readout states, e^2.
    valid : (y, x) bool, the samples that are valid.

    Notes
    -----
    For one capture, with Var = x + v, this is the generalised Anscombe transformation
    2 sqrt(x + 3/8 + v) (Murtagh, Starck, Bijaoui 1995).
    """
    values = x[valid]
    if not len(values):
        return np.zeros(x.shape)
    # regular sampling; an odd step samples all filters of the array
    step = len(values) // SAMPLED | 1
    values = values[::step]
    spreads = variance[valid][::step]
    parts = np.array_split(np.argsort(values), min(BINS, len(values)))
    means = np.array([values[part].mean() for part in parts])
    spread = np.array([spreads[part].mean() for part in parts])
    # values below 0 are noise around 0, and the variance stated for them is too small
    spread = np.maximum(
        spread, np.interp(min(0.0, means[-1]), means, spread) if means[0] < 0 else 0.0
    )
    slope = 1 / np.sqrt(spread + 0.375)
    height = np.concatenate([[0.0], np.cumsum(np.diff(means) * (slope[1:] + slope[:-1]) / 2)])
    outside_table = (
        np.minimum(x - means[0], 0.0) * slope[0] + np.maximum(x - means[-1], 0.0) * slope[-1]
    )
    return np.interp(x, means, height) + outside_table


def likeness(first: np.ndarray, second: np.ndarray, beside: tuple[int, int] = (0, 0)) -> np.ndarray:
    """Return weights (y, x) in (0, 1] from the mean squared difference of stabilised surroundings.
    The weight is 1 if noise explains the difference.

    Parameters
    ----------
    first, second : stabilised values (y, x).
    beside : numbers of first and of last rows that serve only as surroundings and get no weight.
    """
    difference = first - second
    difference *= difference
    # exp(-max(mean - ALIKE, 0) / SOFTNESS), computed in place
    weights = _box_sums(difference, beside)
    weights *= -1 / (SOFTNESS * PATCH**2)
    weights += ALIKE / SOFTNESS
    np.minimum(weights, 0.0, out=weights)
    return np.exp(weights, out=weights)


def _box_sums(values: np.ndarray, beside: tuple[int, int] = (0, 0)) -> np.ndarray:
    """Return sums over squares with `PATCH` = 5 values along each side, mirrored at the border.
    `beside` is as in `likeness`.
    """
    half = PATCH // 2
    height, width = values.shape
    above, below = (half - count for count in beside)
    if height <= max(above, below) or width <= half:
        padded = np.pad(values, [(above, below), (half, half)], mode="reflect")
    else:
        padded = np.empty((above + height + below, width + 2 * half), values.dtype)
        padded[above : above + height, half : half + width] = values
        for k in range(1, above + 1):
            padded[above - k] = padded[above + k]
        last = above + height - 1
        for k in range(1, below + 1):
            padded[last + k] = padded[last - k]
        for k in range(1, half + 1):
            padded[:, half - k] = padded[:, half + k]
            padded[:, -1 - half + k] = padded[:, -1 - half - k]
    pairs = padded[:-1] + padded[1:]
    rows = pairs[:-3] + pairs[2:-1]
    rows += padded[4:]
    pairs = rows[:, :-1] + rows[:, 1:]
    sums = pairs[:, :-3] + pairs[:, 2:-1]
    sums += rows[:, 4:]
    return sums


def shifts(cell_shape: tuple[int, int], shape: tuple[int, int]) -> list[Any]:
    """Return half of the shifts (rows, columns) that map the filter array onto itself, row by row.
    The other half are their opposites.
    """
    dy, dx = (np.arange(-(REACH // period), REACH // period + 1) * period for period in cell_shape)
    return [
        (int(a), int(b))
        for a in dy
        for b in dx
        if (a, b) > (0, 0) and a < shape[0] and abs(b) < shape[1]
    ]


def pair(count: int, shift: int) -> Any:
    """Return the two slices of an axis that lie `shift` apart."""
    return slice(max(-shift, 0), count - max(shift, 0)), slice(max(shift, 0), count + min(shift, 0))
