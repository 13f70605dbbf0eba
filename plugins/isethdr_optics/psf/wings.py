"""Wings: kernels beyond the exact core, from the diffraction pattern on lattices of points.

A lattice (`physics.optics.lattice`) samples the pattern of one wavelength somewhat finer than its
speckles. Its points are weighted with a triangle, the convolution of two constant tiles, which
gives tile means on a grid finer than the tiles. The pattern of a neighbouring wavelength is the
same, scaled about the axis. The mean over a band therefore reads the grid at scaled tile centres,
at wavelengths so close that no tile moves by more than half a tile from one to the next. Speckles
become radial streaks for any number of bands.

Without phase, one pattern scales to all wavelengths: two lattices, offset by half a step, serve
every band. With a wavefront or a third-party pupil, a pair of lattices serves a part of the band,
in which the phase hardly changes. In both cases there are two independent estimates, and half of
their difference states the error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy.fft as sf
from scipy.sparse import csr_array

from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics import lattice as lattices

from ..pupil import sampled_pupil
from . import kernel_sampling_error

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics
    from .kernels import BandPlan

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
GRID = 3  # of tile means, per tile: the nearest stands in for a place between them
# of the highest spatial frequency: what a lattice takes for lower ones; beside those that tiles
# pass, hardly any light has them
CLEAR = 1.0
# samples across a wide tile: it and its neighbours then hold 600, whose mean is right to 3 %
ENOUGH = 16
FARTHEST = 4  # wavelengths x f-number between samples
# samples per wavelength x f-number, at most: between them a line is right to 3 % of the finest
# detail
SMOOTH = 12
READS = 1.0  # per tile that a tile moves within the band, of either half
# of a block of tiles that is read at once
ROWS = 32
COLUMNS = 240
LEAST_READS = 12
MOST_READS = 256
FINER = (1, 2, 4)  # times the reads, tried until the error is what the lens allows
STRETCHED = 1.15  # times the frame, that lattices at knots are read over
FINEST = 0.8  # times a step, at least: what counts as finer
DEFAULT_ERROR = 0.03  # error of lattices with the usual sampling
# cells across a pupil: a minute where it is shapes alone; twenty, cell by cell, with phase
MOST_ACROSS = 3e5
MOST_ACROSS_PHASE = 8e4
# from the shortest wavelength down to the lattice that it is read from, at most: the widest of
# `interpolation_wavelengths.STEPS_NM`
BELOW_NM = 80.0
CHORD_BYTES = 700  # of a pupil of shapes, while it is folded
PHASE_CHANGE = 0.3  # radians rms, from one end of a part of the band to the other
UNKNOWN_PARTS = 2  # of a band, for a third-party pupil whose phase may change with wavelength
MOST_PARTS = 16


@dataclass(frozen=True, eq=False)
class Lattice:
    """Samples of a pattern: values[i, j] is the fraction of the energy per sample at (index -
    middle + offset) * step.
    """

    values: np.ndarray
    # at `wavelength_nm`, as `sampled_pupil.scaled_nm`; without phase it scales with wavelength
    step_um: tuple[float, float]
    wavelength_nm: float
    offset: tuple[float, float]


class Grid(NamedTuple):
    """Tiles of a kernel before it is summed: parts of the frame's tiles."""

    split: int  # parts per tile, along each axis
    pitch_um: tuple[float, float]  # (y, x) of a part
    reach: tuple[int, int]  # (y, x) parts from the axis to the border


class _Size(NamedTuple):
    """Extent and fineness of a lattice."""

    most: float  # samples
    stretch: float = 1.0  # extent over that of the frame
    fine: float = 1.0  # samples over the usual number
    shared: bool = False  # one pattern for all wavelengths


def shared(
    lens: PupilOptics, flares: Sequence[Flare], shortest_nm: float, grid: Grid
) -> list[Lattice]:
    """Return two lattices, shifted by half a step, of the pattern of a pupil without phase, for all
    wavelengths of a frame.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    shortest_nm : shortest wavelength of the frame, nm.
    grid : tiles of the kernel.
    """
    wave = min(shortest_nm, REFERENCE_NM)
    fine = max(1.0, DEFAULT_ERROR / lens.speckle_error)
    size = _Size(most_samples(lens, wave, grid, SHARED_SAMPLES), fine=fine, shared=True)
    step, far, period, cells = _sampling(lens, wave, grid, size)
    _check_pupil(lens, wave, cells, MOST_ACROSS)
    energy = sampled_pupil.open_energy_mm2(lens, flares, wave)
    distance = sampled_pupil.distance_mm(lens)
    out = []
    for offset in ((0.0, 0.0), (0.5, 0.5)):
        pupil = lattices.fold_shapes(
            sampled_pupil.terms(lens, flares),
            sampled_pupil.reach_mm(lens),
            cells,
            period,
            offset,
            _chords_per_cell(lens, wave, grid),
        )
        samples = lattices.ImageSamples(wave, distance, (step, step), offset)
        values = lattices.lattice_psf(pupil, samples, far, energy, lattices.spline_response)
        out.append(Lattice(values, (step, step), wave, offset))
    return out


def own(
    plan: BandPlan, reach: tuple[int, int], wave: float, stretch: float, energy: float, fine: float
) -> list[Lattice]:
    """Return two lattices, shifted by half a step, of the pattern at one wavelength, to be read up
    to `stretch` times the frame.

    Parameters
    ----------
    plan : `kernels.BandPlan` of the band.
    reach : (y, x) parts of tiles from the axis to the border.
    wave : wavelength, nm.
    stretch : times the frame, up to which it is read.
    energy : of the open pupil, mm2.
    fine : times the usual number of samples.
    """
    lens = plan.lens
    flares = plan.flares
    grid = Grid(plan.split, plan.pitch, reach)
    size = _Size(most_samples(lens, wave, grid, OWN_SAMPLES), stretch, fine)
    step, far, period, cells = _sampling(lens, wave, grid, size)
    _check_pupil(lens, wave, cells, MOST_ACROSS_PHASE)
    offsets = ((0.0, 0.0), (0.5, 0.5))
    folded = sampled_pupil.folded(lens, flares, wave, cells, period, offsets)
    out = []
    scaled_nm = sampled_pupil.scaled_nm(lens, wave)
    for offset in offsets:  # the first is let go of before the second is transformed
        samples = lattices.ImageSamples(scaled_nm, plan.distance, (step, step), offset)
        values = lattices.lattice_psf(
            folded.pop(0), samples, far, energy, lattices.binomial_response
        )
        out.append(Lattice(values, (step, step), scaled_nm, offset))
    return out


def most_samples(lens: PupilOptics, wave: float, grid: Grid, usual: float) -> float:
    """Return the samples that one lattice may have, `usual` of them for tiles of any usual width.

    Parameters
    ----------
    lens : a lens of this package. `wave` : wavelength, nm. `grid` : parts of the tiles.
    """
    return min(usual, WIDE_SAMPLES) if _very_wide(lens, wave, grid) else usual


def _very_wide(lens: PupilOptics, wave: float, grid: Grid) -> bool:
    width_um = min(grid.pitch_um) * grid.split
    return width_um > VERY_WIDE * sampled_pupil.blur_um(lens, wave)


def _chords_per_cell(lens: PupilOptics, wave: float, grid: Grid) -> int:
    return WIDE_CHORDS if _very_wide(lens, wave, grid) else lattices.CHORDS_PER_CELL


def fold_seconds(lens: PupilOptics, flares: Sequence[Flare], wave: float, grid: Grid) -> float:
    """Return the CPU seconds of drawing the two pupils of `shared`.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components, all of shapes.
    wave : the shortest wavelength, nm. `grid` : parts of the tiles.
    """
    wave = min(wave, REFERENCE_NM)
    size = _Size(most_samples(lens, wave, grid, SHARED_SAMPLES), shared=True)
    cell_mm = _sampling(lens, wave, grid, size)[3][0]
    heights = sum(shape.high - shape.low for shape, _ in sampled_pupil.terms(lens, flares))
    return 2 * FOLD_S * heights / cell_mm * _chords_per_cell(lens, wave, grid)


def _sampling(
    lens: PupilOptics, wave: float, grid: Grid, size: _Size
) -> tuple[float, tuple[int, int], tuple[int, int], tuple[float, float]]:
    """Return (step um, samples to the border, period, cells mm) of a lattice.

    A tile of several parts is wide: it averages over many speckles, and the step may be coarser.
    """
    split, pitch_um, reach = grid
    most, stretch, fine, shared = size
    extent = [(r + 1) * p * stretch for r, p in zip(reach, pitch_um)]
    blur = sampled_pupil.blur_um(lens, wave)
    pitch = min(pitch_um)
    if shared:
        step_wanted = min(blur / np.sqrt(2), pitch / 3)
    elif split > 1:
        step_wanted = min(max(blur / CLEAR, pitch * split / ENOUGH), FARTHEST * blur)
    else:
        step_wanted = min(blur / (CLEAR + blur / (2 * pitch)), pitch / 2)
    step_wanted = max(step_wanted, blur / SMOOTH) / np.sqrt(fine)
    step = min(
        max(step_wanted, PERIOD * np.sqrt(np.prod(extent) / most)), max(pitch, blur / SMOOTH)
    )
    far = tuple(int(np.ceil(e / step)) + 2 for e in extent)
    least = (
        max(RING_PUPIL, sampled_pupil.phase_samples(lens, wave) / 2)
        * sampled_pupil.blur_um(lens, wave)
        / step
    )
    period = tuple(sf.next_fast_len(int(np.ceil(max(PERIOD * n, least)))) for n in far)
    return (
        step,
        far,
        period,
        lattices.lattice_pitch_mm(
            sampled_pupil.scaled_nm(lens, wave),
            period,
            sampled_pupil.distance_mm(lens),
            (step, step),
        ),
    )


def lattice_bytes(lens: PupilOptics, shortest_nm: float, tiles: Grid) -> float:
    """Return the peak memory, bytes, of the two lattices of a pupil.

    It consists of a complex field over its period, and both patterns.

    Parameters
    ----------
    lens : a lens of this package. `shortest_nm` : wavelength.
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
    size = _Size(most_samples(lens, wave, tiles, most), stretch, shared=not phase)
    _, far, period, cells = _sampling(lens, wave, tiles, size)
    across = _check_pupil(lens, wave, cells, MOST_ACROSS_PHASE if phase else MOST_ACROSS)
    return (
        8 * float(np.prod(period, dtype=float))
        + 2 * 4 * float(np.prod([2.0 * n + 1 for n in far]))
        + (not phase) * CHORD_BYTES * min(lattices.CHORDS, across * lattices.CHORDS_PER_CELL)
    )


def _check_pupil(
    lens: PupilOptics, wave_nm: float, cells_mm: tuple[float, float], most: float
) -> float:
    """Return the cells across a lattice's pupil; refuse more than `most`, before they are drawn.

    Their number is the width of the lattice's period in wavelengths x f-number: large frames of
    fast lenses take many.
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


def rings(
    plan: BandPlan, centre: float, width: float, energy: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the kernel of a band beyond the core, and half the difference of its two estimates.

    Both are 0 within the core. Rings whose error is larger than the lens allows are computed again
    with finer sampling.

    Parameters
    ----------
    plan : lens, flares and lattices. `centre`, `width` : of the band, nm.
    energy : of the open pupil, mm2.
    """
    reach = plan.reach
    fine = FINER[0]
    kernel, wrong = ring(plan, reach, centre, width, energy, fine)
    while True:
        over = np.flatnonzero(_errors(plan, kernel, wrong) > plan.lens.speckle_error)
        if not len(over):
            return kernel, wrong
        nearer = tuple(
            min(r, max(h + 1, 2 ** (int(over[-1]) + 1) * plan.split))
            for r, h in zip(reach, plan.half)
        )
        reach, fine = nearer, _finer(plan, centre, reach, nearer, fine)
        if not fine:
            return kernel, wrong
        ring_values, off = ring(plan, reach, centre, width, energy, fine)
        middle = tuple(slice(r - n, r + n + 1) for r, n in zip(plan.reach, reach))
        if (
            _errors(plan, ring_values, off).max()
            < _errors(plan, kernel[middle], wrong[middle]).max()
        ):
            kernel[middle], wrong[middle] = ring_values, off


def _errors(plan: BandPlan, kernel: np.ndarray, wrong: np.ndarray) -> np.ndarray:
    """Return the error of whole tiles per octave of their distance."""
    return kernel_sampling_error.by_octave(
        *(tile_sums(a[_whole_turns(a, plan.split)], plan.split) for a in (wrong, kernel))
    )


def _whole_turns(fine: np.ndarray, split: int) -> Any:
    """Return the slices of a function sampled `split` times per tile that hold whole tiles, one in
    the middle.
    """
    reach = [(n // 2 - (split - 1)) // split * split + split - 1 for n in fine.shape]
    return tuple(slice(n // 2 - r, n // 2 + r + 1) for n, r in zip(fine.shape, reach))


def tile_sums(fine: np.ndarray, s: int) -> np.ndarray:
    """Return tile-to-tile sums of a function sampled s times per tile: triangular weights along
    both axes.
    """
    if s == 1:
        return fine
    weight = ((s - np.abs(np.arange(-(s - 1), s))) / s).astype(fine.dtype)
    for axis in (0, 1):
        window = np.lib.stride_tricks.sliding_window_view(fine, 2 * s - 1, axis=axis)
        fine = (window[::s] if axis == 0 else window[:, ::s]) @ weight
    return fine


def _error_wanted(lens: PupilOptics) -> float:
    """Return the factor by which lattices with phase are finer, for the error that a lens allows.

    The error falls faster than the number of samples grows.
    """
    return max(1.0, DEFAULT_ERROR / lens.speckle_error) ** 0.5


def _finer(
    plan: BandPlan, wave: float, reach: tuple[int, int], nearer: tuple[int, int], fine: float
) -> float:
    """Return how fine the next ring is to be, within `nearer`; 0 where memory allows no finer
    lattice: more reads alone change little.
    """
    if plan.lattices:
        return next((f for f in FINER if f > fine), 0)
    error_wanted = _error_wanted(plan.lens)
    tries = ((reach, fine), *((nearer, f) for f in FINER))
    most = most_samples(plan.lens, wave, Grid(plan.split, plan.pitch, reach), OWN_SAMPLES)
    now, *steps = (
        _sampling(
            plan.lens,
            wave,
            Grid(plan.split, plan.pitch, r),
            _Size(most, STRETCHED, f * error_wanted),
        )[0]
        for r, f in tries
    )
    return next((f for f, step in zip(FINER, steps) if step < FINEST * now), 0)


def ring(
    plan: BandPlan,
    reach: tuple[int, int],
    centre: float,
    width: float,
    energy: float,
    fine: int = 1,
) -> tuple[np.ndarray, np.ndarray]:
    """Return a ring's kernel, averaged over a band, and half the difference of its two estimates.

    The difference is 0 within the exact core.

    Parameters
    ----------
    plan : lens, flares, lattices and core. `reach` : (y, x) tiles to the border of the ring.
    centre, width : of the band, nm. `energy` : of the open pupil, mm2.
    fine : factor on the usual number of wavelengths and points between tiles.
    """
    grid = int(np.ceil(GRID * np.sqrt(fine)))
    finer = fine * _error_wanted(plan.lens)
    # without phase the rest is the mirror image
    rows = reach[0] + 1 if plan.lattices else 2 * reach[0] + 1
    parts = 1 if plan.lattices else _parts(plan, centre, width)
    halves = [np.zeros((rows, 2 * reach[1] + 1), np.float32) for _ in range(2)]
    for part in range(parts):
        middle = centre + ((part + 0.5) / parts - 0.5) * width
        span = width / parts
        pair = [[(one, 1.0)] for one in plan.lattices] or plan.knots.around(
            plan, reach, middle, span, energy, finer
        )
        for half, pattern_half in enumerate(pair):
            pattern = _Pattern(
                pattern_half,
                sampled_pupil.scaled_nm(plan.lens, middle),
                span,
                fine / parts,
                1 / parts,
            )
            _read(halves[half], half, pattern, plan.pitch, reach, grid)
    both = [(halves[0] + halves[1]) / 2, (halves[0] - halves[1]) / 2]
    for k, half in enumerate(both if plan.lattices else ()):
        both[k] = np.concatenate([half, half[-2::-1, ::-1]])
        both[k][reach[0]] = (both[k][reach[0]] + both[k][reach[0], ::-1]) / 2
    kernel, wrong = both
    wrong[tuple(slice(r - h, r + h + 1) for r, h in zip(reach, plan.half))] = 0.0
    return kernel, wrong


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
    size = _Size(most_samples(lens, wave, grid, usual), stretch, shared=shared_by_all)
    period = _sampling(lens, wave, grid, size)[2]
    return float(np.prod(period, dtype=float))


def reads_of(plan: BandPlan, centre: float, width: float) -> float:
    """Return the tiles of a band times the wavelengths that each is read at, of both halves.

    Parameters
    ----------
    plan : `kernels.BandPlan` of the band.
    centre : of the band, nm.
    width : of the band, nm.
    """
    moved = np.hypot(*plan.reach) * width / centre
    count = np.clip(0.6 * READS * moved, LEAST_READS, MOST_READS)
    return float(2 * count * np.prod([2.0 * r + 1 for r in plan.reach]))


def parts_of(plan: BandPlan, centre: float, width: float) -> int:
    """Return into how many parts of about the same phase a band is divided.

    Parameters
    ----------
    plan : `kernels.BandPlan` of the band.
    centre : of the band, nm.
    width : of the band, nm.
    """
    return _parts(plan, centre, width)


def check_delay(
    delay_um: float, wavelength_nm: ArrayLike, width_nm: np.ndarray, beside: float = 0.0
) -> None:
    """Raise ConfigError if the phase of dust changes too much within a part of a band.

    Parameters
    ----------
    delay_um : largest optical path difference of a grain.
    wavelength_nm, width_nm : centres and widths of the bands.
    beside : change of the lens's own phase within a band, radians rms.
    """
    wave = np.asarray(wavelength_nm, float)
    width = np.asarray(width_nm, float)
    change = 2e3 * np.pi * abs(delay_um) * (1 / (wave - width / 2) - 1 / (wave + width / 2))
    worst = int(np.argmax(change))
    most = MOST_PARTS * PHASE_CHANGE
    if np.hypot(change[worst], beside) > most:
        allowed_um = 0.95 * abs(delay_um) * max(most**2 - beside**2, 0.0) ** 0.5 / change[worst]
        raise ConfigError(
            f"dust_delay_um is {delay_um:g}: within the band at {wave[worst]:g} nm,"
            f" {width[worst]:g} nm wide, its phase changes by {change[worst]:.3g}"
            f" rad{f', the lens by {beside:.3g}' if beside else ''}; expected at most {most:g} rad"
            f" together; type flare.NAME.dust_delay_um={allowed_um:.2g} or less, or take narrower"
            " bands"
        )


def _parts(plan: BandPlan, centre: float, width: float) -> int:
    """Return into how many parts of about the same phase to divide a band."""
    parts_of_ring = (
        sampled_pupil.phase_change(plan.lens, plan.flares, centre - width / 2, centre + width / 2)
        / PHASE_CHANGE
    )
    return int(
        np.clip(
            np.ceil(parts_of_ring),
            1 if sampled_pupil.all_shapes(plan.flares) else UNKNOWN_PARTS,
            MOST_PARTS,
        )
    )


class _Pattern(NamedTuple):
    """The pattern of a part of a band, and how it is read."""

    lattices: list[tuple[Lattice, float]]  # with their weights: the pattern at `middle_nm`
    middle_nm: float
    span_nm: float  # width of the part
    often: float  # factor on the usual number of wavelengths
    weight: float  # of the part in the band


def _read(
    out: np.ndarray,
    half: int,
    pattern: _Pattern,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
    grid: int,
) -> None:
    """Add the weighted mean over a part of a band to `out`.

    Parameters
    ----------
    out : (y, x), from the first row of the kernel on.
    half : 0 or 1: reads every second wavelength, from this one on.
    pattern : of the part of the band.
    pitch_um : (y, x) of a tile. `reach` : (y, x) tiles. `grid` : points per tile.

    Notes
    -----
    Blocks of tiles fit the processor's cache. The outermost tile of a block determines the number
    of wavelengths that it reads.
    """
    pattern_half, middle, span, often, weight = pattern
    draw = 1 / (1 - span / 2 / middle)
    border = [int(np.ceil(r * draw * grid)) + 1 for r in reach]
    last = int(np.ceil((out.shape[0] - 1 - reach[0]) * draw * grid)) + 1
    means = _tile_means(
        pattern_half,
        middle,
        pitch_um,
        grid,
        np.arange(-border[0], last + 1),
        np.arange(-border[1], border[1] + 1),
    )
    for y in _blocks(out.shape[0], ROWS):
        for x in _blocks(out.shape[1], COLUMNS):
            offsets = [np.arange(b.start, b.stop) - r for b, r in zip((y, x), reach)]
            # within the whole band
            moved = np.hypot(*(np.abs(a).max() for a in offsets)) * span / weight / middle
            count = max(
                2, int(np.ceil(often * np.clip(np.ceil(READS * moved), LEAST_READS, MOST_READS)))
            )
            scales = middle / (
                middle + ((np.arange(half, 2 * count, 2) + 0.5) / (2 * count) - 0.5) * span
            )
            columns = slice(
                *(int(np.rint(e * grid * s)) + border[1] for e, s in _outermost(offsets[1], scales))
            )
            total = np.zeros((len(offsets[0]), len(offsets[1])), np.float32)
            for scale in scales:
                rows, cols = (np.rint(a * (scale * grid)).astype(np.intp) for a in offsets)
                part = means[rows + border[0], columns].take(cols + (border[1] - columns.start), 1)
                part *= np.float32(weight / count * scale**2)
                total += part
            out[y, x] += total


def _outermost(
    offsets: np.ndarray, scales: np.ndarray
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return (place, scale) of the first and of one past the last column that is read."""
    low = float(offsets[0])
    high = float(offsets[-1])
    return (low, scales.max() if low < 0 else scales.min()), (
        high + 1,
        scales.max() if high + 1 > 0 else scales.min(),
    )


def _blocks(count: int, size: int) -> Any:
    return [slice(start, min(start + size, count)) for start in range(0, count, size)]


def _tile_means(
    pattern_half: Sequence[tuple[Lattice, float]],
    wave: float,
    pitch_um: tuple[float, float],
    grid: int,
    rows: np.ndarray,
    cols: np.ndarray,
) -> np.ndarray:
    """Return the light from one tile to another, for places `rows` and `cols` in units of a tile /
    grid, the sum of shares of lattices.
    """
    out = np.zeros((len(rows), len(cols)), np.float32)
    for lattice, share in pattern_half:
        scale = wave / lattice.wavelength_nm
        down, across = (
            _triangles(
                n * p / grid, p, p * np.sqrt(1 - 0.5 / grid**2), s * scale, o, m
            )  # the nearest place adds (p / grid)^2 / 12
            for n, p, s, o, m in zip(
                (rows, cols), pitch_um, lattice.step_um, lattice.offset, lattice.values.shape
            )
        )
        down *= np.float32(share)
        for block in _blocks(len(rows), 64):  # that stay in the processor's cache
            out[block] += (across @ np.ascontiguousarray((down[block] @ lattice.values).T)).T
    return out


def _triangles(
    at_um: np.ndarray, pitch_um: float, half_um: float, step_um: float, offset: float, size: int
) -> csr_array:
    """Return the weights (place, sample), sparse, of a triangle about every place; they sum to a
    tile's samples.
    """
    half_um = max(half_um, step_um)  # below a step: between two samples
    at = at_um / step_um - offset + size // 2
    taps = int(2 * half_um / step_um) + 1
    first = np.clip(np.ceil(at - half_um / step_um).astype(np.intp), 0, size - taps)
    sample = first[:, None] + np.arange(taps)
    weight = np.maximum(0.0, 1 - np.abs(sample - at[:, None]) * (step_um / half_um))
    weight *= pitch_um / step_um / weight.sum(axis=1, keepdims=True)
    return csr_array(
        (weight.astype(np.float32).ravel(), sample.ravel(), np.arange(len(at) + 1) * taps),
        (len(at), size),
    )
