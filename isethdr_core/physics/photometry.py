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
FINE_NM = 10.0  # largest distance of equal bands that count with the value at their centre
UNEQUAL = 1e-3  # largest difference of equal distances, as a share; those of float32 differ less


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
    """Return the weights (3, wavelength) that give X, Y, Z from band means (per nm).

    A band that has neighbours at equal distances of at most `FINE_NM` counts with 683 lm/W x value
    of the colour matching function at its centre x band width, the usual rule. With bands of 10 nm
    from 380 to 780 nm, it gives white the same Y as the integral within 2e-5, and Z within 1e-3.
    Other bands count with 683 lm/W x integral of the function over the band, because that rule was
    4 and 22 % off in two examples: light is uniform over each band, as for sensors. A single band
    has the value at its centre, and a width of 1 nm.

    The weight of a band depends on its neighbours only, so it stays if farther bands are dropped.

    Raises
    ------
    ValueError : the wavelengths do not increase.
    """
    nm = np.asarray(wavelength_nm, float)
    widths = band_widths_nm(nm)
    at_centres = xyz_bar(nm) * widths
    if nm.size < 2:
        return LM_PER_W * at_centres
    steps = np.diff(nm)
    before = np.concatenate([steps[:1], steps])
    after = np.concatenate([steps, steps[-1:]])
    widest = np.maximum(before, after)
    fine = (np.abs(after - before) <= UNEQUAL * widest) & (widest <= FINE_NM * (1 + UNEQUAL))
    # borders of bands lie half way between the centres, those at the ends symmetric to the centre
    inner = (nm[1:] + nm[:-1]) / 2
    borders = np.concatenate([[nm[0] - widths[0] / 2], inner, [nm[-1] + widths[-1] / 2]])
    return LM_PER_W * np.where(fine, at_centres, np.diff(_integral_to(borders)))


def _integral_to(wavelength_nm: np.ndarray) -> np.ndarray:
    """Return the integrals (3, wavelength) of the colour matching functions up to `wavelength_nm`,
    nm. They are exact for the functions that `xyz_bar` interpolates.
    """
    table = _table()
    nodes = table[:, 0]
    nm = np.clip(wavelength_nm, nodes[0], nodes[-1])
    before = np.clip(np.searchsorted(nodes, nm, side="right") - 1, 0, len(nodes) - 2)
    whole_cells = np.diff(nodes) * (table[1:, 1:] + table[:-1, 1:]).T / 2
    to_node = np.concatenate([np.zeros((3, 1)), np.cumsum(whole_cells, axis=1)], axis=1)
    rest = (nm - nodes[before]) * (table[before, 1:].T + xyz_bar(nm)) / 2
    return to_node[:, before] + rest


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
