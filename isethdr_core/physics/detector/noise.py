"""Noise by inversion: one random word per pixel becomes a standard normal or an exact Poisson
count.

Inversion makes every draw a monotone function of one word. A sweep over exposures therefore keeps
the same noise realisation, and pixels do not depend on each other. Words come from `random_words`.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.special import gammainc, gammaincc, ndtri

from .random_words import tail, words

SERIES_BELOW_E = 4.0  # mean electrons below which the Poisson series is summed
EXACT_BELOW_E = 1e6  # mean electrons above which the expansion alone is used
# largest mean electrons; float64 counts whole electrons up to 9e15, with a relative step of 1e-16
# beyond
LARGEST_MEAN_E = 1e18


def normal(word: np.ndarray) -> np.ndarray:
    """Return float64 standard normals by inversion of int64 words; the largest possible magnitude
    is 9.2.
    """
    p, upper = tail(word)
    return ndtri(p, out=p) * (1.0 - 2.0 * upper)


def normal_float32(word: np.ndarray) -> np.ndarray:
    """Return float32 standard normals by inversion of int64 words; error below 5e-7 (1 + |z|).

    References
    ----------
    Wichura 1988, algorithm AS 241, PPND7.
    """
    shape = np.shape(word)
    word = np.ravel(word)
    magnitude = word ^ (word >> 63)
    q = (np.int64(2**63 - 1) - magnitude).astype(np.float32)
    q *= np.float32(2.0**-64)  # 0.5 - p, with full relative precision near 0
    r = 0.180625 - q * q
    z = _polynomial(r, (59.10937472, 159.29113202, 50.434271938, 3.3871327179))
    z *= q
    z /= _polynomial(r, (67.18756360, 78.757757664, 17.895169469, 1.0))
    outer = np.flatnonzero(q > 0.425)
    p = (magnitude[outer] + 0.5) * 2.0**-64
    r = np.sqrt(-np.log(p.astype(np.float32))) - np.float32(1.6)
    z[outer] = (((0.17023821103 * r + 1.3067284816) * r + 2.7568153900) * r + 1.4234372777) / (
        (0.12021132975 * r + 0.73700164250) * r + 1.0
    )
    beyond = outer[p < 1.4e-11]  # beyond the range of the rational approximation
    z[beyond] = -ndtri((magnitude[beyond] + 0.5) * 2.0**-64)
    return np.copysign(z, word.astype(np.float32)).reshape(shape)


def _polynomial(x: np.ndarray, coefficients: tuple[float, ...]) -> np.ndarray:
    """Return a polynomial by Horner's rule. The coefficients start with that of the highest power.
    Operations in place take half of the time.
    """
    out = x * coefficients[0]
    for coefficient in coefficients[1:-1]:
        out += coefficient
        out *= x
    out += coefficients[-1]
    return out


def normal_pair(word: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two independent float32 standard normals from each int64 word (Box and Muller 1958);
    |z| < 6.8.
    """
    u = np.asarray(word).view(np.uint64)
    open_unit = (u >> np.uint64(32)).astype(np.float32) * np.float32(2.0**-32) + np.float32(
        2.0**-33
    )
    # 32 bits rounded to float32 can give 1 + 2^-33, which has a positive logarithm
    radius = np.sqrt(-2.0 * np.log(np.minimum(open_unit, np.float32(1.0))))
    angle = (u & np.uint64(0xFFFFFFFF)).astype(np.float32) * np.float32(2 * np.pi * 2.0**-32)
    return radius * np.cos(angle), radius * np.sin(angle)


def poisson(mean: npt.ArrayLike, word: npt.ArrayLike) -> np.ndarray:
    """Return Poisson counts by inversion of one word per pixel. A count never falls if the mean
    rises.

    Parameters
    ----------
    mean : mean electrons, 0..1e18, any shape.
    word : int64 words of the same shape.

    Returns
    -------
    float64 whole numbers of that shape.

    Raises
    ------
    ValueError : a mean is outside 0..1e18, or not a number.

    Notes
    -----
    Below a mean of 4 e, the series is summed. Up to 1e6 e, a Cornish-Fisher expansion to 1/mean is
    used; values within its error bound of a step of the distribution are decided by the incomplete
    gamma function, so that the count is the exact quantile. Above 1e6 e, the expansion is used
    alone: the error of the quantile is below 2e-8 e within 6 sigma, plus one float64 step of the
    mean (128 e at 1e18).

    References
    ----------
    Giles 2016, "Algorithm 955: approximation of the inverse Poisson cumulative distribution
    function".
    """
    shape = np.shape(mean)
    mean = np.ravel(mean).astype(np.float64)
    word = np.ravel(word)
    if not np.all((mean >= 0) & (mean <= LARGEST_MEAN_E)):
        raise ValueError(
            f"mean electrons are {mean.min():g} to {mean.max():g}; expected finite values from 0 to"
            " 1e18"
        )
    low = mean < SERIES_BELOW_E
    if low.all():
        out = _series(mean, word)
    elif not low.any():
        out = _expand(mean, word)
    else:
        out = np.empty_like(mean)
        out[low], out[~low] = _series(mean[low], word[low]), _expand(mean[~low], word[~low])
    return out.reshape(shape)


def poisson_image(
    mean: npt.ArrayLike, stream: tuple[object, ...], y0: int = 0, x0: int = 0
) -> np.ndarray:
    """Return Poisson counts for a (y, x) rectangle of mean electrons with the upper left pixel (y0,
    x0).

    Parameters
    ----------
    mean : mean electrons (y, x), 0 to 1e18.
    stream : key of the random words.
    y0, x0 : position of the rectangle's upper left pixel, 0 or more.
    """
    mean = np.asarray(mean)
    height, width = mean.shape
    rows = rows_per_block(width)
    out = np.empty(mean.shape)
    for y in range(0, height, rows):
        part = mean[y : y + rows]
        out[y : y + rows] = poisson(part, words(stream, y0 + y, y0 + y + len(part), x0, x0 + width))
    return out


def rows_per_block(width: int) -> int:
    """Return the number of rows of `width` pixels for which intermediate results stay in the
    second-level cache.
    """
    return max(1, 30_000 // max(width, 1))


def _series(mean: np.ndarray, word: np.ndarray) -> np.ndarray:
    # `remaining` is the distance of the draw beyond the step from k - 1 to k of the distribution.
    # The smaller tail is summed, so that means of 1e-12 electrons are accurate too.
    if mean.size and mean.max() < 0.69:  # only upper draws with p < mean give a count above 0
        p, upper = tail(word)
        some = np.flatnonzero(upper & (p < mean))
        count = np.zeros_like(mean)
        if some.size < mean.size:
            if some.size:
                count[some] = _series(mean[some], word[some])
            return count
    p, upper = tail(word)
    term = np.exp(-mean)
    remaining = np.where(upper, -np.expm1(-mean) - p, p - term)
    count = np.zeros_like(mean)
    k = 0
    # differences of sums cannot resolve these tails, and the loop below would not end
    rare = np.flatnonzero(upper & (p < 1e-10))
    remaining[rare] = 0.0
    count[rare] = _decide(
        np.ones(rare.size), mean[rare], p[rare], upper[rare], np.ones(rare.size, bool)
    )
    index = np.flatnonzero(remaining > 0)
    mean = mean[index]
    term = term[index]
    remaining = remaining[index]
    while index.size:
        k += 1
        count[index] = k
        term *= mean
        term /= k
        remaining -= term
        stay = np.flatnonzero(remaining > 0)
        index = index[stay]
        mean = mean[stay]
        term = term[stay]
        remaining = remaining[stay]
    return count


def _expand(mean: np.ndarray, word: np.ndarray) -> np.ndarray:
    small = mean < EXACT_BELOW_E
    if small.all():
        return _cornish_fisher(mean, word, normal_float32(word))
    if not small.any():
        return _cornish_fisher(mean, word, normal(word))
    # chosen for each pixel, because the precision must not depend on the block
    out = np.empty_like(mean)
    for part, draw in ((small, normal_float32), (~small, normal)):
        out[part] = _cornish_fisher(mean[part], word[part], draw(word[part]))
    return out


def _cornish_fisher(mean: np.ndarray, word: np.ndarray, z: np.ndarray) -> np.ndarray:
    # the step from the mean is in float32; its rounding error is part of the bound
    mean_ = mean.astype(z.dtype)
    root = np.sqrt(mean_)
    z2 = z * z
    # operations in place take half of the time
    step = z2 + 2
    step /= 72 * root
    np.subtract(root, step, out=step)
    step *= z
    term = z2 / 6
    term += 1 / 3
    step += term
    np.add(z2, 7 / 3, out=term)
    term *= z2
    term *= 1 / 270
    term -= 8 / 405
    term /= mean_
    step += term
    x = mean + step
    count = np.floor(x)
    a = np.abs(z)
    np.multiply(z2, 0.04, out=term)
    term += 1
    bound = z2 * 0.003
    bound *= z2
    bound *= term
    bound += 0.006
    bound *= a
    bound += 0.02
    mean_ *= root
    bound /= mean_
    a += 1
    a *= root
    a *= 5e-7
    bound += a
    x -= count
    x -= 0.5  # close to +-0.5 near a step
    near = np.flatnonzero((np.abs(x) > 0.5 - bound) & (mean < EXACT_BELOW_E))
    if near.size:
        p, upper = tail(word[near])
        k = np.maximum(count[near] + (x[near] > 0), 1.0)
        count[near] = _decide(k, mean[near], p, upper, bound[near] > 0.4)
    return count


def _decide(
    k: np.ndarray, mean: np.ndarray, p: np.ndarray, upper: np.ndarray, search: np.ndarray
) -> np.ndarray:
    """Return k or k - 1, according to the exact distribution.

    Parameters
    ----------
    k : candidate counts, 1 or more.
    mean : mean electrons.
    p, upper : draws, from `tail`.
    search : where true, the search continues beyond k and k - 1.
    """

    def reached(
        k: np.ndarray, i: np.ndarray | slice
    ) -> np.ndarray:  # whether the draw is at or beyond the step from k - 1 to k
        return np.where(upper[i], p[i] < gammainc(k, mean[i]), p[i] > gammaincc(k, mean[i]))

    count = k - ~reached(k, slice(None))
    i = np.flatnonzero(search)
    while i.size:  # far tails of small means, in a few pixels
        up = reached(count[i] + 1, i)
        down = (count[i] > 0) & ~reached(np.maximum(count[i], 1.0), i)
        count[i] += up.astype(float) - down
        i = i[up | down]
    return count
