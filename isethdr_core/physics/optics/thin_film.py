"""Thin films: reflectance and transmittance of a stack of layers between two media, at any angle
and wavelength.

Angles are given by the cosine of incidence in the first medium. Indices may be complex, n - ik with
k >= 0 for absorption. Without layers the result is that of Fresnel's equations.
"""

from __future__ import annotations

import numpy as np


def reflect(n_in, n_out, layers, cos_in, wavelength_nm):
    """Return reflectance and transmittance of a stack, for both polarisations.

    Parameters
    ----------
    n_in, n_out : refractive index of the medium of incidence (real), and of the medium behind the
        stack.
    layers : [(index, thickness_nm), ...] from the side of incidence; empty for a bare surface.
    cos_in : cosine of the angle of incidence, 0 to 1.
    wavelength_nm : in vacuum. All arguments broadcast.

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
    # exactly grazing light has no defined admittance; all of it is reflected
    cos_in = np.clip(cos_in, 1e-12, 1.0)
    transverse = n_in * np.sqrt(1 - cos_in**2)
    behind = _normal_part(n_out, transverse)
    inside = [(index, _normal_part(index, transverse), thickness) for index, thickness in layers]
    reflectances = [
        _of_polarisation(n_in, n_out, cos_in, behind, inside, wavelength_nm, p)
        for p in (False, True)
    ]
    return reflectances[0][0], reflectances[1][0], reflectances[0][1], reflectances[1][1]


def reflect_unpolarised(n_in, n_out, layers, cos_in, wavelength_nm):
    """Return (R, T) of unpolarised light; arguments as `reflect`."""
    r_s, r_p, t_s, t_p = reflect(n_in, n_out, layers, cos_in, wavelength_nm)
    return (r_s + r_p) / 2, (t_s + t_p) / 2


def quarter_wave_nm(index, wavelength_nm: float, quarters: float = 1.0):
    """Return the thickness of a layer `quarters` quarter waves thick at normal incidence, nm."""
    return quarters * wavelength_nm / (4 * np.real(index))


def _normal_part(index, transverse):
    """Return n cos(angle) inside a medium, on the branch that decays along +z."""
    part = np.sqrt(np.asarray(index, complex) ** 2 - transverse**2 + 0j)
    return np.where(part.imag > 0, -part, part)


def _of_polarisation(n_in, n_out, cos_in, behind, inside, wavelength_nm, p):
    def admittance(index, normal):
        return np.asarray(index, complex) ** 2 / normal if p else normal

    first = n_in / cos_in if p else n_in * cos_in
    last = admittance(n_out, np.where(behind == 0, 1e-12, behind))
    electric = np.ones_like(last)
    magnetic = last
    for index, normal, thickness in reversed(inside):
        normal = np.where(normal == 0, 1e-12, normal)
        phase = 2 * np.pi / wavelength_nm * normal * thickness
        own = admittance(index, normal)
        cosine = np.cos(phase)
        sine = 1j * np.sin(phase)
        electric, magnetic = (
            cosine * electric + sine / own * magnetic,
            sine * own * electric + cosine * magnetic,
        )
    total = first * electric + magnetic
    return (
        np.abs((first * electric - magnetic) / total) ** 2,
        4 * first * last.real / np.abs(total) ** 2,
    )
