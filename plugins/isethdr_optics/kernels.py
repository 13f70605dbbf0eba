"""Kernels: how much of a tile's light reaches every other tile, averaged over a band, over the whole frame.

A kernel is the point spread function averaged over the source tile and integrated over the receiving one. Close to the axis this
is
exact (`integrated_psf`). Far out, where only a transform of the folded pupil is affordable, every wavelength gives one point, or
s x s points, per tile; a low-discrepancy set of offsets and wavelengths averages over tile and band. What remains is speckle,
measured by the difference between two halves of that set.
"""

from __future__ import annotations

import os
from collections import OrderedDict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, is_dataclass

import numpy as np
import scipy.fft as sf

from isethdr_core.errors import ConfigError
from isethdr_core.physics.diffraction import integrated_psf, lattice_pitch_mm, lattice_psf, psf_from_pupil
from isethdr_core.physics.pupil import folded
from isethdr_core.physics.radiometry import band_widths_nm

from . import pupils, scatter

CORE_SAMPLES = 240  # image samples from the axis to the border of the exact core
TAIL_SAMPLES = 2.5e6  # of one folded transform: coarse frames are sampled several times per tile up to this
MIDDLE_SAMPLES = 1e6  # of one folded transform of the ring around the core
PERIOD = 3.0  # of the field, in reaches: it wraps in amplitude, 4 % of the light near the border of the frame at 3
RING_PUPIL = 500  # least cells across the stop
LEAST_POINTS = 4  # per band and tile
MOST_WAVELENGTHS = 32  # per band, however wide
MOST_TILES = 4e6  # of a kernel whose coarse tiles were divided
CACHE_BYTES = 3 << 30


@dataclass(frozen=True, eq=False)
class Kernels:
    """Kernels of all bands (float32, the axis in the middle) and what is known of their errors."""

    bands: list[np.ndarray]
    outside: np.ndarray  # fraction of the energy beyond the kernel, per band
    speckle: np.ndarray  # relative L1 error per tile beyond the exact core, per band
    transmitted: np.ndarray  # light through the pupil / light through the clean round stop, per band
    keep: tuple = ()  # what the cache's key names: objects stay alive, so that an id is never used twice


_cache: OrderedDict[tuple, Kernels] = OrderedDict()


def kernels(lens, flares, wavelength_nm, pitch_um, reach) -> Kernels:
    """Return the kernels of a lens with `flares` for bands centred on `wavelength_nm`; kept in the process.

    Parameters
    ----------
    pitch_um : (y, x) tile pitch.
    reach : (y, x) tiles from the axis to the kernel's border; (ny - 1, nx - 1) is the full frame.
    """
    wavelength_nm = np.asarray(wavelength_nm, float)
    key = (
        repr((lens, flares)),
        tuple(map(id, flares)) if any(not _described(f) for f in flares) else (),
        tuple(wavelength_nm),
        tuple(np.round(pitch_um, 9)),
        tuple(reach),
    )
    if key in _cache:
        _cache.move_to_end(key)
        return _cache[key]
    width_nm = band_widths_nm(wavelength_nm)

    def one(centre, width):  # nothing is shared between bands: a band does not depend on which others there are
        split = _split(lens, centre - width / 2, pitch_um, reach)
        fine, wide = [p / split for p in pitch_um], [r * split + split - 1 for r in reach]
        kernel, speckle, energy = _Plan(lens, flares, centre, width, fine, wide, split).band(centre, width)
        kernel = scatter.mix(_tiles(kernel, split), flares, centre, pitch_um, lens.focal_length_mm)
        return np.asarray(kernel, np.float32), speckle, energy / (np.pi * pupils.radius_mm(lens) ** 2)

    with ThreadPoolExecutor(min(cpus(), len(wavelength_nm), 8)) as pool:
        bands, speckle, transmitted = zip(*pool.map(one, wavelength_nm, width_nm))
    outside = np.array([1 - float(b.sum(dtype=float)) for b in bands])
    made = Kernels(list(bands), outside, np.array(speckle), np.array(transmitted), (lens, flares))
    _cache[key] = made
    while len(_cache) > 1 and sum(b.nbytes for k in _cache.values() for b in k.bands) > CACHE_BYTES:
        _cache.popitem(last=False)
    return made


def _split(lens, shortest_nm, pitch_um, reach):
    """Return into how many parts, per axis, to divide tiles that are much wider than the core of the point spread function."""
    if shortest_nm <= 0:
        return 1
    wanted = np.ceil(max(pitch_um) / (8 * pupils.blur_um(lens, shortest_nm)))
    return int(max(1, min(wanted, np.sqrt(MOST_TILES / np.prod([2 * r + 1 for r in reach])))))


def _described(flare) -> bool:
    return is_dataclass(flare)


def cpus() -> int:
    """Return how many threads to use: OMP_NUM_THREADS where it is set, else the processors at hand."""
    return int(os.environ.get("OMP_NUM_THREADS") or os.cpu_count() or 1)


class _Plan:
    """One band: the pupil of the core, its energy, the grids of the rings."""

    def __init__(self, lens, flares, centre_nm, width_nm, pitch_um, reach, split=1):
        self.lens, self.flares, self.pitch, self.reach = lens, flares, tuple(pitch_um), tuple(reach)
        self.distance, self.split = pupils.distance_mm(lens), split
        self.shortest, self.longest = centre_nm - width_nm / 2, centre_nm + width_nm / 2
        if self.shortest <= 0:
            raise ConfigError(f"the band at {centre_nm:g} nm is {width_nm:g} nm wide: it reaches 0; expected closer wavelengths")
        blur = pupils.blur_um(lens, self.shortest)
        self.half = tuple(min(r, max(3, int(CORE_SAMPLES / np.ceil(2 * p / blur)))) for r, p in zip(reach, pitch_um))
        extent = max(2 * (h + 4) * p for h, p in zip(self.half, pitch_um))
        pitch = pupils.core_pitch_mm(lens, extent, self.shortest)
        self.axis = pupils.axis_mm(lens, pitch)
        self.fixed = pupils.same_at_all_wavelengths(flares)
        self.mirror = not pupils.has_phase(lens, flares)
        self.cells = pupils.amplitude(lens, flares, self.axis, self.axis, self.shortest) if self.fixed else None
        self.energy = pupils.open_energy_mm2(lens, flares, self.shortest) if self.fixed else None
        # Rings: the whole frame coarsely, and three times the core with more points per tile.
        middle = tuple(min(r, 3 * h) for r, h in zip(reach, self.half))
        self.rings = [self._ring(reach, TAIL_SAMPLES)]
        if middle != self.reach and self.rings[0][1] == split == 1:
            self.rings.append(self._ring(middle, MIDDLE_SAMPLES))

    def _ring(self, reach, samples):
        """Return (reach, points per tile and axis, period of the field in points) of one ring."""
        period = [PERIOD * (r + 1) for r in reach]
        points = max(1, int(np.sqrt(samples / (period[0] * period[1]))))
        # A pupil drawn on too few cells would be coarse, whatever the image needs.
        least = [RING_PUPIL * pupils.blur_um(self.lens, self.longest) * points / p for p in self.pitch]
        return tuple(reach), points, tuple(sf.next_fast_len(int(np.ceil(max(n * points, m)))) for n, m in zip(period, least))

    def band(self, centre, width):
        """Return one band's kernel without scatter, its speckle error, and the energy of its pupil, mm2."""
        lens, flares = self.lens, self.flares
        energy = self.energy or pupils.open_energy_mm2(lens, flares, centre)
        core = 0.0
        waves = self._wavelengths(centre, width, max(self.half) / self.split, 3 if self.split == 1 else 1)
        for wave in waves:
            cells = self.cells if self.fixed else pupils.amplitude(lens, flares, self.axis, self.axis, wave)
            pupil = pupils.with_wavefront(lens, cells, self.axis, self.axis, wave)
            step = self.axis[1] - self.axis[0]
            core = core + integrated_psf(
                pupil,
                wave,
                (step, step),
                self.distance,
                [2 * h + 1 for h in self.half],
                self.pitch,
                energy,
                cell_means=True,
                boxes=2,
            )
        core /= len(waves)
        kernel, speckle = core, 0.0
        if self.half != self.reach:
            inside = [r[0] for r in self.rings[1:]] + [self.half]
            (kernel, speckle), *inner = [self._sum(ring, hole, centre, width, energy) for ring, hole in zip(self.rings, inside)]
            for part in (*(i[0] for i in inner), core):
                cut = tuple(slice(r - n // 2, r + n // 2 + 1) for r, n in zip(self.reach, part.shape))
                kernel[cut] = part
        return kernel, speckle, energy

    def _wavelengths(self, centre, width, radius, least):
        """Return midpoints of equal sub-bands: from one to the next the pattern at `radius` tiles moves by a speckle at most."""
        pitch = max(self.pitch)
        count = radius * pitch * width / (centre * pupils.blur_um(self.lens, centre))
        count = int(np.clip(np.ceil(count), least if width > 1.5 else 1, MOST_WAVELENGTHS))
        return centre + ((np.arange(count) + 0.5) / count - 0.5) * width

    def _sum(self, ring, hole, centre, width, energy):
        """Return one ring's kernel, averaged over wavelengths and offsets, and its relative L1 error outside the `hole`."""
        reach, s, period = ring
        pitch, fine = [p / s for p in self.pitch], [r * s + s - 1 for r in reach]
        smear = len(self._wavelengths(centre, width, max(reach), 1))
        count = int(np.clip(np.ceil(max(LEAST_POINTS / (s * self.split) ** 2, smear / 4 / self.split)), 2, MOST_WAVELENGTHS))
        halves = [0.0, 0.0]
        for i in range(count):
            wave = centre + ((i + 0.5) / count - 0.5) * width
            step = lattice_pitch_mm(wave, period, self.distance, pitch)
            offset = _offset(i + int(centre))
            if self.mirror:  # no phase: drawn folded
                pupil = folded(pupils.terms(self.lens, self.flares), pupils.radius_mm(self.lens), step, period, offset)
            else:
                x, y = pupils.axis_mm(self.lens, step[1]), pupils.axis_mm(self.lens, step[0])
                pupil = pupils.with_wavefront(self.lens, pupils.amplitude(self.lens, self.flares, x, y, wave), x, y, wave)
            part = lattice_psf(pupil, wave, period, self.distance, fine, pitch, energy, offset, folded=self.mirror)
            part = _tiles(part, s)
            halves[i % 2] = halves[i % 2] + part
        n0, n1 = (count + 1) // 2, count // 2
        total = halves[0] + halves[1]
        # Half the difference of two independent halves has the scatter of their mean.
        difference = np.abs(halves[0] / n0 - halves[1] / n1) / 2
        kernel = total / count
        cut = tuple(slice(r - h, r + h + 1) for r, h in zip(reach, hole))
        seen = kernel.sum(dtype=float) - kernel[cut].sum(dtype=float)
        speckle = float((difference.sum(dtype=float) - difference[cut].sum(dtype=float)) / seen) if seen > 0 else 0.0
        if self.mirror:
            kernel = (kernel + kernel[::-1, ::-1]) / 2
            speckle /= np.sqrt(2)
        return kernel, speckle


def _offset(i):
    """Return the (y, x) point inside the tile of the i-th sample: triangular density, the difference of two uniform points."""
    u = np.modf(0.5 + i * np.array([0.7548776662466927, 0.5698402909980532]))[0]  # Roberts' plastic-number sequence
    return tuple(np.where(u < 0.5, np.sqrt(2 * u) - 1, 1 - np.sqrt(2 * (1 - u))))


def _tiles(fine, s):
    """Return tile-to-tile sums of a function sampled s times per tile: triangular weights along both axes."""
    if s == 1:
        return fine
    weight = ((s - np.abs(np.arange(-(s - 1), s))) / s).astype(fine.dtype)
    for axis in (0, 1):
        window = np.lib.stride_tricks.sliding_window_view(fine, 2 * s - 1, axis=axis)
        fine = (window[::s] if axis == 0 else window[:, ::s]) @ weight
    return fine


def point_spread(lens, wavelength_nm, pitch_um, size, flares, integrated):
    """Return the point spread function of a lens with flares; see `DiffractionLimitedLens.psf`."""
    waves = np.atleast_1d(np.asarray(wavelength_nm, float))
    if integrated is None:
        integrated = bool(pitch_um >= min(pupils.blur_um(lens, w) for w in waves))
    out = []
    for wave in waves:
        pitch_mm = pupils.core_pitch_mm(lens, (size + 8) * pitch_um, wave)
        axis = pupils.axis_mm(lens, pitch_mm)
        pupil = pupils.with_wavefront(lens, pupils.amplitude(lens, flares, axis, axis, wave), axis, axis, wave)
        psf = psf_from_pupil(
            pupil,
            None,
            wave,
            pitch_mm,
            pupils.distance_mm(lens),
            pitch_um,
            size,
            pupils.open_energy_mm2(lens, flares, wave),
            cell_means=True,
            integrated=integrated,
        )
        out.append(scatter.mix(psf, flares, wave, (pitch_um, pitch_um), lens.focal_length_mm))
    return psf_array(np.stack(out), waves, pitch_um, lens, flares, integrated)


def psf_array(values, wavelength_nm, pitch_um, lens, flares, integrated=True):
    """Return point spread functions as a labelled DataArray, y and x in metres."""
    import xarray as xr

    at = (np.arange(values.shape[-1]) - values.shape[-1] // 2) * pitch_um * 1e-6
    return xr.DataArray(
        values,
        dims=("wavelength", "y", "x"),
        coords={"wavelength": np.atleast_1d(np.asarray(wavelength_nm, float)), "y": at, "x": at},
        attrs={
            "units": "1",
            "f_number": lens.f_number,
            "focal_length_mm": lens.focal_length_mm,
            "sample": "integral" if integrated else "point",
        },
    )
