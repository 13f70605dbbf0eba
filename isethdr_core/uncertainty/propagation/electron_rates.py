"""Electron rates: electrons per area and second at each pixel, from light and from direct light."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...data import camera_geometry
from ...data.quantities import PHOTOCURRENT
from ...data.reference_picture import mean_over_pixels
from ...physics.radiometry import photons_per_energy
from ...physics.resampling.area import resample_mean
from ..render_noise import nearest_xyz, pixel_variance

if TYPE_CHECKING:
    import xarray as xr

    from .captured_electrons import Exposure


class Rates(NamedTuple):
    """Electrons per m2 and second, at each pixel (y, x) in its own channel."""

    total: np.ndarray  # all electrons
    image: np.ndarray  # electrons of the tiles that the pixel looks at
    renderer: np.ndarray  # standard deviation that the noise of the scene causes

    def scaled(self, scale: float) -> Rates:
        """Return the rates times `scale`."""
        return Rates(*(scale * values for values in self))


def electron_rates(
    counting: np.ndarray, exposure: Exposure, noise: np.ndarray | None, scene_noise: float
) -> Rates:
    """Return the electrons per m2 and second of one capture, and their error.

    Parameters
    ----------
    counting : electrons per energy in each channel and band.
    exposure : captures, with light and mixed radiance that are constant over time.
    noise : relative standard errors (3, y, x) of X, Y and Z of the mixed radiance; None for none.
    scene_noise : relative noise of all direct light if `noise` is None.
    """
    captures = exposure.captures
    light = exposure.light
    mixed = exposure.mixed
    f_m = captures.attrs["focal_length_mm"] * 1e-3
    gain = captures.attrs["throughput_sr"] * camera_geometry.relative_illumination(
        captures.attrs, captures.x.values[None, :] / f_m, captures.y.values[:, None] / f_m
    )
    side = captures.attrs["pitch_um"] * 1e-6
    place = (captures.x.values, captures.y.values)
    filters = captures["filter"].values
    total, image, variance = np.zeros((3, *filters.shape))
    for channel, row in enumerate(counting):
        mine = filters == channel
        if not mine.any():
            continue
        tiles = band_sum(row, mixed.values)
        total[mine] = resample_mean(
            light_plane(row, captures, light), light.x.values, light.y.values, *place, side, side
        )[mine]
        image[mine] = (gain * mean_over_pixels(tiles, mixed, captures))[mine]
        if noise is not None:
            of_channel = noise[nearest_xyz(row, mixed.wavelength.values)]
            of_pixels = pixel_variance((of_channel * tiles) ** 2, mixed, captures)
            variance[mine] = (gain**2 * of_pixels)[mine]
    return Rates(total, image, np.sqrt(variance) if noise is not None else scene_noise * image)


def light_plane(row: np.ndarray, captures: xr.Dataset, light: xr.DataArray) -> np.ndarray:
    """Return the electrons per m2 and second (y, x) of light in one channel.

    Parameters
    ----------
    row : (band,) electrons per energy of the channel.
    captures : captures, for their bands.
    light : irradiance or photocurrent.
    """
    if light.attrs["units"] != PHOTOCURRENT:
        return band_sum(
            row[np.isin(captures.wavelength.values, light.wavelength.values)], light.values
        )
    efficiency = row / photons_per_energy(captures.wavelength.values)
    # with crosstalk, which mixes channels, no difference is 0
    differences = np.abs(np.asarray(light.attrs["efficiency"]) - efficiency).max(1)
    plane: np.ndarray = light.values[int(differences.argmin())]
    return plane


def band_sum(row: np.ndarray, cube: np.ndarray) -> np.ndarray:
    """Return the sum over bands (y, x) of `row` (band,) times `cube` (band, y, x), float64."""
    out = np.zeros(cube.shape[1:])
    for weight, band in zip(row, cube):
        if weight:
            out += weight * band
    return out
