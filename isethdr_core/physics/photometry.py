"""Photometry: spectra in cd/m2, lux and CIE XYZ.

The colour matching functions are those of the CIE 1931 2 degree standard observer (CIE 015:2018).
They are interpolated linearly between the entries of the 5 nm table in the folder of this file; a
test compares the table with colour-science.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files

import numpy as np
import numpy.typing as npt

from .radiometry import band_widths_nm

# maximum luminous efficacy of the 1931 observer, lm/W (CIE 018:2019; 683.002 for the SI at 555 nm)
LM_PER_W = 683.0


@cache
def _table() -> np.ndarray:
    with files(__package__).joinpath("cie_1931_2deg.csv").open() as f:
        return np.loadtxt(f, delimiter=",", skiprows=1)


def xyz_bar(wavelength_nm: npt.ArrayLike) -> np.ndarray:
    """Return the colour matching functions (3, wavelength) at `wavelength_nm`; 0 outside 360-830
    nm.
    """
    t = _table()
    nm = np.asarray(wavelength_nm, float)
    return np.stack([np.interp(nm, t[:, 0], t[:, k], left=0.0, right=0.0) for k in (1, 2, 3)])


def v_lambda(wavelength_nm: npt.ArrayLike) -> np.ndarray:
    """Return the luminous efficiency V (y-bar of 1931) at `wavelength_nm`; 0 outside 360-830 nm."""
    return xyz_bar(wavelength_nm)[1]


def xyz_weights(wavelength_nm: npt.ArrayLike) -> np.ndarray:
    """Return the weights (3, wavelength) that give X, Y, Z from band means (per nm): 683 lm/W x
    colour matching function x band width.
    """
    return LM_PER_W * xyz_bar(wavelength_nm) * band_widths_nm(wavelength_nm)


def luminance(radiance: npt.ArrayLike, wavelength_nm: npt.ArrayLike, axis: int = 0) -> np.ndarray:
    """Return luminance in cd/m2 from spectral radiance, or illuminance in lux from spectral
    irradiance.

    Parameters
    ----------
    radiance : array of any shape with bands along `axis`, W m-2 sr-1 nm-1; W m-2 nm-1 for lux.
    wavelength_nm : (band,) band centres, nm.
    axis : axis of `radiance` with the bands.
    """
    w = xyz_weights(wavelength_nm)[1]
    return np.tensordot(w, np.asarray(radiance), axes=(0, axis))


def xyz(radiance: npt.ArrayLike, wavelength_nm: npt.ArrayLike, axis: int = 0) -> np.ndarray:
    """Return X, Y, Z, stacked on the last axis, of spectral radiance; Y is in cd/m2.

    Parameters
    ----------
    radiance : spectral radiance, any shape with bands along `axis`, W m-2 sr-1 nm-1.
    wavelength_nm : (band,) band centres, nm.
    axis : axis of `radiance` with the bands.
    """
    out = np.tensordot(xyz_weights(wavelength_nm), np.asarray(radiance), axes=(1, axis))
    return np.moveaxis(out, 0, -1)
