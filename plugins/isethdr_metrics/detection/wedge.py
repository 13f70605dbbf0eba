"""Wedge: the probability that the measured contrast of two noisy levels lies in an interval.

Both levels are normal. In the plane of the two levels, contrasts between two ends are a wedge with
its tip at the origin. The probability of the wedge is 1 minus the probabilities of the half planes
beyond its two sides. For dark levels, both of which may be measured negative, these half planes
overlap in the opposite wedge. Its probability is subtracted twice and therefore added again; it is
computed by quadrature over its angle.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, owens_t

# standard deviations above 0 from which a sum of levels is never measured below 0; the probability
# is 1e-9
FAR_SD = 6.0
TIE = 1e-9  # relative distance from an end of the interval below which a contrast lies on the end
# Gauss-Legendre quadrature over the angle of a wedge; with 5 nodes and an angle of at most
# 2 x NARROW, the error is below 1e-9
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)
NARROW = 0.5  # largest half angle for the quadrature, rad
# largest squared distance of the mean from the tip for the quadrature; exp(500) is still finite
LARGEST_SQUARE = 1000.0
# Coefficients of 1 - x M(x), with Mills's ratio M, as a ratio of polynomials for 0 <= x <= 9,
# lowest power first. Multiplied by exp(-x^2 / 2), its error is below 2e-12.
NUMERATOR = (1.0, 0.53623549, 0.16395286, 0.02620425, 0.00191795)
DENOMINATOR = (1.0, 1.78954962, 1.40682071, 0.62649993, 0.16839927, 0.0262984, 0.00191465)


class Wedges(NamedTuple):
    """The wedge of each pair of levels, as flat arrays. Angles are those in the plane of levels
    divided by their standard deviations.
    """

    ends: tuple[np.ndarray, np.ndarray]  # Michelson contrasts c at both ends of the interval
    # standard deviation of (1 - c) bright - (1 + c) dark at these ends
    sd: tuple[np.ndarray, np.ndarray]
    noise_free: np.ndarray  # bool
    # correlation between this difference at the lower end and its negative at the upper end
    correlation: np.ndarray
    scale: tuple[np.ndarray, np.ndarray]  # standard deviations of both levels; 1 without noise
    far: np.ndarray  # sum of levels from which the sum is never measured below 0
    middle: np.ndarray  # angle of the middle of the wedge, rad
    half_angle: np.ndarray  # angle between the middle of the wedge and its sides, rad

    def some(self, pairs: np.ndarray) -> Wedges:
        """Return the wedges of some pairs."""
        return Wedges(
            ends=(self.ends[0][pairs], self.ends[1][pairs]),
            sd=(self.sd[0][pairs], self.sd[1][pairs]),
            noise_free=self.noise_free[pairs],
            correlation=self.correlation[pairs],
            scale=(self.scale[0][pairs], self.scale[1][pairs]),
            far=self.far[pairs],
            middle=self.middle[pairs],
            half_angle=self.half_angle[pairs],
        )

    def nodes(self, pair: np.ndarray) -> np.ndarray:
        """Return the nodes (2, node, component) of the quadrature over the angle: the direction of
        each node divided by the standard deviation of each level.

        Parameters
        ----------
        pair : number of the wedge of each component (component,).
        """
        if pair.size > self.middle.size:  # each wedge is used several times
            every: np.ndarray = self.nodes(np.arange(self.middle.size))
            return every[:, :, pair]
        half = self.half_angle[pair]
        noisy = np.isfinite(half)
        angle = self.middle[pair] + np.where(noisy, half, 0.0) * NODES[:, None]
        first, second = (scale[pair] for scale in self.scale)
        return np.stack([np.cos(angle) / first, np.sin(angle) / second])


def wedges_between(
    bright_variance: np.ndarray, dark_variance: np.ndarray, contrast: np.ndarray, interval: float
) -> Wedges:
    """Return the wedge of measured contrasts within `contrast` (1 +- `interval`).

    Parameters
    ----------
    bright_variance, dark_variance : variances of the two levels (pair,), any unit squared.
    contrast : true Michelson contrast (pair,), above 0.
    interval : accepted deviation as a share of the contrast, below 1.

    Notes
    -----
    For b + d > 0, (b - d) / (b + d) >= c is equivalent to (1 - c) b - (1 + c) d >= 0.
    """
    ends = contrast * (1 - interval), contrast * (1 + interval)
    low, high = ends
    sd = [np.sqrt((1 - c) ** 2 * bright_variance + (1 + c) ** 2 * dark_variance) for c in ends]
    noise_free = (sd[0] <= 0) | (sd[1] <= 0)
    safe = [np.where(noise_free, 1.0, s) for s in sd]
    together = (1 - low) * (1 - high) * bright_variance + (1 + low) * (1 + high) * dark_variance
    scale = [np.sqrt(np.where(v > 0, v, 1.0)) for v in (bright_variance, dark_variance)]
    # the angle of a wedge is not defined if a level has no noise
    noisy = (bright_variance > 0) & (dark_variance > 0)
    first, last = (np.arctan2((1 - c) / scale[1], (1 + c) / scale[0]) for c in ends)
    middle = (first + last) / 2
    half = np.where(noisy, (first - last) / 2, np.inf)
    return Wedges(
        ends=ends,
        sd=(safe[0], safe[1]),
        noise_free=noise_free,
        correlation=-together / (safe[0] * safe[1]),
        scale=(scale[0], scale[1]),
        far=FAR_SD * np.sqrt(bright_variance + dark_variance),
        middle=middle,
        half_angle=half,
    )


def probability_between(
    wedges: Wedges, bright: np.ndarray, dark: np.ndarray, pair: np.ndarray | None = None
) -> np.ndarray:
    """Return the probability that two normal levels lie in a wedge.

    Parameters
    ----------
    wedges : wedges of pairs.
    bright, dark : mean levels (component,), in the unit of the wedges.
    pair : number of the wedge of each component (component,); None: one component for each wedge,
        in order.
    """
    every = slice(None) if pair is None else pair
    low, high = (c[every] for c in wedges.ends)
    mean = (1 - low) * bright - (1 + low) * dark, (1 - high) * bright - (1 + high) * dark
    noise_free = wedges.noise_free[every]
    total = bright + dark
    some_free = noise_free.any()
    if some_free and noise_free.all():
        return without_noise(mean, total)
    # h and k are the distances from both sides in standard deviations, positive inside the wedge
    h = mean[0] / wedges.sd[0][every]
    k = -mean[1] / wedges.sd[1][every]
    out = ndtr(h) + ndtr(k) - 1  # exact except for levels that may be measured negative
    # points beyond both sides of the wedge have a negative sum
    close = np.flatnonzero((total < wedges.far[every]) & ~noise_free)
    if close.size:
        some = close if pair is None else pair[close]
        out[close] += measured_negative(wedges, some, bright[close], dark[close])
    return np.where(noise_free, without_noise(mean, total), out) if some_free else out


def measured_negative(
    wedges: Wedges, pair: np.ndarray, bright: np.ndarray, dark: np.ndarray
) -> np.ndarray:
    """Return the probability (component,) of the opposite wedge: both levels are measured negative.

    Parameters
    ----------
    wedges : wedges of pairs with noise.
    pair : number of the wedge of each component (component,).
    bright, dark : mean levels (component,), in the unit of the wedges.
    """
    square = (bright / wedges.scale[0][pair]) ** 2 + (dark / wedges.scale[1][pair]) ** 2
    by_angle = (wedges.half_angle[pair] < NARROW) & (square < LARGEST_SQUARE)
    if by_angle.all():
        return _opposite(wedges, pair, bright, dark, square)
    out = np.empty(len(pair))
    for some, compute in ((by_angle, _opposite), (~by_angle, _opposite_by_sides)):
        at = np.flatnonzero(some)
        out[at] = compute(wedges, pair[at], bright[at], dark[at], square[at])
    return out


def _opposite_by_sides(
    wedges: Wedges, pair: np.ndarray, bright: np.ndarray, dark: np.ndarray, square: np.ndarray
) -> np.ndarray:
    """Return the probability (component,) of the opposite wedge from bivariate normal probabilities
    of its sides. `square` is not used.
    """
    low, high = (c[pair] for c in wedges.ends)
    h = ((1 - low) * bright - (1 + low) * dark) / wedges.sd[0][pair]
    k = -((1 - high) * bright - (1 + high) * dark) / wedges.sd[1][pair]
    return both_positive(h, k, wedges.correlation[pair]) - (ndtr(h) + ndtr(k) - 1)


def _opposite(
    wedges: Wedges, pair: np.ndarray, bright: np.ndarray, dark: np.ndarray, square: np.ndarray
) -> np.ndarray:
    """Return the probability (component,) of the opposite wedge by quadrature over its angle.

    `square` is the squared distance of the mean from the tip, in units of the standard deviations.

    Notes
    -----
    In units of the standard deviations, let r be the distance of the mean from the tip, and x the
    distance of the mean behind the tip along a direction. The probability per angle in this
    direction is exp(-r^2 / 2) / (2 pi) (1 - x M(x)), where M is Mills's ratio (Divgi 1979, Annals
    of Statistics 7, 903).
    """
    total = np.zeros(len(pair))
    for weight, along, across in zip(WEIGHTS, *wedges.nodes(pair), strict=True):
        total += weight * _tail(along * bright + across * dark)
    return wedges.half_angle[pair] * np.exp(-square / 2) * total / (2 * np.pi)


def _tail(x: np.ndarray) -> np.ndarray:
    """Return 1 - x M(x), where M is Mills's ratio of the normal distribution."""
    at = np.abs(x)
    over = np.full_like(at, NUMERATOR[-1])
    under = np.full_like(at, DENOMINATOR[-1])
    for coefficients, value in ((NUMERATOR, over), (DENOMINATOR, under)):
        for coefficient in coefficients[-2::-1]:
            value *= at
            value += coefficient
    over /= under
    behind = np.flatnonzero(x < 0)
    if behind.size:
        y = at[behind]
        over[behind] += np.sqrt(2 * np.pi) * y * np.exp(y * y / 2)
    return over


def skewness_effect(
    wedges: Wedges,
    bright: np.ndarray,
    dark: np.ndarray,
    bright_third: np.ndarray,
    dark_third: np.ndarray,
) -> np.ndarray:
    """Return the approximate change of a wedge's probability by the skewness of the levels.

    It is the probability with skewed levels minus that with normal levels.

    Parameters
    ----------
    wedges : one wedge for each pair.
    bright, dark : mean levels (pair,).
    bright_third, dark_third : third cumulants of the levels (pair,).

    Notes
    -----
    The change is the first term of Edgeworth's series (Kendall, Stuart, The Advanced Theory of
    Statistics, volume 1, section 6.18) at both sides of the wedge. Negative levels are neglected.
    """
    out = np.zeros(len(bright))
    for c, sd, side in zip(wedges.ends, wedges.sd, (1.0, -1.0), strict=True):
        at = ((1 - c) * bright - (1 + c) * dark) / sd
        cubes = cube(1 - c) * bright_third - cube(1 + c) * dark_third
        skewness = side * cubes / cube(sd)
        out += skewness / 6 * (at * at - 1) * np.exp(-at * at / 2) / np.sqrt(2 * np.pi)
    return out


def cube(values: np.ndarray) -> np.ndarray:
    """Return values^3. NumPy's power takes ten times as long."""
    return values * values * values


def both_positive(
    h: float | np.ndarray, k: float | np.ndarray, rho: float | np.ndarray
) -> float | np.ndarray:
    """Return P(h + u > 0 and k + v > 0) for standard normals u and v of correlation `rho`.

    Parameters
    ----------
    h, k : means divided by their standard deviations, any shape.
    rho : correlation, -1 to 1, same shape.

    Notes
    -----
    Owen 1956, eq. 2.1.
    """
    tiny = 1e-12
    h, k, rho = (np.asarray(v, float) for v in (h, k, rho))
    h, k = (np.where(np.abs(v) < tiny, tiny, v) for v in (h, k))
    root = np.sqrt(np.maximum(1 - rho**2, 1e-24))
    correction = np.where(h * k < 0, 0.5, 0.0)
    t_h = owens_t(h, (k / h - rho) / root)
    t_k = owens_t(k, (h / k - rho) / root)
    return (ndtr(h) + ndtr(k)) / 2 - t_h - t_k - correction


def without_noise(mean: tuple[np.ndarray, np.ndarray], total: np.ndarray) -> np.ndarray:
    """Return 1.0 for contrasts in the interval, ends included, and 0.0 for others.

    Parameters
    ----------
    mean : (1 - c) bright - (1 + c) dark at both ends c of the interval.
    total : sum of both levels.
    """
    inside = (mean[0] >= -TIE * np.abs(total)) & (mean[1] <= TIE * np.abs(total))
    return (inside & (total > 0)).astype(float)
