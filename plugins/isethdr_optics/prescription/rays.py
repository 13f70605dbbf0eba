"""Rays of a prescription over its stop: parallel light from one field point, traced to the sensor,
and polynomials fitted to values on these rays.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics import paraxial
from isethdr_core.physics.optics.ray_trace import Rays, collimated, follow, sequential

from .figures import beam_middle_mm

if TYPE_CHECKING:
    from isethdr_core.physics.optics.ray_trace import Start

    from .prescription import Prescription

RAYS = 41  # number of rays across the entrance pupil and its surroundings
HIGHEST = 8  # highest radial degree of the fitted polynomials
FEWEST = 300  # least number of rays of a fit


class FilledStop(NamedTuple):
    """Rays of one field point and where they cross the stop."""

    rays: Rays
    places: np.ndarray  # (2, ...) x and y of the crossings, radii of the stop
    within: np.ndarray  # mask of the rays that count


def fitted(basis: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the coefficients of a least-squares fit.

    The normal equations are accurate enough, because Zernike terms over a filled disc are nearly
    orthogonal.

    Parameters
    ----------
    basis : (sample, term) values of the terms.
    values : (sample, ...) values to be fitted.
    """
    return np.linalg.solve(basis.T @ basis, basis.T @ values)


def filling(
    lens: Prescription, tangent: float, wavelength_nm: float, reach: float = 1.0
) -> FilledStop:
    """Return rays from a field point on +x over the stop. Only rays that reach the sensor count.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    tangent : tangent of the field angle.
    wavelength_nm : wavelength, nm.
    reach : radii of the stop within which rays count. Rims do not stop them.

    Raises
    ------
    ConfigError : too few rays count.
    """
    indices = lens.indices(wavelength_nm)
    start = entering(lens, wavelength_nm, tangent)
    rays = follow(lens.surfaces, indices, sequential(len(lens.surfaces)), start, keep_hits=True)
    stop = np.stack(rays.hits_mm[lens.stop]) / lens.surfaces[lens.stop].semi_diameter_mm
    within = np.isfinite(rays.position_mm[0]) & (np.hypot(*stop) <= reach)
    if within.sum() < FEWEST:
        angle = np.degrees(np.arctan(tangent))
        raise ConfigError(
            f"prescription {lens.name!r}: {within.sum()} of {FEWEST} rays {angle:.1f} degrees off"
            f" the axis fill the stop; expected a field within its {lens.half_field_deg:g} degrees,"
            " or a smaller stop"
        )
    return FilledStop(rays, stop, within)


def entering(lens: Prescription, wavelength_nm: float, tangent: float) -> Start:
    """Return (position, direction) of parallel light over 1.4 radii of the entrance pupil.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    wavelength_nm : wavelength, nm.
    tangent : tangent of the field angle, along +x.
    """
    front = lens.surfaces[0].z_mm
    optics = lens.surfaces[:-1]
    _, pupil_radius = paraxial.entrance_pupil(optics, lens.indices(wavelength_nm))
    across = np.linspace(-1.4, 1.4, RAYS) * pupil_radius
    x, y = np.meshgrid(np.append(across, 0.0), across)
    middle = beam_middle_mm(lens, tangent, wavelength_nm)[0]
    return collimated(x + middle, y, front, tangent, 0.0)
