"""Response: the request of a sensor for photocurrent, and the conversion of irradiance or
photocurrent to electrons.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import quantities
from isethdr_core.demand import Demand, Response
from isethdr_core.errors import UnitError

from ..charge import crosstalk
from ..readout import converter
from ..sampling import area_integration
from ..sensor_model import SensorModel
from .colour_filter_array import channels
from .quantum_efficiency import quantum_efficiency

if TYPE_CHECKING:
    import xarray as xr

CLOSE = 1e-12  # relative tolerance between two computations of one quantum efficiency


def ask(
    model: SensorModel, demand: Demand, longest_s: float, quietest: SensorModel | None = None
) -> Demand:
    """Return the demand with the response of a sensor that exposes for at most `longest_s`. For a
    sensor without noise, return the demand unchanged.

    Without noise no error of the light is negligible, so the sensor needs light at each wavelength
    instead of photocurrent.

    Parameters
    ----------
    model : `SensorModel` of the sensor.
    demand : demand of the later stages.
    longest_s : longest exposure, s.
    quietest : model at the gain with the least read noise; None: `model`.
    """
    if not model.noise:
        return demand
    area_s = max(
        model.pitch_um**2 * 1e-12 * d.fill_factor * d.exposure_share * longest_s
        for d in model.photodiodes
    )
    names = [
        letter + mark
        for mark in ("", " astray")[: 1 + bool(model.optical_crosstalk_percent)]
        for letter in channels(model.cfa)
    ]
    return replace(
        demand,
        response=Response(
            tuple(names),
            partial(_efficiency, model),
            area_s,
            min(r.read_noise_e for r in (quietest or model).readings),
            max(full_scale_e(model)),
            window_m=demand.window_m,
            pixel_m=1e-6 * model.pitch_um,
        ),
    )


def full_scale_e(model: SensorModel) -> list[float]:
    """Return the electrons of every reading at which it stops measuring light."""
    return [
        (converter.top_dn(r, model.diode_of(r)) - r.black_dn) / r.gain_dn_per_e
        for r in model.readings
    ]


def _efficiency(model: SensorModel, wavelength_nm: np.ndarray) -> np.ndarray:
    """Return (channel, wavelength) electrons per photon. The channels of each of `crosstalk.parts`
    follow each other.
    """
    return np.concatenate(
        crosstalk.parts(quantum_efficiency(model, wavelength_nm), model, wavelength_nm)
    )


def check_light(light: xr.DataArray) -> None:
    """Raise UnitError unless `light` is irradiance or photocurrent on the sensor plane."""
    photocurrent = light.attrs.get("units") == quantities.PHOTOCURRENT
    (quantities.check_photocurrent if photocurrent else quantities.check_irradiance)(light)


def channel_planes(model: SensorModel, light: xr.DataArray, qe: np.ndarray) -> list[np.ndarray]:
    """Return for each of `crosstalk.parts` the electrons per m2 and second (channel, y, x) on the
    tiles of the light.

    Parameters
    ----------
    model : `SensorModel` with crosstalk and quantum efficiency.
    light : irradiance (wavelength, y, x), W m-2 nm-1, or photocurrent (channel, y, x), electrons
        m-2 s-1.
    qe : quantum efficiency (channel, wavelength) at the light's bands, electrons per photon.
    """
    wavelength_nm = quantities.bands_nm(light)
    if light.attrs["units"] != quantities.PHOTOCURRENT:
        return [
            area_integration.electrons_per_m2_s(light.values, wavelength_nm, part)
            for part in crosstalk.parts(qe, model, wavelength_nm)
        ]
    efficiency = _efficiency(model, wavelength_nm)
    efficiency_of_light = np.asarray(light.attrs["efficiency"])
    # the photocurrent may also have rows for other sensors
    difference = np.abs(efficiency[:, None] - efficiency_of_light).max(2)
    row = difference.argmin(1)
    if np.any(difference[np.arange(len(efficiency)), row] > CLOSE * efficiency.max()):
        raise UnitError(
            "the photocurrent was made for another sensor: its quantum efficiencies differ; call"
            " lens.photocurrent with the response that this sensor puts into the demand, or"
            " lens(...) for irradiance"
        )
    return np.split(light.values[row], len(efficiency) // len(qe))
