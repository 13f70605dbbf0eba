"""Exit pupil of a prescription: its stop as seen from an image point, in direction cosines.

Rays cross a sphere around the chief ray's image that passes through the middle of the exit pupil.
Every point of the sphere sends a wave to the sensor (Born and Wolf 1999, Principles of Optics,
section 9.1). Near the image this is a plane wave along the line from the point to the image. The
point spread is therefore a Fourier transform over the direction cosines of these lines. The range
of direction cosines that the stop fills is smaller off the axis than on the axis, above all in the
meridional plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.physics.optics import paraxial
from isethdr_core.physics.optics.zernike import order, zernike_basis

from .figures import chief_mm
from .rays import HIGHEST, FilledStop, filling, fitted

if TYPE_CHECKING:
    from .prescription import Prescription

AZIMUTHS = 180  # number of points on the border of the stop


class ExitPupil(NamedTuple):
    """The image of the stop in direction cosines: an ellipse, and the distance of the true border
    from it.
    """

    # direction cosine along x, towards the image, per radius of the stop; negative for an upright
    # pupil
    meridional: float
    sagittal: float  # the same along y
    centre: float  # direction cosine along x of the middle of the ellipse
    off_ellipse: float  # largest distance of the border from the ellipse, radii of the ellipse


class PupilRays(NamedTuple):
    """Rays of one field point that fill the stop, and where they cross its exit pupil."""

    filled: FilledStop
    places: np.ndarray  # (2, ...) x and y of the crossings; 1 on the border of the ellipse
    # difference between two paths to the sphere: from the foot of the perpendicular from the image
    # to the ray, and along a ray through the image
    lag_mm: np.ndarray
    image_mm: float  # position of the chief ray on the sensor, along x
    scale: float  # size of the ellipse over that at the reference wavelength


@lru_cache(maxsize=2048)
def exit_pupil(lens: Prescription, tangent: float, wavelength_nm: float) -> ExitPupil:
    """Return the exit pupil as seen from the image of a field point on +x.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    tangent : tangent of the field angle, 0 or more.
    wavelength_nm : wavelength, nm.

    Raises
    ------
    ConfigError : too few rays of that direction fill the stop.
    """
    filled = filling(lens, tangent, wavelength_nm)
    image_mm = float(chief_mm(lens, tangent, wavelength_nm)[0])
    return _ellipse(filled, _directions_of_stop(lens, image_mm, wavelength_nm, filled)[0])


def pupil_rays(
    lens: Prescription, tangent: float, wavelength_nm: float, reach: float = 1.0
) -> PupilRays:
    """Return rays from a field point on +x, and where they cross the exit pupil, in units of its
    radii.

    The unit is the exit pupil at the reference wavelength, scaled to the area of the exit pupil at
    this wavelength. One shape of the pupil therefore serves all wavelengths.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    tangent : tangent of the field angle, 0 or more.
    wavelength_nm : wavelength, nm.
    reach : radii of the stop within which rays count. Rims do not stop them.

    Raises
    ------
    ConfigError : too few rays of that direction fill the stop.
    """
    filled = filling(lens, tangent, wavelength_nm, reach)
    image_mm = float(chief_mm(lens, tangent, wavelength_nm)[0])
    cosines, lag_mm = _directions_of_stop(lens, image_mm, wavelength_nm, filled)
    unit = exit_pupil(lens, tangent, lens.reference_nm)
    own = _ellipse(filled, cosines)
    scale = float(np.sqrt(own.meridional * own.sagittal / (unit.meridional * unit.sagittal)))
    x = (cosines[0] - own.centre) / (scale * unit.meridional)
    y = cosines[1] / (scale * unit.sagittal)
    return PupilRays(filled, np.stack([x, y]), lag_mm, image_mm, scale)


def _directions_of_stop(
    lens: Prescription, image_mm: float, wavelength_nm: float, filled: FilledStop
) -> tuple[np.ndarray, np.ndarray]:
    """Return direction cosines (x, y) from the exit sphere to the image, and `PupilRays.lag_mm`.

    Both are finite also for a pupil at infinity.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    image_mm : position of the chief ray on the sensor, along x, mm.
    wavelength_nm : wavelength, nm.
    filled : rays that fill the stop.
    """
    position = filled.rays.position_mm
    direction = filled.rays.direction
    beside = np.stack([position[0] - image_mm, position[1], 0 * position[2]])
    foot = beside - np.sum(beside * direction, axis=0) * direction
    curvature = _sphere_curvature_per_mm(lens, image_mm, lens.indices(wavelength_nm))
    off2 = np.sum(foot**2, axis=0)
    along = np.sqrt(1 - curvature**2 * off2)
    return (along * direction - curvature * foot)[:2], curvature * off2 / (1 + along)


def _sphere_curvature_per_mm(
    lens: Prescription, image_mm: float, indices: Sequence[float | np.ndarray]
) -> float:
    """Return the curvature, 1/mm, of the sphere around an image point through the paraxial exit
    pupil; it is negative for a pupil behind the sensor.
    """
    behind = [(k, False) for k in range(lens.stop + 1, len(lens.surfaces) - 1)]
    stop_z = lens.surfaces[lens.stop].z_mm
    last_z = lens.surfaces[-2].z_mm
    sensor_z = lens.surfaces[-1].z_mm
    if not behind:
        return 1 / np.hypot(sensor_z - stop_z, image_mm)
    matrix = paraxial.matrices(lens.surfaces, indices, behind, stop_z)[-1]
    # distance from the exit pupil to the sensor, times matrix[1, 1]
    depth = (sensor_z - last_z) * matrix[1, 1] + matrix[0, 1]
    return float(matrix[1, 1] * np.sign(depth) / np.hypot(depth, matrix[1, 1] * image_mm))


def _ellipse(filled: FilledStop, cosines: np.ndarray) -> ExitPupil:
    """Return the ellipse that fits the border of the stop in direction cosines. The border follows
    from polynomials that are fitted to the rays over the stop.
    """
    terms = range((HIGHEST + 1) * (HIGHEST + 2) // 2)
    turn = 2 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    along = np.cos(turn)
    across = np.sin(turn)
    border = []
    stop = filled.places
    within = filled.within
    for cosine, even in zip(cosines, (True, False)):
        same_parity = [j for j in terms if (order(j)[1] >= 0) == even]
        fitted_cosine = fitted(
            zernike_basis(same_parity, *(s[within] for s in stop)), cosine[within]
        )
        border.append(zernike_basis(same_parity, along, across) @ fitted_cosine)
    centre = float(border[0].mean())
    meridional, sagittal = (
        2 * float(np.mean(b * side)) for b, side in zip(border, (along, across))
    )
    radius = np.hypot((border[0] - centre) / meridional, border[1] / sagittal)
    return ExitPupil(meridional, sagittal, centre, float(np.abs(radius - 1).max()))
