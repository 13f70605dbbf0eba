"""Far: kernels beyond the exact core, as averages of single points of the diffraction pattern.

A pattern is sampled once on a lattice about as fine as its speckles (`lattice_psf`). Every tile then takes the lattice point
nearest
to it plus a shift, for many wavelengths of the band and many shifts: reading a point costs a nanosecond, a transform thousands.
Shifts and rounding together have the variance of the triangle that two constant tiles make of a point.

Without phase the pattern of one wavelength is that of any other, scaled: two lattices serve all bands. With a wavefront
or a third-party pupil every wavelength needs a lattice of its own, of fewer points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft as sf

from isethdr_core.physics.diffraction import lattice_pitch_mm, lattice_psf
from isethdr_core.physics.pupil import folded

from . import pupils

REFERENCE_NM = 380.0  # of the shared lattices where all bands are longer: a band then does not depend on which others there are
PERIOD = 3.0  # of the field, in reaches: it wraps in amplitude near the border of the frame
WRAP = {False: 0.018, True: 0.064}  # light too much beyond 600 of 767 tiles, without and with phase; round pupil, 550 nm, measured
RING_PUPIL = 500  # least cells across the stop
SHARED_SAMPLES = 8e7  # of one shared lattice, about a gigabyte while it is made
STEPS = 4  # of a shared lattice per tile at most
POINTS = 3e7  # read per ring and band from shared lattices
MOST_POINTS = 512  # of them per tile
LATTICE_SAMPLES = (2.5e6, 1.3e6)  # of one wavelength's own lattice: frame, middle
LEAST_LATTICES = 4  # of them, per band
MOST_LATTICES = 32


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
    extent = [(r + 1) * p for r, p in zip(reach, pitch_um)]
    finest = max(pupils.blur_um(lens, wave), min(pitch_um) / STEPS, PERIOD * np.sqrt(np.prod(extent) / SHARED_SAMPLES))
    step = min(finest, min(pitch_um))
    far = tuple(int(np.ceil(e / step)) + 2 for e in extent)
    least = RING_PUPIL * pupils.blur_um(lens, wave) / step
    period = _period(far, least, least)
    distance, energy = pupils.distance_mm(lens), pupils.open_energy_mm2(lens, flares, wave)
    cells = lattice_pitch_mm(wave, period, distance, (step, step))
    out = []
    for offset in ((0.0, 0.0), (0.5, 0.5)):
        pupil = folded(pupils.terms(lens, flares), pupils.radius_mm(lens), cells, period, offset)
        values = lattice_psf(pupil, wave, period, distance, far, (step, step), energy, offset, folded=True)
        out.append(Lattice(values, (step, step), wave, offset))
    return out


def _period(reach, least_y, least_x):
    """Return the (y, x) period of a lattice: along the shorter axis more, for what wraps there is no farther than a corner."""
    whole = [max(PERIOD * r, r + 1.6 * max(reach)) for r in reach]
    return tuple(sf.next_fast_len(int(np.ceil(max(n, m)))) for n, m in zip(whole, (least_y, least_x)))


def ring(plan, reach, hole, centre, width, energy):
    """Return a ring's kernel, averaged over wavelengths and shifts, and its relative L1 error outside the `hole`."""
    tiles = np.prod([2.0 * r + 1 for r in reach])
    if plan.lattices:
        count = int(np.clip(POINTS * 2 / tiles, 2, MOST_POINTS))
        points = ((wave, plan.lattices[i % 2], i % 2) for i, wave in enumerate(_waves(centre, width, count)))
        rows = reach[0] + 1  # the rest is the mirror image
    else:
        points, rows = _own(plan, reach, centre, width, energy), 2 * reach[0] + 1
    halves, number = [0.0, 0.0], [0, 0]
    for i, (wave, lattice, half) in enumerate(points):
        halves[half] = halves[half] + _nearest(lattice, wave, plan.pitch, reach, rows, i + int(centre))
        number[half] += 1
    kernel = (halves[0] + halves[1]) / sum(number)
    # Half the difference of two independent halves has the scatter of their mean. These halves complement each other, so it
    # overstates: by 1.2 to 1.8 on wide frames where it was measured, by up to 4 on frames of a hundred tiles.
    difference = np.abs(halves[0] / number[0] - halves[1] / number[1]) / 2
    if plan.lattices:
        kernel, difference = (np.concatenate([a, a[-2::-1, ::-1]]) for a in (kernel, difference))
        kernel[reach[0]] = (kernel[reach[0]] + kernel[reach[0], ::-1]) / 2
    cut = tuple(slice(r - h, r + h + 1) for r, h in zip(reach, hole))
    seen = kernel.sum(dtype=float) - kernel[cut].sum(dtype=float)
    return kernel, float((difference.sum(dtype=float) - difference[cut].sum(dtype=float)) / seen) if seen > 0 else 0.0


def _waves(centre, width, count):
    return centre + ((np.arange(count) + 0.5) / count - 0.5) * width


def _own(plan, reach, centre, width, energy):
    """Yield (wavelength, lattice, half) with a lattice for every wavelength, all from one raster of the pupil."""
    lens, flares, distance = plan.lens, plan.flares, plan.distance
    fine = max(1, int(np.sqrt(LATTICE_SAMPLES[reach != plan.reach] / np.prod([PERIOD * (r + 1) for r in reach]))))
    across = max(RING_PUPIL, pupils.phase_samples(lens, centre - width / 2))
    period = _period([(r + 1) * fine for r in reach], *(across * pupils.blur_um(lens, centre) * fine / p for p in plan.pitch))
    pitch = [p / fine for p in plan.pitch]
    cells_mm = lattice_pitch_mm(centre, period, distance, pitch)
    x, y = pupils.axis_mm(lens, cells_mm[1]), pupils.axis_mm(lens, cells_mm[0])
    opd_um = pupils.opd_um(lens, x, y, centre - width / 2)
    mean = pupils.phase_mean(opd_um / np.float32(centre * 1e-3)) if opd_um.size > 1 else 1.0  # within a band it is the same
    cells = pupils.amplitude(lens, flares, x, y, centre) * mean if plan.fixed else None
    far = tuple(int(np.ceil((r + 1) * fine * (1 + width / centre))) + 2 for r in reach)
    smear = len(plan.wavelengths(centre, width, max(reach), 1))  # speckles that the band draws out into one
    count = max(LEAST_LATTICES / (fine * plan.split) ** 2, smear / 4 / plan.split)
    for i, wave in enumerate(_waves(centre, width, int(np.clip(np.ceil(count), 2, MOST_LATTICES)))):
        offset = tuple(np.modf(0.5 + (i + int(centre)) * np.array([0.8191725133961645, 0.6710436067037893]))[0] - 0.5)
        now = cells if plan.fixed else pupils.amplitude(lens, flares, x, y, wave) * mean
        field = pupils.folded_with_wavefront(now, opd_um, wave, period, offset)
        step = tuple(p * wave / centre for p in pitch)  # the same pupil cells at another wavelength
        lattice = Lattice(lattice_psf(field, wave, period, distance, far, step, energy, offset, folded=True), step, wave, offset)
        for _ in range(4 * fine**2):
            yield wave, lattice, i % 2


def _nearest(lattice, wave, pitch_um, reach, rows, i):
    """Return the lattice point nearest to every tile's centre plus the i-th shift, times tile area, for the first `rows` rows."""
    index, area = [], 1.0
    for axis, n in ((0, rows), (1, 2 * reach[1] + 1)):
        step = lattice.step_um[axis] * wave / lattice.wavelength_nm
        shift = _shift(i)[axis] * np.sqrt(max(0.0, 1 - (step / pitch_um[axis]) ** 2 / 2))  # rounding adds step^2 / 12
        at = (np.arange(n) - reach[axis] + shift) * (pitch_um[axis] / step) - lattice.offset[axis]
        index.append(np.rint(at).astype(np.intp) + lattice.values.shape[axis] // 2)
        area *= pitch_um[axis] / step
    return lattice.values.take(index[0], 0).take(index[1], 1) * np.float32(area)


def _shift(i):
    """Return the (y, x) shift of the i-th point in tiles: triangular density, the difference of two uniform points."""
    u = np.modf(0.5 + i * np.array([0.7548776662466927, 0.5698402909980532]))[0]  # Roberts' plastic-number sequence
    return np.where(u < 0.5, np.sqrt(2 * u) - 1, 1 - np.sqrt(2 * (1 - u)))
