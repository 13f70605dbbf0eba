"""Band phase: error of lenses and dust with a phase that changes too much within a part of a band.

Beyond the core, kernels are computed from parts of a band. Within a part (`wings.parts_of`) the
pattern of its middle wavelength is scaled to all others. The speckles of a real lens change with
the phase and average out; those of the scaled pattern do not. To second order in the change of
phase (rad rms), the relative error of a speckle is up to change^2 / 24.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.radiometry import band_widths_nm
from isethdr_core.uncertainty.error_terms import ErrorTerm

from ..pupil import pupil_phase, pupil_shapes
from . import wings
from .error_parts import SPREAD, term

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics

# Relative error per tile (L1 per octave) if the phase changes by 1 rad rms within a part. Measured:
# 0.004 to 0.030, against kernels of 40 and 100 parts (f/4 and f/8, tiles of 1.5 to 6 um, defocus,
# coma and spherical aberration of 3.7 to 13 rad within a band, with and without dirt). For speckles
# of full contrast it is 1 / 24.
STANDING = 0.04
MOST_RAD = 2.5  # largest change of phase within a part for which the error was measured, rad rms


def check(lens: PupilOptics, flares: Sequence[Flare], wavelength_nm: np.ndarray) -> None:
    """Refuse a phase of dirt or of the wavefront that changes too much within a band.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    wavelength_nm : (band,) centres of the bands, nm.

    Raises
    ------
    ConfigError : the phase changes too much; the message says which bands are narrow enough.
    """
    change, wave, width = _worst((lens,), wavelength_nm)
    delays = pupil_shapes.delays_um(lens, flares)
    if delays:
        wings.check_delay(
            max(delays, key=abs), wavelength_nm, band_widths_nm(wavelength_nm), change
        )
    most = MOST_RAD * wings.MOST_PARTS
    if change > most:
        raise ConfigError(
            f"the phase of the lens changes by {change:.3g} rad rms within the band at {wave:g} nm,"
            f" {width:.3g} nm wide: its PSF wings would need {_needed(change)} sub-bands; expected"
            f" at most {most:g} rad; use bands of {0.95 * most / change * width:.2g} nm or less"
            " (renderer.step_nm or scene.step_nm), or a smaller wavefront"
        )


def errors(lenses: Sequence[PupilOptics], wavelength_nm: np.ndarray) -> list[ErrorTerm]:
    """Return the errors of dividing a band into fewer parts than its phase needs.

    Parameters
    ----------
    lenses : lenses of the field points.
    wavelength_nm : (band,) centres of the bands, nm.
    """
    change, wave, _ = _worst(lenses, wavelength_nm)
    if _needed(change) <= wings.MOST_PARTS:
        return []
    value = STANDING * (change / wings.MOST_PARTS) ** 2
    label = (
        f"speckle that {_needed(change)} parts of the band at {wave:g} nm would wash out, made"
        f" of {wings.MOST_PARTS}"
    )
    return [term(value, "relative", "measured", label, key="band phase", part=SPREAD)]


def _needed(change: float) -> int:
    return int(np.ceil(change / wings.PHASE_CHANGE))


def _worst(lenses: Sequence[PupilOptics], wavelength_nm: np.ndarray) -> tuple[float, float, float]:
    """Return (change, centre, width): the largest change of a lens's own phase within a band,
    radians rms, and the centre and width of that band, nm.
    """
    wave = np.asarray(wavelength_nm, float)
    width = band_widths_nm(wavelength_nm)
    errors_of_lenses = [
        (pupil_phase.phase_change(one, (), w - d / 2, w + d / 2), w, d)
        for one in lenses
        for w, d in zip(wave, width)
        if w > d / 2
    ]
    return max(errors_of_lenses, default=(0.0, 0.0, 0.0))
