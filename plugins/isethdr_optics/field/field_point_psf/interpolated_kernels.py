"""Interpolated kernels: kernels of a field point for many bands, and the error of their
interpolation between wavelengths.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.radiometry import band_widths_nm
from isethdr_core.uncertainty.error_terms import ErrorTerm

from ...psf import kernel_sampling_error, kernels, scatter
from ...psf.error_parts import term
from ...pupil import pupil_phase, pupil_size
from .knots import Knot, Reading, by_interpolation, readings
from .pattern_samples import Pattern, pattern, pupil_light
from .tile_integrals import tiles

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from isethdr_core.plugins.protocols import Flare

    from ...abilities import PupilOptics
    from ...psf.kernels import KernelRequest

# L1 error of linear interpolation between knots, if the phase changes by 1 rad rms between them; a
# share of a point's light; 0.02 to 0.08 were measured
STRAIGHT = 0.1
# largest L1 error measured with the sampling of `pattern_samples`, share of a point's light
ALIASED = 0.006


def field_point_kernels(request: KernelRequest) -> kernels.Kernels:
    """Return the kernels of a field point, with the meaning of those of `kernels.kernels`.

    They are computed exactly where this takes about as few transforms as interpolation.

    Parameters
    ----------
    request : request whose lens is a `field_point_lens.PlaceLens`.
    """
    bands = readings(request.lens, request.flares, request.wavelength_nm, request.reach)
    drawn = by_interpolation(bands, request.band_width_nm)
    if drawn.all():
        return _interpolated(request, bands)
    exact = _exact(request.of_bands(~drawn))
    if not drawn.any():
        return exact
    bands_drawn = [band for band, d in zip(bands, drawn) if d]
    return kernels.joined(drawn, _interpolated(request.of_bands(drawn), bands_drawn), exact)


def _exact(request: KernelRequest) -> kernels.Kernels:
    """Return kernels without interpolation between wavelengths.

    Exact cores have the same sampling at all field points, with or without a wavefront.
    """
    if kernels.without_lattices(request, request.shortest_nm):
        return kernels.of_lattices(request)
    return kernels.computed(request)


def one(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: float,
    pitch_um: tuple[float, float],
    half: tuple[int, int],
) -> np.ndarray:
    """Return the kernel of one wavelength, (y, x).

    Parameters
    ----------
    lens : `field_point_lens.PlaceLens`.
    flares : its flare components.
    wavelength_nm : wavelength, nm.
    pitch_um : (y, x) of a tile, um.
    half : (y, x) tiles from the axis to the border of the kernel.
    """
    light = pupil_light(lens, flares)
    found = pattern(lens, light, (wavelength_nm, wavelength_nm), pitch_um, half)
    kernel = tiles(found, 1.0, pitch_um, half)
    return scatter.mix(kernel, flares, wavelength_nm, pitch_um, lens.focal_length_mm)


def errors(
    lenses: Sequence[PupilOptics],
    flares: Sequence[Flare],
    wavelength_nm: ArrayLike,
    half: tuple[int, int],
) -> list[ErrorTerm]:
    """Return the largest error of kernels that are interpolated between knots.

    Parameters
    ----------
    lenses : lenses of field points, from the axis to the border of the field.
    flares : their flare components.
    wavelength_nm : centres of the bands, nm.
    half : (y, x) tiles from the axis to the border of their kernels.
    """
    wave = np.asarray(wavelength_nm, float)
    changes = []
    for lens in lenses:
        bands = readings(lens, flares, wave, half)
        intervals = {
            tuple(knot.wavelength_nm for knot, _ in reading.shares)
            for band, drawn in zip(bands, by_interpolation(bands, band_widths_nm(wave)))
            if drawn
            for reading in band
        }
        changes += [pupil_phase.phase_change(lens, flares, i[0], i[-1]) for i in intervals]
    if not changes:
        return []
    value = ALIASED + STRAIGHT * max(changes) ** 2
    label = (
        "point spreads of places, drawn between those of some wavelengths: share of a point's"
        " light, L1"
    )
    return [term(value, "relative", "measured", label, key="place wavelengths")]


def _interpolated(request: KernelRequest, bands: Sequence[Sequence[Reading]]) -> kernels.Kernels:
    """Return the kernels of bands, interpolated linearly between the knots of their readings."""
    lens = request.lens
    pitch_um = request.pitch_um
    half = request.reach
    light = pupil_light(lens, request.flares)

    @lru_cache(maxsize=2)
    def pattern_of(knot: Knot) -> Pattern:
        shortest_nm = knot.wavelength_nm - knot.step_nm
        return pattern(lens, light, (knot.wavelength_nm, shortest_nm), pitch_um, half)

    def scale(knot: Knot, reading: Reading) -> float:
        at_knot = pupil_size.scaled_nm(lens, knot.wavelength_nm)
        return at_knot / pupil_size.scaled_nm(lens, reading.wavelength_nm)

    found = []
    for centre, band in zip(request.wavelength_nm, bands):
        kernel = sum(
            share * tiles(pattern_of(knot), scale(knot, reading), pitch_um, half)
            for reading in band
            for knot, share in reading.shares
        )
        mixed = scatter.mix(kernel, request.flares, centre, pitch_um, lens.focal_length_mm)
        found.append(np.asarray(mixed, np.float32))
    count = len(request.wavelength_nm)
    nothing = np.zeros((count, kernel_sampling_error.OCTAVES))
    energy_mm2 = np.array([light.energy_mm2(w) for w in request.wavelength_nm])
    return kernels.Kernels(
        found,
        np.array([1 - float(kernel.sum(dtype=float)) for kernel in found]),
        nothing,
        energy_mm2 / pupil_size.stop_mm2(lens),
        0.0,
        nothing,
        np.full(count, float(max(half))),
        keep=(lens, request.flares),
    )
