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

from isethdr_core.errors import ConfigError
from isethdr_core.physics import lattice as lattices

from . import kernel_errors, pupils

REFERENCE_NM = 380.0  # of the shared lattices where all bands are longer: a band then does not depend on which others there are
PERIOD = 3.0  # of the field, in reaches
WRAP = 0.018  # largest error that this leaves in the border tiles (L1, against a period of 7; clean round pupil with a wavefront)
WRAP_SHARED = 0.0015  # and of a pupil without phase, whose lattices serve all bands
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
    """Return the kernel of a band beyond the core, and half the difference of its halves, 0 within."""
    kernel, wrong = _refined(plan, plan.reach, plan.half, centre, width, energy)
    inner = tuple(min(r, INNER * h) for r, h in zip(plan.reach, plan.half))
    if inner != plan.reach and not plan.lattices and _coarse(plan, centre):
        middle = tuple(slice(r - i, r + i + 1) for r, i in zip(plan.reach, inner))
        kernel[middle], wrong[middle] = _refined(plan, inner, plan.half, centre, width, energy)
    return kernel, wrong


def _refined(plan, reach, hole, centre, width, energy):
    """Return a ring whose error is what the lens allows, or the least of three finer ones."""
    found = None
    for fine in FINER:
        kernel, wrong = ring(plan, reach, hole, centre, width, energy, fine)
        error = kernel_errors.by_octave(wrong, kernel).max()
        if found is None or error < found[2]:
            found = kernel, wrong, error
        if error <= plan.lens.speckle_error:
            break
    return found[:2]


def _coarse(plan, wave):
    """Return whether a lattice over the whole frame is coarser than one over its middle."""
    steps = [_sampling(plan.lens, wave, plan.pitch, reach, 1.0, OWN_SAMPLES, 1)[0] for reach in (plan.reach, plan.half)]
    return steps[0] > 1.01 * steps[1]


def ring(plan, reach, hole, centre, width, energy, fine=1):
    """Return a ring's kernel, averaged over the band, and half the difference of its halves, 0 in the `hole`.

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
        pair = [[(one, 1.0)] for one in plan.lattices] or plan.knots.around(plan, reach, middle, span, energy, finer)
        waves = middle + ((np.arange(2 * each) + 0.5) / (2 * each) - 0.5) * span
        for half, lattice, share in ((half, *one) for half, given in enumerate(pair) for one in given):
            _read(halves[half], lattice, middle, waves[half::2], plan.pitch, reach, grid, share / (parts * each))
    both = [(halves[0] + halves[1]) / 2, (halves[0] - halves[1]) / 2]
    for k, half in enumerate(both if plan.lattices else ()):
        both[k] = np.concatenate([half, half[-2::-1, ::-1]])
        both[k][reach[0]] = (both[k][reach[0]] + both[k][reach[0], ::-1]) / 2
    kernel, wrong = both
    wrong[tuple(slice(r - h, r + h + 1) for r, h in zip(reach, hole))] = 0.0
    return kernel, wrong


def check_delay(delay_um: float, wavelength_nm, width_nm, beside: float = 0.0) -> None:
    """Raise ConfigError where dust delays light by so much that the phase changes by more within a band than its parts can follow.

    Parameters
    ----------
    delay_um : largest optical path difference of a grain.
    wavelength_nm, width_nm : centres and widths of the bands; `beside` the change of the lens's own phase within a band, radians rms.
    """
    wave, width = np.asarray(wavelength_nm, float), np.asarray(width_nm, float)
    change = 2e3 * np.pi * abs(delay_um) * (1 / (wave - width / 2) - 1 / (wave + width / 2))
    worst, most = int(np.argmax(change)), MOST_PARTS * PHASE_CHANGE
    if np.hypot(change[worst], beside) > most:
        allowed_um = 0.95 * abs(delay_um) * max(most**2 - beside**2, 0.0) ** 0.5 / change[worst]
        raise ConfigError(
            f"dust_delay_um is {delay_um:g}: within the band at {wave[worst]:g} nm, {width[worst]:g} nm wide, its phase changes by "
            f"{change[worst]:.3g} rad{f', the lens by {beside:.3g}' if beside else ''}; expected at most {most:g} rad together; "
            f"type flare.NAME.dust_delay_um={allowed_um:.2g} or less, or take narrower bands"
        )


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
