"""Overlap-add: the sum of many parts of an image, each convolved with its own kernel, accurate in
every pixel of the sum.

A part fades out at its borders, where other parts take over: only the sum has to be accurate. All
parts are first convolved by plain transforms. Parts with rounding errors that could matter in a
pixel of the sum are then convolved again by the exact method.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.fft as sf

from isethdr_core.physics.convolution import Bound, convolve_with_bound

RELATIVE = 3e-8  # least allowed error of the transforms, relative to a pixel of the sum
SUMMED = 1e-12  # relative rounding error of the sums


def overlaid(
    parts: Sequence[tuple[tuple[Any, ...], np.ndarray, np.ndarray]],
    shape: tuple[int, int],
    error_allowed: float = 0.0,
) -> tuple[np.ndarray, Bound]:
    """Return the sum (y, x) of parts, and a bound on its error.

    Parameters
    ----------
    parts : [(window, light, kernel), ...]: slices of the frame, light (y, x) of that window, never
        negative, and a kernel of odd size, never negative, its centre in the middle. Light that
        leaves a window is lost.
    shape : (y, x) of the frame.
    error_allowed : relative error allowed in every pixel of the sum. Values below `RELATIVE` have
        no effect, because float32 rounds them away.
    """
    relative = max(error_allowed / 2, RELATIVE)  # the other half is for parts convolved again
    images = []
    errors = []
    for _, light, kernel in parts:
        image, error = _by_transform(light, kernel)
        images.append(image)
        errors.append(error)
    total, doubt = _sums(parts, images, errors, shape)
    doubtful = doubt > relative * total
    if not doubtful.any():
        return total, Bound(relative + SUMMED, 0.0, 0)
    absolute = 0.0
    pixels = 0
    allowed = relative / len(parts)
    for k, (window, light, kernel) in enumerate(parts):
        where = doubtful[window]
        if where.any() and errors[k] > allowed * float(total[window][where].min()):
            images[k], bound = convolve_with_bound(light, kernel, relative)
            errors[k] = 0.0  # the error is now relative, and part of the bound
            absolute = absolute + bound.absolute
            pixels = pixels + bound.pixels
    total, doubt = _sums(parts, images, errors, shape)
    return total, Bound(2 * relative + SUMMED, absolute, pixels)


def _sums(
    parts: Sequence[tuple[tuple[Any, ...], np.ndarray, np.ndarray]],
    images: Sequence[np.ndarray],
    errors: Sequence[float],
    shape: tuple[int, int],
) -> tuple[np.ndarray, np.ndarray]:
    total = np.zeros(shape)
    doubt = np.zeros(shape)
    for (window, _, _), image, error in zip(parts, images, errors):
        total[window] += image
        doubt[window] += error
    return total, doubt


def _by_transform(light: np.ndarray, kernel: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the convolution, never negative, and a bound on a pixel's error: 10 standard
    deviations of white rounding noise.
    """
    # only pixels that are cropped wrap around
    size = [
        sf.next_fast_len(n + min(k // 2, n - 1), real=True)
        for n, k in zip(light.shape, kernel.shape)
    ]
    # all light may be 0, as at a field point from which no light passes the lens
    scale = float(light.max()) or 1.0
    centred = np.zeros(size)
    # the part of the kernel that is not longer than the image
    cut = [slice(max(0, k // 2 - n + 1), k // 2 + n) for n, k in zip(light.shape, kernel.shape)]
    used = kernel[tuple(cut)]
    centred[: used.shape[0], : used.shape[1]] = used
    centred = np.roll(centred, [-(k // 2 - c.start) for k, c in zip(kernel.shape, cut)], (0, 1))
    spectrum = sf.rfft2(light / scale, size)
    spectrum *= sf.rfft2(centred)
    image = sf.irfft2(spectrum, size)
    norms = np.linalg.norm(light) / scale * np.linalg.norm(used) + np.linalg.norm(image)
    error = 10 * 1.2e-16 * norms / np.sqrt(np.prod(size)) * np.sqrt(np.log2(np.prod(size)))
    image = image[: light.shape[0], : light.shape[1]]
    return np.maximum(image, 0.0) * scale, float(error * scale)
