"""Tile means: the light from one tile to another, from the points of lattices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .patterns import Lattice


def tile_means(
    pattern_half: Sequence[tuple[Lattice, float]],
    wave: float,
    pitch_um: tuple[float, float],
    grid: int,
    rows: np.ndarray,
    cols: np.ndarray,
) -> np.ndarray:
    """Return the light from one tile to another, (row, column) float32.

    Parameters
    ----------
    pattern_half : lattices and their shares; the result is the weighted sum.
    wave : wavelength at which the pattern is read, nm, as `pupil_size.scaled_nm`.
    pitch_um : (y, x) pitch of the tiles, um.
    grid : grid positions per tile.
    rows, cols : positions of the receiving tile, in units of a tile / grid.
    """
    out = np.zeros((len(rows), len(cols)), np.float32)
    for lattice, share in pattern_half:
        scale = wave / lattice.wavelength_nm
        down, across = (
            _triangles(
                n * p / grid, p, p * np.sqrt(1 - 0.5 / grid**2), s * scale, o, m
            )  # narrower: rounding to the nearest position adds the variance (p / grid)^2 / 12
            for n, p, s, o, m in zip(
                (rows, cols), pitch_um, lattice.step_um, lattice.offset, lattice.values.shape
            )
        )
        down *= np.float32(share)
        for block in blocks(len(rows), 64):  # blocks of 64 rows stay in the processor's cache
            out[block] += (across @ np.ascontiguousarray((down[block] @ lattice.values).T)).T
    return out


def _triangles(
    at_um: np.ndarray, pitch_um: float, half_um: float, step_um: float, offset: float, size: int
) -> csr_array:
    """Return sparse weights (position, sample) of a triangle about every position. Each row sums to
    the number of samples per tile.

    Parameters
    ----------
    at_um : (position,) positions, um.
    pitch_um : pitch of the tiles, um.
    half_um : half the width of the triangle, um.
    step_um : distance between samples, um.
    offset : position of the middle sample, in steps.
    size : number of samples.
    """
    half_um = max(half_um, step_um)  # a triangle of one step interpolates between two samples
    at = at_um / step_um - offset + size // 2
    taps = int(2 * half_um / step_um) + 1
    first = np.clip(np.ceil(at - half_um / step_um).astype(np.intp), 0, size - taps)
    sample = first[:, None] + np.arange(taps)
    weight = np.maximum(0.0, 1 - np.abs(sample - at[:, None]) * (step_um / half_um))
    weight *= pitch_um / step_um / weight.sum(axis=1, keepdims=True)
    return csr_array(
        (weight.astype(np.float32).ravel(), sample.ravel(), np.arange(len(at) + 1) * taps),
        (len(at), size),
    )


def tile_sums(fine: np.ndarray, s: int) -> np.ndarray:
    """Return the sums from tile to tile of a function: triangular weights along both axes.

    Parameters
    ----------
    fine : (y, x) samples of the function.
    s : samples per tile, along each axis.
    """
    if s == 1:
        return fine
    weight = ((s - np.abs(np.arange(-(s - 1), s))) / s).astype(fine.dtype)
    for axis in (0, 1):
        window = np.lib.stride_tricks.sliding_window_view(fine, 2 * s - 1, axis=axis)
        fine = (window[::s] if axis == 0 else window[:, ::s]) @ weight
    return fine


def blocks(count: int, size: int) -> list[slice]:
    """Return slices of at most `size` items that together cover `count` items."""
    return [slice(start, min(start + size, count)) for start in range(0, count, size)]
