"""Direct sums of a convolution, for pixels that are so dark that rounding errors of the transform
could matter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arrays import on_host
from . import transform

if TYPE_CHECKING:
    from .linear import Kernel

# relative rounding error of a direct float64 sum of 8e6 positive terms, summed pairwise or in rows
SUMMED = 1e-12
# number of products up to which direct summation costs no more than the search for a better method
FEW_PRODUCTS = 1e8
# largest number of products for bright pixels that are spread one by one: some seconds
MOST_SCATTERED = 5e9
# largest number of products of direct summation, about a minute; with more, the bound of `convolve`
# is absolute
MOST_PRODUCTS = 4e10


def mend(
    out: np.ndarray, image: np.ndarray, kernel: Kernel, error: float, allowed: float
) -> tuple[np.ndarray, float, int]:
    """Return (out, error, count): `out` with direct sums in all pixels with a rounding error that
    is not allowed.

    If there are too many such pixels (`MOST_PRODUCTS`), they are kept: `error` is then the bound on
    their error, and `count` their number; otherwise both are 0.

    Parameters
    ----------
    out, image : (y, x) float64, not negative, of any array library, in units of the image's scale
        and the kernel's peak.
    kernel : `convolution.Kernel`.
    error : bound on the error of any pixel of `out`.
    allowed : allowed error, relative to the pixel.
    """
    out, image, psf, spectrum = (on_host(a) for a in (out, image, kernel.psf, kernel.spectrum))
    doubtful = out * allowed < error
    if np.count_nonzero(doubtful) * min(psf.size, image.size) <= FEW_PRODUCTS:
        return _gather(out, doubtful, image, psf, kernel.peak, error)
    psf = np.divide(psf, kernel.peak, dtype=np.float64)
    lit = _reached(image, psf)
    out[~lit] = 0.0
    doubtful &= lit
    if not doubtful.any():
        return out, 0.0, 0
    split = _few_sources(image, psf, np.count_nonzero(doubtful))
    if split is None:
        return _gather(out, doubtful, image, psf, 1.0, error)
    bright, rest = split
    if not rest.any():
        return _scatter(bright, psf), 0.0, 0
    part, norm = transform.convolved(rest, spectrum, kernel.size)
    error = transform.error(norm * kernel.norm, float(np.sqrt(_squares(part))), kernel.size)
    part[~_reached(rest, psf)] = 0.0
    # the rounding error of the rest is compared with the sum that includes the bright light
    summed = np.maximum(part, 0.0) + _scatter(bright, psf)
    return _gather(summed, (summed * allowed < error) & lit, image, psf, 1.0, error)


def _squares(a: np.ndarray) -> float:
    return np.einsum("ij,ij->", a, a)


def _few_sources(
    image: np.ndarray, psf: np.ndarray, doubtful: int
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return (bright, rest), two parts of the image. The few bright pixels cause nearly all of the
    rounding error. Return None if there would be too many of them.

    Parameters
    ----------
    image : (y, x) light.
    psf : (ky, kx) point spread function.
    doubtful : number of pixels that would need direct sums.
    """
    window = min(psf.size, image.size)
    most = int(max(16, 2e8 // window, min(doubtful // 4, MOST_SCATTERED // window)))
    if np.count_nonzero(image) <= most:
        return image, np.zeros_like(image)
    threshold = np.partition(image, image.size - 1 - most, axis=None)[image.size - 1 - most]
    bright = np.where(image > threshold, image, 0.0)
    if not bright.any() or _squares(image - bright) > 0.01 * _squares(image):
        return None
    return bright, image - bright


def _reached(image: np.ndarray, psf: np.ndarray) -> np.ndarray:
    """Return a mask of the pixels with light within the rectangle of the psf around them.

    The result of all other pixels is exactly zero.
    """
    ky = np.flatnonzero(psf.any(axis=1))
    kx = np.flatnonzero(psf.any(axis=0))
    reach = [(int(k[0]) - n // 2, int(k[-1]) - n // 2) for k, n in zip((ky, kx), psf.shape)]
    lit = image != 0
    for axis, (low, high) in enumerate(reach):
        n = lit.shape[axis]
        count = np.concatenate(
            [np.zeros_like(lit.take([0], axis), int), np.cumsum(lit, axis=axis)], axis=axis
        )
        i = np.arange(n)
        lit = (
            count.take(np.clip(i - low + 1, 0, n), axis) - count.take(np.clip(i - high, 0, n), axis)
            > 0
        )
    return lit


def _scatter(sources: np.ndarray, psf: np.ndarray) -> np.ndarray:
    """Return the direct float64 sum of the lit pixels, each spread by the psf."""
    ny, nx = sources.shape
    ky, kx = psf.shape
    out = np.zeros((ny, nx))
    for i, j in zip(*np.nonzero(sources)):
        y = i - ky // 2
        x = j - kx // 2
        top = max(y, 0)
        left = max(x, 0)
        bottom = min(y + ky, ny)
        right = min(x + kx, nx)
        out[top:bottom, left:right] += (
            sources[i, j] * psf[top - y : bottom - y, left - x : right - x]
        )
    return out


def _gather(
    out: np.ndarray,
    where: np.ndarray,
    image: np.ndarray,
    psf: np.ndarray,
    peak: float,
    error: float,
) -> tuple[np.ndarray, float, int]:
    """Replace the pixels `where` by direct sums of image x psf / peak; return (out, error, count)
    as `mend`. Beyond `MOST_PRODUCTS` keep `out`, with negative values set to 0, and its `error`.
    """
    ny, nx = image.shape
    ky, kx = psf.shape
    rows, cols = np.nonzero(where)
    if len(rows) * min(psf.size, image.size) > MOST_PRODUCTS:
        return np.maximum(out, 0.0), error, len(rows)
    flipped = psf[::-1, ::-1]
    for i, j in zip(rows, cols):
        y = i + ky // 2 - (ky - 1)
        x = j + kx // 2 - (kx - 1)
        top = max(y, 0)
        left = max(x, 0)
        bottom = min(y + ky, ny)
        right = min(x + kx, nx)
        window = flipped[top - y : bottom - y, left - x : right - x]
        # summed in rows, so that the rounding error is at most `SUMMED`
        out[i, j] = np.einsum("ij,ij->i", image[top:bottom, left:right], window).sum() / peak
    return out, 0.0, 0
