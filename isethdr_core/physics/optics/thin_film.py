"""Thin films: reflectance and transmittance of a stack of layers between two media, at any angle
and wavelength.

Angles are given by the cosine of incidence in the first medium. Indices may be complex, n - ik with
k >= 0 for absorption. Without layers the result is that of Fresnel's equations.
"""

from __future__ import annotations

from typing import Any

import numpy as np

# Largest absorption of one layer, nepers. A thicker layer has the same reflectance, and transmits
# less than 1e-260; its characteristic matrix would overflow.
OPAQUE = 300.0
LARGE = 1e100  # fields above this value are divided by their own size, against overflow


def reflect(
    n_in: float | np.ndarray,
    n_out: float | np.ndarray,
    layers: list[Any],
    cos_in: float | np.ndarray,
    wavelength_nm: float | np.ndarray,
) -> tuple[float | np.ndarray, float | np.ndarray, float | np.ndarray, float | np.ndarray]:
    """Return reflectance and transmittance of a stack, for both polarisations.

    Parameters
    ----------
    n_in, n_out : refractive index of the medium of incidence (real), and of the medium behind the
        stack.
    layers : [(index, thickness_nm), ...] from the side of incidence; empty for a bare surface.
    cos_in : cosine of the angle of incidence, 0 to 1.
    wavelength_nm : wavelength in vacuum, nm. All arguments broadcast against each other.

    Returns
    -------
    R_s, R_p, T_s, T_p : fractions of the power per area of the surface; R + T = 1 without
        absorption, T = 0 beyond the critical angle.

    References
    ----------
    F. Abeles, Ann. Phys. 5, 596 (1950); H. A. Macleod, Thin-Film Optical Filters, chapter 2,
    characteristic matrix and equation for R and T of an assembly (time dependence exp(+i w t),
    index n - ik).
    """
    cos_in = np.asarray(cos_in, float)
    if np.any(cos_in < 0) or np.any(cos_in > 1 + 1e-12):
        raise ValueError(
            "the cosine of incidence is outside 0 to 1; give the angle to the normal on the side"
            " light comes from"
        )
    if any(np.any(np.asarray(thickness) < 0) for _, thickness in layers):
        raise ValueError("a layer has a negative thickness; expected nm, 0 or more")
    # exactly grazing light has no defined admittance; close to grazing, all light is reflected
    cos_in = np.clip(cos_in, 1e-12, 1.0)
    transverse = n_in * np.sqrt(1 - cos_in**2)
    behind = _normal_part(n_out, transverse)
    inside = [(index, _normal_part(index, transverse), thickness) for index, thickness in layers]
    phases = [
        _bounded(2 * np.pi / wavelength_nm * normal * thickness) for _, normal, thickness in inside
    ]
    r_s, t_s = _assembly(
        n_in * cos_in,
        [(normal, phase) for (_, normal, _), phase in zip(inside, phases)],
        np.asarray(behind, complex),
    )
    r_p, t_p = _assembly(
        n_in / cos_in,
        [
            (_admittance_p(index, normal), phase)
            for (index, normal, _), phase in zip(inside, phases)
        ],
        _admittance_p(n_out, behind),
    )
    return r_s, r_p, t_s, t_p


def reflect_unpolarised(
    n_in: float | np.ndarray,
    n_out: float | np.ndarray,
    layers: list[Any],
    cos_in: np.ndarray,
    wavelength_nm: float | np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return reflectance and transmittance (R, T) of a stack for unpolarised light.

    Parameters
    ----------
    n_in, n_out : refractive index of the medium of incidence (real), and of the medium behind the
        stack.
    layers : [(index, thickness_nm), ...] from the side of incidence; empty for a bare surface.
    cos_in : cosine of the angle of incidence, 0 to 1.
    wavelength_nm : wavelength in vacuum, nm.
    """
    r_s, r_p, t_s, t_p = reflect(n_in, n_out, layers, cos_in, wavelength_nm)
    return (r_s + r_p) / 2, (t_s + t_p) / 2


def quarter_wave_nm(index: float, wavelength_nm: float, quarters: float = 1.0) -> float:
    """Return the thickness, nm, of a layer with an optical thickness of `quarters` quarter waves at
    normal incidence.

    Parameters
    ----------
    index : refractive index of the layer; only the real part counts.
    wavelength_nm : wavelength in vacuum, nm.
    quarters : optical thickness, quarter waves.
    """
    return quarters * wavelength_nm / (4 * np.real(index))


def _normal_part(index: float | np.ndarray, transverse: float | np.ndarray) -> np.ndarray:
    """Return n cos(angle) inside a medium, on the branch that decays along +z. It is never 0,
    because 0 has no admittance.
    """
    part = np.sqrt(np.asarray(index, complex) ** 2 - transverse**2 + 0j)
    part = np.where(part.imag > 0, -part, part)
    return np.where(part == 0, 1e-12, part)


def _bounded(phase: np.ndarray) -> np.ndarray:
    """Return the phase thickness of a layer, rad, with an absorption of at most `OPAQUE`."""
    return np.real(phase) + 1j * np.maximum(np.imag(phase), -OPAQUE)


def _admittance_p(index: float | np.ndarray, normal: np.ndarray) -> complex | np.ndarray:
    """Return the admittance of light polarised in the plane of incidence (p). For the other
    polarisation (s), it is `normal` itself.
    """
    return np.asarray(index, complex) ** 2 / normal


def _assembly(
    first: float | np.ndarray, layers: list[Any], last: complex | np.ndarray
) -> tuple[float | np.ndarray, float | np.ndarray]:
    """Return (R, T) of layers between two media, by their characteristic matrices.

    Parameters
    ----------
    first, last : admittances of the media in front and behind.
    layers : [(admittance, phase thickness in radians), ...] in the order in which light meets them.
    """
    electric = np.ones_like(last)
    magnetic = last
    passed = 1.0  # transmitted field, in the unit of `electric`
    for own, phase in reversed(layers):
        cosine = np.cos(phase)
        sine = 1j * np.sin(phase)
        electric, magnetic = (
            cosine * electric + sine / own * magnetic,
            sine * own * electric + cosine * magnetic,
        )
        size = np.maximum(np.abs(electric), np.abs(magnetic))
        unit = np.where(size > LARGE, size, 1.0)
        electric = electric / unit
        magnetic = magnetic / unit
        passed = passed / unit
    total = first * electric + magnetic
    return (
        np.abs((first * electric - magnetic) / total) ** 2,
        4 * first * last.real / np.abs(total) ** 2 * passed**2,
    )
