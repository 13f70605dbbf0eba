"""Pupil phase: whether a pupil has any, and how much it changes with the wavelength."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..abilities import DrawsPupil
from .pupil_shapes import all_shapes, delays_um
from .wavefronts import coefficients_um

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics


def has_phase(lens: PupilOptics, flares: Sequence[Flare]) -> bool:
    """Return whether the pupil may be complex.

    Without phase, a point spread function equals its mirror image.
    """
    return bool(
        lens.zernike_um or lens.focal_shift_um or lens.traced or delays_um(lens, flares)
    ) or not all_shapes(flares)


def round_and_clean(lens: PupilOptics, flares: Sequence[Flare]) -> bool:
    """Return whether the pupil is the round stop alone, without phase, rims, blades or dirt.

    Its point spread function then has a closed form.
    """
    changed = lens.rims or lens.uneven or lens.pupil_matrix
    return not (
        has_phase(lens, flares) or changed or any(isinstance(f, DrawsPupil) for f in flares)
    )


def phase_change(
    lens: PupilOptics, flares: Sequence[Flare], first_nm: float, last_nm: float
) -> float:
    """Return the difference of the phase between two wavelengths, radians rms over the pupil.

    A piston of the lens does not count. Dirt that delays light counts with its full phase, however
    small its area: far from the axis of the image, there is no other light.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    first_nm : first wavelength, nm.
    last_nm : second wavelength, nm.
    """
    first, last = (coefficients_um(lens, w) for w in (first_nm, last_nm))
    waves = [
        1e3 * (first.get(j, 0.0) / first_nm - last.get(j, 0.0) / last_nm)
        for j in {*first, *last} - {0}
    ]
    waves += [1e3 * d * (1 / first_nm - 1 / last_nm) for d in delays_um(lens, flares)]
    return 2 * np.pi * float(np.sqrt(np.sum(np.square(waves))))
