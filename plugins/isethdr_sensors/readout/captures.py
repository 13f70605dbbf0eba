"""Captures: the Dataset that leaves the sensor, with all that an image signal processor needs to
read it back.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import hypot
from typing import TYPE_CHECKING, Any, NamedTuple

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
    from ..sensor_model import Reading, SensorModel

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
    readings = model.readings
    diodes = [model.diode_of(r) for r in model.readings]
    dark = [
        dark_electrons(d.dark_e_per_s, model.exposure_of(d), model.temperature_c) for d in diodes
    ]

    silicon = sorted({d.silicon or d.name for d in model.photodiodes})
    offsets = {
        "dsnu_e": [r.dsnu_e for r in readings],
        "column_e": [r.column_e for r in readings],
        "row_e": [r.row_e for r in readings],
    }

    def per_capture(
        values: Iterator[Any] | list[float], units: str, dtype: type = float
    ) -> tuple[str, np.ndarray, dict[str, str]]:
        return "capture", np.array(list(values), dtype), {"units": units}

    dataset = xr.Dataset(
        {
            "raw": (("capture", "y", "x"), mosaic.raw, {"units": "DN"}),
            "saturated": (("capture", "y", "x"), mosaic.saturated),
            "filter": (("y", "x"), mosaic.filters),
            "exposure_s": per_capture((model.exposure_of(d) for d in diodes), "s"),
            "gain_dn_per_e": per_capture((r.gain_dn_per_e for r in readings), "DN/e"),
            "black_dn": per_capture((r.black_dn for r in readings), "DN"),
            "top_dn": per_capture(
                (converter.top_dn(r, d) for r, d in zip(readings, diodes, strict=True)), "DN"
            ),
            "read_noise_e": per_capture(
                (
                    hypot(
                        r.read_noise_e,
                        r.row_noise_e,
                        telegraph_noise.rms_e(r.telegraph_e, r.telegraph_percent),
                    )
                    * model.noise
                    for r in readings
                ),
                "e",
            ),
            "dark_e": per_capture(dark, "e"),
            "quantisation_e": per_capture((converter.quantisation_e(r) for r in readings), "e"),
            "area_m2": per_capture((grid.pitch_m**2 * d.fill_factor for d in diodes), "m2"),
            "charge": per_capture((r.diode for r in readings), "1", int),
            "silicon": per_capture((silicon.index(d.silicon or d.name) for d in diodes), "1", int),
            "prnu": per_capture((d.prnu * model.noise for d in diodes), "1"),
            "dark_spread_e": per_capture(
                (e * d.dark_spread * model.noise for e, d in zip(dark, diodes, strict=True)), "e"
            ),
            **{
                name: per_capture((value * model.noise for value in values), "e")
                for name, values in offsets.items()
            },
            "quantum_efficiency": (
                ("capture", "channel", "wavelength"),
                np.repeat(mosaic.qe[None], len(readings), 0),
                {"units": "e/photon"},
            ),
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
    if any(r.companding for r in readings):
        for name, values in zip(
            ("companding_linear_dn", "companding_dn"), _tables(readings), strict=True
        ):
            dataset[name] = ("capture", "entry"), values, {"units": "DN"}
    dataset.wavelength.attrs["units"] = "nm"
    for axis in ("x", "y"):
        dataset[axis].attrs["units"] = "m"
    return dataset


def with_response(
    captures: xr.Dataset, table: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> xr.Dataset:
    """Return captures of one reading with its response table: linear DN, electrons, variance."""
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
