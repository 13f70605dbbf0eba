"""Captures: the Dataset that leaves the sensor, with all that an image signal processor needs to
convert it to electrons.
"""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr

from isethdr_core.data import camera_geometry
from isethdr_core.quantities import bands_nm, names

from ..noise import telegraph_noise
from ..noise.dark_current import dark_electrons
from ..spectral.colour_filter_array import channels
from . import companding, converter

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..sampling.pixel_grid import PixelGrid
    from ..sensor_model import Photodiode, Reading, SensorModel

PerCapture = tuple[str, np.ndarray, dict[str, str]]  # a variable: dimension, values, attributes
# attributes of light that captures take over
FROM_LIGHT = ("f_number", "focal_length_mm", "throughput_sr", *camera_geometry.CARRIED)


class Mosaic(NamedTuple):
    """The readings of all pixels of one shot, and their filters."""

    raw: np.ndarray  # (capture, y, x) DN
    saturated: np.ndarray  # (capture, y, x) bool
    filters: np.ndarray  # (y, x) uint8 index of each pixel's channel
    qe: np.ndarray  # (channel, wavelength) electrons per photon, the same for all captures


def captures(
    model: SensorModel, light: xr.DataArray, grid: PixelGrid, mosaic: Mosaic
) -> xr.Dataset:
    """Return the captures Dataset of docs/reference/contracts.md.

    Parameters
    ----------
    model : photodiodes and readings of the sensor.
    light : irradiance on the sensor plane.
    grid : centres of the pixels and their pitch.
    mosaic : readings of the pixels.
    """
    dataset = xr.Dataset(
        {
            "raw": (("capture", "y", "x"), mosaic.raw, {"units": "DN"}),
            "saturated": (("capture", "y", "x"), mosaic.saturated),
            "filter": (("y", "x"), mosaic.filters),
            "quantum_efficiency": (
                ("capture", "channel", "wavelength"),
                np.repeat(mosaic.qe[None], len(model.readings), 0),
                {"units": "e/photon"},
            ),
            **_codes(model),
            **_exposures(model, grid),
            **_noise(model),
        },
        coords={
            **_grid(model, grid),
            "channel": names(channels(model.cfa)),
            "wavelength": bands_nm(light),
        },
        attrs={
            "pitch_um": model.pitch_um,
            "cfa": model.cfa,
            **{k: light.attrs[k] for k in FROM_LIGHT if k in light.attrs},
        },
    )
    if any(r.companding for r in model.readings):
        linear, companded = _tables(model.readings)
        for name, values in (("companding_linear_dn", linear), ("companding_dn", companded)):
            dataset[name] = ("capture", "entry"), values, {"units": "DN"}
    dataset.wavelength.attrs["units"] = "nm"
    for axis in ("x", "y"):
        dataset[axis].attrs["units"] = "m"
    return dataset


def _codes(model: SensorModel) -> dict[str, PerCapture]:
    """Return the variables that convert the DN of each capture to electrons."""
    readings = model.readings
    tops = [converter.top_dn(reading, model.diode_of(reading)) for reading in readings]
    return {
        "gain_dn_per_e": _per_capture([r.gain_dn_per_e for r in readings], "DN/e"),
        "black_dn": _per_capture([r.black_dn for r in readings], "DN"),
        "top_dn": _per_capture(tops, "DN"),
        "quantisation_e": _per_capture([converter.quantisation_e(r) for r in readings], "e"),
    }


def _exposures(model: SensorModel, grid: PixelGrid) -> dict[str, PerCapture]:
    """Return exposure, photodiode area, and numbers of charge and silicon of each capture.

    Parameters
    ----------
    model : photodiodes and readings of the sensor.
    grid : pitch of the pixels.
    """
    diodes = [model.diode_of(reading) for reading in model.readings]
    silicon = sorted({_silicon(diode) for diode in model.photodiodes})
    areas_m2 = [grid.pitch_m**2 * diode.fill_factor for diode in diodes]
    return {
        "exposure_s": _per_capture([model.exposure_of(diode) for diode in diodes], "s"),
        "area_m2": _per_capture(areas_m2, "m2"),
        "charge": _per_capture([r.diode for r in model.readings], "1", int),
        "silicon": _per_capture([silicon.index(_silicon(diode)) for diode in diodes], "1", int),
    }


def _silicon(diode: Photodiode) -> str:
    """Return the key of the persistent maps of a photodiode."""
    return diode.silicon or diode.name


def _noise(model: SensorModel) -> dict[str, PerCapture]:
    """Return dark charge and noise of each capture. For a model without noise, the noise is 0 and
    the mean dark charge remains.
    """
    readings = model.readings
    diodes = [model.diode_of(reading) for reading in readings]
    dark_e = [
        dark_electrons(d.dark_e_per_s, model.exposure_of(d), model.temperature_c) for d in diodes
    ]
    dark_spread_e = [e * d.dark_spread for e, d in zip(dark_e, diodes, strict=True)]
    rms = {
        "read_noise_e": ([_read_noise_e(reading) for reading in readings], "e"),
        "prnu": ([diode.prnu for diode in diodes], "1"),
        "dark_spread_e": (dark_spread_e, "e"),
        "dsnu_e": ([reading.dsnu_e for reading in readings], "e"),
        "column_e": ([reading.column_e for reading in readings], "e"),
        "row_e": ([reading.row_e for reading in readings], "e"),
    }
    noise = {
        name: _per_capture([value * model.noise for value in values], units)
        for name, (values, units) in rms.items()
    }
    return {"dark_e": _per_capture(dark_e, "e"), **noise}


def _read_noise_e(reading: Reading) -> float:
    """Return the rms, electrons, of the noise that is new in each reading of a pixel."""
    telegraph_e = telegraph_noise.rms_e(reading.telegraph_e, reading.telegraph_percent)
    return hypot(reading.read_noise_e, reading.row_noise_e, telegraph_e)


def _per_capture(values: Sequence[float], units: str, dtype: type = float) -> PerCapture:
    """Return a variable with one value for each capture.

    Parameters
    ----------
    values : one value for each capture.
    units : unit of the values.
    dtype : float or int.
    """
    return "capture", np.array(values, dtype), {"units": units}


def with_response(
    captures: xr.Dataset, table: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> xr.Dataset:
    """Return captures of one reading with its response table: linear DN, electrons, variance in
    e^2.
    """
    names = ("response_dn", "response_e", "response_variance_e2")
    for name, values, units in zip(names, table, ("DN", "e", "e2"), strict=True):
        captures[name] = ("capture", "response_entry"), values[None], {"units": units}
    return captures


def electrons(model: SensorModel, grid: PixelGrid, values: np.ndarray) -> xr.DataArray:
    """Return (capture, y, x) electrons on the pixel grid.

    Parameters
    ----------
    model : `SensorModel`, for the names of the captures.
    grid : `PixelGrid` of the pixels.
    values : electrons (capture, y, x).
    """
    return xr.DataArray(
        values, dims=("capture", "y", "x"), coords=_grid(model, grid), attrs={"units": "e"}
    )


def _tables(readings: Sequence[Reading]) -> np.ndarray:
    """Return linear and companded DN (capture, entry) of all readings; short tables end in NaN."""
    knees = [
        companding.table(r.companding or ((converter.top_code(r),) * 2,), converter.top_code(r))
        for r in readings
    ]
    longest = max(len(linear) for linear, _ in knees)
    return np.moveaxis(
        [
            [np.pad(values, (0, longest - len(values)), constant_values=np.nan) for values in pair]
            for pair in knees
        ],
        1,
        0,
    )


def _grid(model: SensorModel, grid: PixelGrid) -> dict[str, np.ndarray]:
    return {"capture": names(r.capture for r in model.readings), "y": grid.y_m, "x": grid.x_m}
