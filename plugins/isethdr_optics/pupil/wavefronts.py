"""Wavefront of a lens at a wavelength, as Zernike coefficients, and its steepness. It is the sum of
the lens's own terms, terms that depend on the wavelength, and a shift of focus.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics.zernike import Slopes, slopes_um

if TYPE_CHECKING:
    from ..abilities import PupilOptics


def coefficients_um(lens: PupilOptics, wavelength_nm: float) -> dict[int, float]:
    """Return the lens's wavefront at one wavelength: {OSA index: micrometres rms}.

    A focus that lies dz beyond the sensor is a wavefront of dz rho^2 / (8 N^2), N the working
    f-number (Goodman 2005, eq. 6-35, parabolic): of OSA 4, dz / (16 sqrt(3) N^2).
    """
    out = dict(lens.zernike_um or {})
    for j, value in lens.colour_um(wavelength_nm).items():
        out[j] = out.get(j, 0.0) + value
    if lens.focal_shift_um:
        f_number = lens.f_number * (1 + lens.magnification)
        out[4] = out.get(4, 0.0) + _focal_shift_um(lens, wavelength_nm) / (
            16 * np.sqrt(3) * f_number**2
        )
    return out


def _focal_shift_um(lens: PupilOptics, wavelength_nm: float) -> float:
    table = {float(w): s for w, s in lens.focal_shift_um.items()}
    wavelengths_nm = sorted(table)
    if not wavelengths_nm[0] <= wavelength_nm <= wavelengths_nm[-1]:
        raise ConfigError(
            f"lens.focal_shift_um is known from {wavelengths_nm[0]:g} to"
            f" {wavelengths_nm[-1]:g} nm; expected"
            f" {wavelength_nm:g} nm within it, the border of a band; add that wavelength to the"
            " table"
        )
    return float(np.interp(wavelength_nm, wavelengths_nm, [table[w] for w in wavelengths_nm]))


def steepest_um(lens: PupilOptics, wavelength_nm: float) -> float:
    """Return the largest gradient of the lens's wavefront, micrometres per radius of the stop that
    the f-number says.
    """
    return float(slopes(lens, wavelength_nm).largest.max())


def slopes(lens: PupilOptics, wavelength_nm: float) -> Slopes:
    """Return the largest gradient of the lens's wavefront at distances from the axis in the stop.

    Distances are in radii of the stop; gradients are over the pupil as the image sees it, in
    micrometres per radius of the stop that the f-number says.
    """
    slopes_per_radius = _slopes(tuple(coefficients_um(lens, wavelength_nm).items()))
    if lens.pupil_matrix is None:
        return slopes_per_radius
    return Slopes(
        slopes_per_radius.rho,
        slopes_per_radius.largest * float(np.linalg.norm(np.linalg.inv(lens.pupil_matrix), 2)),
    )


@lru_cache(maxsize=256)
def _slopes(wavefront: Sequence[Any]) -> Slopes:
    return slopes_um(dict(wavefront))  # asked for by every block of a pupil
