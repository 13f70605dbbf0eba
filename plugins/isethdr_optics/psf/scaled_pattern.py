"""Scaled pattern: the kernels of all bands from one diffraction pattern, for pupils without phase.

The pattern of such a pupil keeps its shape and grows in proportion to the wavelength. So it is
computed at one wavelength, and scaled for all others.

Close to the axis tiles are integrated exactly, by weights on band-limited samples (`exact_tiles`).
Farther out means over tiles and bands are read from running sums along rays (`ray_sums`), ring by
ring, from lattices that are finer the nearer they are: there a band moves a tile's light by so
little that few speckles are averaged.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isethdr_core.physics.optics import exact_tiles, pattern_columns, ray_sums
from isethdr_core.physics.optics import half_plane_pattern as patterns
from isethdr_core.physics.optics.lattice import spline_response

from ..pupil import sampled_pupil
from . import kernel_sampling_error

if TYPE_CHECKING:
    from isethdr_core.physics.optics.half_plane_pattern import HalfLattice
    from isethdr_core.physics.optics.ray_sums import Columns
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics

MOST_PLACES = 14  # closer together than the finest detail of any wavelength
MOST_SAMPLES = 3e8  # of the period of a lattice
FINEST = 8.0  # times the samples and rays that are read as usual
# wavelengths x f-number wide; wider ones take more rays, so that these lie as close
USUAL_TILE = 1.9
# wavelengths x f-number: wider tiles average over many speckles, and samples may be coarser
WIDE_TILE = 8.0
WIDEST_TILE = 60.0  # wavelengths x f-number: the exact core of wider ones outgrows memory
USUAL_ERROR = 0.03  # of a tile's light that these leave at most
# wavelengths of an exact core, at Gauss's places in a band: so many per speckle that its corner
# moves, and two more. They leave 1e-5 to 1e-4, as many midpoints of equal parts 7e-3
DENSE_GAUSS = 1.0
MORE_GAUSS = 2
MOST_WAVELENGTHS = 64  # of a band, however wide
LEAST_CORE = 8  # tiles from the axis: nearer, rays are too few
WORTH = 0.9  # of the error: finer kernels that leave more of it are not made finer still
FEWEST = 2.0  # samples across a tile
MOST_ACROSS = 1e5  # cells across the pupil
NARROWEST = 2e-4  # of a band, relative: a line of 0.1 nm
# largest error of the border tiles from the period of the field, as `wings.WRAP_SHARED`
WRAP = 0.0015
COLUMNS = 8  # of tiles, looked at together; of wide ones, which hold more speckles,
WIDE_COLUMNS = 2
FINE_STRIPS = 5.0  # of a pupil's cell, for patterns right to 3e-4
# of direct sums. Beside the axis light falls so steeply that they take half the step
FINE_COLUMNS = {"step": 0.1, "moves": 0.25, "period": 6.0, "strips": 3.0}
NEAREST_COLUMNS = {**FINE_COLUMNS, "step": 0.05}
# over wide tiles, as `WIDE`
WIDE_FINE_COLUMNS = {"step": 0.5, "moves": 0.5, "period": 6.0, "strips": 3.0}
NEAREST = 8  # tiles from the axis: nearer, no error of a wider core was found
MOST_SUMS = 1e11  # of a wider core: some 6 CPU seconds
USUAL_SUMS = 8e3  # for every value of the kernels: as long as the other rings take
# times their errors' deviation is stated: whole kernels showed up to 1.5, most below 1.2
ELSEWHERE = 1.25


@dataclass(frozen=True)
class Level:
    """How finely rings are read where a band moves light by less than `moves` tiles."""

    moves: float
    step: float  # of the lattice, wavelengths x f-number
    per_tile: float  # samples along each axis of a tile, at least
    rays: float  # per tile, at a ring's outermost
    places: float = 5.5  # under a tile's triangle, over the tiles that its light moves in a band

    def finer(self, times: float) -> Level:
        """Return the level with `times` the samples of a lattice, rays and positions."""
        root = np.sqrt(times)
        return Level(
            self.moves, self.step / root, self.per_tile * root, self.rays * root, self.places * root
        )


@dataclass(frozen=True)
class Rings:
    """How finely all rings are read, and how their errors are looked at."""

    levels: tuple[Level, ...]
    period: float = patterns.PERIOD  # of the field, in reaches, where memory allows it
    strips: float = patterns.STRIPS  # of a pupil's cell
    sharpened: bool = False  # samples, as `ray_sums.Sector`
    columns: Mapping[str, float] = field(default_factory=dict)  # of direct sums, as `Place`

    def finer(self, times: float) -> Rings:
        """Return rings with `times` the samples, rays and positions."""
        return replace(self, levels=tuple(level.finer(times) for level in self.levels))


USUAL = Rings(
    (
        Level(1.8, 0.4, 4.0, 3.0),
        Level(5.5, 0.45, 4.0, 3.0),
        Level(np.inf, 0.7, 2.5, 2.0),
    )
)
# For light beside very bright lamps: 0.02 to 0.1 of the usual errors
FINE = Rings(
    (
        Level(1.8, 0.2, 8.0, 3.0, 27.0),
        Level(5.5, 0.2, 8.0, 3.0, 27.0),
        Level(np.inf, 0.4, 4.0, 3.0, 27.0),
    ),
    3.2,
    FINE_STRIPS,
    True,
    {"step": 0.15, "moves": 0.5, "period": 4.0, "strips": 3.0},
)
# A pattern has no frequency above 1 / (wavelength x f-number), a tile hardly takes those above
# 1 / width: a step of 0.8 takes none of the first kind for one of the second where tiles are wider
# than 4. A step of 1.2 was up to 17 % wrong.
WIDE = Rings((Level(np.inf, 0.8, 4.0, 3.0),), columns={"step": 0.75})
WIDE_FINE = 4.0  # times the samples, rays and places, where a sensor asks for fine rings


@dataclass(frozen=True)
class Frame:
    """Bands and tiles that kernels are asked for; pairs are (y, x)."""

    edges_nm: np.ndarray  # (band, 2)
    pitch_um: tuple[float, float]
    reach: tuple[int, int]
    core: tuple[int, int]

    @property
    def shortest_nm(self) -> float:
        """Of all bands."""
        return float(self.edges_nm.min())

    @property
    def narrowest(self) -> float:
        """Least width of a band over its longest wavelength: what part of its distance to the axis
        a tile's light moves by.
        """
        return float((np.diff(self.edges_nm)[:, 0] / self.edges_nm[:, 1]).min())


def serves(lens: PupilOptics, flares: Sequence[Flare], frame: Frame) -> bool:
    """Return whether kernels of a frame can be made from one pattern: no phase, and lattices that
    memory and patience allow.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    frame : bands and tiles of the kernels.
    """
    if sampled_pupil.has_phase(lens, flares) or lens.uneven:
        return False
    return lattices_fit(lens, frame)


def lattices_fit(lens: PupilOptics, frame: Frame) -> bool:
    """Return whether memory and patience allow the lattices of a frame.

    Tiles finer than the finest detail need lattices finer than theirs.
    """
    if min(frame.core) < LEAST_CORE or _width(lens, frame) > WIDEST_TILE:
        return False
    last_lattice = _lattices(lens, frame, usual_rings(lens, frame))[-1]
    across = (
        last_lattice.step_um
        * max(last_lattice.period)
        / sampled_pupil.blur_um(lens, frame.shortest_nm)
    )
    coarse = last_lattice.step_um > min(frame.pitch_um) / FEWEST
    return frame.narrowest >= NARROWEST and across <= MOST_ACROSS and not coarse


def memory_bytes(lens: PupilOptics, frame: Frame, read: Rings | None = None) -> float:
    """Return the peak memory, bytes: kernels of a frame, and the largest lattice.

    Parameters
    ----------
    lens : a lens of this package.
    frame : bands and tiles of the kernels.
    read : how finely rings are read; None: as usual.
    """
    rows, columns = frame.reach
    read = read or usual_rings(lens, frame)
    kernel_bytes = 4.0 * len(frame.edges_nm) * (rows + 1) * (2.0 * columns + 1)
    return kernel_bytes + max(
        lattice_of_level.bytes for lattice_of_level in _lattices(lens, frame, read)
    )


def wide_tiles(lens: PupilOptics, frame: Frame) -> bool:
    """Return whether tiles average over enough speckles for coarser samples."""
    return _width(lens, frame) > WIDE_TILE


def _width(lens: PupilOptics, frame: Frame) -> float:
    """Return the width of tiles, wavelengths x f-number."""
    return min(frame.pitch_um) / sampled_pupil.blur_um(lens, frame.shortest_nm)


def usual_rings(lens: PupilOptics, frame: Frame) -> Rings:
    """Return how rings of a frame are read, unless a sensor asks for more."""
    if not wide_tiles(lens, frame):
        return USUAL
    # fewer rays and positions, by the root of the ratio of the tile widths: the error halves
    share = np.sqrt(USUAL_TILE / _width(lens, frame))
    levels = (replace(v, rays=v.rays * share, places=v.places * share) for v in WIDE.levels)
    return replace(WIDE, levels=tuple(levels))


def fine_rings(lens: PupilOptics, frame: Frame) -> Rings:
    """Return how rings of a frame are read beside very bright lamps."""
    return usual_rings(lens, frame).finer(WIDE_FINE) if wide_tiles(lens, frame) else FINE


def finer_rings(lens: PupilOptics, frame: Frame) -> Rings:
    """Return how rings of a frame are read for the error that the lens allows."""
    return usual_rings(lens, frame).finer(min(FINEST, max(1.0, USUAL_ERROR / lens.speckle_error)))


def fine_enough(
    lens: PupilOptics, flares: Sequence[Flare], frame: Frame, apply: Callable = map
) -> tuple[np.ndarray, Errors]:
    """Return `halves` and their `errors`, as finely made as `lens.speckle_error` asks for and
    `FINEST` allows.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    frame : bands and tiles of the kernels.
    apply : `map`, or the `map` of a pool of threads.
    """
    fine = min(FINEST, max(1.0, USUAL_ERROR / lens.speckle_error))
    core = exact_halves(lens, flares, frame, frame.core, apply)
    before = np.inf
    read = usual_rings(lens, frame)
    while True:
        half_kernels = halves(lens, flares, frame, core, read.finer(fine), apply)
        errors_of_bands = errors(lens, flares, frame, half_kernels, read, apply)
        worst = errors_of_bands.relative.max()
        if worst <= lens.speckle_error or fine >= FINEST or worst > WORTH * before:
            return half_kernels, errors_of_bands
        before = worst
        fine = min(FINEST, fine * max(1.5, 1.2 * worst / lens.speckle_error))


def pupil_of(
    lens: PupilOptics, flares: Sequence[Flare], wavelength_nm: float
) -> patterns.RealPupil:
    """Return the pupil of a lens without phase.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    wavelength_nm : wavelength, nm.
    """
    return patterns.RealPupil(
        sampled_pupil.terms(lens, flares),
        sampled_pupil.reach_mm(lens),
        sampled_pupil.distance_mm(lens),
        sampled_pupil.open_energy_mm2(lens, flares, wavelength_nm),
    )


def halves(
    lens: PupilOptics,
    flares: Sequence[Flare],
    frame: Frame,
    core: np.ndarray,
    read: Rings = USUAL,
    apply: Callable = map,
) -> np.ndarray:
    """Return (band, y = 0 .. reach, x = -reach .. reach) float32; the other half is the mirror
    image.

    Parameters
    ----------
    lens : lens of this package, without phase.
    flares : flare models in the lens.
    frame : bands and tiles of the kernels.
    core : exact cores of `exact_halves`, as large as `frame.core`.
    read : sampling of the rings.
    apply : `map`, or the `map` of a pool of threads.
    """
    rows, columns = frame.reach
    out = np.empty((len(frame.edges_nm), rows + 1, 2 * columns + 1), np.float32)
    core_y, core_x = frame.core
    inner = min(frame.core)
    pupil = pupil_of(lens, flares, frame.shortest_nm)
    wave = sampled_pupil.scaled_nm(lens, frame.shortest_nm)
    edges = np.vectorize(lambda w: sampled_pupil.scaled_nm(lens, w))(frame.edges_nm)
    for level, outer in reaches(frame, read):
        if max(outer) <= inner:
            continue
        pattern = patterns.half_pattern(
            pupil, wave, lattice(lens, frame, level, outer, read), apply
        )
        across, along = ray_sums.sectors(pattern, frame.pitch_um, edges, read.sharpened)
        rays = rays_per_tile(lens, frame, level)
        for low, high in ray_sums.rings(inner, outer[1]):
            ring = ray_sums.Ring(low, high, outer[0], 0)
            many = places(frame, low, level)
            write = _columns(out, frame)
            ray_sums.band_means([across], ring, rays, many, write, apply)
        for low, high in ray_sums.rings(inner, outer[0]):
            ring = ray_sums.Ring(low, high, outer[1], 1)
            many = places(frame, low, level)
            write = _rows(out, frame)
            ray_sums.band_means([along], ring, rays, many, write, apply)
        inner = max(outer)
    out[:, : core_y + 1, columns - core_x : columns + core_x + 1] = core
    return out


def reaches(frame: Frame, read: Rings = USUAL) -> Iterator[tuple[Level, list[int]]]:
    """Yield levels and the (y, x) tiles from the axis to the border of each."""
    for level in read.levels if frame.core != frame.reach else ():
        border = level.moves / frame.narrowest
        yield level, [int(min(r, max(border, c))) for r, c in zip(frame.reach, frame.core)]


def _lattices(lens: PupilOptics, frame: Frame, read: Rings = USUAL) -> list[HalfLattice]:
    """Return the lattices of all levels, the largest last; those of a frame within its core too."""
    levels = list(reaches(frame, read)) or [(read.levels[-1], frame.reach)]
    return [lattice(lens, frame, level, outer, read) for level, outer in levels]


def lattice(
    lens: PupilOptics, frame: Frame, level: Level, outer: Sequence[int], read: Rings = USUAL
) -> HalfLattice:
    """Return the `half_plane_pattern.HalfLattice` of a level that ends `outer` (y, x) tiles from
    the axis.

    Parameters
    ----------
    lens : a lens of this package.
    frame : bands and tiles of the kernels.
    level : of the rings that are read from it.
    outer : (y, x) tiles from the axis to the border of the level.
    read : how finely rings are read.
    """
    pitch = min(frame.pitch_um)
    blur = sampled_pupil.blur_um(lens, frame.shortest_nm)
    step = min(level.step * blur, pitch / level.per_tile)
    extent = [(r + 2) * p for r, p in zip(outer, frame.pitch_um)]
    finest = np.sqrt(np.prod(extent) / MOST_SAMPLES)  # for a period of one reach
    step = max(step, patterns.PERIOD * finest)
    period = max(patterns.PERIOD, min(read.period, step / finest))
    return patterns.half_lattice(extent, step, period, read.strips)


def wrap(lens: PupilOptics, frame: Frame, read: Rings) -> float:
    """Return the largest error that the period of the field leaves in the border tiles.

    `WRAP` was measured with the usual period; light from beyond a longer one is held back by more
    (`lattice.spline_response`), in amplitude.

    Parameters
    ----------
    lens : a lens of this package.
    frame : bands and tiles of the kernels.
    read : how finely rings are read.
    """
    level, outer = list(reaches(frame, read))[-1]
    lattice_of_level = lattice(lens, frame, level, outer, read)
    period = min(p / f for p, f in zip(lattice_of_level.period, lattice_of_level.samples_to_border))
    needed, usual = (
        float(spline_response(1 - 1 / p) / spline_response(1 / p))
        for p in (period, patterns.PERIOD)
    )
    return WRAP * min(1.0, needed / usual)


def rays_per_tile(lens: PupilOptics, frame: Frame, level: Level) -> float:
    """Return the rays per tile at a ring's outermost: as close as in a tile of usual width.

    Parameters
    ----------
    lens : a lens of this package.
    frame : bands and tiles of the kernels.
    level : of the ring.
    """
    blur = sampled_pupil.blur_um(lens, frame.shortest_nm)
    return level.rays * max(1.0, max(frame.pitch_um) / (USUAL_TILE * blur))


def places(frame: Frame, low: int, level: Level) -> int:
    """Return the places that stand for the triangle of two tiles in a ring from `low` tiles on.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    low : tiles from the axis to the ring.
    level : of the ring.
    """
    count = np.ceil(level.places / (low * frame.narrowest) - 0.05)
    return int(np.clip(count, 1, MOST_PLACES))


def _columns(out: np.ndarray, frame: Frame) -> Callable[..., Any]:
    """Return what writes blocks of columns, |y| <= x; tiles beyond the diagonal are written again
    by rows.
    """
    middle = frame.reach[1]

    def write(block: Columns) -> None:
        _, count, size = block.values.shape
        half = size // 2
        right = slice(middle + block.first, middle + block.first + count)
        mirrored = slice(middle - block.first - count + 1, middle - block.first + 1)
        for band, values in zip(out, block.values):
            band[: half + 1, right] = values[:, half:].T
            band[: half + 1, mirrored] = values[::-1, half::-1].T

    return write


def _rows(out: np.ndarray, frame: Frame) -> Callable[..., Any]:
    """Return what writes blocks of rows, |x| < y."""
    middle = frame.reach[1]

    def write(block: Columns) -> None:
        half = block.values.shape[2] // 2
        for k in range(block.values.shape[1]):
            own = min(block.first + k - 1, half)
            into = slice(middle - own, middle + own + 1)
            out[:, block.first + k, into] = block.values[:, k, half - own : half + own + 1]

    return write


class Wavelengths(NamedTuple):
    """Wavelengths whose weighted sum stands for a band."""

    nm: np.ndarray
    weight: np.ndarray  # sum 1


def exact_halves(
    lens: PupilOptics,
    flares: Sequence[Flare],
    frame: Frame,
    reach: tuple[int, int],
    apply: Callable = map,
) -> np.ndarray:
    """Return (band, y = 0 .. reach, x = -reach .. reach), integrated exactly over tiles and
    averaged over wavelengths of each band.

    The pattern is sampled once, where samples carry all of it; each wavelength weights the samples
    drawn to its scale.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    frame : bands and tiles of the kernels.
    reach : (y, x) tiles from the axis. `apply` : `map`, or the `map` of a pool of threads.
    """
    blur = sampled_pupil.blur_um(lens, frame.shortest_nm)
    lattice = exact_tiles.exact_lattice(frame.pitch_um, reach, blur, FINE_STRIPS)
    wave = sampled_pupil.scaled_nm(lens, frame.shortest_nm)
    pattern = patterns.half_pattern(pupil_of(lens, flares, frame.shortest_nm), wave, lattice, apply)
    tiles = exact_tiles.ExactTiles(pattern, frame.pitch_um, reach)

    def one(band_nm: np.ndarray) -> np.ndarray:
        rule = gauss_wavelengths(lens, band_nm, frame.pitch_um, reach)
        return sum(
            np.float32(share) * tiles.at(sampled_pupil.scaled_nm(lens, w))
            for w, share in zip(*rule)
        )

    return np.stack(list(apply(one, frame.edges_nm)))


def gauss_wavelengths(
    lens: PupilOptics, band_nm: np.ndarray, pitch_um: tuple[float, float], reach: tuple[int, int]
) -> Wavelengths:
    """Return the Gauss-Legendre wavelengths, nm, in a band for a core of `reach`.

    The pattern is a band-limited function of the wavelength, which they integrate almost exactly.

    Parameters
    ----------
    lens : a lens of this package. `band_nm` : (low, high). `pitch_um` : (y, x) of a tile.
    reach : (y, x) tiles of the core.
    """
    low, high = band_nm
    middle = (low + high) / 2
    width = high - low
    moved = float(np.hypot(*(r * p for r, p in zip(reach, pitch_um)))) * width / middle
    speckles = moved / sampled_pupil.blur_um(lens, middle)
    count = int(min(np.ceil(DENSE_GAUSS * speckles) + MORE_GAUSS, MOST_WAVELENGTHS))
    place, weight = np.polynomial.legendre.leggauss(count)
    return Wavelengths(middle + place * width / 2, weight / 2)


class Errors(NamedTuple):
    """How wrong kernels are beyond the exact core, per octave of radius; the largest of the bands
    looked at.
    """

    relative: np.ndarray  # mean magnitude per tile
    deviation: np.ndarray  # as `kernel_sampling_error.deviation`
    mean: float  # largest relative error of an octave's light as a whole


def errors(
    lens: PupilOptics,
    flares: Sequence[Flare],
    frame: Frame,
    half_kernels: np.ndarray,
    read: Rings = USUAL,
    apply: Callable = map,
) -> Errors:
    """Return what direct sums over the pupil say of kernels, in four groups of eight columns of
    tiles.

    Columns cross all octaves beyond their own. Long wavelengths err most near the core, where they
    hold the fewest speckles, short ones far from it, where they ask most of the lattice.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    frame : bands and tiles of the kernels.
    half_kernels : (band, y, x) of `halves`: the half plane from the axis on.
    read : how finely rings are read.
    apply : `map`, or the `map` of a pool of threads.
    """
    if frame.core == frame.reach:
        return Errors(*np.zeros((2, kernel_sampling_error.OCTAVES)), 0.0)
    order = np.argsort(frame.edges_nm[:, 0])
    near_column, middle_column, far_column = _checked_columns(lens, frame)
    short = order[0]
    long = order[-1]
    places_checked = {
        (near_column, short),
        (near_column, long),
        (middle_column, long),
        (far_column, short),
    }

    def one(place: tuple[int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        first, band = place
        wrong, light = _wrong(lens, flares, frame, half_kernels[band], first, band, **read.columns)
        column_errors = kernel_sampling_error.ColumnErrors()
        column_errors.add(wrong, light, first, frame.core)
        return column_errors.relative(), column_errors.deviation(), np.abs(column_errors.mean())

    relative, deviation, mean = (
        np.max(part, axis=0) for part in zip(*apply(one, sorted(places_checked)))
    )
    return of_whole_kernels(relative, deviation, float(mean.max()))


def _checked_columns(lens: PupilOptics, frame: Frame) -> tuple[int, int, int]:
    """Return the first tiles of columns near the core, in the middle, and far out."""
    reach = frame.reach[1]
    last = max(2, reach + 1 - columns_together(lens, frame))
    near_column = min(frame.core[1] + 1, last)
    far_column = min(max(near_column, int(0.75 * reach)), last)
    return near_column, int(np.sqrt(near_column * far_column)), far_column


def checked_columns(lens: PupilOptics, frame: Frame) -> list[int]:
    """Return the first tile of every group of columns that `errors` compares with direct sums."""
    near_column, middle_column, far_column = _checked_columns(lens, frame)
    return [near_column, near_column, middle_column, far_column]


def of_whole_kernels(relative: np.ndarray, deviation: np.ndarray, mean: float) -> Errors:
    """Return the errors of kernels from the largest, per octave, of a few columns of tiles.

    Parameters
    ----------
    relative : largest error per tile of a few columns, per octave of distance, relative; changed in
        place.
    deviation : the same of `kernel_sampling_error.deviation`.
    mean : relative error of the mean of the tiles of a column.
    """
    # of a small frame, corners lie in an octave that no column crosses: as wrong as the one before
    outermost = int(np.flatnonzero(relative).max(initial=0))
    for values in (relative, deviation):
        values[outermost + 1 :] = values[outermost]
    return Errors(relative, ELSEWHERE * deviation, mean)


class Core(NamedTuple):
    """An exact core wider than the usual one."""

    reach: tuple[int, int]  # (y, x) tiles from the axis
    halves: np.ndarray  # as `exact_halves`
    relative: np.ndarray  # mean magnitude of the error per tile, per octave
    deviation: np.ndarray  # of light of any pattern, as `kernel_sampling_error.deviation`


def wider_core(
    lens: PupilOptics, flares: Sequence[Flare], frame: Frame, tiles: int, apply: Callable = map
) -> Core:
    """Return an exact core of `tiles`, with its error against direct sums over the pupil.

    Direct sums are finer than in `errors`, because the error of the core is smaller.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components. `frame` : of the kernels.
    tiles : from the axis to the border of the core. `apply` : `map`, or that of a pool of threads.
    """
    reach = wider_reach(frame, tiles)
    exact = exact_halves(lens, flares, frame, reach, apply)
    order = np.argsort(frame.edges_nm[:, 0])
    last = max(2, reach[1] + 1 - columns_together(lens, frame))
    wide = wide_tiles(lens, frame)
    inside = replace(frame, reach=reach, core=(NEAREST, NEAREST))
    places_checked = {(min(f, last), b) for f in (NEAREST, last) for b in (order[0], order[-1])}

    def one(place: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
        first, band = place
        fine = NEAREST_COLUMNS if first == NEAREST else FINE_COLUMNS
        if wide:
            fine = WIDE_FINE_COLUMNS
        wrong, light = _wrong(lens, flares, inside, exact[band], first, band, **fine)
        column_errors = kernel_sampling_error.ColumnErrors()
        column_errors.add(wrong, light, first, inside.core)
        return column_errors.relative(), column_errors.deviation()

    relative, deviation = (
        np.max(part, axis=0) for part in zip(*apply(one, sorted(places_checked)))
    )
    return Core(reach, exact, relative, ELSEWHERE * deviation)


def wider_reach(frame: Frame, tiles: int) -> tuple[int, int]:
    """Return the reach (y, x) of an exact core of `tiles`, at most that of the frame."""
    return tuple(min(tiles, r) for r in frame.reach)


class CoreSize(NamedTuple):
    """A size that an exact core can have, and what it takes."""

    tiles: int
    quick: bool  # it takes no longer than the rings of the usual kernels


def wider_cores(lens: PupilOptics, frame: Frame) -> list[CoreSize]:
    """Return the sizes that an exact core of a frame can have: each time the root of two wider than
    the usual one, as far as `MOST_SUMS` lets it.
    """
    sizes = []
    tiles = float(max(frame.core))
    usual = USUAL_SUMS * len(frame.edges_nm) * np.prod([r + 1.0 for r in frame.reach])
    while tiles < max(frame.reach):
        tiles = min(tiles * np.sqrt(2), max(frame.reach))
        sums = exact_sums(lens, frame, wider_reach(frame, int(tiles)))
        if sums > MOST_SUMS:
            break
        sizes.append(CoreSize(int(tiles), sums <= usual))
    return sizes


def exact_sums(lens: PupilOptics, frame: Frame, reach: tuple[int, int]) -> float:
    """Return the multiplications that `exact_halves` takes.

    Parameters
    ----------
    lens : a lens of this package.
    frame : bands and tiles of the kernels.
    reach : (y, x) tiles from the axis to the border of the exact core.
    """
    wave = frame.shortest_nm
    step = exact_tiles.STEP * sampled_pupil.blur_um(lens, wave)
    rows, columns = ((2 * r + 3) * p / step for r, p in zip(reach, frame.pitch_um))
    tall, wide = (
        (exact_tiles.BLOCK + 2) * p / step + 2 * exact_tiles.SUPPORT for p in frame.pitch_um
    )
    waves = sum(len(gauss_wavelengths(lens, b, frame.pitch_um, reach).nm) for b in frame.edges_nm)
    return waves * (reach[1] + 1.0) * (wide * rows + (2 * reach[0] + 1) * tall)


def columns_together(lens: PupilOptics, frame: Frame) -> int:
    """Return how many columns of tiles are looked at together."""
    return WIDE_COLUMNS if wide_tiles(lens, frame) else COLUMNS


def _wrong(
    lens: PupilOptics,
    flares: Sequence[Flare],
    frame: Frame,
    half: np.ndarray,
    first: int,
    band: int,
    **fine: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the error and the light, (y, column), of columns from `first` on; `fine` as the
    fields of a `pattern_columns.Place`.
    """
    count = min(columns_together(lens, frame), frame.reach[1] + 1 - first)
    edges = tuple(float(sampled_pupil.scaled_nm(lens, w)) for w in frame.edges_nm[band])
    place = pattern_columns.Place(first, count, frame.reach[0], frame.pitch_um, edges, **fine)
    light = pattern_columns.columns(pupil_of(lens, flares, frame.shortest_nm), place)
    middle = frame.reach[1]
    right = half[:, middle + first : middle + first + count]
    mirrored = half[:0:-1, middle - first - count + 1 : middle - first + 1][:, ::-1]
    return np.concatenate([mirrored, right]) - light, light
