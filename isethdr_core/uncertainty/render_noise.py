"""Render noise: the renderer's own noise in each tile of a scene, and in the pixels of a camera."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..data import camera_geometry
from ..data.quantities import PHOTOCURRENT, bands_nm, full_field, tile_pitch
from ..data.temporal_modulation import time_mean
from ..physics.photometry import xyz_weights
from ..physics.radiometry import photons_per_energy
from ..physics.resampling.area import overlaps
from ..physics.resampling.overlap import borders
from ..pipeline import window

if TYPE_CHECKING:
    import numpy.typing as npt
    import xarray as xr

# variable (light_group, xyz_channel, y, x) of a scene: standard errors of X, Y and Z, cd/m2
NOISE = "xyz_noise"
# variable (light_group, y, x): half of the luminance difference of half buffers A and B, cd/m2
HALF_DIFFERENCE = "half_difference"
WINDOW_TILES = 3  # side of the window that tells noise from the scene


def relative_noise(scene: xr.Dataset, mixed: xr.DataArray) -> np.ndarray | None:
    """Return the relative standard errors (3, y, x) of X, Y and Z of `mixed`, constant over time;
    None if the scene states none.

    A renderer with a single pass states NaN; the result is None then, too. The noise of light
    groups is independent, so that squares add up. All bands share their samples, but lamps of other
    colours have other noise.
    """
    if NOISE not in scene:
        return None
    squares = np.zeros((3, *mixed.shape[1:]))
    for k, group in enumerate(map(str, scene.light_group.values)):
        if weight := mixed.attrs["weights"].get(group, 0.0):
            squares += (weight * scene[NOISE].isel(light_group=k).values.astype(float)) ** 2
    if not np.isfinite(squares).all():
        return None
    level = levels(mixed, xyz_weights(mixed.wavelength.values))
    return np.sqrt(squares) / np.where(level > 0, level, 1.0)


def relative_halves(scene: xr.Dataset, mixed: xr.DataArray) -> np.ndarray | None:
    """Return half of the relative luminance difference (y, x) of half buffers A and B.

    The values lie between -1 and 1. Their sign is random; their variance is that of the noise of
    the light. None if the scene states no half buffers, or has only one pass.

    Parameters
    ----------
    scene : scene radiance.
    mixed : mixed radiance of this scene.
    """
    if HALF_DIFFERENCE not in scene:
        return None
    apart = np.zeros(mixed.shape[1:])
    for k, group in enumerate(map(str, scene.light_group.values)):
        if weight := mixed.attrs["weights"].get(group, 0.0):
            apart += weight * scene[HALF_DIFFERENCE].isel(light_group=k).values
    if not np.isfinite(apart).all():
        return None
    level = luminance_cd_m2(mixed)
    return np.clip(apart / np.where(level > 0, level, np.inf), -1.0, 1.0)


def smoothing_change(halves: np.ndarray, level_cd_m2: np.ndarray) -> np.ndarray:
    """Return the relative change (y, x) of luminance that removes renderer noise where it hides the
    scene.

    Parameters
    ----------
    halves : half of the relative difference of the half buffers (y, x), as `relative_halves`
        returns it.
    level_cd_m2 : luminance of the same tiles, cd/m2.

    Notes
    -----
    The local statistics filter of Lee 1980 (eq. 9 to 11): a tile moves towards the mean of its
    window by the share of the window's variance that is noise. Tiles without noise, lamps and sky,
    stay.
    """
    from scipy.ndimage import correlate1d

    def window_mean(values: np.ndarray) -> np.ndarray:
        # running sums would carry the rounding error of a lamp along its whole row
        equal = np.full(WINDOW_TILES, 1 / WINDOW_TILES)
        return correlate1d(
            correlate1d(values, equal, axis=0, mode="nearest"), equal, axis=1, mode="nearest"
        )

    noise = window_mean((halves * level_cd_m2) ** 2)
    mean = window_mean(level_cd_m2)
    deviation = level_cd_m2 - mean
    count = WINDOW_TILES**2
    variance = (window_mean(level_cd_m2**2) - mean**2) * count / (count - 1)
    noise_share = np.where(variance > noise, noise / np.where(variance > noise, variance, 1.0), 1.0)
    relative = -noise_share * deviation / np.where(level_cd_m2 > 0, level_cd_m2, np.inf)
    return np.where(halves == 0, 0.0, relative)


def luminance_cd_m2(mixed: xr.DataArray) -> np.ndarray:
    """Return the luminance (y, x) of `mixed`, constant over time, cd/m2."""
    return levels(mixed, xyz_weights(mixed.wavelength.values)[1:2])[0]


def levels(mixed: xr.DataArray, weights: np.ndarray) -> np.ndarray:
    """Return sums over bands (k, y, x) of `weights` (k, wavelength) times light, in float64. The
    sum is computed band by band, without a copy of all bands.
    """
    out = np.zeros((len(weights), *mixed.shape[1:]))
    for weight, band in zip(weights.T, mixed.values):
        out += weight[:, None, None] * band
    return out


def nearest_xyz(sensitivity: np.ndarray, wavelength_nm: npt.ArrayLike) -> int:
    """Return the index of X, Y or Z, the one that a channel's `sensitivity` (wavelength,) resembles
    most. The channel is assumed to have the same relative noise.
    """
    curves = xyz_weights(wavelength_nm)
    alike = (
        curves
        @ sensitivity
        / np.sqrt((curves**2).sum(1) * max(float(sensitivity @ sensitivity), np.finfo(float).tiny))
    )
    return int(np.nanargmax(alike))


def pixel_variance(
    variance: np.ndarray, field: xr.Dataset | xr.DataArray, picture: xr.Dataset
) -> np.ndarray:
    """Return the variance (..., y, x) of each pixel's mean over tiles with independent errors.

    Parameters
    ----------
    variance : (..., y, x) variance of each tile of `field`, any unit.
    field : light or radiance, for the grid of tiles.
    picture : a picture, for its pixels and distortion, as in `reference_picture.mean_over_pixels`.

    Notes
    -----
    A mean with weights w has the variance sum of w^2 times the tiles' variances. If a lens
    distorts, w are shares of the area that the pixel covers in the field.
    """
    f_m = float(picture.attrs["focal_length_mm"]) * 1e-3
    side = float(picture.attrs["pitch_um"]) * 1e-6
    at = {d: picture[d].values / f_m for d in ("x", "y")}
    lens = camera_geometry.map_of(picture)
    side = side / f_m
    if isinstance(lens, camera_geometry.Identity):
        across, down = (overlaps(field[d].values, at[d], side, d) / side for d in ("x", "y"))
        across = across.multiply(across).tocsr()
        down = down.multiply(down).tocsr()
        flat = np.reshape(variance, (-1, *np.shape(variance)[-2:]))
        return np.stack([(across @ (down @ tile_variance).T).T for tile_variance in flat]).reshape(
            *np.shape(variance)[:-2], len(at["y"]), len(at["x"])
        )
    areas = camera_geometry.field_areas(
        lens,
        *(borders(field[d].values, tile_pitch(field, d)) for d in ("x", "y")),
        *(borders(at[d], side) for d in ("x", "y")),
    )
    shares = areas.multiply(1 / areas.sum(axis=1)[:, None]).tocsr()
    out = (shares.multiply(shares).tocsr() @ np.reshape(variance, (-1, areas.shape[1])).T).T
    return out.reshape(*np.shape(variance)[:-2], len(at["y"]), len(at["x"]))


def direct_share(light: xr.DataArray, mixed: xr.DataArray) -> np.ndarray:
    """Return the share (plane, y, x) of `light` that is direct, neither spread nor flare.

    It lies between 0 and 1, and is 0 without light.

    Parameters
    ----------
    light : irradiance or photocurrent.
    mixed : mixed radiance of this light, constant over time.
    """
    total = time_mean(light).values
    f_m = light.attrs["focal_length_mm"] * 1e-3
    bands = mixed.sel(wavelength=bands_nm(light)).values
    if light.attrs["units"] == PHOTOCURRENT:
        counting = np.asarray(light.attrs["efficiency"]) * photons_per_energy(bands_nm(light))
        bands = np.tensordot(counting.astype(bands.dtype), bands, 1)
    gain = light.attrs["throughput_sr"] * camera_geometry.relative_illumination(
        light.attrs, light.x.values[None, :] / f_m, light.y.values[:, None] / f_m
    )
    out = np.empty(total.shape, np.float32)
    for share, tiles, plane in zip(out, bands, total):
        np.clip(
            gain * on_light(tiles, mixed, light) / np.where(plane > 0, plane, np.inf),
            0.0,
            1.0,
            out=share,
        )
    return out


def on_light(tiles: np.ndarray, mixed: xr.DataArray, light: xr.DataArray) -> np.ndarray:
    """Return tiles (..., y, x) of the field on the grid of `light`: the same tiles if the grids
    agree, otherwise the mean over the area that each tile of the sensor plane covers in the field.

    If a lens magnifies colours differently, the sensor plane reaches a little beyond the field.

    Parameters
    ----------
    tiles : values (..., y, x) of the field, any unit.
    mixed : mixed radiance on the grid of the tiles.
    light : irradiance or photocurrent on the sensor plane.
    """
    lens = camera_geometry.map_of(light)
    f_m = light.attrs["focal_length_mm"] * 1e-3
    inside = window.tiles(mixed, [side / f_m for side in full_field(light)])
    if (
        isinstance(lens, camera_geometry.Identity)
        and (part := tiles[..., inside["y"], inside["x"]]).shape[-2:] == light.shape[-2:]
    ):
        return part
    pixels = camera_geometry.PixelGrid(
        light.x.values / f_m, light.y.values / f_m, tile_pitch(light, "x") / f_m
    )
    return camera_geometry.mean_over_pixels(tiles, mixed, lens, pixels, beyond=True)
