"""Area integration: from spectral irradiance to the electrons per second that each photodiode collects.

Bands are projected onto the filters first, so that 31 planes of light become three or four before any resampling.
"""

from __future__ import annotations

import numpy as np

from isethdr_core.physics.area import resample_mean
from isethdr_core.physics.radiometry import band_widths_nm, photon_energy_j

from .pixel_grid import PixelGrid


def electrons_per_m2_s(irradiance, wavelength_nm, qe) -> np.ndarray:
    """Return (channel, y, x) float64 electrons per m2 and second on the light's own tiles.

    Sum over bands of irradiance * band width / photon energy * quantum efficiency.

    Parameters
    ----------
    irradiance : (wavelength, y, x), W m-2 nm-1, band means.
    wavelength_nm : band centres.
    qe : (channel, wavelength), electrons per photon.
    """
    weights = qe * band_widths_nm(wavelength_nm) / photon_energy_j(wavelength_nm)
    out = np.zeros((len(weights), *irradiance.shape[1:]))
    rows = max(1, 60_000 // irradiance.shape[2])
    for y in range(0, irradiance.shape[1], rows):  # band by band in a fixed order: matrix products round by block shape
        for band, plane in enumerate(irradiance[:, y:y + rows]):
            plane = np.asarray(plane, np.float64)
            for channel, weight in enumerate(weights[:, band]):
                out[channel, y:y + rows] += weight * plane
    return out


def electrons_per_s(channel_planes, x_m, y_m, grid: PixelGrid, filters, fill_factor: float) -> np.ndarray:
    """Return the (y, x) electrons per second that the photodiode of each pixel collects under its own filter.

    Parameters
    ----------
    channel_planes : (channel, y, x) electrons m-2 s-1, constant over tiles centred at `x_m`, `y_m`.
    filters : (y, x) index of each pixel's channel.
    fill_factor : the photodiode is a centred square of this share of the pixel's area.
    """
    side = grid.pitch_m * np.sqrt(fill_factor)
    out = np.empty(filters.shape)
    for channel, plane in enumerate(channel_planes):
        mask = filters == channel
        out[mask] = resample_mean(plane, x_m, y_m, grid.x_m, grid.y_m, side, side)[mask]
    return np.maximum(out, 0.0) * side**2  # sums of differences may round just below 0
