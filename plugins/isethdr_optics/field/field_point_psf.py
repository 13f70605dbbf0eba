"""Field-point cores: kernels of a field point near their axis, for many bands from transforms at a
few wavelengths.

A field point has its own kernel for every band, and there are a hundred field points. Transforms at
all their wavelengths would take far longer than the rest of an image. Scaled to the same size,
patterns of neighbouring wavelengths differ only by the change of phase. They are interpolated
linearly between interpolation wavelengths, called knots (as in `interpolation_wavelengths`, far
from the axis). The samples are so fine that they hold all of the pattern. For every wavelength of a
band, the pattern is scaled and weighted with a triangle, the convolution of two tiles.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy.fft as sf
from scipy.sparse import csr_array

from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics.pupil import disc, raster
from isethdr_core.physics.radiometry import band_widths_nm
from isethdr_core.uncertainty.error_terms import ErrorTerm

from ..psf import kernel_sampling_error, kernels, scatter
from ..psf.error_parts import term
from ..psf.exact_core import Wavelengths
from ..pupil import (
    pupil_cells,
    pupil_energy,
    pupil_grid,
    pupil_phase,
    pupil_shapes,
    pupil_size,
    wavefront_cells,
    wavefronts,
)

if TYPE_CHECKING:
    from numpy.polynomial.polynomial import Polynomial
    from numpy.typing import ArrayLike

    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics
    from ..psf.kernels import KernelRequest

FIRST_NM = 380.0  # one of the knots; all others lie whole steps away
STEPS_NM = (80.0, 40.0, 20.0, 10.0, 5.0)  # distances of knots; each divides the one before
APART = 0.5  # largest change of phase from knot to knot, radians rms
# L1 error of linear interpolation between knots, if the phase changes by 1 rad rms between them; a
# share of a point's light; 0.02 to 0.08 were measured
STRAIGHT = 0.1
# least numbers of samples per wavelength x f-number, and per tile
PER_BLUR = 2.5
PER_TILE = 5.0
ALIASED = 0.006  # largest L1 error measured with that sampling, share of a point's light
TURNS = (
    1 / 8
    # largest change of phase between adjacent cells of the pupil, wavelengths.
    # `fine_cells.FINE_TURNS`, for an accuracy of 0.3 %, is a quarter of it.
)
# Number of cells across the stop, as in `pupil_grid.core_pitch_mm`: least number; number per
# wavelength x f-number of the image width, used up to `USUAL`; largest number
FEWEST = 256
BORDER = 4.0
USUAL = 768
MOST = 4096
# largest number of samples from the axis: 512 wavelengths x f-number, beyond which lies 1e-3 of a
# point's light
WIDEST = 1024
# Interpolation is used if it takes at most this share of the transforms of an exact computation.
WORTH = 0.7
FEWEST_READS = 3  # least number of wavelengths of a band
# number of wavelengths of a band in addition to one for every tile that its outermost light moves
MORE_READS = 1
MOST_READS = 32  # largest number of wavelengths of a band of any width


def field_point_kernels(request: KernelRequest) -> kernels.Kernels:
    """Return the kernels of a field point, with the meaning of those of `kernels.kernels`.

    They are computed exactly where this takes about as few transforms as interpolation. The lens of
    the request is a `field_point_lens.PlaceLens`.
    """
    read = _read(request.lens, request.flares, request.wavelength_nm, request.reach)
    drawn = _worth_computing(read, request.band_width_nm)
    if drawn.all():
        return _lines(request, read)
    exact = _exact(request.of_bands(~drawn))
    if not drawn.any():
        return exact
    lines = _lines(request.of_bands(drawn), [r for r, d in zip(read, drawn) if d])
    return kernels.joined(drawn, lines, exact)


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
    light = _light(lens, flares)
    pattern = _points(lens, light, (wavelength_nm, wavelength_nm), pitch_um, half)
    return scatter.mix(
        _tiles(pattern, 1.0, pitch_um, half), flares, wavelength_nm, pitch_um, lens.focal_length_mm
    )


def errors(
    lenses: Sequence[PupilOptics],
    flares: Sequence[Flare],
    wavelength_nm: ArrayLike,
    half: tuple[int, int],
) -> list[ErrorTerm]:
    """Return the largest error of kernels that are interpolated between knots.

    Parameters
    ----------
    lenses : of field points, from the axis to the border of the field.
    flares : its flare components.
    wavelength_nm : centres of the bands, nm.
    half : (y, x) tiles from the axis to the border of their kernels.
    """
    wave = np.asarray(wavelength_nm, float)
    rows = []
    for lens in lenses:
        read = _read(lens, flares, wave, half)
        cells = {
            tuple(knot for (knot, _), _ in ends)
            for band, drawn in zip(read, _worth_computing(read, band_widths_nm(wave)))
            if drawn
            for _, ends in band
        }
        rows += [pupil_phase.phase_change(lens, flares, c[0], c[-1]) for c in cells]
    if not rows:
        return []
    value = ALIASED + STRAIGHT * max(rows) ** 2
    label = (
        "point spreads of places, drawn between those of some wavelengths: share of a point's"
        " light, L1"
    )
    return [term(value, "relative", "measured", label, key="place wavelengths")]


def _lines(request: KernelRequest, read: Sequence[list[tuple[Any, ...]]]) -> kernels.Kernels:
    """Return the kernels of bands, interpolated linearly between the knots in `read` (see
    `_read`).
    """
    lens = request.lens
    flares = request.flares
    wave = request.wavelength_nm
    pitch_um = request.pitch_um
    half = request.reach
    light = _light(lens, flares)
    scaled_nm = partial(pupil_size.scaled_nm, lens)
    pattern = lru_cache(maxsize=2)(
        lambda w, step: _points(lens, light, (w, w - step), pitch_um, half)
    )
    bands = []
    for centre, band in zip(wave, read):
        read_at = [
            (knot, share, scaled_nm(knot[0]) / scaled_nm(one))
            for one, ends in band
            for knot, share in ends
        ]
        kernel = sum(
            share * _tiles(pattern(*knot), scale, pitch_um, half) for knot, share, scale in read_at
        )
        bands.append(
            np.asarray(
                scatter.mix(kernel, flares, centre, pitch_um, lens.focal_length_mm), np.float32
            )
        )
    nothing = np.zeros((len(wave), kernel_sampling_error.OCTAVES))
    outside = np.array([1 - float(b.sum(dtype=float)) for b in bands])
    return kernels.Kernels(
        bands,
        outside,
        nothing,
        np.array([light.energy_mm2(w) for w in wave]) / pupil_size.stop_mm2(lens),
        0.0,
        nothing,
        np.full(len(wave), float(max(half))),
        keep=(lens, flares),
    )


class _Light(NamedTuple):
    """Functions that give the light through a pupil."""

    energy_mm2: Callable[[float], float]  # function(wavelength in nm) -> energy, mm2
    # function(cells across the stop, wavelength in nm) -> amplitude (y, x)
    amplitude: Callable[[int, float], np.ndarray]


def _light(lens: PupilOptics, flares: Sequence[Flare]) -> _Light:
    """Return the light through a pupil; it is computed once if it is the same at all
    wavelengths.
    """
    flare_shapes = pupil_shapes.all_shapes(flares)
    fixed = flare_shapes and not pupil_shapes.delays_um(lens, flares)
    energy = cache(partial(pupil_energy.open_energy_mm2, lens, flares))
    stop = cache(partial(_stop, lens, flares))
    return _Light(
        lambda w: energy(FIRST_NM if flare_shapes else w),
        lambda cells, w: stop(cells, FIRST_NM if fixed else w),
    )


def _worth_computing(read: Sequence[list[tuple[Any, ...]]], width_nm: np.ndarray) -> np.ndarray:
    """Return the mask (band,) of bands that take fewer transforms by interpolation between knots
    than by exact computation.

    A band is judged as if bands of the same width lay on either side, so that the result does not
    depend on the other bands. Bands as narrow as a spectral line (1.5 nm or less) are computed
    exactly unless there are many of them.
    """
    exact = [max(len(band), 3 if w > 1.5 else 1) for band, w in zip(read, width_nm)]
    knots = {knot for band in read for _, ends in band for (knot, _), _ in ends}
    few = len(knots) > WORTH * sum(exact)
    steps = [min(step for _, ends in band for (_, step), _ in ends) for band in read]
    return np.array(
        [
            step > 0 and (w / step <= WORTH * e if w > 1.5 else not few)
            for w, step, e in zip(width_nm, steps, exact)
        ],
        bool,
    )


def _read(
    lens: PupilOptics, flares: Sequence[Flare], wave: np.ndarray, half: tuple[int, int]
) -> list[list[tuple[Any, ...]]]:
    """Return the wavelengths of every band and the knots between which they are interpolated.

    The result has, per band, [(wavelength, (((knot, step), share), ...)), ...], all wavelengths in
    nm. The shares of a band sum to 1.
    """
    change = (
        cache(partial(pupil_phase.phase_change, lens, flares))
        if pupil_shapes.all_shapes(flares)
        else None
    )
    return [
        [_ends(one, weight, change) for one, weight in zip(*_wavelengths(c, w, half, change))]
        for c, w in zip(wave, band_widths_nm(wave))
    ]


def _wavelengths(
    centre: float, width: float, half: tuple[int, int], change: Callable[..., Any]
) -> Wavelengths:
    """Return the Gauss-Legendre wavelengths of a band.

    Their number is the larger of two numbers, plus `MORE_READS`: the tiles that the band moves its
    outermost light, and the change of phase divided by `APART`. A spectral line has no additional
    wavelength, and may have only one.

    The error of this quadrature is 1e-6 to 7e-5 of a point's light (L1); that of the same number of
    midpoints of equal parts is 4e-5 to 4e-4. Most of the error lies at the border of the kernel: up
    to 3e-3 of the light of its octave.
    """
    count = max(
        np.hypot(*half) * width / centre,
        change(centre - width / 2, centre + width / 2) / APART if change else 0.0,
    )
    is_line = width <= 1.5
    fewest, more = (1, 0) if is_line else (FEWEST_READS, MORE_READS)
    count = np.clip(int(np.ceil(count)) + more, fewest, MOST_READS)
    place, weight = np.polynomial.legendre.leggauss(count)
    return Wavelengths(centre + place * width / 2, weight / 2)


def _ends(
    wave: float, weight: float, change: Callable[..., Any]
) -> tuple[float, tuple[tuple[Any, ...], tuple[Any, ...]]]:
    """Return (wavelength, (((knot, step), share), ...)), the knots that give its pattern.

    The wavelength itself is the only knot, with step 0, where the phase of the lens changes too
    fast or is not known at the knots.

    Parameters
    ----------
    wave : wavelength, nm.
    weight : weight of the wavelength in its band: the sum of the shares.
    change : function of two wavelengths, nm, that returns the change of phase, radians rms; None
        where it is not known.
    """
    for step in STEPS_NM if change else ():
        low = FIRST_NM + step * ((wave - FIRST_NM) // step)
        try:
            if change(low, low + step) <= APART:
                part = (wave - low) / step
                return wave, tuple(
                    ((knot, step), share)
                    for knot, share in ((low, weight * (1 - part)), (low + step, weight * part))
                    if share
                )
        except ConfigError:
            continue
    return wave, (((wave, 0.0), weight),)


class Transform(NamedTuple):
    """The size of a transform from the pupil of a field point to its point spread."""

    cells: int  # number of cells across the stop
    size: int  # number of samples along each axis
    step_um: float  # distance between samples
    reach: int  # number of samples from the axis that are kept

    @property
    def samples(self) -> float:
        """Number of complex values in the transforms along both axes."""
        return float(self.size * (self.cells + 2 * self.reach + 1))


def transform(
    lens: PupilOptics,
    waves_nm: tuple[float, float],
    pitch_um: tuple[float, float],
    half: tuple[int, int],
) -> Transform:
    """Return the size of the transform of one field point at one wavelength.

    Parameters
    ----------
    lens : `field_point_lens.PlaceLens`.
    waves_nm : (wavelength, shortest wavelength that is read from its pattern). The pattern extends
        as far as the shortest wavelength needs.
    pitch_um : (y, x) pitch of the tiles, um.
    half : (y, x) tiles from the axis to the border of the kernel.
    """
    wave, shortest = waves_nm
    blur = pupil_size.blur_um(lens, wave)
    extent = max((h + 1) * p for h, p in zip(half, pitch_um))
    across = 2 * extent / (blur * min(1.0, shortest / wave))
    steep = 2 * wavefronts.steepest_um(lens, wave) / (wave * 1e-3) / TURNS
    cells = _rounded(
        min(
            max(FEWEST, min(USUAL, BORDER * across), min(2 * across, 2 * WIDEST / PER_BLUR), steep),
            MOST,
        )
    )
    size = sf.next_fast_len(int(np.ceil(cells * max(PER_BLUR, PER_TILE * blur / min(pitch_um)))))
    step = blur * cells / size
    reach = int(min(np.ceil(extent * max(1.0, wave / shortest) / step), WIDEST, size // 2 - 1))
    return Transform(cells, size, step, reach)


def transforms(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: np.ndarray,
    half: tuple[int, int],
) -> int:
    """Return the number of transforms that the kernels of a field point take.

    Parameters
    ----------
    lens : `field_point_lens.PlaceLens`.
    flares : its flare components.
    wavelength_nm : (band,) centres of the bands, nm.
    half : (y, x) tiles from the axis to the border of the kernels.
    """
    wave = np.asarray(wavelength_nm, float)
    read = _read(lens, flares, wave, half)
    drawn = _worth_computing(read, band_widths_nm(wave))
    knots = {knot for band, d in zip(read, drawn) if d for _, ends in band for (knot, _), _ in ends}
    return len(knots) + sum(len(band) for band, d in zip(read, drawn) if not d)


def _points(
    lens: PupilOptics,
    light: _Light,
    waves_nm: tuple[float, float],
    pitch_um: tuple[float, float],
    half: tuple[int, int],
) -> tuple[np.ndarray, float]:
    """Return (pattern, step): the fraction of the energy per sample (y, x), with the axis in the
    middle, and the distance between samples, um.

    Parameters
    ----------
    lens, waves_nm, pitch_um, half : as in `transform`.
    light : light through the pupil.
    """
    wave = waves_nm[0]
    total = light.energy_mm2(wave)  # raises an error if no light passes the stop
    radius = pupil_size.radius_mm(lens)
    cells, size, step, reach = transform(lens, waves_nm, pitch_um, half)
    stop = light.amplitude(cells, wave)
    axis = pupil_grid.axis_mm(lens, 2 * radius / cells)
    rows, columns = (
        slice(open_rows[0], open_rows[-1] + 1)
        for open_rows in (np.flatnonzero(stop.any(axis=a)) for a in (1, 0))
    )
    field = wavefront_cells.with_wavefront(
        lens, stop[rows, columns], axis[columns], axis[rows], wave
    )
    reached = np.arange(-reach, reach + 1)
    for a in (1, 0):
        field = sf.fft(field, size, axis=a).take(reached, axis=a, mode="wrap")
    loss = np.sinc(reached / size) ** -2  # undoes the averaging of the pupil over each cell
    scale = (2 * radius / cells / size) ** 2 / total
    return (
        np.square(np.abs(field))
        * (loss[:, None] * scale).astype(np.float32)
        * loss.astype(np.float32),
        step,
    )


def _rounded(cells: float) -> int:
    """Return the number of cells, rounded up to a power of the root of two. Field points then share
    a few numbers of cells, and the stop is rasterised once for each number.
    """
    return int(np.ceil(2 ** (np.ceil(2 * np.log2(cells)) / 2)))


def _stop(lens: PupilOptics, flares: Sequence[Flare], cells: int, wave: float) -> np.ndarray:
    """Return the pupil amplitude (y, x) of a field point: the stop with its dirt, times the share
    of each cell that the rims leave open.
    """
    radius = pupil_size.radius_mm(lens)
    axis = pupil_grid.axis_mm(lens, 2 * pupil_size.radius_mm(lens) / cells)
    drawn = pupil_cells.amplitude(replace(lens, rims=()), flares, axis, axis, wave)
    for rim in lens.rims:
        opening = disc(*(radius * v for v in rim))
        if lens.pupil_matrix is not None:
            opening = opening.mapped(lens.pupil_matrix)
        drawn = drawn * raster([(opening, 1.0)], axis, axis)
    return drawn


def _tiles(
    samples: tuple[np.ndarray, float],
    scale: float,
    pitch_um: tuple[float, float],
    half: tuple[int, int],
) -> np.ndarray:
    """Return the light from one tile to another, (y, x).

    Parameters
    ----------
    samples : (pattern, step um) of `_points`.
    scale : factor on the pitch of the tiles, in place of scaling the pattern by 1 / `scale`.
    pitch_um : (y, x) pitch of the tiles, um.
    half : (y, x) tiles from the axis to the border of the kernel.
    """
    pattern, step = samples
    size = pattern.shape[0]
    if pitch_um[0] == pitch_um[1]:
        most = max(half)
        triangles = _triangles(most, scale * pitch_um[0], step, size)
        down, across = (triangles[most - h : most + h + 1] for h in half)
    else:
        down, across = (_triangles(h, scale * p, step, size) for h, p in zip(half, pitch_um))
    # the cubic's overshoot could give negative light, though none was found
    return np.maximum((across @ (down @ pattern).T).T, 0.0)


def _triangles(half: int, pitch_um: float, step_um: float, size: int) -> csr_array:
    """Return sparse weights (tile, sample) that integrate a sampled function over a triangle, two
    tiles wide, about every tile.

    The function is interpolated between samples by the cubic of Keys (1981, IEEE Trans. ASSP 29,
    1153). A triangle is a sum of three ramps, so that its integral is the sum of three integrals of
    ramps. They are exact, also at the kinks.
    """
    wide = pitch_um / step_um
    at = np.arange(-half, half + 1) * wide + size // 2
    taps = int(2 * wide) + 5
    point = np.ceil(at - wide - 2).astype(np.intp)[:, None] + np.arange(taps)
    distance = point - at[:, None]
    weight = (
        (_ramp(distance + wide) - 2 * _ramp(distance) + _ramp(distance - wide))
        / wide
        * ((point >= 0) & (point < size))
    )
    return csr_array(
        (
            weight.ravel().astype(np.float32),
            point.clip(0, size - 1).ravel(),
            np.arange(len(at) + 1) * taps,
        ),
        (len(at), size),
    )


def _ramp(at: np.ndarray) -> np.ndarray:
    """Return the integral over t of max(at - t, 0) times Keys's cubic at t. It differs from a ramp
    only within two samples on either side of the kink.
    """
    t = np.minimum(np.abs(at), 2.0)
    return np.maximum(at, 0.0) + np.where(t < 1, INNER(t), OUTER(t))


def _ramps() -> tuple[Polynomial, Polynomial]:
    """Return the polynomials that Keys's cubic adds to a ramp within one sample of its kink, and
    from one to two samples: second integrals of the cubic, taken from the outside to the kink.
    """
    inner = np.polynomial.Polynomial([1, 0, -2.5, 1.5])
    outer = np.polynomial.Polynomial([2, -4, 2.5, -0.5])
    outer_integral = outer.integ(2, lbnd=2)
    slope = outer_integral.deriv()(1)
    value = outer_integral(1)
    inner_integral = inner.integ(lbnd=1) + slope
    return inner_integral.integ(lbnd=1) + value, outer_integral


INNER, OUTER = _ramps()
