"""Area integration: from spectral irradiance to the electrons per second that each photodiode
collects.

Bands are summed with the response of each filter first, so that for example 31 planes of light
become three or four before any resampling.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse import csr_array

from isethdr_core.physics.radiometry import photons_per_energy
from isethdr_core.physics.resampling.area import integrate_tiles

from .pixel_grid import PixelGrid


def electrons_per_m2_s(
    irradiance: np.ndarray, wavelength_nm: np.ndarray, qe: np.ndarray
) -> np.ndarray:
    """Return (channel, y, x) float64 electrons per m2 and second on the light's own tiles.

    Sum over bands of irradiance * band width / photon energy * quantum efficiency.

    Parameters
    ----------
    irradiance : (wavelength, y, x), W m-2 nm-1, band means.
    wavelength_nm : (wavelength,) band centres, nm.
    qe : (channel, wavelength), electrons per photon.
    """
    # sparse products add band by band in a fixed order; the rounding of dense products would depend
    # on the shape of a block and on the number of threads
    weights = csr_array(qe * photons_per_energy(wavelength_nm))
    bands, height, width = irradiance.shape
    out = np.empty((weights.shape[0], height, width))
    rows = max(1, 4_000 // width)  # all bands of these rows fit in the second-level cache
    for y in range(0, height, rows):
        part = irradiance[:, y : y + rows]
        out[:, y : y + rows] = (weights @ part.reshape(bands, -1).astype(np.float64)).reshape(
            -1, *part.shape[1:]
        )
    return out


def electrons_per_s(
    channel_planes: np.ndarray,
    x_m: np.ndarray,
    y_m: np.ndarray,
    grid: PixelGrid,
    filters: np.ndarray,
    fill_factor: float,
) -> np.ndarray:
    """Return the electrons per second (y, x) that the photodiode of each pixel collects.

    Parameters
    ----------
    channel_planes : (channel, y, x) electrons m-2 s-1, constant over each tile.
    x_m, y_m : (x,) and (y,) centres of the tiles, m.
    grid : positions and pitch of the pixels.
    filters : (y, x) index of each pixel's channel, periodic.
    fill_factor : the photodiode is a centred square of this share of the pixel's area.
    """
    side = grid.pitch_m * np.sqrt(fill_factor)
    out = np.empty(filters.shape)
    for columns, rows, channel in lattices(filters):
        out[rows, columns] = integrate_tiles(
            channel_planes[channel], x_m, y_m, grid.x_m[columns], grid.y_m[rows], side, side
        )
    return np.maximum(out, 0.0, out=out)  # rounding may make sums of differences negative


def lattices(filters: np.ndarray) -> Iterator[tuple[slice, slice, int]]:
    """Yield (columns, rows, channel): slices of pixels of one channel. Together, they contain each
    pixel once.
    """
    row_period, column_period = (_period(f) for f in (filters, filters.T))
    for y in range(row_period):
        for x in range(column_period):
            yield slice(x, None, column_period), slice(y, None, row_period), filters[y, x]


def _period(filters: np.ndarray) -> int:
    """Return the smallest shift along the first axis that maps the pattern onto itself; the full
    length if there is none.
    """
    return next(
        (p for p in range(1, len(filters)) if np.array_equal(filters[p:], filters[:-p])),
        len(filters),
    )
