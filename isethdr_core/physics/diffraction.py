"""Public path of `physics.optics.diffraction`."""

from .optics.diffraction import (
    MARGIN,
    Counts,
    Pair,
    diffraction_mtf,
    energy_of,
    integrated_airy,
    integrated_psf,
    phase,
    psf_from_pupil,
    sampled_psf,
)

__all__ = [
    "Counts",
    "MARGIN",
    "Pair",
    "diffraction_mtf",
    "energy_of",
    "integrated_airy",
    "integrated_psf",
    "phase",
    "psf_from_pupil",
    "sampled_psf",
]
