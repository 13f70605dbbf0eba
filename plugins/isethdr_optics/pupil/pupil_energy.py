"""Pupil energy: the integral of the squared amplitude over a pupil."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.diffraction import energy_of
from isethdr_core.physics.optics.pupil import transmitted_light

from . import apodization
from .pupil_cells import amplitude
from .pupil_grid import axis_mm
from .pupil_shapes import all_shapes, opening_and_dirt, terms
from .pupil_size import radius_mm, stop_mm2

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics

ENERGY_SAMPLES = 2048  # number of samples across the stop, for flares without exact shapes
# Least share of the clean stop's light that a pupil passes. Less may be the rounding error of sums
# over shapes, and counts as darkness.
DARK = 1e-6

_energy = lru_cache(maxsize=16)(transmitted_light.energy)


def open_energy_mm2(lens: PupilOptics, flares: Sequence[Flare], wavelength_nm: float) -> float:
    """Return the integral of the squared amplitude over the pupil, mm2.

    It follows from areas if all flares state exact shapes, and otherwise from a grid of means over
    cells (`diffraction.energy_of`).

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    wavelength_nm : wavelength, nm.

    Raises
    ------
    ConfigError : no light passes the pupil, or its dirt has too many overlaps.
    """
    if all_shapes(flares):
        terms(lens, flares, wavelength_nm)  # refuses dirt with too many overlaps
        opening, dirt = opening_and_dirt(lens, flares)
        dirt = tuple(d[:2] for d in dirt)  # a delay takes no light away
        energy = _energy(opening, dirt) * (
            apodization.share(lens.uneven, opening, dirt, radius_mm(lens)) if lens.uneven else 1.0
        )
        energy *= stop_mm2(lens) / (np.pi * radius_mm(lens) ** 2)
    else:
        pitch = 2 * radius_mm(lens) / ENERGY_SAMPLES
        axis = axis_mm(lens, pitch)
        cells = amplitude(lens, flares, axis, axis, wavelength_nm)
        cells = cells * apodization.cell_amplitude(lens, axis, axis) if lens.uneven else cells
        energy = energy_of(cells, pitch, cell_means=True)
    if not energy > DARK * stop_mm2(lens):
        raise ConfigError(
            "the flares block all light in the pupil; expected a transmission above 0 somewhere;"
            " type for example flare.NAME.dust_per_mm2=40 for less dirt"
        )
    return energy
