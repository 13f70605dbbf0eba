"""Pixel grid: where the pixels lie in the camera's field."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.temporal_modulation import time_mean
from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.pipeline import memory
from isethdr_core.quantities import tile_pitch

from ..sensor_model import SensorModel

if TYPE_CHECKING:
    import xarray as xr

# Memory per pixel at the peak of a run, measured: of pictures and scores, and of each capture
PIXEL_BYTES = 175
CAPTURE_BYTES = 45
# relative tolerance: a field of 100 pitches has 100 pixels although metres are rounded
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class PixelGrid:
    """Pixel centres in metres, x right and y down, centred on the axis."""

    x_m: np.ndarray
    y_m: np.ndarray
    pitch_m: float


def pixel_grid(light: xr.DataArray, pitch_um: float, rows: int = 0, columns: int = 0) -> PixelGrid:
    """Return the grid of `rows` x `columns` pixels, centred; 0 fills the camera's nominal field.

    Tiles beyond `field_width` and `field_height` of the light are not part of the field.

    Parameters
    ----------
    light : irradiance or photocurrent DataArray with the size of the field, m, in its attributes.
    pitch_um : pixel pitch, um.
    rows, columns : pixels along both axes; 0 fills the field.

    Raises
    ------
    ConfigError : the sensor is larger than the field, so that its border would get no light.
    """
    from isethdr_core.quantities import centres

    pitch = pitch_um * 1e-6
    y, x = pixel_counts(
        light.attrs["field_width"], light.attrs["field_height"], pitch_um, rows, columns
    )
    return PixelGrid(centres(x, x * pitch), centres(y, y * pitch), pitch)


def pixel_counts(
    field_width_m: float, field_height_m: float, pitch_um: float, rows: int = 0, columns: int = 0
) -> tuple[int, int]:
    """Return (rows, columns), with 0 replaced by the largest number that fits into the field.

    Parameters
    ----------
    field_width_m, field_height_m : size of the field on the sensor plane, m.
    pitch_um : pixel pitch, um.
    rows, columns : pixels along both axes; 0 fills the field.

    Raises
    ------
    ConfigError : more pixels are requested than fit into the field, or no pixel fits.
    """
    pitch = pitch_um * 1e-6
    return _count(field_height_m, pitch, rows, "rows", "high"), _count(
        field_width_m, pitch, columns, "columns", "wide"
    )


def pixel_need(model: SensorModel, field_width_m: float, field_height_m: float) -> memory.Need:
    """Return the memory that the pixels of a sensor need from the shot to the scores, with advice
    on a pitch that fits into the machine's memory.

    Parameters
    ----------
    model : `SensorModel` of the sensor.
    field_width_m, field_height_m : size of the field on the sensor plane, m.
    """
    rows, columns = pixel_counts(
        field_width_m, field_height_m, model.pitch_um, model.rows, model.columns
    )
    size = rows * columns * float(PIXEL_BYTES + CAPTURE_BYTES * len(model.readings))
    pitch_um = 1.05 * model.pitch_um * np.sqrt(max(size / memory.machine_bytes(), 1.0))
    advice = f"type sensor.pitch_um={pitch_um:.2g} or more, or fewer sensor.rows and sensor.columns"
    return memory.Need(
        f"{rows} x {columns} pixels of {model.pitch_um:g} um, {len(model.readings)} captures",
        size,
        advice,
    )


def window_m(pitch_um: float, rows: int, columns: int) -> tuple[float, float] | None:
    """Return (width, height), m, of the part of the image plane that the pixels cover. It is inf
    along an axis that the pixels fill; None if they fill both.

    Parameters
    ----------
    pitch_um : pixel pitch, um.
    rows, columns : pixels along both axes; 0 fills the field.
    """
    return (
        tuple(n * pitch_um * 1e-6 or np.inf for n in (columns, rows)) if rows or columns else None
    )


def _count(field_m: float, pitch: float, asked_count: int, name: str, direction: str) -> int:
    fits = int(np.floor(field_m / pitch * (1 + ROUNDING)))
    if fits < 1:
        raise ConfigError(
            f"one pixel of {pitch * 1e6:g} um is larger than the field, {field_m * 1e6:g} um"
            f" {direction}; type a smaller sensor.pitch_um or a longer lens.focal_length_mm"
        )
    if asked_count > fits:
        raise ConfigError(
            f"sensor.{name}={asked_count} at {pitch * 1e6:g} um is {asked_count * pitch * 1e3:.4g}"
            " mm"
            f" {direction}; the camera's field is {field_m * 1e3:.4g} mm, {fits} pixels; type"
            f" sensor.{name}={fits}, or 0 to fill the field"
        )
    return asked_count or fits


def check_tiles(light: xr.DataArray, grid: PixelGrid) -> None:
    """Refuse light that does not cover the pixels. State in the ledger if its tiles are coarser
    than the pixels.

    The detail inside a tile is not known. Its amplitude is estimated by the mean change from tile
    to tile.
    """
    if min(light.sizes["x"], light.sizes["y"]) < 2:
        raise UnitError(
            f"irradiance has {light.sizes['y']} x {light.sizes['x']} tiles; expected at least 2 x"
            " 2, so that a tile has a size"
        )
    for name, centres in (("x", grid.x_m), ("y", grid.y_m)):
        tiles = light[name].values
        spare = (centres[-1] - centres[0] + grid.pitch_m) * ROUNDING + (
            tile_pitch(light, name) - grid.pitch_m
        ) / 2
        if tiles[0] > centres[0] + spare or tiles[-1] < centres[-1] - spare:
            raise UnitError(
                f"irradiance covers {name} only within {tiles[0]:.6g}..{tiles[-1]:.6g} m (tile"
                f" centres), the pixels lie within {centres[0]:.6g}..{centres[-1]:.6g} m; expected"
                " tiles over all of field_width and field_height"
            )
    tile = max(tile_pitch(light, "x"), tile_pitch(light, "y"))
    if tile > grid.pitch_m * (1 + ROUNDING):
        first = light.dims[-3]  # wavelength, or channel
        band = np.asarray(time_mean(light.isel({first: light.sizes[first] // 2})).values, float)
        step = max(np.abs(np.diff(band, axis=axis)).mean() for axis in (0, 1)) / max(
            band.mean(), np.finfo(float).tiny
        )
        ledger.error(
            step,
            "relative",
            "measured",
            f"mean change from tile to tile: tiles of {tile * 1e6:.3g} um hide the detail "
            f"inside {tile / grid.pitch_m:.3g} pixels of {grid.pitch_m * 1e6:.3g} um",
        )
