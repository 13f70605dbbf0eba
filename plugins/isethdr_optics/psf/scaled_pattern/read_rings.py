"""Reading rings: the kernels of all bands, read ring by ring around their exact core."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.physics.optics import half_plane_pattern as patterns
from isethdr_core.physics.optics import ray_sums

from .column_errors import Errors, direct_sums, errors
from .core_halves import exact_halves
from .rings import (
    FINEST,
    USUAL,
    USUAL_ERROR,
    Rings,
    lattice,
    places,
    rays_per_tile,
    reaches,
    usual_rings,
)

if TYPE_CHECKING:
    from isethdr_core.physics.optics.ray_sums import Columns

    from .frame import Frame

# If finer sampling leaves more than this share of the error before, the sampling is not refined
# again.
WORTH = 0.9


def halves(
    frame: Frame,
    core: np.ndarray,
    read: Rings = USUAL,
    apply: Callable = map,
) -> np.ndarray:
    """Return one half of every kernel, (band, y = 0 .. reach, x = -reach .. reach) float32. The
    other half is its mirror image.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    core : exact cores from `exact_halves`, with the reach `frame.core`.
    read : sampling of the rings.
    apply : `map`, or the `map` of a pool of threads.
    """
    rows, columns = frame.reach
    out = np.empty((len(frame.edges_nm), rows + 1, 2 * columns + 1), np.float32)
    core_y, core_x = frame.core
    inner = min(frame.core)
    pupil = frame.pupil(frame.shortest_nm)
    wave = frame.scaled_nm
    edges = frame.scaled_edges_nm
    for level, outer in reaches(frame, read):
        if max(outer) <= inner:
            continue
        pattern = patterns.half_pattern(pupil, wave, lattice(frame, level, outer, read), apply)
        across, along = ray_sums.sectors(pattern, frame.pitch_um, edges, read.sharpened)
        rays = rays_per_tile(frame, level)
        for low, high in ray_sums.rings(inner, outer[1]):
            ring = ray_sums.Ring(low, high, outer[0], 0)
            many = places(frame, low, level)
            write = _columns(out, frame)
            ray_sums.band_means([across], ring, rays, many, write, apply)
        for low, high in ray_sums.rings(inner, outer[0]):
            ring = ray_sums.Ring(low, high, outer[1], 1)
            many = places(frame, low, level)
            write = _rows(out, frame)
            ray_sums.band_means([along], ring, rays, many, write, apply)
        inner = max(outer)
    out[:, : core_y + 1, columns - core_x : columns + core_x + 1] = core
    return out


def _columns(out: np.ndarray, frame: Frame) -> Callable[..., Any]:
    """Return a function that writes blocks of columns, |y| <= x, into `out`. Rows later replace
    tiles beyond the diagonals.
    """
    middle = frame.reach[1]

    def write(block: Columns) -> None:
        _, count, size = block.values.shape
        half = size // 2
        right = slice(middle + block.first, middle + block.first + count)
        mirrored = slice(middle - block.first - count + 1, middle - block.first + 1)
        for band, values in zip(out, block.values):
            band[: half + 1, right] = values[:, half:].T
            band[: half + 1, mirrored] = values[::-1, half::-1].T

    return write


def _rows(out: np.ndarray, frame: Frame) -> Callable[..., Any]:
    """Return a function that writes blocks of rows, |x| < y, into `out`."""
    middle = frame.reach[1]

    def write(block: Columns) -> None:
        half = block.values.shape[2] // 2
        for k in range(block.values.shape[1]):
            own = min(block.first + k - 1, half)
            into = slice(middle - own, middle + own + 1)
            out[:, block.first + k, into] = block.values[:, k, half - own : half + own + 1]

    return write


def fine_enough(frame: Frame, apply: Callable = map) -> tuple[np.ndarray, Errors]:
    """Return the result of `halves` and its errors. The sampling is refined until the error is at
    most `frame.lens.speckle_error`, or until `FINEST`.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    apply : `map`, or the `map` of a pool of threads.
    """
    fine = min(FINEST, max(1.0, USUAL_ERROR / frame.lens.speckle_error))
    core = exact_halves(frame, frame.core, apply)
    before = np.inf
    read = usual_rings(frame)
    sums = direct_sums(frame, read, apply)
    while True:
        half_kernels = halves(frame, core, read.finer(fine), apply)
        errors_of_bands = errors(frame, half_kernels, sums)
        worst = errors_of_bands.relative.max()
        if worst <= frame.lens.speckle_error or fine >= FINEST or worst > WORTH * before:
            return half_kernels, errors_of_bands
        before = worst
        fine = min(FINEST, fine * max(1.5, 1.2 * worst / frame.lens.speckle_error))
