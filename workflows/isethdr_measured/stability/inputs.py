"""Inputs: small light fields, as inputs of the stages."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.quantities import IRRADIANCE, RADIANCE, centres, plane, scene_radiance

if TYPE_CHECKING:
    import xarray as xr

BANDS = np.arange(400.0, 701.0, 10.0)
PITCH_UM = 3.0
THROUGHPUT_SR = np.pi / 65  # throughput of a lens at f/4


def mixed(cube: np.ndarray, wavelength_nm: np.ndarray = BANDS, pitch: float = 1e-3) -> xr.DataArray:
    """Return mixed radiance of a cube.

    Parameters
    ----------
    cube : (wavelength, y, x) radiance, W m-2 sr-1 nm-1.
    wavelength_nm : (wavelength,) band centres, nm.
    pitch : side of a tile, tangents of the field angle.
    """
    _, ny, nx = cube.shape
    return plane(
        cube,
        wavelength_nm,
        centres(nx, nx * pitch),
        centres(ny, ny * pitch),
        RADIANCE,
        weights={},
        field_width=nx * pitch,
        field_height=ny * pitch,
        pitch_x=pitch,
        pitch_y=pitch,
    )


def irradiance(
    cube: np.ndarray, wavelength_nm: np.ndarray = BANDS, tile_um: float = PITCH_UM
) -> xr.DataArray:
    """Return irradiance of a cube.

    Parameters
    ----------
    cube : (wavelength, y, x) irradiance, W m-2 nm-1.
    wavelength_nm : (wavelength,) band centres, nm.
    tile_um : side of a tile on the sensor plane, um.
    """
    _, ny, nx = cube.shape
    p = tile_um * 1e-6
    return plane(
        cube,
        wavelength_nm,
        centres(nx, nx * p),
        centres(ny, ny * p),
        IRRADIANCE,
        f_number=4.0,
        focal_length_mm=4.0,
        throughput_sr=THROUGHPUT_SR,
        falloff="none",
        field_width=nx * p,
        field_height=ny * p,
        pitch_x=p,
        pitch_y=p,
    )


def scene(maps: dict, wavelength_nm: np.ndarray = BANDS, pitch: float = 1e-3) -> xr.Dataset:
    """Return scene radiance with flat spectra.

    Parameters
    ----------
    maps : {light group: (y, x) radiance, W m-2 sr-1 nm-1}.
    wavelength_nm : (wavelength,) band centres, nm.
    pitch : side of a tile, tangents of the field angle.
    """
    stack = np.stack(
        [np.broadcast_to(m, (len(wavelength_nm), *np.shape(m))) for m in maps.values()]
    )
    ny, nx = stack.shape[-2:]
    return scene_radiance(
        stack,
        maps,
        wavelength_nm,
        centres(nx, nx * pitch),
        centres(ny, ny * pitch),
        (nx * pitch, ny * pitch),
    )


def patchy(shape: tuple[int, int], seed: int = 1) -> np.ndarray:
    """Return random numbers (y, x) between 0.5 and 1.5."""
    return 0.5 + np.random.default_rng(seed).random(shape)
