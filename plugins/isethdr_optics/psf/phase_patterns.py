"""Phase patterns: the kernels of all bands of a lens with a wavefront, from its patterns at a few
wavenumbers.

A wavefront with the same path difference at all wavelengths is a phase proportional to the
wavenumber. Scaled to the same size, the pattern is then a smooth function of the wavenumber. A
polynomial through a few patterns gives the pattern of every band (`whole_plane_pattern`). Means
over tiles and bands are read from running sums along rays, with the sampling of `scaled_pattern`.
The exact core is computed band by band (`exact_core`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.physics.optics import half_plane_pattern as patterns
from isethdr_core.physics.optics import pattern_columns, ray_sums
from isethdr_core.physics.optics import whole_plane_pattern as whole
from isethdr_core.physics.optics.zernike import wavefront_um

from ..pupil import pupil_phase, pupil_shapes, pupil_size, wavefronts
from ..pupil.wavefronts import coefficients_um
from . import kernel_sampling_error
from . import scaled_pattern as scaled
from .scaled_pattern import Errors, Frame, Rings
from .wings import PHASE_CHANGE

if TYPE_CHECKING:
    from isethdr_core.physics.optics.half_plane_pattern import HalfLattice
    from isethdr_core.physics.optics.ray_sums import Columns

    from ..abilities import PupilOptics

INTERPOLATED = 0.005  # largest error of the polynomial, relative to the light
# largest number of wavenumbers; each takes as long as all kernels of a lens without phase
MOST_WAVENUMBERS = 9
# step of the direct sums, wavelengths x f-number; samples that close hold all of the pattern
CHECKED_STEP = 0.5
CHECKED_PERIOD = 4.0  # period of the direct sums, in reaches of the kernel
# largest change of phase between adjacent pupil cells of the direct sums, wavelengths
CHECKED_TURNS = 1 / 128


def serves(frame: Frame) -> bool:
    """Return whether patterns at a few wavenumbers can give the kernels of a frame: the phase must
    be proportional to the wavenumber, and the lattices must fit into memory.
    """
    lens = frame.lens
    flares = frame.flares
    if not lens.zernike_um or lens.focal_shift_um or lens.traced is not None or lens.uneven:
        return False
    if not pupil_shapes.all_shapes(flares) or pupil_shapes.delays_um(lens, flares):
        return False
    if lens.pupil_matrix is not None or frame.core == frame.reach:
        return False
    if frame.has_wide_tiles:  # each tile holds many speckles: coarse lattices cost less
        return False
    if whole.left_by(MOST_WAVENUMBERS, _change(frame)) > INTERPOLATED:
        return False
    within = (pupil_phase.phase_change(lens, flares, *band) for band in frame.edges_nm)
    if max(within) > PHASE_CHANGE or not scaled.lattices_fit(frame):
        return False
    wave = frame.scaled_nm
    outline = patterns.RealPupil([], pupil_size.reach_mm(lens), pupil_size.distance_mm(lens), 1.0)
    return all(
        whole.fits(outline, wave, lattice)
        and _steepest_turns(frame, lattice) <= 1.01 * whole.MOST_TURNS
        for _, _, lattice in lattices(frame, scaled.usual_rings(frame))
    )


def memory_bytes(frame: Frame) -> float:
    """Return the peak memory, bytes, of the kernels of a frame and the patterns of the largest
    lattice.
    """
    kernel_bytes = 4.0 * len(frame.edges_nm) * np.prod([2.0 * r + 1 for r in frame.reach])
    *_, (_, _, lattice) = lattices(frame, scaled.usual_rings(frame))
    pattern = 4.0 * np.prod([2.0 * n + 1 for n in lattice.samples_to_border])
    count = len(wavenumbers(frame))
    return float(kernel_bytes + count * pattern + 4.0 * np.prod(lattice.period, dtype=float))


def wavenumbers(frame: Frame) -> np.ndarray:
    """Return the wavenumbers, 1 / nm, at which patterns are computed."""
    ends = 1 / frame.edges_nm.max(), 1 / frame.edges_nm.min()
    return whole.interpolation_wavenumbers(*ends, _change(frame), INTERPOLATED)


def wings(
    frame: Frame,
    read: Rings,
    out: np.ndarray,
    apply: Callable = map,
) -> None:
    """Write the kernels beyond the exact core into `out`, (band, y, x) float32.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    read : sampling of the rings.
    out : (band, y, x) float32 array that receives the kernels.
    apply : `map`, or the `map` of a pool of threads.
    """
    pupil = frame.pupil(frame.shortest_nm)
    wave = frame.scaled_nm
    edges = frame.scaled_edges_nm
    numbers = wavenumbers(frame)
    share = whole.shares(numbers, (1 / frame.edges_nm).mean(axis=1))
    inner = min(frame.core)
    for level, outer, lattice in lattices(frame, read):
        if max(outer) <= inner:
            continue
        drawn = whole.drawn_pupil(pupil, wave, lattice)
        patterns = [whole.whole_pattern(drawn, _turns(frame.lens, 1 / k), apply) for k in numbers]
        del drawn
        rays = scaled.rays_per_tile(frame, level)
        # the right half plane, and the left one rotated by 180 degrees
        views = out, out[:, ::-1, ::-1]
        # columns also write tiles beyond the diagonals; rows are written last and replace them
        for axis, writer in ((1, _columns), (0, _rows)):
            for side, into in enumerate(views):
                sectors = [
                    tuple(
                        ray_sums.sectors(
                            pattern[side],
                            frame.pitch_um,
                            edges,
                            read.sharpened,
                            pattern[1 - side].density,
                            part,
                        )
                    )[1 - axis]
                    for pattern, part in zip(patterns, share)
                ]
                for low, high in ray_sums.rings(inner, outer[axis]):
                    ring = ray_sums.Ring(low, high, outer[1 - axis], 1 - axis)
                    many = scaled.places(frame, low, level)
                    write = writer(into, frame)
                    ray_sums.band_means(sectors, ring, rays, many, write, apply)
        inner = max(outer)


def errors(
    frame: Frame,
    whole_kernels: np.ndarray,
    apply: Callable = map,
) -> Errors:
    """Return the errors of kernels against direct sums over the pupil, as `scaled_pattern.errors`.

    Three groups of columns are compared: the band of the shortest wavelengths next to the core;
    and, on the other side of the axis, the longest next to the core and the shortest far from it.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    whole_kernels : (band, y, x) kernels.
    apply : `map`, or the `map` of a pool of threads.
    """
    reach = frame.reach[1]
    order = np.argsort(frame.edges_nm[:, 0])
    last = max(2, reach + 1 - scaled.columns_together(frame))
    near_column = min(frame.core[1] + 1, last)
    far_column = min(max(near_column, int(0.75 * reach)), last)
    short = order[0]
    long = order[-1]
    relative = []
    deviation = []
    means = []
    for first, band, turned in (
        (near_column, short, False),
        (near_column, long, True),
        (far_column, short, True),
    ):
        kernel = whole_kernels[band][::-1, ::-1] if turned else whole_kernels[band]
        wrong, light = _wrong(frame, kernel, (first, band, turned), apply)
        column_errors = kernel_sampling_error.ColumnErrors()
        column_errors.add(wrong, light, first, frame.core)
        relative.append(column_errors.relative())
        deviation.append(column_errors.deviation())
        means.append(float(np.abs(column_errors.mean()).max()))
    return scaled.of_whole_kernels(np.max(relative, axis=0), np.max(deviation, axis=0), max(means))


def _wrong(
    frame: Frame,
    kernel: np.ndarray,
    place: tuple[int, int, bool],
    apply: Callable[..., Any],
) -> tuple[np.ndarray, np.ndarray]:
    """Return the error and the light, each (y, column), of a few columns of a kernel.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    kernel : (y, x) kernel of one band.
    place : (first column in tiles from the axis, index of the band, whether the kernel is rotated
        by 180 degrees).
    apply : `map`, or the `map` of a pool of threads.
    """
    first, band, turned = place
    count = min(scaled.columns_together(frame), frame.reach[1] + 1 - first)
    edges = tuple(float(pupil_size.scaled_nm(frame.lens, w)) for w in frame.edges_nm[band])
    asked = pattern_columns.Place(
        first,
        count,
        frame.reach[0],
        frame.pitch_um,
        edges,
        step=CHECKED_STEP,
        period=CHECKED_PERIOD,
    )
    wave = 1 / float((1 / frame.edges_nm[band]).mean())
    light = pattern_columns.columns_with_phase(
        frame.pupil(wave),
        asked,
        _turns(frame.lens, wave, turned),
        _displacement_um(frame) / CHECKED_TURNS,
        apply,
    )
    middle = frame.reach[1]
    return kernel[:, middle + first : middle + first + count] - light, light


def _turns(lens: PupilOptics, wavelength_nm: float, turned: bool = False) -> whole.Turns:
    """Return the function that gives the phase of the lens, in wavelengths, over the pupil.

    Parameters
    ----------
    lens : a lens with a wavefront.
    wavelength_nm : wavelength, nm.
    turned : return the negative phase, which rotates the pattern by 180 degrees.
    """
    radius = pupil_size.radius_mm(lens)
    wavefront = coefficients_um(lens, wavelength_nm)
    scale = (-1 if turned else 1) / (wavelength_nm * 1e-3)

    def turns(x_mm: np.ndarray, y_mm: np.ndarray) -> np.ndarray:
        # y of the OSA polynomials points up. Cells with a smooth response end a little beyond the
        # rim; the polynomial is evaluated there too.
        return scale * wavefront_um(wavefront, x_mm / radius, -y_mm / radius)

    return turns


def _change(frame: Frame) -> float:
    """Return the change of phase from the shortest to the longest wavelength of all bands, rad
    rms.
    """
    return pupil_phase.phase_change(
        frame.lens, frame.flares, float(frame.edges_nm.min()), float(frame.edges_nm.max())
    )


def _displacement_um(frame: Frame) -> float:
    """Return the displacement of light in the image by the steepest slope of the wavefront, um."""
    slope = wavefronts.steepest_um(frame.lens, frame.shortest_nm)
    return slope / pupil_size.radius_mm(frame.lens) * pupil_size.distance_mm(frame.lens)


def _period(frame: Frame, reach_um: float, turns: float) -> float:
    """Return the period of the field, in reaches, at which the phase changes by at most `turns`
    wavelengths between adjacent cells.
    """
    return max(whole.PERIOD, _displacement_um(frame) / (turns * reach_um))


def lattices(
    frame: Frame, read: Rings
) -> Iterator[tuple[scaled.Level, Sequence[int], HalfLattice]]:
    """Yield (level, (y, x) tiles from the axis to its border, lattice) for every level of rings.

    The periods of the lattices are long enough for the slope of the phase.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    read : sampling of the rings.
    """
    for level, outer in scaled.reaches(frame, read):
        reach_um = min(r * p for r, p in zip(outer, frame.pitch_um))
        period = max(read.period, _period(frame, reach_um, whole.MOST_TURNS))
        yield level, outer, scaled.lattice(frame, level, outer, replace(read, period=period))


def _steepest_turns(frame: Frame, lattice: HalfLattice) -> float:
    """Return the largest change of phase between adjacent cells of a lattice's pupil,
    wavelengths.
    """
    return _displacement_um(frame) / (min(lattice.period) * lattice.step_um)


def _columns(out: np.ndarray, frame: Frame) -> Callable[..., Any]:
    """Return a function that writes blocks of columns, x > 0, |y| <= x, into `out`. Rows later
    replace tiles beyond the diagonals.
    """
    rows, middle = frame.reach

    def write(block: Columns) -> None:
        _, count, size = block.values.shape
        half = size // 2
        first = middle + block.first
        into = out[:, rows - half : rows + half + 1, first : first + count]
        into[...] = block.values.transpose(0, 2, 1)

    return write


def _rows(out: np.ndarray, frame: Frame) -> Callable[..., Any]:
    """Return a function that writes blocks of rows, y > 0, |x| < y, into `out`."""
    rows, middle = frame.reach

    def write(block: Columns) -> None:
        half = block.values.shape[2] // 2
        for k in range(block.values.shape[1]):
            own = min(block.first + k - 1, half)
            into = slice(middle - own, middle + own + 1)
            out[:, rows + block.first + k, into] = block.values[:, k, half - own : half + own + 1]

    return write
