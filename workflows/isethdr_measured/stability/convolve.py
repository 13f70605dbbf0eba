"""Convolution: neighbouring tiles that differ by up to 15 decades, against direct sums in long
double.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from isethdr_core.physics.convolution import convolve_with_bound

from .inputs import patchy
from .verdict import Measured, relative


def cases() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield (case, measure)."""
    for decades in (0, 3, 6, 9, 12, 15):
        yield (
            f"one lamp 1e{decades} times its surroundings",
            lambda d=decades: direct(lamps(10.0**d, 1)),
        )
    yield "a quarter of the tiles lamps of 1e12", lambda: direct(lamps(1e12, 300))
    for level in (1e-12, 1e12, 1e-200, 1e200):
        yield f"{level:g} everywhere", lambda v=level: direct(v * patchy((32, 40)))
    yield "one lit tile", lambda: direct(alone(32, 40))
    yield "all dark", lambda: direct(np.zeros((32, 40)))
    yield "one tile", lambda: direct(np.full((1, 1), 3.0))
    yield "a row of 300", lambda: direct(lamps(1e12, 1, (1, 300)))
    yield "a column of 300", lambda: direct(lamps(1e12, 1, (300, 1)))


def lamps(level: float, count: int, shape: tuple[int, int] = (32, 40)) -> np.ndarray:
    """Return surroundings of about 1 with some bright tiles.

    Parameters
    ----------
    level : value of the bright tiles.
    count : number of bright tiles.
    shape : (rows, columns) of the picture.
    """
    picture = patchy(shape)
    picture.flat[np.random.default_rng(2).choice(picture.size, count, replace=False)] = level
    return picture


def alone(ny: int, nx: int) -> np.ndarray:
    """Return a picture with a single bright tile."""
    picture = np.zeros((ny, nx))
    picture[ny // 3, nx // 4] = 1.0
    return picture


def wide(reach: int = 24) -> np.ndarray:
    """Return a point spread function with the tail of a diffraction pattern, r^-3."""
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    psf = (1.0 + x**2 + 1.5 * y**2) ** -1.5
    return psf / psf.sum()


def direct(image: np.ndarray) -> Measured:
    """Compare a convolution with the sum of shifted pictures in long double."""
    psf = wide()
    convolved, bound = convolve_with_bound(image, psf)
    return Measured(
        relative(convolved, summed(image, psf)),
        bound.relative + bound.absolute,
        "direct sum in long double, relative",
    )


def summed(image: np.ndarray, psf: np.ndarray) -> np.ndarray:
    """Return the linear convolution as a sum of shifted pictures, long double."""
    ny, nx = image.shape
    ky, kx = psf.shape
    padded = np.zeros((ny + ky - 1, nx + kx - 1), np.longdouble)
    for i in range(ky):
        for j in range(kx):
            padded[i : i + ny, j : j + nx] += np.longdouble(psf[i, j]) * image
    return padded[ky // 2 : ky // 2 + ny, kx // 2 : kx // 2 + nx]
