"""Kernels: the share of a tile's light that reaches every other tile of the frame, averaged over a
band.

A kernel is the point spread function averaged over the source tile and integrated over the
receiving one. Close to the axis it is exact (`integrated_psf`); farther out it is an average over
many points and wavelengths (`wings`). The remaining sampling error there is measured by the
difference between two halves of the points.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, is_dataclass, replace
from functools import cached_property
from threading import Lock
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from isethdr_core.cli.progress import track
from isethdr_core.errors import ConfigError
from isethdr_core.physics import convolution
from isethdr_core.physics.convolution.mirrored import Mirrored
from isethdr_core.physics.diffraction import psf_from_pupil
from isethdr_core.physics.radiometry import band_widths_nm
from isethdr_core.pipeline.memory import FLOAT32_BYTES, machine_bytes

from ..imaging.threads import MOST_THREADS, cpus, executor
from ..pupil import sampled_pupil
from . import (
    band_phase,
    interpolation_wavelengths,
    kernel_sampling_error,
    kernel_spectra,
    kernel_store,
    kernel_work,
    memory,
    phase_patterns,
    scaled_pattern,
    scatter,
    wings,
)
from .exact_core import exact_core
from .wings import tile_sums

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from isethdr_core.plugins.protocols import Flare

    from ..abilities import LensOptics, PupilOptics
    from .interpolation_wavelengths import Knots
    from .scaled_pattern import Frame

CORE_SAMPLES = 240  # image samples from the axis to the border of the exact core
WIDER = 1.25  # times its size, an exact core may be made to cover a frame
# of an exact core that covers a frame of tiles finer than its samples: a second a wavelength
CORE_TILES = 1e6
MOST_WAVELENGTHS = 32  # per band, however wide
MOST_TILES = 4e6  # of a kernel whose coarse tiles were divided
CACHE_BYTES = 3 << 30  # of kernels held by this process and not by a file
SPECTRA_BYTES = 1 << 30  # of transforms of one lens's kernels that are held and not on disk
SAMPLED = 64  # sample points of a kernel along each axis, for estimates
WITHOUT_REACH = 4  # items of a cache's key, before how far kernels reach
# CPU seconds, measured on a busy machine: one wavelength of an exact core of usual size, one value
# of the two lattices of a pupil, one tile read at one wavelength
CORE_WAVELENGTH_S = 0.06
LATTICE_SAMPLE_S = 1.5e-7
SHARED_SAMPLE_S = 2.5e-8  # of the lattices of a pupil without phase, beside its chords
READ_S = 1.2e-8
WORTH_KEEPING_S = 1.0  # kernels made faster than this are not written to disk
# of kernels from one pattern, which are many while somebody tries lenses
PATTERN_WORTH_KEEPING_S = 5.0


class Wide(NamedTuple):
    """Properties of an exact core that is wider than the usual one."""

    tiles: int  # from the axis, along y and along x
    deviation: np.ndarray  # per octave within it, as `Kernels.deviation`


@dataclass(frozen=True, eq=False)
class Kernels:
    """Kernels of all bands (float32, the axis in the middle), and their errors."""

    bands: Sequence[np.ndarray | Mirrored]
    outside: np.ndarray  # fraction of the energy beyond the kernel, per band
    # (band, octave of radius from 1 to 2 tiles on) relative L1 error per tile; 0 in the exact core
    speckle: np.ndarray
    # light through the pupil / light through the clean round stop, per band
    transmitted: np.ndarray
    # relative, light wrapped into tiles near the kernel's border by the period of the far field
    wrap: float = 0.0
    deviation: np.ndarray | None = (
        # (band, octave) relative, as `kernel_sampling_error.deviation`; None: exact
        None
    )
    core: np.ndarray | None = (
        # per band, tiles from the axis, along y and along x, within which it holds for nothing:
        # exact
        None
    )
    # what the cache's key names: objects stay alive, so that an id is never used twice
    keep: tuple = ()

    name: str | None = None  # under which they are kept on disk
    scaled: scaled_pattern.Frame | None = None  # of kernels from one pattern, which can have
    wide: Wide | None = None  # a wider exact core
    fine_rings: bool = False  # read as `scaled_pattern.FINE`
    key: tuple = ()  # in the cache

    @cached_property
    def profiles(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Sums over x and over y of every band's kernel."""
        # not made for their sake
        source = self.__dict__.get("spectra") or self.__dict__.get("divided")
        return source.profiles if source else [kernel_spectra.profile(b) for b in self.bands]

    @cached_property
    def sampled(self) -> tuple[np.ndarray, list[int], list[int]]:
        """Points of the kernels (y, x, band) on a coarse grid, with its spacing along (y, x) and
        its first tiles: the shape of the kernels at a distance.
        """
        steps = [max(1, n // SAMPLED) for n in self.bands[0].shape]
        first = [s // 3 for s in steps]
        cut = tuple(slice(f, None, s) for f, s in zip(first, steps))
        return np.stack([np.asarray(b[cut], float) for b in self.bands], axis=-1), steps, first

    @cached_property
    def centre(self) -> np.ndarray:
        """Share of a tile's light that stays in it, per band."""
        return np.array([b[b.shape[0] // 2, b.shape[1] // 2] for b in self.bands], float)

    @cached_property
    def transforms(self) -> kernel_spectra.KeptTransforms:
        """The transforms of kernels in memory, for images of the full frame."""
        return kernel_spectra.KeptTransforms(self.bands, SPECTRA_BYTES)

    @cached_property
    def spectra(self) -> kernel_spectra.Spectra | None:
        """The kernels with their transforms, for images of the full frame; None without a file on
        disk and enough memory.
        """
        return kernel_spectra.spectra(self.bands, self.name) if self._fits else None

    @cached_property
    def divided(self) -> kernel_spectra.Divided | None:
        """The kernels' near and far parts with their transforms, for images of the full frame; None
        as `spectra`.
        """
        return kernel_spectra.divided(self.bands, self.name) if self._fits else None

    @cached_property
    def _fits(self) -> bool:
        return (
            bool(self.name)
            or 2 * len(self.bands) * self.bands[0].nbytes * (1 + (not _mirrored(self.bands[0])))
            <= SPECTRA_BYTES
        )

    def ready(self, band: int) -> convolution.Kernel:
        """Return one band's kernel with its transform, for images of the full frame."""
        if isinstance(self.bands[band], Mirrored):
            return self.transforms.kernel(band)
        if self.spectra:
            return self.spectra.kernels[band]
        return convolution.prepare(self.bands[band], [n // 2 + 1 for n in self.bands[band].shape])

    @property
    def held_bytes(self) -> int:
        """Memory of this process that the kernels and their transforms take; mapped files take
        none.
        """
        holders = [self.__dict__.get(n) for n in ("spectra", "divided", "transforms")]
        return sum(b.nbytes for b in self.bands if not isinstance(b, np.memmap)) + sum(
            m.held_bytes for m in holders if m
        )


_cache: OrderedDict[tuple, Kernels] = OrderedDict()
_lock = Lock()
_making: dict[tuple, Lock] = {}  # by key: a thread that asks for the same kernels waits for them


def kernels(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
    make: Callable[..., Any] | None = None,
) -> Kernels:
    """Return the kernels of a lens with flares; they are cached in the process and on disk.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    wavelength_nm : centres of the bands.
    pitch_um : (y, x) tile pitch.
    reach : (y, x) tiles from the axis to the kernel's border; (ny - 1, nx - 1) is the full frame.
    make : function of the same arguments that computes the kernels by another method. Its results
        are always stored on disk.
    """
    wavelength_nm = np.asarray(wavelength_nm, float)
    key = _key(lens, flares, wavelength_nm, pitch_um, reach, make)
    with _lock:
        making = _making.setdefault(key, Lock())
    with making:
        return _read_or_made(key, _Asked(lens, flares, wavelength_nm, pitch_um, reach), make)


def _read_or_made(key: tuple, asked: _Asked, make: Callable[..., Any] | None) -> Kernels:
    """Return kernels from this process or from the disk, else make and keep them.

    Parameters
    ----------
    key : of the kernels in this process. `asked` : the kernels. `make` : as of `kernels`.
    """
    with _lock:
        if key in _cache:
            _cache.move_to_end(key)
            return _cache[key]
    lens = asked.lens
    flares = asked.flares
    wavelength_nm = asked.wavelength_nm
    pitch_um = asked.pitch_um
    reach = asked.reach
    name = _name(lens, flares, wavelength_nm, pitch_um, reach, make)
    frame = None if make else _frame(lens, flares, wavelength_nm, pitch_um, reach)
    stored = _stored(name) if frame is None else _stored_halves(name, lens, flares, frame)
    if stored is None:
        memory.check_kernels(
            held_bytes(lens, flares, wavelength_nm, pitch_um, reach), len(wavelength_nm), reach
        )
        band_phase.check(lens, flares, wavelength_nm)
        start = perf_counter()
        stored = (
            make(lens, flares, wavelength_nm, pitch_um, reach) if make else _kernels_of(asked, name)
        )
        worth_s = WORTH_KEEPING_S if frame is None else PATTERN_WORTH_KEEPING_S
        if name and (make or perf_counter() - start > worth_s):
            _store(name, stored)
            kernel_store.remove_parts(name)
            if frame is None:
                stored = _stored(name) or stored  # mapped, no longer this process's own
    return _in_cache(key, replace(stored, key=key))


def _store(name: str, made: Kernels) -> None:
    """Keep kernels on disk; of mirrored ones a half."""
    arrays = [band.half if isinstance(band, Mirrored) else band for band in made.bands]
    count = len(arrays)
    facts = [made.outside, made.transmitted, np.full(count, made.wrap), made.core]
    facts += [*made.speckle.T, *made.deviation.T]
    if made.wide is not None:
        facts += [np.full(count, value) for value in made.wide.deviation]
    kernel_store.save(name, (count, *arrays[0].shape), "<f4", arrays, lambda: np.stack(facts))


def at_hand(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
    shorter: float = 0.0,
) -> bool:
    """Return whether this process or the disk holds the kernels.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    wavelength_nm : centres of the bands, nm.
    pitch_um : (y, x) of a tile, um.
    shorter : such as reach up to that share of `reach` count too: how far kernels have to reach
        for a sensor is known with the light.
    """
    wavelength_nm = np.asarray(wavelength_nm, float)
    key_without_reach = _key(lens, flares, wavelength_nm, pitch_um, reach)[:WITHOUT_REACH]
    with _lock:
        cached_reaches = [
            key[WITHOUT_REACH] for key in _cache if key[:WITHOUT_REACH] == key_without_reach
        ]
    name = _name(lens, flares, wavelength_nm, pitch_um, reach)
    if name is not None:
        cached_reaches += kernel_store.reaches(name)
    return any(
        cached == tuple(reach) or all(n <= shorter * r for n, r in zip(cached, reach))
        for cached in cached_reaches
    )


def expected_s(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
) -> float:
    """Return the CPU seconds that kernels take to make.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    wavelength_nm : centres of the bands, nm.
    pitch_um : (y, x) of a tile, um.
    reach : (y, x) tiles from the axis to the border of the kernels.
    """
    wavelength_nm = np.asarray(wavelength_nm, float)
    frame = _frame(lens, flares, wavelength_nm, pitch_um, reach)
    if frame is not None:
        return kernel_work.seconds(kernel_work.one_pattern(lens, flares, frame))
    frame = _phase_frame(lens, flares, wavelength_nm, pitch_um, reach)
    if frame is not None:
        return kernel_work.seconds(kernel_work.with_phase(lens, flares, frame))
    return _lattices_s(lens, flares, wavelength_nm, pitch_um, reach)


def _lattices_s(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
) -> float:
    """Return the CPU seconds of kernels from lattices, or of exact cores alone."""
    mirrored = not sampled_pupil.has_phase(lens, flares)
    total = 0.0
    cells = set()
    for centre, width in zip(wavelength_nm, band_widths_nm(wavelength_nm)):
        shortest = centre - width / 2
        grid = split, fine, wide = fine_tiles(lens, shortest, pitch_um, reach)
        half = core_half(lens, shortest, fine, wide)
        plan = BandPlan(lens, flares, (centre, width), grid)
        waves = plan.wavelengths(centre, width, max(half) / split, 3 if split == 1 else 1)
        blur = sampled_pupil.blur_um(lens, shortest)
        samples = max(h * np.ceil(2 * p / blur) for h, p in zip(half, fine))
        total += CORE_WAVELENGTH_S * len(waves) * max(0.1, samples / CORE_SAMPLES)
        if tuple(half) != tuple(wide):
            parts = 1 if mirrored else wings.parts_of(plan, centre, width)
            cells.update(
                interpolation_wavelengths.lattices_of(plan, centre, width, parts)
                if not mirrored
                else [(float(shortest), 1.0)]
            )
            total += wings.reads_of(plan, centre, width) * READ_S
    if mirrored and cells:
        cells = {min(cells)}
    for wave, stretch in cells:
        grid = fine_tiles(lens, wave, pitch_um, reach)
        sample_s = SHARED_SAMPLE_S if mirrored else LATTICE_SAMPLE_S
        total += 2 * sample_s * wings.samples_of(lens, wave, grid, stretch, mirrored)
        if mirrored:
            total += wings.fold_seconds(lens, flares, wave, grid)
    return total


def from_patterns(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
) -> bool:
    """Return whether kernels come from one pattern or a few; others come from lattices or exact
    cores alone.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    wavelength_nm : centres of the bands, nm.
    pitch_um : (y, x) of a tile, um.
    reach : (y, x) tiles from the axis to the border of the kernels.
    """
    wavelength_nm = np.asarray(wavelength_nm, float)
    given = lens, flares, wavelength_nm, pitch_um, reach
    return _frame(*given) is not None or _phase_frame(*given) is not None


def from_one_pattern(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
) -> bool:
    """Return whether one pattern gives the kernels of all bands.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    wavelength_nm : centres of the bands, nm.
    pitch_um : (y, x) of a tile, um.
    reach : (y, x) tiles from the axis to the border of the kernels.
    """
    return _frame(lens, flares, np.asarray(wavelength_nm, float), pitch_um, reach) is not None


def _key(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
    make: Callable[..., Any] | None = None,
) -> tuple:
    return (
        repr((lens, flares)),
        tuple(map(id, flares)) if any(not _described(f) for f in flares) else (),
        tuple(wavelength_nm),
        tuple(np.round(pitch_um, 9)),
        tuple(reach),
        make,
    )


def _name(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: ArrayLike,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
    make: Callable[..., Any] | None = None,
) -> str | None:
    """Return the name of kernels on disk; None if they are not kept there."""
    if not all(map(_described, (lens, *flares))):
        return None
    return kernel_store.name(lens, flares, wavelength_nm, pitch_um, reach, make and make.__module__)


def _in_cache(key: tuple[str, ...], computed: Kernels) -> Kernels:
    """Keep kernels in this process under a key, and return them."""
    with _lock:
        _cache[key] = computed
        while len(_cache) > 1 and sum(k.held_bytes for k in _cache.values()) > CACHE_BYTES:
            _cache.popitem(last=False)
    return computed


def wider_cores(computed: Kernels) -> list[scaled_pattern.CoreSize]:
    """Return the sizes that an exact core of kernels can have beyond its own."""
    if computed.scaled is None or computed.wide is not None:
        return []
    return scaled_pattern.wider_cores(computed.keep[0], computed.scaled)


def fine_rings_fit(computed: Kernels) -> bool:
    """Return whether the machine's memory holds kernels together with kernels with fine rings."""
    if computed.scaled is None:
        return False
    lens = computed.keep[0]
    read = scaled_pattern.fine_rings(lens, computed.scaled)
    fine = scaled_pattern.memory_bytes(lens, computed.scaled, read)
    return computed.held_bytes + fine <= machine_bytes()


def with_core(computed: Kernels, tiles: int, fine_rings: bool = False) -> Kernels:
    """Return kernels from one pattern with an exact core of `tiles`, one of `wider_cores`. They are
    kept in the process.

    Parameters
    ----------
    computed : the kernels; such as have a smaller core and fine rings keep the rings.
    tiles : size of the core.
    fine_rings : compute the rings beyond the core again, as `scaled_pattern.FINE`.
    """
    are_fine = fine_rings or computed.fine_rings
    key = (*computed.key, tiles, fine_rings)
    with _lock:
        making = _making.setdefault(key, Lock())
    with making:
        with _lock:
            if key in _cache:
                _cache.move_to_end(key)
                return _cache[key]
        name = _name(*computed.keep, *computed.key[2:5]) if computed.key else None
        name = name and f"{name}-core-{tiles}{'-fine' * are_fine}"
        found = _stored_halves(name, *computed.keep, computed.scaled, tiles)
        if found is None:
            start = perf_counter()
            found = _with_core(computed, tiles, fine_rings)
            if name and perf_counter() - start > PATTERN_WORTH_KEEPING_S:
                _store(name, found)
        return _in_cache(key, replace(found, key=key, fine_rings=are_fine))


def _with_core(computed: Kernels, tiles: int, fine_rings: bool) -> Kernels:
    """Return kernels as `with_core`, made anew."""
    lens, flares = computed.keep
    with executor(min(cpus(), MOST_THREADS)) as pool:
        core = scaled_pattern.wider_core(lens, flares, computed.scaled, tiles, pool.map)
        if fine_rings:
            rings = _fine_rings(computed, core, pool.map)
        else:
            rings = _inserted(computed, core)
    inside = 2.0 ** (np.arange(len(core.relative)) + 1) <= tiles  # whole octaves
    changed = {
        "outside": np.array([1 - float(b.sum(dtype=float)) for b in rings["bands"]]),
        "speckle": np.where(inside, core.relative, rings.pop("speckle")),
        "wide": Wide(tiles, core.deviation),
    }
    return replace(computed, **rings, **changed)


def _inserted(computed: Kernels, core: scaled_pattern.Core) -> dict:
    """Return the fields of kernels with another core."""
    lens, flares = computed.keep
    _scatter(core.halves, lens, flares, computed.scaled)
    bands = []
    rows, columns = core.reach
    for band, inner in zip(computed.bands, core.halves):
        half = band.half.copy()
        middle = band.half.shape[1] // 2
        half[: rows + 1, middle - columns : middle + columns + 1] = inner
        bands.append(Mirrored(half))
    return {"bands": bands, "speckle": computed.speckle}


def _fine_rings(computed: Kernels, core: scaled_pattern.Core, apply: Callable[..., Any]) -> dict:
    """Return the fields of kernels with fine rings around a wider core."""
    lens, flares = computed.keep
    read = scaled_pattern.fine_rings(lens, computed.scaled)
    frame = replace(computed.scaled, core=core.reach)
    finer_halves = scaled_pattern.halves(lens, flares, frame, core.halves, read, apply)
    errors = scaled_pattern.errors(lens, flares, frame, finer_halves, read, apply)
    _scatter(finer_halves, lens, flares, frame)
    count = len(finer_halves)
    return {
        "bands": [Mirrored(half) for half in finer_halves],
        "speckle": np.tile(errors.relative, (count, 1)),
        "deviation": np.tile(errors.deviation, (count, 1)),
        "wrap": max(errors.mean, scaled_pattern.wrap(lens, computed.scaled, read)),
    }


def _stored(name: str | None, tiles: int | None = None) -> Kernels | None:
    """Return stored kernels; None where they are not stored.

    Parameters
    ----------
    tiles : of a wider core that they have; None: they have none.
    """
    arrays = kernel_store.load(name) if name else None
    if arrays is None:
        return None
    (outside, transmitted, wrap, core, *errors), bands = arrays
    parts = np.split(np.stack(errors, axis=1), 2 if tiles is None else 3, axis=1)
    wide = None if tiles is None else Wide(tiles, parts[2][0])
    return Kernels(
        list(bands),
        outside,
        parts[0],
        transmitted,
        float(wrap[0]),
        parts[1],
        core,
        name=name,
        wide=wide,
    )


def _stored_halves(
    name: str | None,
    lens: PupilOptics,
    flares: Sequence[Flare],
    frame: scaled_pattern.Frame,
    tiles: int | None = None,
) -> Kernels | None:
    """Return stored kernels from one pattern; None where they are not stored. `tiles` : as
    `_stored`.
    """
    stored = _stored(name, tiles)
    if stored is None:
        return None
    bands = [Mirrored(np.array(half)) for half in stored.bands]
    return replace(stored, bands=bands, keep=(lens, flares), name=None, scaled=frame)


def _mirrored(kernel: Mirrored | np.ndarray) -> bool:
    return isinstance(kernel, Mirrored) or np.array_equal(kernel, kernel[::-1, ::-1])


def joined(first: int, some: Kernels, computed: Kernels) -> Kernels:
    """Return kernels of all bands: `some` where the mask `first` is true, `computed` elsewhere."""
    order = np.argsort(np.concatenate([np.flatnonzero(first), np.flatnonzero(~first)]))
    arrays = {
        n: np.concatenate([getattr(some, n), getattr(computed, n)])[order]
        for n in ("outside", "speckle", "transmitted", "deviation", "core")
    }
    bands = [*some.bands, *computed.bands]
    return Kernels(
        [bands[k] for k in order], **arrays, wrap=max(some.wrap, computed.wrap), keep=some.keep
    )


def _frame(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
    width_nm: np.ndarray | None = None,
) -> Frame | None:
    """Return the `scaled_pattern.Frame` of bands and tiles, or None where one pattern does not
    serve them.
    """
    frame = _rings_frame(lens, wavelength_nm, pitch_um, reach, width_nm)
    return frame if frame is not None and scaled_pattern.serves(lens, flares, frame) else None


def _phase_frame(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
    width_nm: np.ndarray | None = None,
) -> Frame | None:
    """Return the `scaled_pattern.Frame` of bands and tiles, or None where patterns at a few
    wavenumbers do not serve them.
    """
    frame = _rings_frame(lens, wavelength_nm, pitch_um, reach, width_nm)
    return frame if frame is not None and phase_patterns.serves(lens, flares, frame) else None


def _rings_frame(
    lens: PupilOptics,
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
    width_nm: np.ndarray | None = None,
) -> Frame | None:
    """Return the `scaled_pattern.Frame` of bands and tiles; None where exact cores cover all."""
    width_nm = band_widths_nm(wavelength_nm) if width_nm is None else width_nm
    edges = np.stack([wavelength_nm - width_nm / 2, wavelength_nm + width_nm / 2], axis=1)
    if edges.min() <= 0:
        return None
    shortest = float(edges.min())
    if without_lattices(lens, shortest, pitch_um, reach):
        return None
    half = core_half(lens, shortest, pitch_um, reach)
    # of wide tiles, whose core would be smaller
    half = tuple(min(max(h, scaled_pattern.LEAST_CORE), r) for h, r in zip(half, reach))
    if all(r <= WIDER * h for r, h in zip(reach, half)):
        half = tuple(reach)  # a little more of the exact core costs less than rings
    return scaled_pattern.Frame(edges, tuple(pitch_um), tuple(reach), tuple(half))


def _scaled(lens: PupilOptics, flares: Sequence[Flare], frame: Frame) -> Kernels:
    """Return kernels of all bands from one pattern."""
    with executor(min(cpus(), MOST_THREADS)) as pool:
        halves, errors = scaled_pattern.fine_enough(lens, flares, frame, pool.map)
    _scatter(halves, lens, flares, frame)
    bands = [Mirrored(half) for half in halves]
    count = len(halves)
    energy = sampled_pupil.open_energy_mm2(
        lens, flares, frame.shortest_nm
    ) / sampled_pupil.stop_mm2(lens)
    return Kernels(
        bands,
        np.array([1 - float(b.sum(dtype=float)) for b in bands]),
        np.tile(errors.relative, (count, 1)),
        np.full(count, energy),
        max(errors.mean, scaled_pattern.WRAP) if errors.relative.any() else 0.0,
        np.tile(errors.deviation, (count, 1)),
        np.full(count, float(min(frame.core) if errors.relative.any() else max(bands[0].shape))),
        (lens, flares),
        scaled=frame,
    )


def _interpolated(lens: PupilOptics, flares: Sequence[Flare], frame: Frame) -> Kernels:
    """Return kernels of all bands from patterns at a few wavenumbers."""
    count = len(frame.edges_nm)
    sides = [2 * r + 1 for r in frame.reach]
    middles = frame.edges_nm.mean(axis=1)
    widths = np.diff(frame.edges_nm)[:, 0]
    core = tuple(slice(r - c, r + c + 1) for r, c in zip(frame.reach, frame.core))
    read = scaled_pattern.finer_rings(lens, frame)
    bands = np.empty((count, *sides), np.float32)

    def exact(band: int) -> np.ndarray:
        grid = wings.Grid(1, frame.pitch_um, frame.core)
        plan = BandPlan(lens, flares, (middles[band], widths[band]), grid)
        return plan.band(middles[band], widths[band])[0]

    with executor(min(cpus(), MOST_THREADS)) as pool:
        phase_patterns.wings(lens, flares, frame, read, bands, pool.map)
        errors_of_bands = phase_patterns.errors(lens, flares, frame, bands, read, pool.map)
        for kernel, inner in zip(bands, pool.map(exact, range(count))):
            kernel[core] = inner
    for kernel, wave in zip(bands, middles):
        if scatter.active(flares, wave):
            kernel[...] = scatter.mix(kernel, flares, wave, frame.pitch_um, lens.focal_length_mm)
    energy = sampled_pupil.open_energy_mm2(lens, flares, frame.shortest_nm)
    return Kernels(
        list(bands),
        np.array([1 - float(b.sum(dtype=float)) for b in bands]),
        np.tile(errors_of_bands.relative, (count, 1)),
        np.full(count, energy / sampled_pupil.stop_mm2(lens)),
        max(errors_of_bands.mean, scaled_pattern.WRAP),
        np.tile(errors_of_bands.deviation, (count, 1)),
        np.full(count, float(min(frame.core))),
        (lens, flares),
    )


def _scatter(halves: np.ndarray, lens: PupilOptics, flares: Sequence[Flare], frame: Frame) -> None:
    """Mix the scatter of flares into halves of kernels."""
    waves = frame.edges_nm.mean(axis=1)
    if not scatter.active(flares, waves):
        return
    for half, wave in zip(halves, waves):
        full = np.asarray(Mirrored(half))
        mixed = scatter.mix(full, flares, wave, frame.pitch_um, lens.focal_length_mm)
        half[...] = mixed[len(full) // 2 :]


@dataclass(frozen=True)
class _Asked:
    """Kernels that are asked for."""

    lens: Any
    flares: Any
    wavelength_nm: np.ndarray  # centres of the bands
    pitch_um: tuple[float, float]  # (y, x) of a tile
    reach: tuple[int, int]  # (y, x) tiles from the axis to the border
    width_nm: np.ndarray | None = None  # of the bands; None: they lie side by side


def _computed(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
    width_nm: np.ndarray | None = None,
) -> Kernels:
    """Return kernels, neither read from the store nor written into it; arguments as the fields of
    `_Asked`.
    """
    return _kernels_of(_Asked(lens, flares, wavelength_nm, pitch_um, reach, width_nm))


def _kernels_of(asked: _Asked, name: str | None = None) -> Kernels:
    """Return kernels. Bands that take long are read from the store, and written into it, by the
    `name` of the kernels; None: neither.
    """
    lens = asked.lens
    flares = asked.flares
    wavelength_nm = asked.wavelength_nm
    pitch_um = asked.pitch_um
    reach = asked.reach
    width_nm = band_widths_nm(wavelength_nm) if asked.width_nm is None else asked.width_nm
    frame = _frame(lens, flares, wavelength_nm, pitch_um, reach, width_nm)
    if frame is not None:
        return _scaled(lens, flares, frame)
    frame = _phase_frame(lens, flares, wavelength_nm, pitch_um, reach, width_nm)
    if frame is not None:
        return _interpolated(lens, flares, frame)
    lattices = _lattices(lens, flares, wavelength_nm, width_nm, pitch_um, reach)
    mirrored = not sampled_pupil.has_phase(lens, flares)
    shared = interpolation_wavelengths.Knots()

    def one_band(
        centre: float, width: float
    ) -> tuple[
        np.ndarray, ...
    ]:  # interpolation wavelengths are fixed: a band does not depend on the other bands
        grid = fine_tiles(lens, centre - width / 2, pitch_um, reach)
        split = grid.split
        plan = BandPlan(lens, flares, (centre, width), grid, lattices, shared)
        kernel, wrong, energy = plan.band(centre, width)
        kernel = np.asarray(
            scatter.mix(tile_sums(kernel, split), flares, centre, pitch_um, lens.focal_length_mm),
            np.float32,
        )
        if mirrored:  # but for rounding; then the transform is real
            kernel = (kernel + kernel[::-1, ::-1]) / 2
        errors = *np.zeros((2, kernel_sampling_error.OCTAVES)), max(kernel.shape)
        if wrong is not None:
            wrong = tile_sums(wrong, split)
            errors = (
                kernel_sampling_error.by_octave(wrong, kernel),
                kernel_sampling_error.deviation(wrong, kernel),
                kernel_sampling_error.core(wrong),
            )
        return kernel, *errors, energy / sampled_pupil.stop_mm2(lens)

    def stored_band(
        centre: float, width: float
    ) -> tuple[
        np.ndarray, ...
    ]:  # band by band, so that what was done before a run was stopped is not done again
        part = f"{name}{kernel_store.PART}{centre:.9g}"
        if name and (stored := kernel_store.load(part)):
            (core, transmitted, *errors), [kernel] = stored
            return np.array(kernel), *np.split(np.ravel(errors), 2), core[0], transmitted[0]
        start = perf_counter()
        kernel, speckle, deviation, core, transmitted = band = one_band(centre, width)
        if name and perf_counter() - start > WORTH_KEEPING_S:
            kernel_store.save(
                part,
                (1, *kernel.shape),
                "<f4",
                [kernel],
                lambda: np.array([core, transmitted, *speckle, *deviation])[:, None],
            )
        return band

    with executor(min(cpus(), len(wavelength_nm), MOST_THREADS)) as pool:
        bands, speckle, deviation, core, transmitted = zip(
            *track(
                pool.map(stored_band, wavelength_nm, width_nm),
                "bands of the point spread",
                len(wavelength_nm),
            )
        )
    outside = np.array([1 - float(b.sum(dtype=float)) for b in bands])
    speckle = np.array(speckle)
    deviation = np.array(deviation)
    wrap = (wings.WRAP_SHARED if lattices else wings.WRAP) if speckle.max() > 0 else 0.0
    return Kernels(
        list(bands),
        outside,
        speckle,
        np.array(transmitted),
        wrap,
        deviation,
        np.array(core, float),
        (lens, flares),
    )


def _split(
    lens: PupilOptics, shortest_nm: float, pitch_um: tuple[float, float], reach: tuple[int, int]
) -> int:
    """Return the number of parts, per axis, into which to divide tiles that are much wider than the
    core of the point spread function.
    """
    if shortest_nm <= 0:
        return 1
    parts = np.ceil(max(pitch_um) / (8 * sampled_pupil.blur_um(lens, shortest_nm)))
    return int(max(1, min(parts, np.sqrt(MOST_TILES / np.prod([2 * r + 1 for r in reach])))))


def core_half(
    lens: PupilOptics, shortest_nm: float, pitch_um: Sequence[float], reach: Sequence[int]
) -> tuple[int, int]:
    """Return the (y, x) tiles from the axis to the border of the exact core, `reach` at most.

    Samples are at most half as wide as the finest detail, wavelength x f-number. If tiles are finer
    still (slow lenses, small pixels) and the frame is not wider than such a core, the core covers
    the whole frame, up to `CORE_TILES`.

    Parameters
    ----------
    lens : a lens of this package. `shortest_nm` : wavelength. `pitch_um` : (y, x) of a tile.
    reach : (y, x) tiles of the kernel.
    """
    blur = sampled_pupil.blur_um(lens, shortest_nm)
    half = [
        min(r, max(3, int(CORE_SAMPLES / np.ceil(2 * p / blur)))) for r, p in zip(reach, pitch_um)
    ]
    within = all(
        2 * p * max(r, CORE_SAMPLES) <= CORE_SAMPLES * blur for r, p in zip(reach, pitch_um)
    )
    if within and np.prod([2.0 * r + 1 for r in reach]) <= CORE_TILES:
        half = reach
    return tuple(half)


def _lattices(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: np.ndarray,
    width_nm: np.ndarray,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
) -> list:
    """Return the result of `wings.shared` for all bands; None if it would be wrong, or exact cores
    cover the frame.
    """
    shortest = wavelength_nm - width_nm / 2
    if shortest.min() <= 0 or sampled_pupil.has_phase(lens, flares):
        return []
    if all(without_lattices(lens, first, pitch_um, reach) for first in shortest):
        return []
    grid = fine_tiles(lens, float(shortest.min()), pitch_um, reach)
    return wings.shared(lens, flares, float(shortest.min()), grid)


def without_lattices(
    lens: PupilOptics, shortest_nm: float, pitch_um: tuple[float, float], reach: tuple[int, int]
) -> bool:
    """Return whether the exact core of a band that starts at `shortest_nm` covers its kernel.

    Parameters
    ----------
    lens : a lens of this package.
    shortest_nm : shortest wavelength of the band, nm.
    pitch_um : (y, x) of a tile, um.
    reach : (y, x) tiles from the axis to the border of the kernels.
    """
    _, fine, wide = fine_tiles(lens, shortest_nm, pitch_um, reach)
    return core_half(lens, shortest_nm, fine, wide) == tuple(wide)


def fine_tiles(
    lens: PupilOptics, shortest_nm: float, pitch_um: tuple[float, float], reach: tuple[int, int]
) -> wings.Grid:
    """Return the tiles of which a kernel is composed.

    They are parts of the frame's tiles if these are much wider than the finest detail.

    Parameters
    ----------
    lens : a lens of this package. `shortest_nm` : wavelength.
    pitch_um : (y, x) of a tile. `reach` : (y, x) tiles.
    """
    split = _split(lens, shortest_nm, pitch_um, reach)
    return wings.Grid(split, [p / split for p in pitch_um], [r * split + split - 1 for r in reach])


def held_bytes(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: np.ndarray,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
) -> float:
    """Return the bytes of kernels up to `reach` (y, x) tiles, and of lattices. Those of traced
    lenses are not counted.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    wavelength_nm : centres of the bands, nm.
    pitch_um : (y, x) of a tile, um.
    reach : (y, x) tiles from the axis to the border of the kernels.
    """
    total = float(FLOAT32_BYTES * len(wavelength_nm) * np.prod([2.0 * r + 1 for r in reach]))
    shortest = float(np.min(wavelength_nm - band_widths_nm(wavelength_nm) / 2))
    if not lens.blurs or lens.field_varies or lens.traced is not None or shortest <= 0:
        return total
    if without_lattices(lens, shortest, pitch_um, reach):
        return total
    frame = _frame(lens, flares, wavelength_nm, pitch_um, reach)
    if frame is not None:
        return scaled_pattern.memory_bytes(lens, frame)
    frame = _phase_frame(lens, flares, wavelength_nm, pitch_um, reach)
    if frame is not None:
        return phase_patterns.memory_bytes(lens, flares, frame)
    return total + wings.lattice_bytes(lens, shortest, fine_tiles(lens, shortest, pitch_um, reach))


def _described(flare: Any) -> bool:
    return is_dataclass(flare)


class BandPlan:
    """One band: the pupil of the core, its energy, the grids of the rings."""

    def __init__(
        self,
        lens: PupilOptics,
        flares: Sequence[Flare],
        band_nm: tuple[float, float],
        grid: wings.Grid,
        lattices: Sequence[Any] = (),
        shared: Knots | None = None,
    ) -> None:
        """Compute the core's grid of one band.

        Parameters
        ----------
        lens : a lens of this package. `flares` : its flare components.
        band_nm : (centre, width). `grid` : tiles of the kernel.
        lattices : of the pattern, if it is one for all wavelengths.
        shared : `interpolation_wavelengths.Knots` that other bands use too.
        """
        centre_nm, width_nm = band_nm
        split, pitch_um, reach = grid
        self.lens = lens
        self.flares = flares
        self.pitch = tuple(pitch_um)
        self.reach = tuple(reach)
        self.distance = sampled_pupil.distance_mm(lens)
        self.split = split
        self.lattices = lattices
        self.knots = shared or interpolation_wavelengths.Knots()
        self.shortest = centre_nm - width_nm / 2
        self.longest = centre_nm + width_nm / 2
        if self.shortest <= 0:
            raise ConfigError(
                f"the band at {centre_nm:g} nm is {width_nm:g} nm wide: it reaches 0; expected"
                " closer wavelengths"
            )
        self.half = core_half(lens, self.shortest, pitch_um, reach)
        extent = max(2 * (h + 4) * p for h, p in zip(self.half, pitch_um))
        pitch = sampled_pupil.core_pitch_mm(
            lens, extent, self.shortest, sampled_pupil.FEWEST_SAMPLES
        )
        self.axis = sampled_pupil.axis_mm(lens, pitch)
        self.fixed = sampled_pupil.all_shapes(flares) and not sampled_pupil.delays_um(lens, flares)
        self.energy = (
            sampled_pupil.open_energy_mm2(lens, flares, self.shortest) if self.fixed else None
        )

    def band(self, centre: float, width: float) -> np.ndarray:
        """Return one band's kernel without scatter, the difference between its halves (None:
        exact), and the energy of its pupil, mm2.
        """
        lens = self.lens
        flares = self.flares
        energy = self.energy or sampled_pupil.open_energy_mm2(lens, flares, centre)
        waves = self.wavelengths(
            centre, width, max(self.half) / self.split, 3 if self.split == 1 else 1
        )
        core = exact_core(self, centre, width, waves, energy)
        kernel = core
        wrong = None
        if self.half != self.reach:
            kernel, wrong = wings.rings(self, centre, width, energy)
            # both halves go along the same lines
            if straight := (
                0.0 if self.lattices else interpolation_wavelengths.error(self, centre, width)
            ):
                wrong *= np.float32(
                    np.hypot(
                        1,
                        straight
                        / max(kernel_sampling_error.by_octave(wrong, kernel).max(), straight / 10),
                    )
                )
            kernel[tuple(slice(r - h, r + h + 1) for r, h in zip(self.reach, self.half))] = core
        return kernel, wrong, energy

    def wavelengths(self, centre: float, width: float, radius: float, least: int) -> np.ndarray:
        """Return midpoints of equal sub-bands of the core. From one to the next, the pattern at
        `radius` tiles moves by a speckle at most.

        Parameters
        ----------
        centre, width : of the band, nm.
        radius : tiles from the axis to the border of the core.
        least : number of sub-bands at least.
        """
        pitch = max(self.pitch)
        count = radius * pitch * width / (centre * sampled_pupil.blur_um(self.lens, centre))
        # a radian rms from one to the next
        count = max(
            count,
            sampled_pupil.phase_change(
                self.lens, self.flares, centre - width / 2, centre + width / 2
            ),
        )
        count = int(np.clip(np.ceil(count), least if width > 1.5 else 1, MOST_WAVELENGTHS))
        return centre + ((np.arange(count) + 0.5) / count - 0.5) * width


def point_spread(
    lens: PupilOptics,
    wavelength_nm: float | list[float],
    pitch_um: float,
    size: int,
    flares: Sequence[Flare],
    integrated: bool | None,
) -> xr.DataArray:
    """Return the point spread function of a lens with flares; see `DiffractionLimitedLens.psf`.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    wavelength_nm : one or more wavelengths, nm.
    pitch_um : of the samples, um.
    size : samples along either axis.
    integrated : whether samples are integrals over their squares; None: where they are wide.
    """
    waves = np.atleast_1d(np.asarray(wavelength_nm, float))
    memory.check_psf(waves, pitch_um, size)
    if integrated is None:
        integrated = bool(pitch_um >= min(sampled_pupil.blur_um(lens, w) for w in waves))
    out = []
    for wave in waves:
        pitch_mm = sampled_pupil.core_pitch_mm(lens, (size + 8) * pitch_um, wave)
        axis = sampled_pupil.axis_mm(lens, pitch_mm)
        pupil = sampled_pupil.resolved(lens, flares, axis, axis, wave)
        psf = psf_from_pupil(
            pupil,
            None,
            sampled_pupil.scaled_nm(lens, wave),
            pitch_mm,
            sampled_pupil.distance_mm(lens),
            pitch_um,
            size,
            sampled_pupil.open_energy_mm2(lens, flares, wave),
            cell_means=True,
            integrated=integrated,
        )
        out.append(scatter.mix(psf, flares, wave, (pitch_um, pitch_um), lens.focal_length_mm))
    return psf_array(np.stack(out), waves, pitch_um, lens, flares, integrated)


def psf_array(
    values: np.ndarray,
    wavelength_nm: ArrayLike,
    pitch_um: float,
    lens: LensOptics,
    flares: Sequence[Flare],
    integrated: bool = True,
) -> xr.DataArray:
    """Return point spread functions as a labelled DataArray, y and x in metres.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    values : (wavelength, y, x), the axis at index size // 2.
    wavelength_nm : one or more wavelengths, nm.
    pitch_um : of the samples, um.
    integrated : whether samples are integrals over their squares.
    """
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
