"""Far: kernels beyond the exact core, from the diffraction pattern on lattices of points.

A lattice (`physics.lattice`) holds the pattern of one wavelength somewhat finer than its speckles, at half the distance that they
may lie apart without loss. Weighting its points with the triangle that two constant tiles make of a point gives tile means, on a
grid finer than tiles. The pattern of a neighbouring wavelength is the same, scaled about the axis: the mean over a band reads the
grid at tile centres drawn in and out, for so many wavelengths that from one to the next no tile moves by more than half a tile.
Speckles thus become radial streaks, whatever the number of bands.

Without phase one pattern scales to all wavelengths: two lattices, half a step apart, serve every band. With a wavefront or a
third-party pupil a pair of lattices serves a part of the band, over which the phase hardly changes. Either way two independent
halves result, and half their difference states the error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft as sf

from isethdr_core.physics import lattice as lattices

from . import pupils

REFERENCE_NM = 380.0  # of the shared lattices where all bands are longer: a band then does not depend on which others there are
PERIOD = 3.0  # of the field, in reaches
WRAP = 0.015  # largest error that this leaves in the border tiles (L1, against a period of 7; clean round pupil with a wavefront)
RING_PUPIL = 500  # least cells across the stop
SHARED_SAMPLES = 1.2e8  # of one shared lattice, about a gigabyte while it is made
OWN_SAMPLES = 3e7  # of a lattice that serves one band
INNER = 4  # cores: within, a lattice of its own, where one over the frame would be coarse
GRID = 3  # of tile means, per tile: the nearest stands in for a place between them
READS = 1.5  # per tile that the corner moves within the band, of either half
LEAST_READS, MOST_READS = 12, 256
FINER = (1, 2, 4)  # times the reads, tried until the error is what the lens allows
DEFAULT_ERROR = 0.03  # for which lattices are made; for less they are finer
PHASE_CHANGE = 0.3  # radians rms, from one end of a part of the band to the other
UNKNOWN_PARTS = 2  # of a band, for a third-party pupil whose phase may change with wavelength
MOST_PARTS = 16
OCTAVES = 13  # of radius, for the errors: 1 to 2 tiles, 2 to 4, ... 4096 and more
STATED_ROWS = 256  # of a kernel that its error is read from


@dataclass(frozen=True, eq=False)
class Lattice:
    """Samples of a pattern: values[i, j] is the fraction of the energy per sample at (index - middle + offset) * step."""

    values: np.ndarray
    step_um: tuple[float, float]  # at `wavelength_nm`; a pattern without phase scales with wavelength
    wavelength_nm: float
    offset: tuple[float, float]


def shared(lens, flares, shortest_nm, pitch_um, reach) -> list[Lattice]:
    """Return two lattices, shifted by half a step, of the pattern of a pupil without phase, for all wavelengths of a frame."""
    wave = min(shortest_nm, REFERENCE_NM)
    step, far, period, cells = _sampling(lens, wave, pitch_um, reach, 1.0, SHARED_SAMPLES, max(1.0, DEFAULT_ERROR / lens.speckle_error), per_tile=3)
    energy, distance = pupils.open_energy_mm2(lens, flares, wave), pupils.distance_mm(lens)
    out = []
    for offset in ((0.0, 0.0), (0.5, 0.5)):
        pupil = lattices.fold_shapes(pupils.terms(lens, flares), pupils.radius_mm(lens), cells, period, offset)
        values = lattices.lattice_psf(pupil, wave, distance, far, (step, step), energy, offset, lattices.spline_response)
        out.append(Lattice(values, (step, step), wave, offset))
    return out


def own(plan, reach, wave, stretch, energy, fine) -> list[Lattice]:
    """Return two lattices, shifted by half a step, of the pattern at one wavelength, to be read up to `stretch` times the frame."""
    lens, flares = plan.lens, plan.flares
    step, far, period, cells = _sampling(lens, wave, plan.pitch, reach, stretch, OWN_SAMPLES, fine)
    offsets = ((0.0, 0.0), (0.5, 0.5))
    out = []
    for offset, pupil in zip(offsets, pupils.folded(lens, flares, wave, cells, period, offsets)):
        values = lattices.lattice_psf(pupil, wave, plan.distance, far, (step, step), energy, offset, lattices.binomial_response)
        out.append(Lattice(values, (step, step), wave, offset))
    return out


def _sampling(lens, wave, pitch_um, reach, stretch, most, fine, per_tile=2):
    """Return (step um, samples to the border, period, cells mm) of a lattice."""
    extent = [(r + 1) * p * stretch for r, p in zip(reach, pitch_um)]
    wanted = min(pupils.blur_um(lens, wave) / np.sqrt(2), min(pitch_um) / per_tile) / np.sqrt(fine)
    step = min(max(wanted, PERIOD * np.sqrt(np.prod(extent) / most)), min(pitch_um))
    far = tuple(int(np.ceil(e / step)) + 2 for e in extent)
    least = max(RING_PUPIL, pupils.phase_samples(lens, wave) / 2) * pupils.blur_um(lens, wave) / step
    period = tuple(sf.next_fast_len(int(np.ceil(max(PERIOD * n, least)))) for n in far)
    return step, far, period, lattices.lattice_pitch_mm(wave, period, pupils.distance_mm(lens), (step, step))


def rings(plan, centre, width, energy):
    """Return the kernel of a band beyond the core, and its relative L1 error per octave of radius in tiles (0 where exact)."""
    kernel, error = _refined(plan, plan.reach, plan.half, centre, width, energy)
    inner = tuple(min(r, INNER * h) for r, h in zip(plan.reach, plan.half))
    if inner != plan.reach and not plan.lattices and _coarse(plan, centre):
        part, part_error = _refined(plan, inner, plan.half, centre, width, energy)
        kernel[tuple(slice(r - i, r + i + 1) for r, i in zip(plan.reach, inner))] = part
        error[part_error > 0] = part_error[part_error > 0]
    return kernel, error


def _refined(plan, reach, hole, centre, width, energy):
    """Return a ring whose error is what the lens allows, or the least of three finer ones."""
    found = None
    for fine in FINER:
        kernel, error = ring(plan, reach, hole, centre, width, energy, fine)
        if found is None or error.max() < found[1].max():
            found = kernel, error
        if error.max() <= plan.lens.speckle_error:
            break
    return found


def _coarse(plan, wave):
    """Return whether a lattice over the whole frame is coarser than one over its middle."""
    steps = [_sampling(plan.lens, wave, plan.pitch, reach, 1.0, OWN_SAMPLES, 1)[0] for reach in (plan.reach, plan.half)]
    return steps[0] > 1.01 * steps[1]


def ring(plan, reach, hole, centre, width, energy, fine=1):
    """Return a ring's kernel, averaged over the band, and its relative L1 error outside the `hole`, per octave of radius.

    `fine` times as many wavelengths and places between tiles are read as usual.
    """
    moved = np.hypot(*reach) * width / centre
    count = fine * int(np.clip(np.ceil(READS * moved), LEAST_READS, MOST_READS))
    grid = int(np.ceil(GRID * np.sqrt(fine)))
    finer = fine * max(1.0, DEFAULT_ERROR / plan.lens.speckle_error)
    rows = reach[0] + 1 if plan.lattices else 2 * reach[0] + 1  # without phase the rest is the mirror image
    parts = 1 if plan.lattices else _parts(plan, centre, width)
    halves = [np.zeros((rows, 2 * reach[1] + 1), np.float32) for _ in range(2)]
    each = max(2, -(-count // parts))
    for part in range(parts):
        middle, span = centre + ((part + 0.5) / parts - 0.5) * width, width / parts
        pair = plan.lattices or own(plan, reach, middle, 1 / (1 - span / 2 / middle), energy, finer)
        waves = middle + ((np.arange(2 * each) + 0.5) / (2 * each) - 0.5) * span
        for half, lattice in enumerate(pair):
            _read(halves[half], lattice, middle, waves[half::2], plan.pitch, reach, grid, 1 / (parts * each))
    kernel, difference = (halves[0] + halves[1]) / 2, np.abs(halves[0] - halves[1]) / 2
    error = _by_octave(difference, kernel, reach, hole)
    if plan.lattices:
        kernel = np.concatenate([kernel, kernel[-2::-1, ::-1]])
        kernel[reach[0]] = (kernel[reach[0]] + kernel[reach[0], ::-1]) / 2
    return kernel, error


def _parts(plan, centre, width):
    """Return into how many parts of about the same phase to divide a band."""
    known = pupils.phase_change(plan.lens, plan.flares, centre - width / 2, centre + width / 2) / PHASE_CHANGE
    return int(np.clip(np.ceil(known), 1 if pupils.all_shapes(plan.flares) else UNKNOWN_PARTS, MOST_PARTS))


def _read(out, lattice, middle, waves, pitch_um, reach, grid, weight):
    """Add `weight` x the mean over tiles at every wavelength to `out`, whose rows start at the kernel's first."""
    draw = middle / waves.min()
    border = [int(np.ceil(r * draw * grid)) + 1 for r in reach]
    last = int(np.ceil((out.shape[0] - 1 - reach[0]) * draw * grid)) + 1
    means = _tile_means(lattice, middle, pitch_um, grid, np.arange(-border[0], last + 1), np.arange(-border[1], border[1] + 1))
    for wave in waves:
        scale = middle / wave
        y, x = (np.rint((np.arange(n) - r) * (scale * grid)).astype(np.intp) + b for n, r, b in zip(out.shape, reach, border))
        part = means.take(y, 0).take(x, 1)
        part *= np.float32(weight * scale**2)
        out += part


def _tile_means(lattice, wave, pitch_um, grid, rows, cols):
    """Return the light from one tile to another, for places `rows` and `cols` in units of a tile / grid."""
    scale = wave / lattice.wavelength_nm
    (first_y, weight_y), (first_x, weight_x) = (
        _triangle(n * p / grid, p, p * np.sqrt(1 - 0.5 / grid**2), s * scale, o, m)  # the nearest place adds (p / grid)^2 / 12
        for n, p, s, o, m in zip((rows, cols), pitch_um, lattice.step_um, lattice.offset, lattice.values.shape)
    )
    out = np.empty((len(rows), len(cols)), np.float32)
    for start in range(0, len(rows), 32):  # in blocks that stay in the processor's cache
        block = slice(start, start + 32)
        part = sum(lattice.values[first_y[block] + t] * w[block, None] for t, w in enumerate(weight_y))
        out[block] = sum(part.take(first_x + t, axis=1) * w for t, w in enumerate(weight_x))
    return out


def _triangle(at_um, pitch_um, half_um, step_um, offset, size):
    """Return the first sample and the weights (tap, place) of a triangle about every place; they sum to a tile's samples."""
    half_um = max(half_um, step_um)  # below a step: between two samples
    at = at_um / step_um - offset + size // 2
    taps = int(2 * half_um / step_um) + 1
    first = np.clip(np.ceil(at - half_um / step_um).astype(np.intp), 0, size - taps)
    weight = np.maximum(0.0, 1 - np.abs(first + np.arange(taps)[:, None] - at) * (step_um / half_um))
    return first, (weight * (pitch_um / step_um / weight.sum(0))).astype(np.float32)


def _by_octave(difference, kernel, reach, hole):
    """Return the sum of differences over the sum of the kernel outside the `hole`, per octave of radius."""
    rows = np.arange(0, len(kernel), max(1, len(kernel) // STATED_ROWS))
    y, x = rows[:, None] - reach[0], np.arange(kernel.shape[1]) - reach[1]
    octave = np.log2(np.maximum(np.hypot(y, x), 1.0)).astype(np.intp)
    seen = (np.abs(y) > hole[0]) | (np.abs(x) > hole[1])
    octave = np.minimum(octave, OCTAVES - 1)[seen]
    wrong, light = (np.bincount(octave, a[rows][seen], OCTAVES) for a in (difference, kernel))
    return np.divide(wrong, light, out=np.zeros(OCTAVES), where=light > 0)
