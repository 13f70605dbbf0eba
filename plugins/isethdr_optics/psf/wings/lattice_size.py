"""Lattice size: how far and how finely a pattern is sampled, and what that takes."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy.fft as sf

from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics import lattice as lattices

from ...pupil import sampled_pupil

if TYPE_CHECKING:
    from collections.abc import Sequence

    from isethdr_core.plugins.protocols import Flare

    from ...abilities import PupilOptics

# of the shared lattices where all bands are longer: a band then does not depend on which others
# there are
REFERENCE_NM = 380.0
PERIOD = 3.0  # of the field, in reaches
# largest error that this leaves in the border tiles (L1, against a period of 7; clean round pupil
# with a wavefront)
WRAP = 0.018
WRAP_SHARED = 0.0015  # and of a pupil without phase, whose lattices serve all bands
RING_PUPIL = 500  # least cells across the stop
SHARED_SAMPLES = 1.2e8  # of one shared lattice: about a gigabyte while it is computed
# of a lattice with phase: a gigabyte while it is computed, then a third of that
OWN_SAMPLES = 1.2e8
# of either where tiles are wider than `VERY_WIDE` wavelengths x f-number, which no lattice samples
# as finely as speckles: 0.3 GB while it is computed
WIDE_SAMPLES = 4e7
VERY_WIDE = 60.0
# of a cell of their pupil, in place of `lattice.CHORDS_PER_CELL`: 2e-5 of the light of the wings
# differs (L1), where points between speckles leave 5e-3
WIDE_CHORDS = 4
FOLD_S = 1.9e-6  # CPU seconds of a chord of a folded pupil, measured on a busy machine
# of the highest spatial frequency: what a lattice takes for lower ones; beside those that tiles
# pass, hardly any light has them
CLEAR = 1.0
# samples across a wide tile: it and its neighbours then hold 600, whose mean is right to 3 %
ENOUGH = 16
FARTHEST = 4  # wavelengths x f-number between samples
# samples per wavelength x f-number, at most: between them a line is right to 3 % of the finest
# detail
SMOOTH = 12
# extent of a lattice over that of the frame, where neighbouring wavelengths read it stretched
STRETCHED = 1.15
# cells across a pupil: a minute where it is shapes alone; twenty, cell by cell, with phase
MOST_ACROSS = 3e5
MOST_ACROSS_PHASE = 8e4
# from the shortest wavelength down to the lattice that it is read from, at most: the widest of
# `interpolation_wavelengths.STEPS_NM`
BELOW_NM = 80.0
CHORD_BYTES = 700  # of a pupil of shapes, while it is folded


class Grid(NamedTuple):
    """Tiles of a kernel before it is summed: parts of the frame's tiles."""

    split: int  # parts per tile, along each axis
    pitch_um: tuple[float, float]  # (y, x) of a part
    reach: tuple[int, int]  # (y, x) parts from the axis to the border


class Size(NamedTuple):
    """Extent and fineness of a lattice."""

    most: float  # samples
    stretch: float = 1.0  # extent over that of the frame
    fine: float = 1.0  # samples over the usual number
    shared: bool = False  # one pattern for all wavelengths


def most_samples(lens: PupilOptics, wave: float, grid: Grid, usual: float) -> float:
    """Return the samples that one lattice may have.

    Parameters
    ----------
    lens : a lens of this package.
    wave : wavelength, nm.
    grid : tiles of the kernel.
    usual : samples where tiles are not very wide.
    """
    return min(usual, WIDE_SAMPLES) if very_wide(lens, wave, grid) else usual


def very_wide(lens: PupilOptics, wave: float, grid: Grid) -> bool:
    """Return whether tiles are so wide that no lattice samples them as finely as speckles.

    Parameters
    ----------
    lens : a lens of this package.
    wave : wavelength, nm.
    grid : tiles of the kernel.
    """
    width_um = min(grid.pitch_um) * grid.split
    return width_um > VERY_WIDE * sampled_pupil.blur_um(lens, wave)


def chords_per_cell(lens: PupilOptics, wave: float, grid: Grid) -> int:
    """Return the chords of a cell of the pupil.

    Parameters
    ----------
    lens : a lens of this package.
    wave : wavelength, nm.
    grid : tiles of the kernel.
    """
    return WIDE_CHORDS if very_wide(lens, wave, grid) else lattices.CHORDS_PER_CELL


def sampling(
    lens: PupilOptics, wave: float, grid: Grid, size: Size
) -> tuple[float, tuple[int, int], tuple[int, int], tuple[float, float]]:
    """Return (step um, samples to the border, period, cells mm) of a lattice.

    A tile of several parts is wide: it averages over many speckles, and the step may be coarser.

    Parameters
    ----------
    lens : a lens of this package.
    wave : wavelength, nm.
    grid : tiles of the kernel.
    size : extent and fineness of the lattice.
    """
    extent = [(r + 1) * p * size.stretch for r, p in zip(grid.reach, grid.pitch_um)]
    blur = sampled_pupil.blur_um(lens, wave)
    pitch = min(grid.pitch_um)
    if size.shared:
        step_wanted = min(blur / np.sqrt(2), pitch / 3)
    elif grid.split > 1:
        step_wanted = min(max(blur / CLEAR, pitch * grid.split / ENOUGH), FARTHEST * blur)
    else:
        step_wanted = min(blur / (CLEAR + blur / (2 * pitch)), pitch / 2)
    step_wanted = max(step_wanted, blur / SMOOTH) / np.sqrt(size.fine)
    step_affordable = PERIOD * np.sqrt(np.prod(extent) / size.most)
    step = min(max(step_wanted, step_affordable), max(pitch, blur / SMOOTH))
    far = tuple(int(np.ceil(e / step)) + 2 for e in extent)
    least = max(RING_PUPIL, sampled_pupil.phase_samples(lens, wave) / 2) * blur / step
    period = tuple(sf.next_fast_len(int(np.ceil(max(PERIOD * n, least)))) for n in far)
    scaled_nm = sampled_pupil.scaled_nm(lens, wave)
    distance_mm = sampled_pupil.distance_mm(lens)
    cells = lattices.lattice_pitch_mm(scaled_nm, period, distance_mm, (step, step))
    return step, far, period, cells


def samples_of(
    lens: PupilOptics, wave: float, grid: Grid, stretch: float, shared_by_all: bool
) -> float:
    """Return the samples of one lattice at a wavelength.

    Parameters
    ----------
    lens : a lens of this package.
    wave : wavelength, nm.
    grid : tiles of the kernel.
    stretch : times the frame, up to which the lattice is read.
    shared_by_all : whether one lattice serves all wavelengths.
    """
    usual = SHARED_SAMPLES if shared_by_all else OWN_SAMPLES
    size = Size(most_samples(lens, wave, grid, usual), stretch, shared=shared_by_all)
    period = sampling(lens, wave, grid, size)[2]
    return float(np.prod(period, dtype=float))


def fold_seconds(lens: PupilOptics, flares: Sequence[Flare], wave: float, grid: Grid) -> float:
    """Return the CPU seconds of drawing the two pupils of `shared`.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components, all of shapes.
    wave : the shortest wavelength, nm.
    grid : tiles of the kernel.
    """
    wave = min(wave, REFERENCE_NM)
    size = Size(most_samples(lens, wave, grid, SHARED_SAMPLES), shared=True)
    cell_mm = sampling(lens, wave, grid, size)[3][0]
    heights = sum(shape.high - shape.low for shape, _ in sampled_pupil.terms(lens, flares))
    return 2 * FOLD_S * heights / cell_mm * chords_per_cell(lens, wave, grid)


def lattice_bytes(lens: PupilOptics, shortest_nm: float, tiles: Grid) -> float:
    """Return the peak memory, bytes, of the two lattices of a pupil.

    It consists of a complex field over its period, and both patterns.

    Parameters
    ----------
    lens : a lens of this package.
    shortest_nm : shortest wavelength of the frame, nm.
    tiles : of the frame.

    Raises
    ------
    ConfigError : the frame is too wide for the finest detail; the pupil would take hours.
    """
    phase = bool(lens.zernike_um or lens.focal_shift_um)
    # a table of focal shifts may not reach below the shortest band
    below = shortest_nm if lens.focal_shift_um else max(shortest_nm - BELOW_NM, shortest_nm / 2)
    wave, stretch, most = (
        (below, STRETCHED, OWN_SAMPLES)
        if phase
        else (min(shortest_nm, REFERENCE_NM), 1.0, SHARED_SAMPLES)
    )
    size = Size(most_samples(lens, wave, tiles, most), stretch, shared=not phase)
    _, far, period, cells = sampling(lens, wave, tiles, size)
    across = check_pupil(lens, wave, cells, MOST_ACROSS_PHASE if phase else MOST_ACROSS)
    return (
        8 * float(np.prod(period, dtype=float))
        + 2 * 4 * float(np.prod([2.0 * n + 1 for n in far]))
        + (not phase) * CHORD_BYTES * min(lattices.CHORDS, across * lattices.CHORDS_PER_CELL)
    )


def check_pupil(
    lens: PupilOptics, wave_nm: float, cells_mm: tuple[float, float], most: float
) -> float:
    """Return the cells across a lattice's pupil; refuse more than `most`, before they are drawn.

    Their number is the width of the lattice's period in wavelengths x f-number: large frames of
    fast lenses take many.

    Parameters
    ----------
    lens : a lens of this package.
    wave_nm : wavelength.
    cells_mm : width of a cell along y and x.
    most : cells across that are allowed.

    Raises
    ------
    ConfigError : there are more.
    """
    across = 2 * sampled_pupil.radius_mm(lens) / min(cells_mm)
    if across > most:
        raise ConfigError(
            f"at f/{lens.f_number:g} and {wave_nm:g} nm this frame is {across / PERIOD:.3g} times"
            f" wavelength x f-number wide: its kernels would take a pupil of {across:.3g} cells"
            f" across; expected at most {most:g}; type"
            f" lens.f_number={1.05 * lens.f_number * across / most:.2g} or more, or a smaller field"
        )
    return across
