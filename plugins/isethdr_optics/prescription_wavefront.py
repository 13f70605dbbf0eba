"""Wavefronts of a prescription: optical paths of exact rays to the chief ray's image, as Zernike coefficients over the stop."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics import paraxial
from isethdr_core.physics.ray_trace import collimated, follow, sequential
from isethdr_core.physics.surfaces import sag_mm
from isethdr_core.physics.zernike import order, zernike

from .prescription_figures import chief_mm

RAYS = 41  # across the entrance pupil
HIGHEST = 8  # radial degree that is fitted
FEWEST = 300  # rays of a fit


@lru_cache(maxsize=2048)
def zernike_um(lens, tangent: float, wavelength_nm: float) -> tuple[dict[int, float], float]:
    """Return the wavefront of light from a field tangent along +x, {OSA index: um rms}, and what the fit leaves, um rms.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    tangent : of the field angle, 0 or above.

    Notes
    -----
    Optical path of a ray less that of the chief ray, up to a sphere around the chief ray's place on the sensor that passes
    through the middle of the exit pupil: larger paths lag, and a lag that rises along x sends light to +x, as everywhere here.
    The coordinates are those of the ray in the stop. Terms that a lens of revolution cannot have (odd in y) are not fitted;
    piston is dropped.

    Raises
    ------
    ConfigError : where too few rays of that direction reach the sensor.
    """
    image = np.array([float(chief_mm(lens, tangent, wavelength_nm)[0]), 0.0, lens.surfaces[-1].z_mm])
    indices = lens.indices(wavelength_nm)
    rays, stop, within = filling(lens, tangent, wavelength_nm)
    exit_mm = np.linalg.norm(image - np.array([0.0, 0.0, _exit_pupil_z(lens, indices)]))
    lag_um = 1e3 * _paths_mm(lens, indices, entering(lens, indices, tangent), rays, image, exit_mm)[within]
    terms = [j for j in range((HIGHEST + 1) * (HIGHEST + 2) // 2) if order(j)[1] >= 0]
    basis = np.stack([zernike(j, *(s[within] for s in stop)) for j in terms], axis=1)
    found = fitted(basis, lag_um - lag_um.mean())
    left = float(np.std(lag_um - basis @ found))
    return {j: float(c) for j, c in zip(terms, found) if j and abs(c) > 1e-9}, left


def fitted(basis, values) -> np.ndarray:
    """Return the coefficients of least squares; by the normal equations, as Zernike terms over a filled disc are nearly orthogonal."""
    return np.linalg.solve(basis.T @ basis, basis.T @ values)


def filling(lens, tangent: float, wavelength_nm: float, reach: float = 1.0):
    """Return rays from a field tangent along +x over the stop, where they cross it (x, y), radii of the stop, and which reach the sensor.

    Parameters
    ----------
    reach : radii of the stop within which rays count. Rims do not stop them.

    Raises
    ------
    ConfigError : where too few rays do.
    """
    indices = lens.indices(wavelength_nm)
    start = entering(lens, indices, tangent)
    rays = follow(lens.surfaces, indices, sequential(len(lens.surfaces)), *start, keep_hits=True)
    stop = np.stack(rays.hits_mm[lens.stop]) / lens.surfaces[lens.stop].semi_diameter_mm
    within = np.isfinite(rays.position_mm[0]) & (np.hypot(*stop) <= reach)
    if within.sum() < FEWEST:
        angle = np.degrees(np.arctan(tangent))
        raise ConfigError(
            f"prescription {lens.name!r}: {within.sum()} of {FEWEST} rays {angle:.1f} degrees off the axis fill the stop; "
            f"expected a field within its {lens.half_field_deg:g} degrees, or a smaller stop"
        )
    return rays, stop, within


def entering(lens, indices, tangent):
    """Return (position, direction) of parallel light over the entrance pupil and somewhat more."""
    front, optics = lens.surfaces[0].z_mm, lens.surfaces[:-1]
    pupil_z, pupil_radius = paraxial.entrance_pupil(optics, indices)
    across = np.linspace(-1.4, 1.4, RAYS) * pupil_radius
    x, y = np.meshgrid(np.append(across, 0.0), across)
    return collimated(x + (front - pupil_z) * tangent, y, front, tangent, 0.0)


def _paths_mm(lens, indices, start, rays, image, radius_mm):
    """Return optical path lengths from a wave in front of the lens to the sphere of `radius_mm` around `image`."""
    position, direction = start
    total = indices[0] * np.sum(position * direction, axis=0)
    for k, surface in enumerate(lens.surfaces[:-1]):
        hit = rays.hits_mm[k]
        here = np.stack([hit[0], hit[1], surface.z_mm + sag_mm(surface, hit[0] ** 2 + hit[1] ** 2)])
        # a plane that stands in the hollow of the surface before it is reached backwards
        total = total + indices[k] * np.copysign(np.sqrt(np.sum((here - position) ** 2, axis=0)), here[2] - position[2])
        position = here
    # along the last direction: to the foot of the image point on the ray, then back to the sphere
    to_image = image[:, None, None] - position
    foot = np.sum(to_image * rays.direction, axis=0)
    off2 = np.sum(to_image**2, axis=0) - foot**2
    return total + indices[-1] * (foot - np.sqrt(radius_mm**2 - off2))


def _exit_pupil_z(lens, indices) -> float:
    """Return z of the paraxial image of the stop in image space."""
    behind = [(k, False) for k in range(lens.stop + 1, len(lens.surfaces) - 1)]
    stop_z, last_z = lens.surfaces[lens.stop].z_mm, lens.surfaces[-2].z_mm
    if not behind:
        return stop_z
    matrix = paraxial.matrices(lens.surfaces, indices, behind, stop_z)[-1]
    return float(last_z - matrix[0, 1] / matrix[1, 1])
