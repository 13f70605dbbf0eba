"""Kernels computed band by band, from lattices or from exact cores alone.

They serve pupils with patterns that do not scale with the wavelength, and small frames. Each band
has an exact core and, beyond it, rings that are read from a lattice of diffraction samples. The
kernels of small frames are exact cores alone.
"""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.cli.progress import track

from ...imaging.threads import MOST_THREADS, cpus, executor
from ...pupil import pupil_phase, pupil_size
from .. import (
    exact_core,
    interpolation_wavelengths,
    kernel_sampling_error,
    kernel_store,
    scatter,
    wings,
)
from .band_plan import BandPlan
from .core_size import fine_tiles, without_lattices
from .kernel_set import Kernels

if TYPE_CHECKING:
    from ..kernel_request import KernelRequest


class _Band(NamedTuple):
    """The kernel of one band and its errors; the fields are those of `Kernels`."""

    kernel: np.ndarray
    speckle: np.ndarray
    deviation: np.ndarray
    core: float
    transmitted: float


def of_lattices(request: KernelRequest, name: str | None = None) -> Kernels:
    """Return kernels of all bands.

    Parameters
    ----------
    request : the kernels that are asked for.
    name : name of the kernels on disk, where bands that take long are stored one by one; None:
        they are neither read from disk nor stored.
    """
    lens = request.lens
    flares = request.flares
    lattices = shared_lattices(request)
    mirrored = not pupil_phase.has_phase(lens, flares)
    shared = interpolation_wavelengths.Knots()

    # interpolation wavelengths are fixed: a band does not depend on the other bands
    def one_band(centre: float, width: float) -> _Band:
        grid = fine_tiles(request, centre - width / 2)
        plan = BandPlan(lens, flares, (centre, width), grid, lattices, shared)
        values, wrong, energy = plan.band(centre, width)
        summed = wings.tile_sums(values, grid.split)
        mixed = scatter.mix(summed, flares, centre, request.pitch_um, lens.focal_length_mm)
        kernel = np.asarray(mixed, np.float32)
        if mirrored:  # removes rounding differences, so that the transform is real
            kernel = (kernel + kernel[::-1, ::-1]) / 2
        errors = *np.zeros((2, kernel_sampling_error.OCTAVES)), max(kernel.shape) // 2
        if wrong is not None:
            wrong = wings.tile_sums(wrong, grid.split)
            errors = (
                kernel_sampling_error.by_octave(wrong, kernel),
                kernel_sampling_error.deviation(wrong, kernel),
                kernel_sampling_error.core(wrong),
            )
        return _Band(kernel, *errors, energy / pupil_size.stop_mm2(lens))

    # bands are stored one by one, so that a run that was interrupted can continue
    def stored_band(centre: float, width: float) -> _Band:
        part = f"{name}{kernel_store.PART}{centre:.9g}"
        if name and (stored := kernel_store.load(part)):
            (core, transmitted, *errors), [kernel] = stored
            halves = np.split(np.ravel(errors), 2)
            return _Band(np.array(kernel), *halves, core[0], transmitted[0])
        start = perf_counter()
        band = one_band(centre, width)
        if name and perf_counter() - start > kernel_store.WORTH_KEEPING_S:
            facts = np.array([band.core, band.transmitted, *band.speckle, *band.deviation])
            shape = (1, *band.kernel.shape)
            kernel_store.save(part, shape, "<f4", [band.kernel], lambda: facts[:, None])
        return band

    count = len(request.wavelength_nm)
    with executor(min(cpus(), count, MOST_THREADS)) as pool:
        made = pool.map(stored_band, request.wavelength_nm, request.band_width_nm)
        bands, speckle, deviation, core, transmitted = zip(
            *track(made, "bands of the point spread", count)
        )
    speckle = np.array(speckle)
    wrap = (wings.WRAP_SHARED if lattices else wings.WRAP) if speckle.max() > 0 else 0.0
    at_border = exact_core.CELLS_AT_BORDER
    core_deviation = exact_core.CELLS_DEVIATION
    if exact_core.is_closed_form(lens, flares):  # only the wavelengths of a band leave an error
        at_border = exact_core.PATTERN_ERROR
        core_deviation = exact_core.PATTERN_ERROR
    of_core = [exact_core.core_error_by_octave(at_border, reach) for reach in core]
    speckle = np.maximum(speckle, of_core)
    return Kernels(
        list(bands),
        np.array([1 - float(b.sum(dtype=float)) for b in bands]),
        speckle,
        np.array(transmitted),
        wrap,
        np.array(deviation),
        np.array(core, float),
        core_deviation,
        (lens, flares),
    )


def shared_lattices(request: KernelRequest) -> list[wings.Lattice]:
    """Return the lattices of `wings.shared` for all bands; none if the pupil has phase or exact
    cores cover the frame.
    """
    if not _has_shared_lattices(request):
        return []
    shortest_nm = float(request.edges_nm[:, 0].min())
    grid = fine_tiles(request, shortest_nm)
    return wings.shared(request.lens, request.flares, shortest_nm, grid)


def can_be_finer(request: KernelRequest, factor: float) -> bool:
    """Return whether kernels with a smaller allowed error would come from a finer lattice.

    The memory of a lattice that serves all bands is limited. Where it is as fine as that allows,
    kernels that are computed again have nearly the same errors.

    Parameters
    ----------
    request : the kernels with the error that their lens allows.
    factor : the smaller error, as a share of that.
    """
    if not _has_shared_lattices(request):
        return True
    shortest_nm = float(request.edges_nm[:, 0].min())
    grid = fine_tiles(request, shortest_nm)
    lens = request.lens
    finer_lens = replace(lens, speckle_error=factor * lens.speckle_error)
    usual_um, finer_um = (wings.shared_step_um(x, shortest_nm, grid) for x in (lens, finer_lens))
    return bool(finer_um < wings.FINEST * usual_um)


def _has_shared_lattices(request: KernelRequest) -> bool:
    """Return whether all bands of a request share lattices. The pupil must be without phase."""
    shortest = request.edges_nm[:, 0]
    return (
        shortest.min() > 0
        and not pupil_phase.has_phase(request.lens, request.flares)
        and not all(without_lattices(request, first) for first in shortest)
    )
