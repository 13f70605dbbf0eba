"""Patterns: the diffraction pattern of one wavelength on two lattices of points.

Without phase, one pattern scales to all wavelengths: two lattices, offset by half a step, serve
every band. With a wavefront or a third-party pupil, each part of a band in which the phase hardly
changes has a pair of lattices of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.optics import lattice as lattices

from ...pupil import folded_pupil, pupil_energy, pupil_shapes, pupil_size
from .lattice_size import (
    MOST_ACROSS,
    MOST_ACROSS_PHASE,
    OWN_SAMPLES,
    REFERENCE_NM,
    SHARED_SAMPLES,
    Grid,
    Size,
    check_pupil,
    chords_per_cell,
    most_samples,
    sampling,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from isethdr_core.plugins.protocols import Flare

    from ...abilities import PupilOptics
    from ..kernels import BandPlan

DEFAULT_ERROR = 0.03  # relative error of kernels from lattices with the usual sampling


@dataclass(frozen=True, eq=False)
class Lattice:
    """Samples of a pattern: values[i, j] is the fraction of the energy per sample at (index -
    middle + offset) * step.
    """

    values: np.ndarray
    # (y, x) distance between samples at `wavelength_nm`; without phase it scales with wavelength
    step_um: tuple[float, float]
    wavelength_nm: float  # as `pupil_size.scaled_nm`
    offset: tuple[float, float]  # (y, x) in steps


def shared(
    lens: PupilOptics, flares: Sequence[Flare], shortest_nm: float, grid: Grid
) -> list[Lattice]:
    """Return two lattices of the pattern of a pupil without phase, shifted by half a step against
    each other. They serve all wavelengths of a frame.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    shortest_nm : shortest wavelength of the frame, nm.
    grid : tiles of the kernel.
    """
    wave = min(shortest_nm, REFERENCE_NM)
    step, far, period, cells = _shared_sampling(lens, wave, grid)
    check_pupil(lens, wave, cells, MOST_ACROSS)
    energy = pupil_energy.open_energy_mm2(lens, flares, wave)
    distance = pupil_size.distance_mm(lens)
    out = []
    for offset in ((0.0, 0.0), (0.5, 0.5)):
        pupil = lattices.fold_shapes(
            pupil_shapes.terms(lens, flares),
            pupil_size.reach_mm(lens),
            cells,
            period,
            offset,
            chords_per_cell(lens, wave, grid),
        )
        samples = lattices.ImageSamples(wave, distance, (step, step), offset)
        values = lattices.lattice_psf(pupil, samples, far, energy, lattices.spline_response)
        out.append(Lattice(values, (step, step), wave, offset))
    return out


def shared_step_um(lens: PupilOptics, shortest_nm: float, grid: Grid) -> float:
    """Return the distance between samples of the lattices that `shared` returns, um.

    Parameters
    ----------
    lens, shortest_nm, grid : as in `shared`.
    """
    return _shared_sampling(lens, min(shortest_nm, REFERENCE_NM), grid)[0]


def _shared_sampling(
    lens: PupilOptics, wave: float, grid: Grid
) -> tuple[float, tuple[int, int], tuple[int, int], tuple[float, float]]:
    """Return step, extent, period and pupil cells of the lattices that `shared` makes, in the form
    of `lattice_size.sampling`.
    """
    fine = max(1.0, DEFAULT_ERROR / lens.speckle_error)
    most = most_samples(lens, wave, grid, SHARED_SAMPLES)
    return sampling(lens, wave, grid, Size(most, fine=fine, shared=True))


def own(
    plan: BandPlan, reach: tuple[int, int], wave: float, stretch: float, energy: float, fine: float
) -> list[Lattice]:
    """Return two lattices of the pattern at one wavelength, shifted by half a step against each
    other.

    Parameters
    ----------
    plan : `kernels.BandPlan` of the band.
    reach : (y, x) parts of tiles from the axis to the border.
    wave : wavelength, nm.
    stretch : extent of the lattice over that of the frame.
    energy : energy of the open pupil, mm2.
    fine : factor on the usual number of samples.
    """
    lens = plan.lens
    flares = plan.flares
    grid = Grid(plan.split, plan.pitch, reach)
    size = Size(most_samples(lens, wave, grid, OWN_SAMPLES), stretch, fine)
    step, far, period, cells = sampling(lens, wave, grid, size)
    check_pupil(lens, wave, cells, MOST_ACROSS_PHASE)
    offsets = ((0.0, 0.0), (0.5, 0.5))
    folded = folded_pupil.folded(lens, flares, wave, cells, period, offsets)
    out = []
    scaled_nm = pupil_size.scaled_nm(lens, wave)
    for offset in offsets:  # `pop` frees the first pupil before the second is transformed
        samples = lattices.ImageSamples(scaled_nm, plan.distance, (step, step), offset)
        values = lattices.lattice_psf(
            folded.pop(0), samples, far, energy, lattices.binomial_response
        )
        out.append(Lattice(values, (step, step), scaled_nm, offset))
    return out
