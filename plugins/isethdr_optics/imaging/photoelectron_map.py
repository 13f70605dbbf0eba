"""Counted light: electrons that a sensor makes of a scene's light before it is spread, tile by tile
and in blocks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from isethdr_core.physics.convolution.spectral import matrix_product
from isethdr_core.physics.radiometry import photons_per_energy

from .threads import threads

MOST_BLOCKS = 96  # along an axis


@dataclass(frozen=True, eq=False)
class Counted:
    """A scene's light as one sensor counts it; `block` tiles along either axis make a block, fewer
    at the border.
    """

    block: int
    frame: tuple[int, int]  # (y, x) tiles
    weights: np.ndarray  # (row, band): electrons per radiance, of the channels that differ
    whole: np.ndarray  # (y, x) electrons of all rows together
    sums: np.ndarray  # (row, y, x) electrons of blocks
    least: np.ndarray  # of any tile of the block
    # (band, y, x): sums of the squares of radiance over blocks, at the largest relative
    # illumination
    squares: np.ndarray


def counted(lens, mixed, relative, response) -> Counted:
    """Return what a sensor of `response` counts of mixed radiance; `relative` multiplies the tiles'
    light, (y, x) or 1.
    """
    weights = np.unique(
        lens.throughput_sr()
        * response.area_exposure_m2_s
        * electrons(response, mixed.wavelength.values.astype(float)),
        axis=0,
    )
    values, rows, block = (
        np.asarray(mixed.values),
        weights.astype(mixed.dtype),
        block_of(mixed.shape[1:]),
    )
    whole = np.empty(values.shape[1:], values.dtype)

    def strip(start):
        part = values[:, start : start + block]
        charges = matrix_product(rows, part)
        charges *= relative[start : start + block] if np.ndim(relative) else relative
        whole[start : start + block] = charges.sum(0)
        return charges.sum(1), charges.min(1), np.einsum("byx,byx->bx", part, part)

    with threads() as apply:
        sums, least, squares = (
            np.stack(a, axis=1) for a in zip(*apply(strip, range(0, values.shape[1], block)))
        )
    squares = _columns(np.add, squares, block) * float(np.max(relative)) ** 2
    return Counted(
        block,
        values.shape[1:],
        weights,
        whole,
        _columns(np.add, sums, block),
        _columns(np.minimum, least, block),
        squares,
    )


def electrons(response, wavelength_nm):
    """Return electrons per m2 and second that irradiance of 1 W m-2 nm-1 makes, (channel, band)."""
    return response.efficiency(wavelength_nm) * photons_per_energy(wavelength_nm)


def block_of(shape) -> int:
    """Return how many tiles make a block along either axis of a frame."""
    return max(1, -(-max(shape) // MOST_BLOCKS))


def sums(planes, block: int, power: int = 1):
    """Return sums of the first or second power of planes (..., y, x) over blocks, float64."""
    strips = [planes[..., start : start + block, :] for start in range(0, planes.shape[-2], block)]
    rows = [s.sum(-2) if power == 1 else np.einsum("...yx,...yx->...x", s, s) for s in strips]
    return _columns(np.add, np.stack(rows, axis=-2), block)


def _columns(reduce, rows, block):
    return reduce.reduceat(rows.astype(float), np.arange(0, rows.shape[-1], block), axis=-1)
