"""Convolution: linear, never circular, and accurate in dark pixels next to light 1e12 times
brighter.

The rounding error of a float64 transform is about the same in all pixels, so that it matters only
in pixels far darker than the brightest. These pixels are found from a bound on the error, and their
light is summed directly. The bound takes the rounding errors as white noise; beside a few small
lamps it is too small (`transform.error`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import device, namespace
from . import direct_sums, transform
from .direct_sums import SUMMED
from .mirrored import Mirrored

# largest relative error of a pixel in exact computation: half of the rounding error of a float32
# result
RELATIVE = 3e-8


@dataclass(frozen=True)
class Bound:
    """Bound on the error of a convolution. The bound of each pixel is relative, except for some
    pixels with an absolute bound. Both take rounding errors as white noise (`transform.error`).
    """

    relative: float  # share of the pixel's value
    absolute: float  # unit of image times psf; 0 if `pixels` is 0
    pixels: int  # number of pixels with the absolute bound


@dataclass(frozen=True, eq=False)
class Kernel:
    """A point spread function prepared for images of one shape; its transform is computed once (see
    `prepare`).
    """

    psf: Any  # (ky, kx), cut to the part that images of `shape` use; centre at (ky // 2, kx // 2)
    shape: tuple[int, int]  # (y, x) shape of the images
    size: tuple[int, int]  # size of the transform; only pixels that are cropped wrap around
    spectrum: Any  # transform of psf / peak, from `transform.spectrum`; may be a mapped file
    peak: float  # largest magnitude of psf
    norm: float  # root of the sum of squares of psf / peak
    positive: bool  # no value is below 0


def prepare(psf: Any, shape: Sequence[int]) -> Kernel:
    """Return a point spread function prepared for images of `shape`.

    The result holds `psf` and its transform: about as many complex or real float64 numbers.

    Parameters
    ----------
    psf : (ky, kx) array of any size, its centre at index (ky // 2, kx // 2). Values beyond the
        reach of the image are not used. An array of another library than NumPy stays on its device,
        for example a graphics processor, and images must be there too. Of a `Mirrored` array only
        the half is kept.
    shape : (y, x) pixels of the images.

    Raises
    ------
    ValueError : `psf` or `shape` does not have two dimensions, or `psf` holds values that are not
        finite.
    """
    if isinstance(psf, Mirrored):
        return _prepare_mirrored(psf, shape)
    xp = namespace(psf)
    psf = xp.asarray(psf)
    if psf.ndim != 2 or len(shape) != 2:
        raise ValueError(
            f"image and psf have {len(shape)} and {psf.ndim} dimensions; expected two each:"
            " convolve one band at a time"
        )
    if not (psf.dtype == xp.float32 or psf.dtype == xp.float64):
        psf = xp.astype(psf, xp.float64)
    psf = _crop(psf, shape, xp)
    low, high = _range(psf, xp)
    peak = max(-low, high)
    size = transform.sizes(shape, psf.shape)
    if peak == 0:
        return Kernel(
            psf,
            (shape[0], shape[1]),
            size,
            xp.zeros((0, size[0], 0), device=device(psf)),
            0.0,
            0.0,
            True,
        )
    parts = (psf[i : min(i + 64, psf.shape[0]), :] for i in range(0, psf.shape[0], 64))
    norm = sum(transform.squares(xp.astype(part, xp.float64) / peak, xp) for part in parts) ** 0.5
    mirrored = all(n % 2 for n in psf.shape) and bool(xp.all(psf == xp.flip(psf)))
    spectrum = transform.spectrum(psf, size, peak, mirrored)
    return Kernel(psf, (shape[0], shape[1]), size, spectrum, peak, norm, low >= 0)


def _prepare_mirrored(psf: Mirrored, shape: Sequence[int]) -> Kernel:
    """Return `prepare` of a `Mirrored` kernel."""
    psf = psf.within(*(n - 1 for n in shape))
    low, high = _range(psf.half, np)
    peak = max(-low, high)
    size = transform.sizes(shape, psf.shape)
    if peak == 0:
        return Kernel(psf, (shape[0], shape[1]), size, np.zeros((0, size[0], 0)), 0.0, 0.0, True)
    spectrum = transform.mirrored_spectrum(psf.half, size, peak)
    norm = psf.squares() ** 0.5 / peak
    return Kernel(psf, (shape[0], shape[1]), size, spectrum, peak, norm, low >= 0)


def convolve(image: Any, psf: Any, error_allowed: float = 0.0) -> Any:
    """Return the linear convolution of an image with a point spread function.

    Parameters
    ----------
    image : (y, x) array, finite, of NumPy or of any library with the Python array API. Light
        outside it is zero.
    psf : (ky, kx) array of any size, its centre at index (ky // 2, kx // 2), or a `Kernel` prepared
        for the image's shape.
    error_allowed : largest relative error of any output pixel; 0: exact computation. Only pixels
        with an error that may exceed this value are summed directly, so that a larger value saves
        time.

    Returns
    -------
    (y, x) float64, of the image's shape. If `image` and `psf` are not negative, the result is not
    negative either, and the error of a pixel is at most max(error_allowed, 1e-7) of its value. This
    does not hold in two cases. In and next to the rows of a few small lamps in a dark image, the
    error can be 14 times max(error_allowed, 3e-8) (`transform.error`). If direct summation of all
    doubtful pixels would take more than `direct_sums.MOST_PRODUCTS`, they are not summed:
    `convolve_with_bound` then returns an absolute bound.

    Raises
    ------
    ValueError : `image` or `psf` does not have two dimensions or holds values that are not finite,
        or a `Kernel` was prepared for images of another shape.
    """
    return convolve_with_bound(image, psf, error_allowed)[0]


def convolve_with_bound(image: Any, psf: Any, error_allowed: float = 0.0) -> tuple[Any, Bound]:
    """Return the convolution and a bound on its actual error.

    Parameters
    ----------
    image : (y, x) array, finite, any unit; light outside it is zero.
    psf : (ky, kx) array, its centre at index (ky // 2, kx // 2), or a `Kernel` prepared for the
        image's shape.
    error_allowed : largest relative error of any output pixel, as in `convolve`; 0: exact
        computation.
    """
    xp = namespace(image)
    image = xp.asarray(image)
    kernel = psf if isinstance(psf, Kernel) else prepare(psf, image.shape)
    out = xp.empty(image.shape, dtype=xp.float64, device=device(image))
    return out, convolve_into(out, image, kernel, error_allowed)


def convolve_into(  # noqa: PLR0913 - plugins call it with these arguments
    out: Any,
    image: Any,
    kernel: Kernel,
    error_allowed: float = 0.0,
    factor: Any = None,
    gain: float = 1.0,
    apply: Callable[..., Iterable[Any]] = map,
) -> Bound:
    """Write gain x the convolution of image x factor into `out`. Return a bound on its error, which
    does not include the rounding to the type of `out`.

    Parameters
    ----------
    out : (y, x) float32 or float64 array. The transforms of its rows are the only other arrays of
        this size.
    image : (y, x) array, finite.
    kernel : kernel prepared for the image's shape.
    error_allowed : largest relative error of any output pixel; 0: exact computation.
    factor : None, or a (y, x) array, 0 or more, by which the image is multiplied.
    gain : factor on the result.
    apply : `map`, or the `map` of a pool of threads; it is called for blocks of rows and columns.

    Raises
    ------
    ValueError : the kernel was prepared for images of another shape, or `image` or `factor` holds
        values that are not finite.
    """
    xp = namespace(image)
    if tuple(image.shape) != kernel.shape:
        raise ValueError(
            f"the kernel was prepared for images of {kernel.shape}; got {image.shape}; prepare it"
            " for that shape"
        )
    low, high = _range(image, xp)
    scale = max(-low, high) * (1.0 if factor is None else _range(factor, xp)[1])
    if scale == 0 or kernel.peak == 0:
        out[...] = 0.0
        return Bound(0.0, 0.0, 0)
    # a scale is used only if squares could leave the range of float64
    scale = scale if not 1e-100 < scale < 1e100 else 1.0

    def read(rows: slice, values: Any) -> None:
        values[0, ...] = image[rows, :]
        if factor is not None:
            values *= factor[rows, :]
        if scale != 1.0:
            values /= scale

    def write(rows: slice, values: Any) -> tuple[float, Any]:
        _scaled(values, (scale, gain, kernel.peak), out[rows, :], xp)
        return float(xp.min(values)), transform.squares(values, xp)

    half = transform.rows_of(image.shape[0], kernel.size, image)
    norm = transform.forward(read, [half], kernel.size, image.shape[1], apply) ** 0.5
    transform.columns([half], transform.times(kernel.spectrum), kernel.size, apply)
    done = transform.back(half, write, kernel.size, image.shape[1], apply)
    least = min(d[0] for d in done)
    allowed = max(error_allowed, RELATIVE)
    absolute = transform.error(norm * kernel.norm, sum(d[1] for d in done) ** 0.5, kernel.size)
    left = 0
    if low < 0 or not kernel.positive:  # terms of different sign cancel: the bound is absolute
        return Bound(0.0, absolute * scale * gain * kernel.peak, out.shape[0] * out.shape[1])
    # the error of the darkest pixel is usually far below the allowed error
    if least * allowed >= absolute:
        return Bound((absolute / least if least > 0 else 0.0) + SUMMED, 0.0, 0)

    def again(rows: slice, values: Any) -> None:
        exact[rows, :] = values

    exact, light = (
        xp.empty(shape, dtype=xp.float64, device=device(image))
        for shape in (image.shape, (1, *image.shape))
    )
    transform.back(half, again, kernel.size, image.shape[1], apply)
    read(slice(None), light)
    exact, absolute, left = direct_sums.mend(exact, light[0, ...], kernel, absolute, allowed)
    _scaled(xp.asarray(exact, device=device(image)), (scale, gain, kernel.peak), out, xp)
    return Bound(allowed + SUMMED, absolute * scale * gain * kernel.peak, left)


def _scaled(values: Any, factors: tuple[float, float, float], out: Any, xp: Any) -> None:
    """Write values x the product of `factors` into `out`; in one pass if the product is in the
    range of float64.
    """
    product = factors[0] * factors[1] * factors[2]
    if not 1e-290 < abs(product) < 1e290:
        values = values * factors[0] * factors[1]
        product = factors[2]
    if xp is np:
        np.multiply(values, product, out=out, casting="same_kind")
    else:
        out[...] = xp.astype(values * product, out.dtype)


def _range(a: Any, xp: Any) -> tuple[float, float]:
    if 0 in a.shape:
        return 0.0, 0.0
    low = float(xp.min(a))
    high = float(xp.max(a))
    if not (np.isfinite(low) and np.isfinite(high)):
        raise ValueError(
            "image or psf holds NaN or infinite values; expected finite numbers: one would spoil"
            " every pixel"
        )
    return low, high


def _crop(psf: Any, shape: Sequence[int], xp: Any) -> Any:
    cut = []
    for k, n in zip(psf.shape, shape):
        centre = k // 2
        cut.append(slice(max(0, centre - (n - 1)), min(centre + n, k)))
    # the centre of the cropped kernel may no longer be at size // 2: zeros are added at one end
    part = psf[tuple(cut)]
    pad = []
    for k, s in zip(psf.shape, cut):
        before = k // 2 - s.start
        after = s.stop - k // 2 - 1
        pad.append((max(0, after - before), max(0, before - after - 1)))
    if all(p == (0, 0) for p in pad):
        return part
    padded = xp.zeros(
        tuple(n + sum(p) for n, p in zip(part.shape, pad)), dtype=psf.dtype, device=device(psf)
    )
    padded[tuple(slice(p[0], p[0] + n) for n, p in zip(part.shape, pad))] = part
    return padded
