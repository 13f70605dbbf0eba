"""Kernel work: CPU seconds of kernels from patterns, estimated before they are computed.

Operations are counted and multiplied by measured times: samples of lattices, running sums along
rays, reads at the borders of bands, weights of tiles, and chords of the pupil.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isethdr_core.physics.optics import exact_tiles, pattern_columns, ray_sums

from ..pupil import pupil_shapes, pupil_size
from . import phase_patterns, scaled_pattern
from .scaled_pattern import Frame

if TYPE_CHECKING:
    from isethdr_core.physics.optics.half_plane_pattern import HalfLattice
    from isethdr_core.physics.optics.pupil import Convex

    from ..abilities import PupilOptics
    from .scaled_pattern import Level


class Counts(NamedTuple):
    """Numbers of operations that kernels from patterns take."""

    samples: float = 0.0  # samples of lattices
    sums: float = 0.0  # as in `ray_sums.Work`
    reads: float = 0.0  # as in `ray_sums.Work`, times borders of bands, times bands
    taps: float = 0.0  # as in `ray_sums.Work`, times bands
    chords: float = 0.0  # chords of the pupil in lattices and direct sums
    cores: float = 0.0  # multiplications of exact cores without phase
    transforms: float = 0.0  # wavelengths of exact cores with phase


# CPU seconds of each operation. The estimates are 0.7 to 1.3 of the measured times of kernels of
# nine lenses with and without phase (f/1.6 to f/4, 8 and 31 bands, tiles of 3 to 35 um)
SECONDS = Counts(
    samples=2.0e-8,
    sums=7.0e-8,
    reads=1.24e-10,
    taps=3.1e-9,
    chords=1.5e-6,
    cores=8.0e-10,
    transforms=0.09,
)


def seconds(counts: Counts) -> float:
    """Return the CPU seconds of counted operations."""
    return float(np.dot(counts, SECONDS))


def one_pattern(frame: Frame) -> Counts:
    """Return the work of kernels without phase (`scaled_pattern`)."""
    read = scaled_pattern.finer_rings(frame)
    levels = [
        (level, outer, scaled_pattern.lattice(frame, level, outer, read))
        for level, outer in scaled_pattern.reaches(frame, read)
    ]
    terms = pupil_shapes.terms(frame.lens, frame.flares)
    blur = frame.blur_um
    lattices = [patterns for _, _, patterns in levels]
    core = exact_tiles.exact_lattice(frame.pitch_um, frame.core, blur, scaled_pattern.FINE_STRIPS)
    chords = sum(
        _chords(
            frame.lens, terms, blur / (patterns.period[0] * patterns.step_um), patterns.strips + 1
        )
        for patterns in (*lattices, core)
    )
    rows_um = frame.reach[0] * frame.pitch_um[0]
    cell = blur / (pattern_columns.PERIOD * rows_um)
    for first in scaled_pattern.checked_columns(frame):
        far_um = first * frame.pitch_um[1]
        strips = np.ceil(pattern_columns.STRIPS + far_um / rows_um)
        chords += _chords(frame.lens, terms, cell, strips)
    cores = scaled_pattern.exact_sums(frame, frame.core)
    samples = float(sum(np.prod(patterns.period, dtype=float) for patterns in (*lattices, core)))
    return Counts(samples, *_rings(frame, levels), chords, cores)


def with_phase(frame: Frame) -> Counts:
    """Return the work of kernels from patterns at a few wavenumbers (`phase_patterns`)."""
    read = scaled_pattern.finer_rings(frame)
    levels = list(phase_patterns.lattices(frame, read))
    count = len(phase_patterns.wavenumbers(frame))
    terms = pupil_shapes.terms(frame.lens, frame.flares)
    blur = frame.blur_um
    chords = sum(
        _chords(
            frame.lens, terms, blur / (patterns.period[0] * patterns.step_um), patterns.strips + 1
        )
        for _, _, patterns in levels
    )
    samples = count * sum(np.prod(patterns.period, dtype=float) for _, _, patterns in levels)
    # direct sums take one complex lattice for each of three groups of columns
    sides_um = [r * p for r, p in zip(frame.reach, frame.pitch_um)]
    step = phase_patterns.CHECKED_STEP
    period = [phase_patterns.CHECKED_PERIOD * side / (step * blur) for side in sides_um]
    samples += 0.5 * 3 * float(np.prod(period))
    chords += 3 * _chords(frame.lens, terms, 1 / (period[0] * step), 2.0)
    sums, reads, taps = _rings(frame, levels)
    waves = scaled_pattern.core_wavelengths(frame, frame.core)
    both = 2.0 * sums * count, 2.0 * reads * count, 2.0 * taps
    return Counts(samples, *both, chords, transforms=float(waves))


def _rings(
    frame: Frame, levels: Sequence[tuple[Level, list[Any], HalfLattice]]
) -> tuple[float, float, float]:
    """Return (sums, reads, taps), as in `Counts`, of all rings of a half plane."""
    edges = frame.edges_nm
    borders = len(np.unique(edges))
    bands = len(edges)
    inner = min(frame.core)
    total = np.zeros(3)
    for level, outer, patterns in levels:
        if max(outer) <= inner:
            continue
        rays = scaled_pattern.rays_per_tile(frame, level)
        for axis, pitch in ((1, frame.pitch_um[::-1]), (0, frame.pitch_um)):
            sector = ray_sums.Sector(
                _no_lines, 0, patterns.step_um, pitch, float(edges.min()), edges
            )
            for low, high in ray_sums.rings(inner, outer[axis]):
                ring = ray_sums.Ring(low, high, outer[1 - axis], 1 - axis)
                places = scaled_pattern.places(frame, low, level)
                total += ray_sums.work(sector, ring, rays, places)
        inner = max(outer)
    return tuple(total * (1.0, borders * bands, bands))


def _no_lines(first: int, last: int) -> None:
    raise AssertionError("work is counted without samples")


def _chords(
    lens: PupilOptics, terms: Sequence[tuple[Convex, float]], cell: float, strips: float
) -> float:
    """Return the number of chords of a pupil in rows of cells, two per strip.

    Parameters
    ----------
    lens : a lens of this package.
    terms : shapes of the pupil and their weights.
    cell : height of a row of cells, in diameters of the stop.
    strips : strips per row of cells.
    """
    across = cell * 2 * pupil_size.radius_mm(lens)
    return float(sum((shape.high - shape.low) / across + 1 for shape, _ in terms) * 2 * strips)
