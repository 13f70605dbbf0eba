"""Convolution methods compared: error against run time in frames with lamps of up to 1e12 times the
background.
"""

from __future__ import annotations

from time import process_time
from typing import Any

import numpy as np
import scipy.fft as sf

from isethdr_core.physics.convolution import convolve
from isethdr_core.physics.convolution import prepare as ready
from isethdr_core.physics.convolution.transform import whole_spectrum

RATIOS = (1e2, 1e4, 1e6, 1e8, 1e12)
LAMPS = 30  # number of lamps, each one pixel large
SAMPLED = 40  # number of random pixels with long double sums; the darkest pixel is added to them


def convolution_methods(rows: int = 270, columns: int = 480) -> list[dict]:
    """Return one row per lamp brightness and method, for a kernel that covers the whole frame and
    falls with the cube of the distance.

    Parameters
    ----------
    rows, columns : size of the frame, pixels.

    Returns
    -------
    rows with the largest relative error at sampled pixels, against long double sums, negative
    pixels, and CPU seconds with the kernel prepared.
    """
    out = []
    y = np.arange(1 - rows, rows)
    x = np.arange(1 - columns, columns)
    psf = (1 + np.hypot(y[:, None], x)) ** -3.0
    psf /= psf.sum()
    prepared = prepare(psf, (rows, columns))
    for ratio in RATIOS:
        image = frame(rows, columns, ratio)
        truth = None
        for method, function in METHODS.items():
            function(image, prepared)  # sets up transforms and memory before the timed call
            start = process_time()
            result = function(image, prepared)
            seconds = process_time() - start
            if truth is None:
                pixels, truth = direct(image, psf, result)
            error = float(np.max(np.abs(result[pixels] / truth - 1)))
            out.append(
                {
                    "lamp_to_background": ratio,
                    "method": method,
                    "largest_error": error,
                    "negative_pixels": int(np.sum(result < 0)),
                    "cpu_s": seconds,
                }
            )
    return out


def frame(rows: int, columns: int, ratio: float) -> np.ndarray:
    """Return a background from 0.5 to 1.5 with `LAMPS` bright pixels.

    Parameters
    ----------
    rows, columns : size of the image, pixels.
    ratio : value of the bright pixels, over that of the background.
    """
    rng = np.random.default_rng(1)
    image = rng.uniform(0.5, 1.5, (rows, columns))
    image[rng.integers(0, rows, LAMPS), rng.integers(0, columns, LAMPS)] = ratio
    return image


def prepare(psf: np.ndarray, shape: tuple[int, int]) -> dict:
    """Return the shared inputs of the methods: the kernel as isethdr prepares it, its spectrum in
    both precisions, and the psf.

    Parameters
    ----------
    psf : kernel of (2 ny - 1, 2 nx - 1) pixels, its centre in the middle.
    shape : (ny, nx) size of the frame, pixels.
    """
    kernel = ready(psf, shape)
    spectrum = whole_spectrum(kernel.spectrum, kernel.size) * kernel.peak
    return {
        "product": kernel,
        "size": kernel.size,
        np.float64: spectrum,
        np.float32: spectrum.astype(np.float32),
        "psf": psf,
    }


def product(image: np.ndarray, prepared: Any) -> np.ndarray:
    """Return the convolution that the lenses use: float64, with doubtful pixels summed directly."""
    return convolve(image, prepared["product"])


def transform(image: np.ndarray, prepared: Any, dtype: Any) -> np.ndarray:
    """Return the plain transform in one precision.

    Parameters
    ----------
    image : (y, x) array.
    prepared : size of the transform, and the kernel's spectrum by dtype.
    dtype : precision of the transform, float32 or float64.
    """
    spectrum = sf.rfft2(image.astype(dtype), prepared["size"])
    spectrum *= prepared[dtype]
    return sf.irfft2(spectrum, prepared["size"])[: image.shape[0], : image.shape[1]]


def lamps_of(image: np.ndarray) -> tuple[Any, np.ndarray]:
    """Return the frame without its lamps, and the lamps alone."""
    lamps = np.where(image > 50 * np.median(image), image, 0.0)
    return image - lamps, lamps


def split(image: np.ndarray, prepared: Any) -> np.ndarray:
    """Return the convolution with lamps in float64 and the rest in float32."""
    background, lamps = lamps_of(image)
    return transform(lamps, prepared, np.float64) + transform(background, prepared, np.float32)


def summed(image: np.ndarray, prepared: Any) -> np.ndarray:
    """Return the convolution with lamps by direct sums and the rest in float64."""
    background, lamps = lamps_of(image)
    ny, nx = image.shape
    total = transform(background, prepared, np.float64)
    for i, j in np.argwhere(lamps):
        total += (
            lamps[i, j] * prepared["psf"][ny - 1 - i : 2 * ny - 1 - i, nx - 1 - j : 2 * nx - 1 - j]
        )
    return total


DEFAULT = "float64, doubtful pixels summed directly (isethdr)"  # that of the lenses
METHODS = {
    DEFAULT: product,
    "float64": lambda i, p: transform(i, p, np.float64),
    "float32": lambda i, p: transform(i, p, np.float32),
    "lamps float64, rest float32": split,
    "lamps summed, rest float64": summed,
}


def direct(
    image: np.ndarray, psf: np.ndarray, result: Any
) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """Return the positions of sampled pixels and the long double sums there. The darkest pixel of
    `result` is among them.

    Parameters
    ----------
    image : (y, x) array.
    psf : kernel of (2 ny - 1, 2 nx - 1) pixels, its centre in the middle.
    result : (y, x) convolution under test; its darkest pixel is sampled too.
    """
    ny, nx = image.shape
    rng = np.random.default_rng(2)
    darkest = np.unravel_index(int(np.argmin(result)), result.shape)
    pixels = tuple(np.append(rng.integers(0, n, SAMPLED), d) for n, d in zip((ny, nx), darkest))
    wide = image.astype(np.longdouble)
    flipped = psf[::-1, ::-1]
    sums = [
        np.sum(wide * flipped[ny - 1 - i : 2 * ny - 1 - i, nx - 1 - j : 2 * nx - 1 - j])
        for i, j in zip(*pixels)
    ]
    return pixels, np.array(sums)
