"""Convolution: linear, never circular, right in the dark beside light 1e12 times brighter.

A float64 transform errs by the same small amount everywhere, so only pixels far darker than the brightest can suffer.
Those are found afterwards from a bound on that error, and their light is summed directly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft as sf

SUMMED = 1e-12  # of a pixel: rounding of a direct float64 sum of positive terms, 8e6 of them pairwise or in rows
RELATIVE = 1e-8  # of a pixel: what the exact way allows the transform
MOST_PRODUCTS = 4e10  # of direct summation, about a minute; beyond it the bound of `convolve` is absolute


@dataclass(frozen=True)
class Bound:
    """How wrong a convolution may be: every pixel by `relative` of itself, but for `pixels` of them by `absolute` each."""

    relative: float
    absolute: float  # unit of image times psf; 0 where `pixels` is 0
    pixels: int


def convolve(image, psf, error_allowed: float = 0.0) -> np.ndarray:
    """Return the linear convolution of an image with a point spread function.

    Parameters
    ----------
    image : (y, x) array, finite. Light outside it is zero.
    psf : (ky, kx) array of any size, its centre at index (ky // 2, kx // 2). Reach beyond the image is not used.
    error_allowed : largest relative error of any output pixel; 0 asks for the exact way. Above 1e-7 the pixels whose error may
        reach it are summed directly, and others are not, so that a larger value only saves time.

    Returns
    -------
    (y, x) float64, of the image's shape. Where `image` and `psf` are not negative, neither is the result, and a pixel is wrong by
    at most max(error_allowed, 1e-7) of itself. Only where direct summation of all doubtful pixels would take more than
    `MOST_PRODUCTS` is that not kept: `convolve_with_bound` says what was.
    """
    return convolve_with_bound(image, psf, error_allowed)[0]


def convolve_with_bound(image, psf, error_allowed: float = 0.0) -> tuple[np.ndarray, Bound]:
    """Return the convolution and a bound on its error as it came out; arguments as `convolve`."""
    image, psf = np.asarray(image, np.float64), _crop(np.asarray(psf, np.float64), np.shape(image))
    if image.ndim != 2 or psf.ndim != 2:
        raise ValueError(
            f"image and psf have {image.ndim} and {psf.ndim} dimensions; expected two each: convolve one band at a time"
        )
    if not (np.isfinite(image).all() and np.isfinite(psf).all()):
        raise ValueError("image or psf holds NaN or infinite values; expected finite numbers: one would spoil every pixel")
    if not image.any() or not psf.any():
        return np.zeros(image.shape), Bound(0.0, 0.0, 0)
    scale = np.abs(image).max(), np.abs(psf).max()  # powers stay in range for any unit
    image, psf = image / scale[0], psf / scale[1]
    out, allowed = _by_transform(image, psf), max(error_allowed, RELATIVE)
    absolute, left = transform_error(image, psf, out), 0
    if image.min() >= 0 and psf.min() >= 0:
        out, absolute, left = _mend(out, image, psf, allowed)
        bound = Bound(allowed + SUMMED, absolute * scale[0] * scale[1], left)
    else:  # signed sums cancel: only an absolute bound holds
        bound = Bound(0.0, absolute * scale[0] * scale[1], out.size)
    return out * scale[0] * scale[1], bound


def transform_error(image, psf, out) -> float:
    """Return a bound on the error of any pixel of a float64 transform: rounding is white, 10 standard deviations of it."""
    size = np.prod(_sizes(image.shape, psf.shape), dtype=float)
    return (
        10 * 1.2e-16 * (np.linalg.norm(image) * np.linalg.norm(psf) + np.linalg.norm(out)) / np.sqrt(size) * np.log2(size) ** 0.5
    )


def _crop(psf, shape):
    if psf.ndim != 2 or len(shape) != 2:
        return psf
    cut = []
    for k, n in zip(psf.shape, shape):
        centre = k // 2
        cut.append(slice(max(0, centre - (n - 1)), centre + n))
    # The centre of what is left need not sit at size // 2 any more: pad at the end or the start until it does.
    part = psf[tuple(cut)]
    pad = []
    for k, s in zip(psf.shape, cut):
        before, after = k // 2 - s.start, min(s.stop, k) - k // 2 - 1
        pad.append((max(0, after - before), max(0, before - after - 1)))
    return np.pad(part, pad) if any(p != (0, 0) for p in pad) else part


def _sizes(shape, kernel):
    """Transform sizes for which only cropped pixels wrap."""
    return [sf.next_fast_len(max(n + k - 1 - k // 2, k // 2 + n, k), real=True) for n, k in zip(shape, kernel)]


def _by_transform(image, psf):
    size = _sizes(image.shape, psf.shape)
    spectrum = _forward(image, size)
    spectrum *= _forward(psf, size)
    cy, cx = psf.shape[0] // 2, psf.shape[1] // 2
    rows = sf.ifft(spectrum, axis=0, overwrite_x=True)[cy : cy + image.shape[0]]
    return sf.irfft(rows, size[1], axis=1)[:, cx : cx + image.shape[1]]


def _forward(a, size):
    rows = np.flatnonzero(a.any(axis=1))  # empty rows need no transform
    if len(rows) > 0.8 * len(a):
        half = sf.rfft(a, size[1], axis=1)
    else:
        half = np.zeros((len(a), size[1] // 2 + 1), complex)
        half[rows] = sf.rfft(a[rows], size[1], axis=1)
    return sf.fft(half, size[0], axis=0, overwrite_x=True)


def _mend(out, image, psf, allowed):
    """Return `out` without pixels that rounding may have spoiled, summed directly; the error of those kept, and their number."""
    doubtful = out * allowed < transform_error(image, psf, out)
    if not doubtful.any():
        return out, 0.0, 0
    lit = _reached(image, psf)
    out[~lit] = 0.0
    doubtful &= lit
    if not doubtful.any():
        return out, 0.0, 0
    split = _few_sources(image, psf, out, allowed)
    if split is None:
        return _gather(out, doubtful, image, psf, transform_error(image, psf, out))
    bright, rest = split
    if not rest.any():
        return _scatter(bright, psf), 0.0, 0
    part = _by_transform(rest, psf)
    error = transform_error(rest, psf, part)
    part[~_reached(rest, psf)] = 0.0
    # Rounding of the rest matters only against the sum with the bright light.
    summed = np.maximum(part, 0.0) + _scatter(bright, psf)
    return _gather(summed, (summed * allowed < error) & lit, image, psf, error)


def _few_sources(image, psf, out, allowed):
    """Return (bright, rest) where few enough bright pixels make the trouble, else None."""
    window = min(psf.size, image.size)
    most = int(max(16, 2e8 // window))
    values = np.sort(image, axis=None)[::-1]
    if np.count_nonzero(values) <= most:
        return image, np.zeros_like(image)
    threshold = values[most]
    bright = np.where(image > threshold, image, 0.0)
    if not bright.any() or np.linalg.norm(image - bright) > 0.1 * np.linalg.norm(image):
        return None
    return bright, image - bright


def _reached(image, psf):
    """Return where any lit pixel lies within the rectangle of the psf: elsewhere the result is exactly zero."""
    ky, kx = np.flatnonzero(psf.any(axis=1)), np.flatnonzero(psf.any(axis=0))
    reach = [(int(k[0]) - n // 2, int(k[-1]) - n // 2) for k, n in zip((ky, kx), psf.shape)]
    lit = image != 0
    for axis, (low, high) in enumerate(reach):
        n = lit.shape[axis]
        count = np.concatenate([np.zeros_like(lit.take([0], axis), int), np.cumsum(lit, axis=axis)], axis=axis)
        i = np.arange(n)
        lit = count.take(np.clip(i - low + 1, 0, n), axis) - count.take(np.clip(i - high, 0, n), axis) > 0
    return lit


def _scatter(sources, psf):
    """Return the direct float64 sum of the lit pixels, each spread by the psf."""
    (ny, nx), (ky, kx) = sources.shape, psf.shape
    out = np.zeros((ny, nx))
    for i, j in zip(*np.nonzero(sources)):
        y, x = i - ky // 2, j - kx // 2
        top, left, bottom, right = max(y, 0), max(x, 0), min(y + ky, ny), min(x + kx, nx)
        out[top:bottom, left:right] += sources[i, j] * psf[top - y : bottom - y, left - x : right - x]
    return out


def _gather(out, where, image, psf, error):
    """Replace the pixels `where` by direct sums; past `MOST_PRODUCTS` keep the transform, lifted to zero, and its `error`."""
    (ny, nx), (ky, kx) = image.shape, psf.shape
    rows, cols = np.nonzero(where)
    if len(rows) * min(psf.size, image.size) > MOST_PRODUCTS:
        return np.maximum(out, 0.0), error, len(rows)
    flipped = psf[::-1, ::-1]
    for i, j in zip(rows, cols):
        y, x = i + ky // 2 - (ky - 1), j + kx // 2 - (kx - 1)
        top, left, bottom, right = max(y, 0), max(x, 0), min(y + ky, ny), min(x + kx, nx)
        out[i, j] = np.sum(image[top:bottom, left:right] * flipped[top - y : bottom - y, left - x : right - x])
    return out, 0.0, 0
