"""Bright tiles: the part of their light that a spectral fit misses is added, band by band."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isethdr_core.physics.convolution.spectral import matrix_product

if TYPE_CHECKING:
    from .field_optics import FieldOptics
    from .spectral_fit import Fit

# half sides, in tiles, of the squares that are corrected around bright tiles; at most
# `kernel_spectra.NEAR`
RADII = (96, 64, 32, 16, 8, 4)
MOST_VALUES_WRITTEN = 3e7  # largest number of values that are written per channel
TILES_AT_ONCE = 64  # number of bright tiles that are spread in one matrix product
STRIPS = 2  # number of strips of rows, so that there is work for all threads with few channels


def radii(rate: np.ndarray) -> np.ndarray:
    """Return the radius in tiles within which each bright tile is corrected, (tile,).

    The wings of a kernel fall with r^-3. The radius is chosen so that all tiles bring the same
    light to a tile at their radius.

    Parameters
    ----------
    rate : (tile,) light of the bright tiles, in any unit.
    """
    radius = RADII[0] * np.cbrt(rate / max(float(rate.max(initial=0.0)), np.finfo(float).tiny))
    steps = np.array(RADII)[::-1]
    chosen = steps[np.searchsorted(steps, radius)]
    for largest in RADII:
        chosen = np.minimum(chosen, largest)
        if np.sum((2.0 * chosen + 1) ** 2) <= MOST_VALUES_WRITTEN:
            break
    return chosen


class _Group(NamedTuple):
    """Bright tiles with the same radius."""

    tiles: np.ndarray  # (tile,) flat indices
    missed: np.ndarray  # (band, tile) radiance that the fit misses
    cores: np.ndarray  # (band, tile of the core) kernels within the radius
    half_widths: list[int]  # (y, x) tiles from the middle to the border of the cores


def correct(
    out: np.ndarray,
    cube: np.ndarray,
    weights: np.ndarray,
    fit: Fit,
    optics: FieldOptics,
    apply: Callable[..., Any] = map,
) -> None:
    """Add to `out` the light of bright tiles that `fit` misses, within their radii.

    Parameters
    ----------
    out : photocurrent (channel, y, x).
    cube : radiance (band, y, x).
    weights : (channel, band) photocurrent per radiance.
    fit : `spectral_fit.Fit` of the light.
    optics : optics of the field, for relative illumination and kernels.
    apply : `map`, or the `map` of a pool of threads.
    """
    groups = []
    kernels = optics.kernels
    relative = optics.relative
    for radius in np.unique(fit.radii):
        half_widths = [min(int(radius), n // 2) for n in kernels.bands[0].shape]
        core_window = tuple(
            slice(n // 2 - h, n // 2 + h + 1) for n, h in zip(kernels.bands[0].shape, half_widths)
        )
        cores = np.stack([b[core_window].ravel() for b in kernels.bands])
        tiles = fit.bright[fit.radii == radius]
        light = cube.reshape(len(cube), -1)[:, tiles]
        missed = light - fit.near.predict @ (fit.near.project.astype(cube.dtype) @ light).astype(
            float
        )
        groups.append(
            _Group(
                tiles,
                missed if relative is None else missed * relative.ravel()[tiles],
                cores,
                half_widths,
            )
        )

    def strip(task: tuple[int, int]) -> None:
        number, first = task
        for group in groups:
            _spread(out[number, first : first + strip_rows], first, weights[number], group)

    strip_rows = -(-out.shape[1] // STRIPS)
    list(
        apply(
            strip,
            [
                (number, first)
                for first in range(0, out.shape[1], strip_rows)
                for number in range(len(out))
            ],
        )
    )


def _spread(out: np.ndarray, first: int, weights: np.ndarray, group: _Group) -> None:
    """Add the missed light of a group to some rows of one channel, from row `first` on."""
    tiles, missed, cores, half_widths = group
    ny, nx = out.shape
    shape = tuple(2 * h + 1 for h in half_widths)
    rows = tiles // nx - first
    columns = tiles % nx
    reaches = (rows + half_widths[0] >= 0) & (rows - half_widths[0] < ny)
    rows = rows[reaches]
    columns = columns[reaches]
    missed = missed[:, reaches]
    for start in range(0, len(rows), TILES_AT_ONCE):
        chunk = slice(start, start + TILES_AT_ONCE)
        # single precision is enough for a small correction
        missed_light = (missed[:, chunk] * weights[:, None]).T.astype(cores.dtype)
        spread = matrix_product(np.ascontiguousarray(missed_light), cores).reshape(-1, *shape)
        for tile_light, y, x in zip(spread, rows[chunk], columns[chunk]):
            top = max(y - half_widths[0], 0)
            left = max(x - half_widths[1], 0)
            bottom = min(y + half_widths[0] + 1, ny)
            right = min(x + half_widths[1] + 1, nx)
            inside = (
                slice(top - y + half_widths[0], bottom - y + half_widths[0]),
                slice(left - x + half_widths[1], right - x + half_widths[1]),
            )
            out[top:bottom, left:right] += tile_light[inside]
