"""Pupil size: radius, area and distance of a pupil, and the size of its diffraction pattern."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..abilities import PupilOptics


def radius_mm(lens: PupilOptics) -> float:
    """Return the radius of the round stop, mm."""
    return lens.focal_length_mm / lens.f_number / 2


def reach_mm(lens: PupilOptics) -> float:
    """Return the distance from the axis, mm, beyond which the pupil is dark.

    It is the radius of the stop, or more if the image of the stop reaches farther.
    """
    return radius_mm(lens) * max(
        1.0, float(np.linalg.norm(lens.pupil_matrix, 2)) if lens.pupil_matrix else 1.0
    )


def stop_mm2(lens: PupilOptics) -> float:
    """Return the area of the clean round stop as the image sees it, mm2."""
    matrix = lens.pupil_matrix
    return np.pi * radius_mm(lens) ** 2 * (abs(float(np.linalg.det(matrix))) if matrix else 1.0)


def distance_mm(lens: PupilOptics) -> float:
    """Return the distance from the pupil to the image, mm: focal length x (1 + magnification)."""
    return lens.focal_length_mm * (1 + lens.magnification)


def scaled_nm(lens: PupilOptics, wavelength_nm: float) -> float:
    """Return the wavelength, nm, at which the drawn pupil has the pattern of `wavelength_nm`.

    The pupil of a traced lens has a different size at each wavelength (`pupil_scale`), but its
    shapes are drawn in one size. The diffraction pattern grows with wavelength / size.
    """
    return wavelength_nm / lens.pupil_scale(wavelength_nm)


def blur_um(lens: PupilOptics, wavelength_nm: float) -> float:
    """Return wavelength x working f-number, um: the reciprocal of the highest spatial frequency."""
    return scaled_nm(lens, wavelength_nm) * 1e-3 * distance_mm(lens) / (2 * radius_mm(lens))
