"""Radiometry: photons and joules, bands, and the irradiance of a lens from radiance."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.constants import c, h, k


def photon_energy_j(wavelength_nm: npt.ArrayLike) -> np.ndarray:
    """Return the energy of one photon, J, at `wavelength_nm`: h c / wavelength."""
    energy: np.ndarray = h * c / (np.asarray(wavelength_nm, float) * 1e-9)
    return energy


def photons_from_energy(
    energy: float | np.ndarray, wavelength_nm: npt.ArrayLike, axis: int = 0
) -> np.ndarray:
    """Return photons per second from W; or photons per second and unit from W per unit, for any
    unit.

    Parameters
    ----------
    energy : power, any shape with bands along `axis`, W or W per any unit.
    wavelength_nm : (band,) band centres, nm.
    axis : axis of `energy` with the bands.
    """
    return energy / _along(photon_energy_j(wavelength_nm), np.ndim(energy), axis)


def energy_from_photons(
    photons: float | np.ndarray, wavelength_nm: npt.ArrayLike, axis: int = 0
) -> np.ndarray:
    """Return W from photons per second; or W per unit from photons per second and unit, for any
    unit.

    Parameters
    ----------
    photons : photon rate, any shape with bands along `axis`, photons/s or photons/s per any unit.
    wavelength_nm : (band,) band centres, nm.
    axis : axis of `photons` with the bands.
    """
    return photons * _along(photon_energy_j(wavelength_nm), np.ndim(photons), axis)


def band_widths_nm(wavelength_nm: npt.ArrayLike) -> np.ndarray:
    """Return the width of each band, nm. Borders of bands lie half way between the centres.

    The outer bands are symmetric about their centres. A single band has a width of 1 nm by
    convention.

    Raises
    ------
    ValueError : the wavelengths do not increase, which would give widths of 0 or less.
    """
    w = np.asarray(wavelength_nm, float)
    if len(w) < 2:
        return np.ones(len(w))
    if not np.all(w[1:] > w[:-1]):
        raise ValueError(f"wavelengths are {w!s} nm; expected increasing centres of bands")
    inner = (w[1:] + w[:-1]) / 2
    return np.diff(np.concatenate([[2 * w[0] - inner[0]], inner, [2 * w[-1] - inner[-1]]]))


def photons_per_energy(wavelength_nm: npt.ArrayLike) -> np.ndarray:
    """Return the photons of each band per spectral energy, (band,): photons m-2 s-1 per W m-2
    nm-1.
    """
    return band_widths_nm(wavelength_nm) / photon_energy_j(wavelength_nm)


def irradiance_factor(f_number: float, magnification: float = 0.0) -> float:
    """Return irradiance / radiance on the axis, sr, in the tangent form pi / (1 + 4 N^2 (1 +
    |m|)^2).

    N is the f-number, m the magnification. This is ISETCam's rule
    (opticalimage/oiCalculateIrradiance.m): the projected solid angle of a cone with a half-angle of
    the tangent 1 / (2 N (1 + |m|)).
    """
    return np.pi / (1.0 + 4.0 * f_number**2 * (1.0 + abs(magnification)) ** 2)


def irradiance_factor_aplanatic(f_number: float, magnification: float = 0.0) -> float:
    """Return irradiance / radiance on the axis, sr, of an aplanatic lens: pi sin^2 = pi / (4 N^2 (1
    + |m|)^2).

    N is the f-number, m the magnification. The sine condition allows no f-number below 0.5; a
    smaller one raises ValueError.
    """
    if f_number < 0.5:
        raise ValueError(
            f"f-number {f_number:g} is below 0.5, the limit of an aplanatic lens; expected at"
            " least 0.5"
        )
    return np.pi / (4.0 * f_number**2 * (1.0 + abs(magnification)) ** 2)


def cos4_falloff(x_m: npt.ArrayLike, y_m: npt.ArrayLike, focal_length_m: float) -> np.ndarray:
    """Return the relative illumination cos^4 of the field angle; it is 1 on the axis.

    Parameters
    ----------
    x_m, y_m : sensor positions from the axis, m; any shapes that broadcast.
    focal_length_m : focal length, m.
    """
    return (1.0 + (np.square(x_m) + np.square(y_m)) / focal_length_m**2) ** -2.0


def planck_radiance(wavelength_nm: npt.ArrayLike, temperature_k: float) -> np.ndarray:
    """Return the spectral radiance of a black body, W m-2 sr-1 nm-1 (Planck 1901)."""
    wl = np.asarray(wavelength_nm, float) * 1e-9
    return 2 * h * c**2 / wl**5 / np.expm1(h * c / (wl * k * temperature_k)) * 1e-9


def _along(values: np.ndarray, ndim: int, axis: int) -> np.ndarray:
    shape = [1] * ndim
    if ndim:
        shape[axis] = -1
        return np.reshape(values, shape)
    return values
