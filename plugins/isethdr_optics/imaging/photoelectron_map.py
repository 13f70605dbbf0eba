"""Photoelectron map: electrons that a sensor would collect from a scene without blur, per tile and
per block of tiles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.physics.convolution.spectral import matrix_product
from isethdr_core.physics.radiometry import photons_per_energy

from .threads import threads

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Response

    from ..abilities import PupilOptics

MOST_BLOCKS = 96  # largest number of blocks along an axis


@dataclass(frozen=True, eq=False)
class PhotoelectronMap:
    """Electrons that one sensor collects from a scene without blur.

    A block has `block` tiles along each axis, or fewer at the border. A row is a channel; equal
    channels are one row.
    """

    block: int
    frame: tuple[int, int]  # (y, x) tiles
    weights: np.ndarray  # (row, band) electrons per radiance
    total_e: np.ndarray  # (y, x) electrons per tile, summed over rows
    sums: np.ndarray  # (row, y, x) electrons per block
    least: np.ndarray  # (row, y, x) electrons of the darkest tile of each block
    # (band, y, x) sums over blocks of the squares of radiance, times the square of the largest
    # relative illumination
    squares: np.ndarray


def map_photoelectrons(
    lens: PupilOptics, mixed: xr.DataArray, relative: np.ndarray, response: Response
) -> PhotoelectronMap:
    """Return the photoelectron map of mixed radiance.

    Parameters
    ----------
    lens : lens that gives the throughput.
    mixed : mixed radiance (wavelength, y, x).
    relative : relative illumination of the tiles, (y, x) or 1.
    response : `isethdr_core.demand.Response` of the sensor.
    """
    weights = np.unique(
        lens.throughput_sr()
        * response.area_exposure_m2_s
        * electrons(response, mixed.wavelength.values.astype(float)),
        axis=0,
    )
    values = np.asarray(mixed.values)
    rows = weights.astype(mixed.dtype)
    block = block_of(mixed.shape[1:])
    whole = np.empty(values.shape[1:], values.dtype)

    def strip(start: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        rows_of_strip = values[:, start : start + block]
        charges = matrix_product(rows, rows_of_strip)
        charges *= relative[start : start + block] if np.ndim(relative) else relative
        whole[start : start + block] = charges.sum(0)
        return (
            charges.sum(1),
            charges.min(1),
            np.einsum("byx,byx->bx", rows_of_strip, rows_of_strip),
        )

    with threads() as apply:
        sums, least, squares = (
            np.stack(a, axis=1) for a in zip(*apply(strip, range(0, values.shape[1], block)))
        )
    squares = _columns(np.add, squares, block) * float(np.max(relative)) ** 2
    return PhotoelectronMap(
        block,
        values.shape[1:],
        weights,
        whole,
        _columns(np.add, sums, block),
        _columns(np.minimum, least, block),
        squares,
    )


def electrons(response: Response, wavelength_nm: np.ndarray) -> np.ndarray:
    """Return electrons per m2 and second for an irradiance of 1 W m-2 nm-1, (channel, band)."""
    return response.efficiency(wavelength_nm) * photons_per_energy(wavelength_nm)


def block_of(shape: tuple[int, ...]) -> int:
    """Return the number of tiles of a block along each axis of a frame."""
    return max(1, -(-max(shape) // MOST_BLOCKS))


def sums(planes: np.ndarray, block: int, power: int = 1) -> np.ndarray:
    """Return sums over blocks of the first or second power of planes (..., y, x), as float64.

    Parameters
    ----------
    planes : (..., y, x) values.
    block : number of tiles of a block along each axis; fewer at the border.
    power : power of the values that are summed: 1 or 2.
    """
    strips = [planes[..., start : start + block, :] for start in range(0, planes.shape[-2], block)]
    rows = [s.sum(-2) if power == 1 else np.einsum("...yx,...yx->...x", s, s) for s in strips]
    return _columns(np.add, np.stack(rows, axis=-2), block)


def _columns(reduce: Callable[..., Any], rows: np.ndarray, block: int) -> np.ndarray:
    return reduce.reduceat(rows.astype(float), np.arange(0, rows.shape[-1], block), axis=-1)
