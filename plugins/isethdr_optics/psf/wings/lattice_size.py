"""Lattice size: extent and step of the samples of a pattern, and their time and memory."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy.fft as sf

from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics import lattice as lattices

from ...pupil import pupil_grid, pupil_shapes, pupil_size

if TYPE_CHECKING:
    from collections.abc import Sequence

    from isethdr_core.plugins.protocols import Flare

    from ...abilities import PupilOptics

# Wavelength of the shared lattices if all bands are longer. It is fixed, so that a band does not
# depend on which other bands a run has.
REFERENCE_NM = 380.0
PERIOD = 3.0  # period of the field, in reaches
# largest L1 error of that period in the border tiles, against a period of 7: for a clean round
# pupil with a wavefront, and for a pupil without phase, whose lattices serve all bands
WRAP = 0.018
WRAP_SHARED = 0.0015
RING_PUPIL = 500  # least number of cells across the stop
# largest number of samples of one shared lattice: about 1 GB while it is computed
SHARED_SAMPLES = 1.2e8
# largest number of samples of a lattice with phase: 1 GB while it is computed, then a third of it
OWN_SAMPLES = 1.2e8
# Largest number of samples of either lattice where tiles are wider than `VERY_WIDE` wavelengths x
# f-number: 0.3 GB while it is computed. No lattice samples such tiles as finely as speckles.
WIDE_SAMPLES = 4e7
VERY_WIDE = 60.0
# Number of chords per pupil cell for such tiles, in place of `lattice.CHORDS_PER_CELL`. It changes
# 2e-5 of the light of the wings (L1); the coarse samples leave an error of 5e-3.
WIDE_CHORDS = 4
FOLD_S = 1.9e-6  # CPU seconds per chord of a folded pupil, measured on a busy machine
# Spatial frequencies of the pattern up to this share of the highest one do not alias into the
# frequencies that tiles pass. Hardly any light has higher frequencies.
CLEAR = 1.0
# number of samples across a wide tile: the tile and its neighbours then hold 600 samples, and their
# mean is accurate to 3 %
ENOUGH = 16
FARTHEST = 4  # largest distance between samples, wavelengths x f-number
# largest number of samples per wavelength x f-number: linear interpolation between them is accurate
# to 3 % of the finest detail
SMOOTH = 12
# extent of a lattice over that of the frame, because shorter wavelengths read it stretched
STRETCHED = 1.15
# largest number of cells across a pupil: computing takes one minute for a pupil of shapes alone,
# and twenty minutes, cell by cell, for a pupil with phase
MOST_ACROSS = 3e5
MOST_ACROSS_PHASE = 8e4
# largest distance from the shortest wavelength of a frame to the lattice below it: the largest of
# `interpolation_wavelengths.STEPS_NM`
BELOW_NM = 80.0
CHORD_BYTES = 700  # memory per chord of a pupil of shapes while it is folded


class Grid(NamedTuple):
    """The fine tiles of a kernel before it is summed: parts of the frame's tiles."""

    split: int  # parts per tile, along each axis
    pitch_um: tuple[float, float]  # (y, x) of a part
    reach: tuple[int, int]  # (y, x) parts from the axis to the border


class Size(NamedTuple):
    """Extent and fineness of a lattice."""

    most: float  # largest number of samples
    stretch: float = 1.0  # extent over that of the frame
    fine: float = 1.0  # factor on the usual number of samples
    shared: bool = False  # one pattern serves all wavelengths


def most_samples(lens: PupilOptics, wave: float, grid: Grid, usual: float) -> float:
    """Return the largest number of samples of one lattice.

    Parameters
    ----------
    lens : a lens of this package.
    wave : wavelength, nm.
    grid : tiles of the kernel.
    usual : largest number if the tiles are not very wide.
    """
    return min(usual, WIDE_SAMPLES) if very_wide(lens, wave, grid) else usual


def very_wide(lens: PupilOptics, wave: float, grid: Grid) -> bool:
    """Return whether tiles are so wide that no lattice resolves the speckles in them.

    Parameters
    ----------
    lens : a lens of this package.
    wave : wavelength, nm.
    grid : tiles of the kernel.
    """
    width_um = min(grid.pitch_um) * grid.split
    return width_um > VERY_WIDE * pupil_size.blur_um(lens, wave)


def chords_per_cell(lens: PupilOptics, wave: float, grid: Grid) -> int:
    """Return the number of chords per cell of the pupil.

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
    """Return the sampling of a lattice.

    The result is (step in um, (y, x) samples from the axis to the border, (y, x) samples of the
    period, (y, x) width of the pupil cells in mm). A tile of several parts is wide: it averages
    over many speckles, and the step may be coarser.

    Parameters
    ----------
    lens : a lens of this package.
    wave : wavelength, nm.
    grid : tiles of the kernel.
    size : extent and fineness of the lattice.
    """
    extent = [(r + 1) * p * size.stretch for r, p in zip(grid.reach, grid.pitch_um)]
    blur = pupil_size.blur_um(lens, wave)
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
    least = max(RING_PUPIL, pupil_grid.phase_samples(lens, wave) / 2) * blur / step
    period = tuple(sf.next_fast_len(int(np.ceil(max(PERIOD * n, least)))) for n in far)
    scaled_nm = pupil_size.scaled_nm(lens, wave)
    distance_mm = pupil_size.distance_mm(lens)
    cells = lattices.lattice_pitch_mm(scaled_nm, period, distance_mm, (step, step))
    return step, far, period, cells


def samples_of(
    lens: PupilOptics, wave: float, grid: Grid, stretch: float, shared_by_all: bool
) -> float:
    """Return the number of samples of one lattice at a wavelength.

    Parameters
    ----------
    lens : a lens of this package.
    wave : wavelength, nm.
    grid : tiles of the kernel.
    stretch : extent of the lattice over that of the frame.
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
    flares : its flare components, which all have exact shapes.
    wave : shortest wavelength of the frame, nm.
    grid : tiles of the kernel.
    """
    wave = min(wave, REFERENCE_NM)
    size = Size(most_samples(lens, wave, grid, SHARED_SAMPLES), shared=True)
    cell_mm = sampling(lens, wave, grid, size)[3][0]
    heights = sum(shape.high - shape.low for shape, _ in pupil_shapes.terms(lens, flares))
    return 2 * FOLD_S * heights / cell_mm * chords_per_cell(lens, wave, grid)


def lattice_bytes(lens: PupilOptics, shortest_nm: float, tiles: Grid) -> float:
    """Return the peak memory, bytes, of the two lattices of a pupil.

    It is the sum of a complex field over its period, both patterns, and the chords of a pupil of
    shapes.

    Parameters
    ----------
    lens : a lens of this package.
    shortest_nm : shortest wavelength of the frame, nm.
    tiles : tiles of the kernel.

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
    """Return the number of cells across a lattice's pupil; refuse too many before they are drawn.

    Their number is the width of the lattice's period in wavelengths x f-number. It is large for
    large frames and fast lenses.

    Parameters
    ----------
    lens : a lens of this package.
    wave_nm : wavelength, nm.
    cells_mm : (y, x) width of a cell, mm.
    most : largest allowed number of cells across.

    Raises
    ------
    ConfigError : there are more than `most` cells.
    """
    across = 2 * pupil_size.radius_mm(lens) / min(cells_mm)
    if across > most:
        raise ConfigError(
            f"at f/{lens.f_number:g} and {wave_nm:g} nm this frame is {across / PERIOD:.3g} times"
            f" wavelength x f-number wide: its kernels would need a pupil of {across:.3g} cells"
            f" across; expected at most {most:g}; type"
            f" lens.f_number={1.05 * lens.f_number * across / most:.2g} or more, or a smaller field"
        )
    return across
