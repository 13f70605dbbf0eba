"""Kernels from patterns: one for a pupil without phase, a few for a lens with a wavefront."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.convolution.mirrored import Mirrored

from ...imaging.threads import MOST_THREADS, cpus, executor
from ...pupil import pupil_energy, pupil_size
from .. import exact_core, phase_patterns, scaled_pattern, scatter, wings
from .band_plan import BandPlan
from .core_size import core_half, without_lattices
from .kernel_set import Kernels

if TYPE_CHECKING:
    from ..kernel_request import KernelRequest
    from ..scaled_pattern import Frame

WIDER = 1.25  # largest factor by which an exact core is enlarged to cover a frame


def from_patterns(request: KernelRequest) -> bool:
    """Return whether kernels come from one or a few patterns; other kernels come from lattices or
    from exact cores alone.
    """
    return one_pattern_frame(request) is not None or phase_frame(request) is not None


def one_pattern_frame(request: KernelRequest) -> Frame | None:
    """Return the frame of kernels from one pattern; None if one pattern cannot give them."""
    frame = _frame(request)
    if frame is None or not scaled_pattern.serves(frame):
        return None
    covered = without_lattices(request, request.shortest_nm)
    if covered and exact_core.is_closed_form(request.lens, request.flares):
        return None
    return frame


def phase_frame(request: KernelRequest) -> Frame | None:
    """Return the frame of kernels from patterns at a few wavenumbers; None if these cannot give
    them.
    """
    frame = _frame(request)
    return frame if frame is not None and phase_patterns.serves(frame) else None


def _frame(request: KernelRequest) -> Frame | None:
    """Return the frame of a request; None if a band reaches the wavelength 0."""
    shortest = request.shortest_nm
    if shortest <= 0:
        return None
    reach = request.reach
    half = core_half(request.lens, shortest, request.pitch_um, reach)
    # the core of wide tiles would be smaller than the rings allow
    half = tuple(min(max(h, scaled_pattern.LEAST_CORE), r) for h, r in zip(half, reach))
    if all(r <= WIDER * h for r, h in zip(reach, half)):
        half = reach  # a slightly larger exact core costs less than rings
    return scaled_pattern.Frame(request, half)


def of_one_pattern(frame: Frame) -> Kernels:
    """Return kernels of all bands from one pattern."""
    lens = frame.lens
    flares = frame.flares
    with executor(min(cpus(), MOST_THREADS)) as pool:
        halves, errors = scaled_pattern.fine_enough(frame, pool.map)
    mix_scatter(halves, frame)
    bands = [Mirrored(half) for half in halves]
    count = len(halves)
    open_mm2 = pupil_energy.open_energy_mm2(lens, flares, frame.shortest_nm)
    energy = open_mm2 / pupil_size.stop_mm2(lens)
    has_rings = errors.relative.any()
    core = min(frame.core) if has_rings else max(frame.core)
    of_core = exact_core.core_error_by_octave(exact_core.PATTERN_ERROR, max(frame.core))
    return Kernels(
        bands,
        np.array([1 - float(b.sum(dtype=float)) for b in bands]),
        np.tile(np.maximum(errors.relative, of_core), (count, 1)),
        np.full(count, energy),
        max(errors.mean, scaled_pattern.WRAP) if has_rings else 0.0,
        np.tile(errors.deviation, (count, 1)),
        np.full(count, float(core)),
        exact_core.PATTERN_ERROR,
        (lens, flares),
        scaled=frame,
    )


def of_phase_patterns(frame: Frame) -> Kernels:
    """Return kernels of all bands from patterns at a few wavenumbers."""
    lens = frame.lens
    flares = frame.flares
    count = len(frame.edges_nm)
    sides = [2 * r + 1 for r in frame.reach]
    middles = frame.edges_nm.mean(axis=1)
    widths = np.diff(frame.edges_nm)[:, 0]
    core = tuple(slice(r - c, r + c + 1) for r, c in zip(frame.reach, frame.core))
    read = scaled_pattern.finer_rings(frame)
    # zeros: the errors are computed before the core is filled, and do not count there
    bands = np.zeros((count, *sides), np.float32)

    def exact(band: int) -> np.ndarray:
        grid = wings.Grid(1, frame.pitch_um, frame.core)
        plan = BandPlan(lens, flares, (middles[band], widths[band]), grid)
        return plan.band(middles[band], widths[band]).values

    with executor(min(cpus(), MOST_THREADS)) as pool:
        phase_patterns.wings(frame, read, bands, pool.map)
        errors_of_bands = phase_patterns.errors(frame, bands, pool.map)
        for kernel, inner in zip(bands, pool.map(exact, range(count))):
            kernel[core] = inner
    for kernel, wave in zip(bands, middles):
        if scatter.active(flares, wave):
            kernel[...] = scatter.mix(kernel, flares, wave, frame.pitch_um, lens.focal_length_mm)
    energy = pupil_energy.open_energy_mm2(lens, flares, frame.shortest_nm)
    return Kernels(
        list(bands),
        np.array([1 - float(b.sum(dtype=float)) for b in bands]),
        np.tile(
            np.maximum(
                errors_of_bands.relative,
                exact_core.core_error_by_octave(exact_core.CELLS_AT_BORDER, max(frame.core)),
            ),
            (count, 1),
        ),
        np.full(count, energy / pupil_size.stop_mm2(lens)),
        max(errors_of_bands.mean, scaled_pattern.WRAP),
        np.tile(errors_of_bands.deviation, (count, 1)),
        np.full(count, float(min(frame.core))),
        exact_core.CELLS_DEVIATION,
        (lens, flares),
    )


def mix_scatter(halves: np.ndarray, frame: Frame) -> None:
    """Mix the scatter of flares into kernels, of which `halves` (band, y, x) holds one half each,
    in place.
    """
    waves = frame.edges_nm.mean(axis=1)
    if not scatter.active(frame.flares, waves):
        return
    for half, wave in zip(halves, waves):
        full = np.asarray(Mirrored(half))
        mixed = scatter.mix(full, frame.flares, wave, frame.pitch_um, frame.lens.focal_length_mm)
        half[...] = mixed[len(full) // 2 :]
