"""Pupil grid: cells that cover a pupil, fine enough for its image and its wavefront."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import ConfigError

from .pupil_size import blur_um, radius_mm, reach_mm
from .wavefronts import steepest_um

if TYPE_CHECKING:
    from ..abilities import PupilOptics

# Number of samples across the stop with which kernel values are exact to 1e-4 (L1 norm), measured
# against 3072 samples.
CORE_SAMPLES = 768
FEWEST_SAMPLES = 256  # least number of samples across the stop for a narrow image
# Number of samples across the stop for each wavelength x f-number of the image's width, if this
# gives fewer than `CORE_SAMPLES`.
BORDER = 4.0
MOST_SAMPLES = 8192  # largest number of samples across the stop
MOST_TURNS = 0.5  # change of the wavefront from one cell to the next that is aliased, wavelengths


def axis_mm(lens: PupilOptics, pitch_mm: float) -> np.ndarray:
    """Return cell centres, mm, symmetric about the axis, that cover the pupil and one more cell on
    either side.
    """
    half = int(np.ceil(reach_mm(lens) / pitch_mm)) + 1
    return (np.arange(2 * half) - half + 0.5) * pitch_mm


def phase_samples(lens: PupilOptics, wavelength_nm: float) -> float:
    """Return the number of samples across the stop with which the wavefront changes by at most a
    quarter wave from one sample to the next.
    """
    return 8 * steepest_um(lens, wavelength_nm) / (wavelength_nm * 1e-3)


def core_pitch_mm(
    lens: PupilOptics, extent_um: float, wavelength_nm: float, least: int = CORE_SAMPLES
) -> float:
    """Return a pupil pitch, mm, that resolves the stop, an image and the wavefront.

    The wavefront changes by at most a quarter wave per sample. If `least` is below `CORE_SAMPLES`,
    a narrow image takes fewer samples than a wide one, and is as exact at its border: 2e-3 of the
    light there, 5e-3 for the widest image (measured against 2304 samples).

    Parameters
    ----------
    lens : a lens of this package.
    extent_um : width of the image, um.
    wavelength_nm : wavelength, nm.
    least : least number of samples across the stop.

    Raises
    ------
    ConfigError : more than `MOST_SAMPLES` are needed.
    """
    diameter = 2 * radius_mm(lens)
    across = extent_um / blur_um(lens, wavelength_nm)
    samples = max(least, min(CORE_SAMPLES, BORDER * across), 2.0 * across)
    samples = max(samples, phase_samples(lens, wavelength_nm))
    if samples > MOST_SAMPLES:
        raise ConfigError(
            f"the pupil would need {samples:.0f} samples across at {wavelength_nm:g} nm; expected"
            f" at most {MOST_SAMPLES}: ask for a smaller image, or smaller lens.zernike_um"
        )
    return diameter / samples


def turns_per_cell(lens: PupilOptics, step_mm: float, wavelength_nm: float) -> float:
    """Return the largest change of the wavefront from one cell to the next, in wavelengths.

    Parameters
    ----------
    lens : a lens of this package.
    step_mm : distance between the centres of the cells, mm.
    wavelength_nm : wavelength, nm.
    """
    return steepest_um(lens, wavelength_nm) * step_mm / radius_mm(lens) / (wavelength_nm * 1e-3)


def check_phase_sampling(lens: PupilOptics, step_mm: float, wavelength_nm: float) -> None:
    """Refuse cells that are too wide for the wavefront.

    A slope of half a wave per cell sends light to the border of the image that the cells can
    represent. Light of a steeper slope would appear at the opposite border (aliasing).

    Parameters
    ----------
    lens : a lens of this package.
    step_mm : distance between the centres of the cells, mm.
    wavelength_nm : wavelength, nm.

    Raises
    ------
    ConfigError : the wavefront changes by half a wave or more from one cell to the next.
    """
    turns = turns_per_cell(lens, step_mm, wavelength_nm)
    if turns >= MOST_TURNS:
        raise ConfigError(
            f"the wavefront changes by {turns:.2f} wavelengths per pupil sample at"
            f" {wavelength_nm:g} nm: its blur is wider than the image; expected a smaller"
            " lens.zernike_um or lens.focal_shift_um, or a wider field"
        )
