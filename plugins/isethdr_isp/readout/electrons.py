"""Electrons: from DN to electrons with their variance, and the light that corresponds to one
electron of a capture.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.data import camera_geometry
from isethdr_core.errors import UnitError, did_you_mean
from isethdr_core.physics.radiometry import photons_per_energy

from .fixed_pattern import DeviceSpread, device_spread
from .nonlinear_response import bent_response

if TYPE_CHECKING:
    import xarray as xr

PER_CAPTURE = (
    "exposure_s",
    "gain_dn_per_e",
    "black_dn",
    "top_dn",
    "read_noise_e",
    "dark_e",
    "quantisation_e",
    "area_m2",
    "charge",
)
# margin below the top, in standard deviations of read noise, in which charge may be clipped
MARGIN = 5.0
# smallest estimated variance as a share of the read variance; a variance estimated from one pixel
# must be above 0
VARIANCE_FLOOR = 0.1


@dataclass(frozen=True, eq=False)
class Readout:
    """One capture in electrons of charge, dark charge included. Read noise can make it negative."""

    charge_e: np.ndarray  # (y, x)
    saturated: np.ndarray  # (y, x) bool
    # variance of read noise and quantisation; (y, x) if the steps of the code depend on the light
    # or the pixel is nonlinear
    read_var_e2: float
    dark_e: float  # mean dark charge
    top_e: float  # largest charge still measured
    clear_top_e: float  # the same minus a margin in which charge may be clipped
    sensitivity: np.ndarray  # (channel,) electrons per cd/m2 of the white on the axis
    response: np.ndarray  # (channel, wavelength) electrons per band mean radiance on the axis
    capture: int = 0  # number of this capture in the shot
    # differences between devices of the same model
    spread: DeviceSpread = field(default_factory=DeviceSpread)

    def of_rows(self, rows: slice) -> Readout:
        """Return the readout of some rows of the sensor."""
        gain = self.spread.offset_gain
        return replace(
            self,
            charge_e=self.charge_e[rows],
            saturated=self.saturated[rows],
            read_var_e2=self.read_var_e2[rows] if np.ndim(self.read_var_e2) else self.read_var_e2,
            spread=replace(self.spread, offset_gain=gain[rows] if np.ndim(gain) else gain),
        )

    def variance_e2(self) -> np.ndarray:
        """Return the variance (y, x) estimated from each pixel's own charge: charge + read
        variance.
        """
        return charge_variance(self.charge_e, self.read_var_e2)


def charge_variance(charge_e: np.ndarray, read_var_e2: float | np.ndarray) -> np.ndarray:
    """Return the estimated variance, e^2, of one reading of a Poisson charge. It is limited to
    positive values, because noise may make `charge_e` negative.

    Parameters
    ----------
    charge_e : (y, x) reading, electrons.
    read_var_e2 : variance of the reading without shot noise, e^2.
    """
    return np.maximum(charge_e + read_var_e2, VARIANCE_FLOOR * read_var_e2)


def readouts(captures: xr.Dataset, white_radiance: np.ndarray) -> list[Readout]:
    """Return every capture in electrons, in the captures' order.

    Parameters
    ----------
    captures : captures Dataset.
    white_radiance : (wavelength,) spectral radiance of a white of 1 cd/m2 on the captures'
        wavelengths.

    Notes
    -----
    If the captures have a response table (`response_dn`), the electrons are those that arrived at
    the pixel, and a pixel is saturated only at the end of the table.
    """
    per_photon = captures["quantum_efficiency"].values.astype(float)
    wavelength = captures.wavelength.values
    photons = photons_per_energy(wavelength)
    reads = []
    for i in range(captures.sizes["capture"]):
        c = {name: float(captures[name].values[i]) for name in PER_CAPTURE}
        response = (
            per_photon[i]
            * photons
            * c["exposure_s"]
            * c["area_m2"]
            * float(captures.attrs["throughput_sr"])
        )
        linear, steps, top_steps = decompanded(captures, i)
        read_var = c["read_noise_e"] ** 2
        step_var = c["quantisation_e"] ** 2 / 12
        top = (c["top_dn"] - c["black_dn"]) / c["gain_dn_per_e"]
        margin = MARGIN * np.sqrt(read_var + step_var * top_steps**2)
        bent = bent_response(captures, i)
        if bent is None:
            charge = (linear - c["black_dn"]) / c["gain_dn_per_e"]
            saturated = np.asarray(captures["saturated"].values[i], bool)
            noise = read_var + step_var * steps**2
            clear_top = top - margin
            offset_gain = 1.0
        else:
            charge = bent.electrons_at(linear)
            saturated = linear >= bent.dn[-1]
            noise = bent.read_variance_e2(linear)
            top = bent.electrons[-1]
            clear_top = float(bent.electrons_at(bent.dn[-1] - margin * c["gain_dn_per_e"]))
            offset_gain = c["gain_dn_per_e"] * bent.electrons_per_dn(linear)
        reads.append(
            Readout(
                charge_e=charge,
                saturated=saturated,
                read_var_e2=noise,
                dark_e=c["dark_e"],
                top_e=top,
                clear_top_e=clear_top,
                sensitivity=response @ white_radiance,
                response=response,
                capture=i,
                spread=device_spread(captures, i, offset_gain),
            )
        )
    return reads


def decompanded(captures: xr.Dataset, i: int) -> tuple[np.ndarray, float | np.ndarray, float]:
    """Return the linear DN (y, x) of capture `i`, and the linear DN per code at each pixel (y, x)
    and at the top. The latter two are 1 without companding.
    """
    return linear_dn(captures, i, captures["raw"].values[i].astype(float))


def linear_dn(
    captures: xr.Dataset, i: int, raw: np.ndarray
) -> tuple[np.ndarray, float | np.ndarray, float]:
    """Return the linear DN of codes `raw` of capture `i`, and the linear DN per code at these codes
    and at the top. The latter two are 1 without companding.

    The sensor's table from `companding_dn` to `companding_linear_dn` is interpolated linearly;
    entries of NaN, which pad it, are left out. Black level, gain, top and quantisation of captures
    refer to linear DN.

    Parameters
    ----------
    captures : captures Dataset.
    i : number of the capture.
    raw : codes of that capture, any shape, DN.
    """
    if "companding_dn" not in captures:
        return raw, 1.0, 1.0
    code, linear = (
        captures[name].values[i].astype(float) for name in ("companding_dn", "companding_linear_dn")
    )
    finite = np.isfinite(code) & np.isfinite(linear)
    code = code[finite]
    linear = linear[finite]
    slope = np.diff(linear) / np.diff(code)
    segment = np.clip(np.searchsorted(code, raw, side="right") - 1, 0, len(slope) - 1)
    return (
        linear[segment] + (raw - code[segment]) * slope[segment],
        slope[segment],
        float(slope[-1]),
    )


def falloff(captures: xr.Dataset) -> np.ndarray:
    """Return the relative illumination (y, x) that the lens states for these pixels, 1 on the
    axis.
    """
    f_m = captures.attrs["focal_length_mm"] * 1e-3
    return camera_geometry.relative_illumination(
        captures.attrs, captures.x.values[None, :] / f_m, captures.y.values[:, None] / f_m
    )


def chosen(captures: xr.Dataset, name: str) -> xr.Dataset:
    """Return the captures Dataset with only the capture called `name`, or with the first one if the
    name is empty.
    """
    names = [str(c) for c in captures["capture"].values]
    if name and name not in names:
        raise UnitError(
            f"capture {name!r} is not in this shot{did_you_mean(name, names)}; set isp.capture"
        )
    return captures.isel(capture=[names.index(name) if name else 0])
