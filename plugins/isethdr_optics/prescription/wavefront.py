"""Wavefronts of a prescription: optical paths of exact rays to the chief ray's image, as Zernike
coefficients over its exit pupil.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.physics.optics.surfaces import sag_mm
from isethdr_core.physics.optics.zernike import order, zernike_basis

from .exit_pupil import pupil_rays
from .rays import HIGHEST, entering, fitted

if TYPE_CHECKING:
    from isethdr_core.physics.optics.ray_trace import Rays, Start

    from .prescription import Prescription


class Wavefront(NamedTuple):
    """The wavefront of one field point at one wavelength, over its exit pupil."""

    terms_um: dict[int, float]  # {OSA index: um rms}
    left_um: float  # residual of the fit, um rms
    pupil_scale: float  # size of the exit pupil over that at the reference wavelength


@lru_cache(maxsize=2048)
def zernike_um(lens: Prescription, tangent: float, wavelength_nm: float) -> Wavefront:
    """Return the wavefront of light from a field point on +x.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    tangent : tangent of the field angle, 0 or more.
    wavelength_nm : wavelength, nm.

    Raises
    ------
    ConfigError : too few rays of that direction reach the sensor.

    Notes
    -----
    The wavefront is the optical path of rays to a sphere around the chief ray's position on the
    sensor; the sphere passes through the middle of the exit pupil. Longer paths are positive, and a
    path that rises along x sends light to +x. The coordinates are those of the exit pupil. Terms
    odd in y, which a rotationally symmetric lens cannot have, are not fitted; piston is dropped.
    """
    indices = lens.indices(wavelength_nm)
    (rays, _, within), places, lag_mm, image_mm, scale = pupil_rays(lens, tangent, wavelength_nm)
    image = np.array([image_mm, 0.0, lens.surfaces[-1].z_mm])
    paths_mm = _paths_mm(lens, indices, entering(lens, wavelength_nm, tangent), rays, image)
    lag_um = 1e3 * (paths_mm + indices[-1] * lag_mm)[within]
    terms = [j for j in range((HIGHEST + 1) * (HIGHEST + 2) // 2) if order(j)[1] >= 0]
    basis = zernike_basis(terms, *(s[within] for s in places))
    coefficients = fitted(basis, lag_um - lag_um.mean())
    residual_um = float(np.std(lag_um - basis @ coefficients))
    return Wavefront(
        {j: float(c) for j, c in zip(terms, coefficients) if j and abs(c) > 1e-9},
        residual_um,
        scale,
    )


def _paths_mm(
    lens: Prescription,
    indices: list[float | np.ndarray],
    start: Start,
    rays: Rays,
    image: np.ndarray,
) -> np.ndarray:
    """Return the optical path length of every ray, mm: from a plane wave in front of the lens to
    the foot of the perpendicular from `image` to the ray.
    """
    position, direction = start
    total = indices[0] * np.sum(position * direction, axis=0)
    for k, surface in enumerate(lens.surfaces[:-1]):
        hit = rays.hits_mm[k]
        point = np.stack(
            [hit[0], hit[1], surface.z_mm + sag_mm(surface, hit[0] ** 2 + hit[1] ** 2)]
        )
        # a plane may lie within the sag of the surface before it: the path to it is negative there
        total = total + indices[k] * np.copysign(
            np.sqrt(np.sum((point - position) ** 2, axis=0)), point[2] - position[2]
        )
        position = point
    return total + indices[-1] * np.sum((image[:, None, None] - position) * rays.direction, axis=0)
