"""Expected cost: CPU seconds and memory of kernels, estimated before they are computed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.pipeline.memory import FLOAT32_BYTES

from ...pupil import pupil_phase, pupil_size
from .. import interpolation_wavelengths, kernel_work, phase_patterns, scaled_pattern, wings
from . import core_size
from .band_plan import BandPlan
from .core_size import core_half, fine_tiles, without_lattices
from .patterns import one_pattern_frame, phase_frame

if TYPE_CHECKING:
    from ..kernel_request import KernelRequest

# CPU seconds, measured on a busy machine
CORE_WAVELENGTH_S = 0.06  # one wavelength of an exact core of usual size
LATTICE_SAMPLE_S = 1.5e-7  # one sample of a lattice of a pupil with phase
SHARED_SAMPLE_S = 2.5e-8  # one sample of a lattice of a pupil without phase, without its chords
READ_S = 1.2e-8  # one tile read at one wavelength


def expected_s(request: KernelRequest) -> float:
    """Return the expected CPU seconds for computing kernels."""
    frame = one_pattern_frame(request)
    if frame is not None:
        return kernel_work.seconds(kernel_work.one_pattern(frame))
    frame = phase_frame(request)
    if frame is not None:
        return kernel_work.seconds(kernel_work.with_phase(frame))
    return _lattices_s(request)


def _lattices_s(request: KernelRequest) -> float:
    """Return the CPU seconds of kernels from lattices, or of exact cores alone."""
    lens = request.lens
    flares = request.flares
    mirrored = not pupil_phase.has_phase(lens, flares)
    total = 0.0
    cells = set()
    for centre, width in zip(request.wavelength_nm, request.band_width_nm):
        shortest = centre - width / 2
        grid = split, fine, wide = fine_tiles(request, shortest)
        half = core_half(lens, shortest, fine, wide)
        plan = BandPlan(lens, flares, (centre, width), grid)
        waves = plan.wavelengths(centre, width).nm
        blur = pupil_size.blur_um(lens, shortest)
        samples = max(h * np.ceil(2 * p / blur) for h, p in zip(half, fine))
        total += CORE_WAVELENGTH_S * len(waves) * max(0.1, samples / core_size.CORE_SAMPLES)
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
        grid = fine_tiles(request, wave)
        sample_s = SHARED_SAMPLE_S if mirrored else LATTICE_SAMPLE_S
        total += 2 * sample_s * wings.samples_of(lens, wave, grid, stretch, mirrored)
        if mirrored:
            total += wings.fold_seconds(lens, flares, wave, grid)
    return total


def held_bytes(request: KernelRequest) -> float:
    """Return the memory, bytes, of kernels and of the lattices while they are computed.

    The lattices of lenses with traced colour, and of lenses that vary over the field, are not
    counted.
    """
    lens = request.lens
    sides = np.prod([2.0 * r + 1 for r in request.reach])
    total = float(FLOAT32_BYTES * len(request.wavelength_nm) * sides)
    shortest = request.shortest_nm
    if not lens.blurs or lens.field_varies or lens.traced is not None or shortest <= 0:
        return total
    if without_lattices(request, shortest):
        return total
    frame = one_pattern_frame(request)
    if frame is not None:
        return scaled_pattern.memory_bytes(frame)
    frame = phase_frame(request)
    if frame is not None:
        return phase_patterns.memory_bytes(frame)
    return total + wings.lattice_bytes(lens, shortest, fine_tiles(request, shortest))
