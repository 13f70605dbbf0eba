"""Convolution of all bands at once, directly to channels: the sum over bands of weight x (kernel of
the band * light of the band).

Light is first projected onto K functionals of its spectrum (`spectral_basis`). Then K transforms
forward and J transforms back give J channels, instead of one pair of transforms per band. The
kernel of channel j and functional k is a weighted sum of the bands' transforms. These sums are
computed block by block, by matrix products.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from . import transform as transform

# memory of the bands' kernels that are combined at a time, so that they stay in the processor's
# cache
TOGETHER_BYTES = 2**20


def channels(
    out: np.ndarray,
    planes: Callable[..., Any],
    combine: np.ndarray,
    blocks: np.ndarray,
    size: tuple[int, int],
    apply: Callable[..., Any] = map,
) -> tuple[float, float]:
    """Add the channels' convolutions to `out`. Return the norm of all input planes together, and of
    all output planes.

    Parameters
    ----------
    out : (channel, y, x) float32 or float64.
    planes : function(rows) -> these rows of the functionals of the light, (functional, row, x).
    combine : (channel, functional, band) weight of a band's kernel in the kernel of a channel and
        functional.
    blocks : (band, block, sy, columns) transforms of the bands' kernels (`transform.spectrum`). The
        computation has their precision, single or double.
    size : (y, x) size of the transforms.
    apply : `map`, or the `map` of a pool of threads. The linear algebra library must have one
        thread meanwhile, because its own threads would compete with those of the pool.
    """
    outputs, count, bands = combine.shape
    ny, nx = out.shape[1:]
    scale = float(np.abs(combine).max()) or 1.0  # keeps single precision in range for any unit
    # a plain array view, because slices of mapped files are slow
    blocks, single = (
        np.asarray(blocks),
        blocks.dtype in (np.float32, np.complex64),
    )
    flat = (combine / scale).reshape(-1, bands).astype(np.float32 if single else float)
    together = max(1, TOGETHER_BYTES // (bands * transform.COLUMNS * blocks.itemsize))
    half_spectra = [transform.rows_of(ny, size, out, single) for _ in range(max(count, outputs))]

    def read(rows: slice, values: np.ndarray) -> None:
        values[:count] = planes(rows)
        values[count:] = 0.0

    def multiply(block: int, parts: list[np.ndarray]) -> list[np.ndarray]:
        for start in range(0, size[0], together):
            rows = slice(start, start + together)
            weighted_rows = _weighted(
                [part[rows] for part in parts[:count]], blocks[:, block, rows], flat
            )
            for part, now in zip(parts, weighted_rows):
                part[rows] = now
        return parts[:outputs]

    norm = transform.forward(read, half_spectra, size, nx, apply) ** 0.5
    transform.columns(half_spectra, multiply, size, apply)
    del half_spectra[outputs:]  # frees memory before `out` is written
    return norm, scale * sum(
        _back(plane, half, scale, size, apply) for plane, half in zip(out, half_spectra)
    ) ** 0.5


def _weighted(
    parts: list[np.ndarray], spectra: np.ndarray, weights: np.ndarray
) -> list[np.ndarray]:
    """Return, per channel, the sum over functionals of kernel x plane, for a block of the spectrum.

    Parameters
    ----------
    parts : (y, x) transforms of the planes of the functionals.
    spectra : (band, y, x) transforms of the bands' kernels.
    weights : (channel x functional, band) weights of the bands' kernels.
    """
    real = not np.iscomplexobj(spectra)
    kernels = matrix_product(weights, spectra if real else spectra.view(weights.dtype))
    kernels = (kernels if real else kernels.view(spectra.dtype)).reshape(
        -1, len(parts), *spectra.shape[1:]
    )
    weighted = []
    term = np.empty(spectra.shape[1:], parts[0].dtype)
    for row in kernels:
        total = parts[0] * row[0]
        for part, kernel in zip(parts[1:], row[1:]):
            total += np.multiply(part, kernel, out=term)
        weighted.append(total)
    return weighted


def _back(
    out: np.ndarray,
    half: np.ndarray,
    scale: float,
    size: tuple[int, int],
    apply: Callable[..., Any],
) -> float:
    """Transform one plane back and add it, times `scale`, to `out`. Return its sum of squares
    without `scale`.
    """

    def write(rows: slice, values: np.ndarray) -> float:
        total = transform.squares(values, np)
        values *= scale
        out[rows] += values
        return total

    return sum(transform.back(half, write, size, out.shape[1], apply))


def matrix_product(weights: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return weights (row, band) times values (band, ...), as (row, ...)."""
    # `reshape` returns a view if each band is contiguous
    return (weights @ values.reshape(len(values), -1)).reshape(len(weights), *values.shape[1:])
