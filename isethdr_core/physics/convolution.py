"""Convolution: linear, never circular, right in the dark beside light 1e12 times brighter.

A float64 transform errs by the same small amount everywhere, so only pixels far darker than the brightest can suffer.
Those are found afterwards from a bound on that error, and their light is summed directly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft as sf

SUMMED = 1e-12  # of a pixel: rounding of a direct float64 sum of positive terms, 8e6 of them pairwise or in rows
RELATIVE = 3e-8  # of a pixel: what the exact way allows the transform, half of the rounding of a float32 result
ROWS, COLUMNS = 64, 32  # of a transform at a time
FEW_PRODUCTS = 1e8  # of direct summation, about what it costs to look for a better way
MOST_PRODUCTS = 4e10  # of direct summation, about a minute; beyond it the bound of `convolve` is absolute


@dataclass(frozen=True)
class Bound:
    """How wrong a convolution may be: every pixel by `relative` of itself, but for `pixels` of them by `absolute` each."""

    relative: float
    absolute: float  # unit of image times psf; 0 where `pixels` is 0
    pixels: int


@dataclass(frozen=True, eq=False)
class Kernel:
    """A point spread function made ready for images of one shape, with its transform taken once; see `prepare`."""

    psf: np.ndarray  # (ky, kx), cut to what an image of `shape` can use, its centre at (ky // 2, kx // 2)
    shape: tuple[int, int]  # (y, x) of the images
    size: tuple[int, int]  # of the transform: only cropped pixels wrap
    spectrum: np.ndarray  # of psf / peak, centred on [0, 0]: real, half the memory, where psf equals its mirror image
    peak: float  # largest magnitude of psf
    norm: float  # root of the sum of squares of psf / peak
    positive: bool  # no value is below 0


def prepare(psf, shape) -> Kernel:
    """Return a point spread function ready for images of `shape`; it keeps `psf` and as many complex or real float64.

    Parameters
    ----------
    psf : (ky, kx) array of any size, its centre at index (ky // 2, kx // 2). Reach beyond the image is not used.
    shape : (y, x) pixels of the images it will be convolved with.
    """
    psf = np.asarray(psf)
    if psf.ndim != 2 or len(shape) != 2:
        raise ValueError(
            f"image and psf have {len(shape)} and {psf.ndim} dimensions; expected two each: convolve one band at a time"
        )
    if not (psf.dtype == np.float32 or psf.dtype == np.float64):
        psf = psf.astype(np.float64)
    psf = _crop(psf, shape)
    low, high = (float(psf.min()), float(psf.max())) if psf.size else (0.0, 0.0)
    if not (np.isfinite(low) and np.isfinite(high)):
        raise ValueError("image or psf holds NaN or infinite values; expected finite numbers: one would spoil every pixel")
    size, peak = tuple(_sizes(shape, psf.shape)), max(-low, high)
    if peak == 0:
        return Kernel(psf, tuple(shape), size, np.zeros((size[0], size[1] // 2 + 1)), 0.0, 0.0, True)
    centred = np.zeros(size)
    np.divide(psf, peak, out=centred[: psf.shape[0], : psf.shape[1]], dtype=np.float64)
    norm = float(np.sqrt(_squares(centred)))
    centred = np.roll(centred, [-(n // 2) for n in psf.shape], (0, 1))
    spectrum = sf.fft(sf.rfft(centred, axis=1), axis=0, overwrite_x=True)
    if all(n % 2 for n in psf.shape) and np.array_equal(psf, psf[::-1, ::-1]):
        spectrum = np.ascontiguousarray(spectrum.real)
    return Kernel(psf, tuple(shape), size, spectrum, peak, norm, low >= 0)


def convolve(image, psf, error_allowed: float = 0.0) -> np.ndarray:
    """Return the linear convolution of an image with a point spread function.

    Parameters
    ----------
    image : (y, x) array, finite. Light outside it is zero.
    psf : (ky, kx) array of any size, its centre at index (ky // 2, kx // 2), or a `Kernel` prepared for the image's shape.
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
    image = np.asarray(image)
    kernel = psf if isinstance(psf, Kernel) else prepare(psf, image.shape)
    if image.shape != kernel.shape:
        raise ValueError(f"the kernel was prepared for images of {kernel.shape}; got {image.shape}; prepare it for that shape")
    low, high = (float(image.min()), float(image.max())) if image.size else (0.0, 0.0)
    if not (np.isfinite(low) and np.isfinite(high)):
        raise ValueError("image or psf holds NaN or infinite values; expected finite numbers: one would spoil every pixel")
    scale = max(-low, high)  # powers stay in range for any unit
    if scale == 0 or kernel.peak == 0:
        return np.zeros(image.shape), Bound(0.0, 0.0, 0)
    (out, norm), allowed = _by_transform(image, kernel, scale), max(error_allowed, RELATIVE)
    absolute, left = _transform_error(norm, kernel, out), 0
    if low >= 0 and kernel.positive:
        if float(out.min()) * allowed < absolute:
            out, absolute, left = _mend(out, np.divide(image, scale, dtype=np.float64), kernel, absolute, allowed)
        else:
            absolute = 0.0
        bound = Bound(allowed + SUMMED, absolute * scale * kernel.peak, left)
    else:  # signed sums cancel: only an absolute bound holds
        bound = Bound(0.0, absolute * scale * kernel.peak, out.size)
    out *= scale
    out *= kernel.peak
    return out, bound


def _transform_error(norm, kernel, out) -> float:
    """Return a bound on the error of any pixel of a float64 transform: rounding is white, 10 standard deviations of it."""
    size = float(np.prod(kernel.size))
    return 10 * 1.2e-16 * (norm * kernel.norm + np.sqrt(_squares(out))) / np.sqrt(size) * np.log2(size) ** 0.5


def _squares(a) -> float:
    return float(np.einsum("ij,ij->", a, a))  # not by BLAS, whose threads go on spinning beside the transforms


def _crop(psf, shape):
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


def _by_transform(image, kernel, scale=1.0):
    """Return the convolution of image / scale with psf / peak, and the norm of image / scale.

    Rows and columns go through in blocks that stay in the processor's cache: the whole spectrum never exists, only the image's rows.
    """
    (ny, nx), (sy, sx) = image.shape, kernel.size
    half, squares = np.empty((ny, sx // 2 + 1), complex), 0.0
    for start in range(0, ny, ROWS):
        block = np.divide(image[start : start + ROWS], scale, dtype=np.float64)
        squares += _squares(block)
        half[start : start + ROWS] = sf.rfft(block, sx, axis=1) if block.any() else 0.0  # empty rows need no transform
    for start in range(0, half.shape[1], COLUMNS):
        columns = slice(start, start + COLUMNS)
        part = sf.fft(half[:, columns], sy, axis=0)
        part *= kernel.spectrum[:, columns]
        half[:, columns] = sf.ifft(part, axis=0, overwrite_x=True)[:ny]
    out = np.empty((ny, nx))
    for start in range(0, ny, ROWS):
        out[start : start + ROWS] = sf.irfft(half[start : start + ROWS], sx, axis=1)[:, :nx]
    return out, np.sqrt(squares)


def _mend(out, image, kernel, error, allowed):
    """Return `out` without pixels that rounding may have spoiled, summed directly; the error of those kept, and their number."""
    doubtful = out * allowed < error
    if np.count_nonzero(doubtful) * min(kernel.psf.size, image.size) <= FEW_PRODUCTS:
        return _gather(out, doubtful, image, kernel, error)
    psf = np.divide(kernel.psf, kernel.peak, dtype=np.float64)
    lit = _reached(image, psf)
    out[~lit] = 0.0
    doubtful &= lit
    if not doubtful.any():
        return out, 0.0, 0
    split = _few_sources(image, psf, out, allowed)
    if split is None:
        return _gather(out, doubtful, image, kernel, error)
    bright, rest = split
    if not rest.any():
        return _scatter(bright, psf), 0.0, 0
    part, norm = _by_transform(rest, kernel)
    error = _transform_error(norm, kernel, part)
    part[~_reached(rest, psf)] = 0.0
    # Rounding of the rest matters only against the sum with the bright light.
    summed = np.maximum(part, 0.0) + _scatter(bright, psf)
    return _gather(summed, (summed * allowed < error) & lit, image, kernel, error)


def _few_sources(image, psf, out, allowed):
    """Return (bright, rest) where few enough bright pixels make the trouble, else None."""
    window = min(psf.size, image.size)
    most = int(max(16, 2e8 // window))
    if np.count_nonzero(image) <= most:
        return image, np.zeros_like(image)
    threshold = np.partition(image, image.size - 1 - most, axis=None)[image.size - 1 - most]
    bright = np.where(image > threshold, image, 0.0)
    if not bright.any() or _squares(image - bright) > 0.01 * _squares(image):
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


def _gather(out, where, image, kernel, error):
    """Replace the pixels `where` by direct sums; past `MOST_PRODUCTS` keep the transform, lifted to zero, and its `error`."""
    (ny, nx), (ky, kx) = image.shape, kernel.psf.shape
    rows, cols = np.nonzero(where)
    if len(rows) * min(kernel.psf.size, image.size) > MOST_PRODUCTS:
        return np.maximum(out, 0.0), error, len(rows)
    flipped = kernel.psf[::-1, ::-1]
    for i, j in zip(rows, cols):
        y, x = i + ky // 2 - (ky - 1), j + kx // 2 - (kx - 1)
        top, left, bottom, right = max(y, 0), max(x, 0), min(y + ky, ny), min(x + kx, nx)
        window = flipped[top - y : bottom - y, left - x : right - x]
        out[i, j] = np.einsum("ij,ij->i", image[top:bottom, left:right], window).sum() / kernel.peak  # in rows: rounding as `SUMMED`
    return out, 0.0, 0
