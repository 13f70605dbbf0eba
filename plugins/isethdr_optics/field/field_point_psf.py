"""Place cores: kernels of a place of the field near their axis, for many bands from transforms at a
few wavelengths.

A place has a kernel of its own for every band, and there are a hundred places: transforms at all
their wavelengths take far longer than the rest of an image. Scaled to the same size, patterns of
neighbouring wavelengths differ only by the change of phase. They are interpolated linearly between
some wavelengths (as `interpolation_wavelengths` does far from the axis). The pattern is sampled
finely enough to hold all of it. It is weighted with the triangle that two tiles make of a point,
scaled for every wavelength of a band.
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
from isethdr_core.physics.optics import pupil as shapes
from isethdr_core.physics.radiometry import band_widths_nm
from isethdr_core.uncertainty.error_terms import ErrorTerm

from ..psf import kernel_sampling_error, kernels, scatter
from ..psf.error_parts import term
from ..psf.exact_core import Wavelengths
from ..pupil import sampled_pupil

if TYPE_CHECKING:
    from numpy.polynomial.polynomial import Polynomial
    from numpy.typing import ArrayLike

    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics
    from ..psf.kernels import KernelRequest

FIRST_NM = 380.0
STEPS_NM = (80.0, 40.0, 20.0, 10.0, 5.0)  # between knots, each a part of the one before
APART = 0.5  # radians rms from knot to knot at most
STRAIGHT = 0.1  # share of a point's light, L1, for a radian: measured 0.02 to 0.08
# points per wavelength x f-number, and per tile, at least
PER_BLUR = 2.5
PER_TILE = 5.0
ALIASED = 0.006  # share of a point's light, L1, that these leave: the largest measured
TURNS = (
    1 / 8
    # of phase from one cell of the pupil to the next at most; a quarter of it where light is looked
    # for to 0.3 %
)
# cells across the stop, as `sampled_pupil.core_pitch_mm`
FEWEST = 256
BORDER = 4.0
USUAL = 768
MOST = 4096
# points from the axis: 512 wavelengths x f-number, beyond which lies 1e-3 of a point's light
WIDEST = 1024
WORTH = 0.7  # of the transforms that all bands would take: fewer are worth lines
FEWEST_READS = 3  # wavelengths of a band
MORE_READS = 1  # than one for every tile that its light moves
MOST_READS = 32  # however wide it is


def field_point_kernels(request: KernelRequest) -> kernels.Kernels:
    """Return kernels of a place as `kernels.kernels` does, and the same way where that takes as few
    transforms; the lens of the request is a `field_point_lens.PlaceLens`.
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
    """Return kernels without lines between wavelengths.

    Exact cores are sampled alike at all places, with a wavefront there or without.
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
    half : (y, x) tiles from the axis to the border.
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
    """Return how far kernels between knots are from exact ones; `lenses` of places from the axis to
    the border of the field.

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
        rows += [sampled_pupil.phase_change(lens, flares, c[0], c[-1]) for c in cells]
    if not rows:
        return []
    value = ALIASED + STRAIGHT * max(rows) ** 2
    label = (
        "point spreads of places, drawn between those of some wavelengths: share of a point's"
        " light, L1"
    )
    return [term(value, "relative", "measured", label, key="place wavelengths")]


def _lines(request: KernelRequest, read: Sequence[list[tuple[Any, ...]]]) -> kernels.Kernels:
    """Return the kernels of bands by lines between the wavelengths that are `read`."""
    lens = request.lens
    flares = request.flares
    wave = request.wavelength_nm
    pitch_um = request.pitch_um
    half = request.reach
    light = _light(lens, flares)
    scaled_nm = partial(sampled_pupil.scaled_nm, lens)
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
        np.array([light.energy_mm2(w) for w in wave]) / sampled_pupil.stop_mm2(lens),
        0.0,
        nothing,
        np.full(len(wave), float(max(half))),
        keep=(lens, flares),
    )


class _Light(NamedTuple):
    """What a pupil lets through."""

    energy_mm2: Callable[[float], float]  # of a wavelength, nm
    amplitude: Callable[[int, float], np.ndarray]  # (y, x) of cells across, and a wavelength, nm


def _light(lens: PupilOptics, flares: Sequence[Flare]) -> _Light:
    """Return the light through a pupil; computed once where all wavelengths share it."""
    flare_shapes = sampled_pupil.all_shapes(flares)
    fixed = flare_shapes and not sampled_pupil.delays_um(lens, flares)
    energy = cache(partial(sampled_pupil.open_energy_mm2, lens, flares))
    stop = cache(partial(_stop, lens, flares))
    return _Light(
        lambda w: energy(FIRST_NM if flare_shapes else w),
        lambda cells, w: stop(cells, FIRST_NM if fixed else w),
    )


def _worth_computing(read: Sequence[list[tuple[Any, ...]]], width_nm: np.ndarray) -> np.ndarray:
    """Return which bands take fewer transforms by lines between knots than exactly: of a band
    alone, as if others like it lay on either side.

    Bands as narrow as a line are exact unless there are many of them.
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
    """Return per band ((wavelength that is read, (((knot, step), share), ...)), ...); the shares of
    a band sum to 1.
    """
    change = (
        cache(partial(sampled_pupil.phase_change, lens, flares))
        if sampled_pupil.all_shapes(flares)
        else None
    )
    return [
        [_ends(one, weight, change) for one, weight in zip(*_wavelengths(c, w, half, change))]
        for c, w in zip(wave, band_widths_nm(wave))
    ]


def _wavelengths(
    centre: float, width: float, half: tuple[int, int], change: Callable[..., Any]
) -> Wavelengths:
    """Return Gauss's wavelengths of a band: one for each tile that its outermost light moves, or
    for each half radian of phase, and `MORE_READS`; of a line one alone where neither asks for two.

    They leave 1e-6 to 7e-5 of a point's light (L1); as many midpoints of equal parts leave 4e-5 to
    4e-4. Most of what is left lies at the border of the kernel: up to 3e-3 of its octave's light.
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
    """Return (wavelength, (((knot, step), share), ...)) of its pattern: itself where the lens
    changes too fast, or is not known at knots.

    Parameters
    ----------
    wave : wavelength, nm.
    weight : of the wavelength in its band: the sum of the shares.
    change : function of two wavelengths, radians rms; None where nobody knows.
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

    cells: int  # across the stop
    size: int  # points along each axis
    step_um: float  # between points
    reach: int  # points from the axis that are kept

    @property
    def samples(self) -> float:
        """Complex values that the transforms along both axes go through."""
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
    waves_nm : the wavelength, and the shortest that is read from its pattern, which reaches as far
        as that asks.
    pitch_um, half : (y, x) of a tile, and tiles from the axis to the border.
    """
    wave, shortest = waves_nm
    blur = sampled_pupil.blur_um(lens, wave)
    extent = max((h + 1) * p for h, p in zip(half, pitch_um))
    across = 2 * extent / (blur * min(1.0, shortest / wave))
    steep = 2 * sampled_pupil.steepest_um(lens, wave) / (wave * 1e-3) / TURNS
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
    lens : `field_point_lens.PlaceLens`. `flares` : flare components.
    wavelength_nm : centres of the bands.
    half : (y, x) tiles from the axis to the border.
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
    """Return (fraction of the energy per point, (y, x), the axis in the middle; their distance, um)
    at a wavelength; arguments as `transform`.
    """
    wave = waves_nm[0]
    total = light.energy_mm2(wave)  # refuses a stop without light
    radius = sampled_pupil.radius_mm(lens)
    cells, size, step, reach = transform(lens, waves_nm, pitch_um, half)
    stop = light.amplitude(cells, wave)
    axis = sampled_pupil.axis_mm(lens, 2 * radius / cells)
    rows, columns = (
        slice(open_rows[0], open_rows[-1] + 1)
        for open_rows in (np.flatnonzero(stop.any(axis=a)) for a in (1, 0))
    )
    field = sampled_pupil.with_wavefront(lens, stop[rows, columns], axis[columns], axis[rows], wave)
    reached = np.arange(-reach, reach + 1)
    for a in (1, 0):
        field = sf.fft(field, size, axis=a).take(reached, axis=a, mode="wrap")
    loss = np.sinc(reached / size) ** -2  # cells are means
    scale = (2 * radius / cells / size) ** 2 / total
    return (
        np.square(np.abs(field))
        * (loss[:, None] * scale).astype(np.float32)
        * loss.astype(np.float32),
        step,
    )


def _rounded(cells: float) -> int:
    """Return a few numbers of cells for all places, so that their stop is drawn once."""
    return int(np.ceil(2 ** (np.ceil(2 * np.log2(cells)) / 2)))


def _stop(lens: PupilOptics, flares: Sequence[Flare], cells: int, wave: float) -> np.ndarray:
    """Return the pupil of a place: the open one with its dirt, times what rims leave of each
    cell.
    """
    radius = sampled_pupil.radius_mm(lens)
    axis = sampled_pupil.axis_mm(lens, 2 * sampled_pupil.radius_mm(lens) / cells)
    drawn = sampled_pupil.amplitude(replace(lens, rims=()), flares, axis, axis, wave)
    for rim in lens.rims:
        opening = shapes.disc(*(radius * v for v in rim))
        if lens.pupil_matrix is not None:
            opening = opening.mapped(lens.pupil_matrix)
        drawn = drawn * shapes.raster([(opening, 1.0)], axis, axis)
    return drawn


def _tiles(
    samples: tuple[np.ndarray, float],
    scale: float,
    pitch_um: tuple[float, float],
    half: tuple[int, int],
) -> np.ndarray:
    """Return the light from one tile to another, (y, x), of a pattern that is drawn to 1 /
    `scale`.
    """
    pattern, step = samples
    size = pattern.shape[0]
    if pitch_um[0] == pitch_um[1]:
        most = max(half)
        triangles = _triangles(most, scale * pitch_um[0], step, size)
        down, across = (triangles[most - h : most + h + 1] for h in half)
    else:
        down, across = (_triangles(h, scale * p, step, size) for h, p in zip(half, pitch_um))
    # the cubic's overshoot could be darker than dark; none was found
    return np.maximum((across @ (down @ pattern).T).T, 0.0)


def _triangles(half: int, pitch_um: float, step_um: float, size: int) -> csr_array:
    """Return the weights (tile, point), sparse, that integrate a triangle two tiles wide about
    every tile over what runs through points.

    Between points runs Keys's cubic (1981, IEEE Trans. ASSP 29, 1153). A triangle is three ramps,
    so that its integral is that of ramps: exact, kinks and all.
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
    """Return the integral of max(at - t, 0) times Keys's cubic at t: a ramp but for two points on
    either side of its kink.
    """
    t = np.minimum(np.abs(at), 2.0)
    return np.maximum(at, 0.0) + np.where(t < 1, INNER(t), OUTER(t))


def _ramps() -> tuple[Polynomial, Polynomial]:
    """Return what Keys's cubic adds to a ramp within one point of its kink, and beyond: its second
    integrals from the outside in.
    """
    inner = np.polynomial.Polynomial([1, 0, -2.5, 1.5])
    outer = np.polynomial.Polynomial([2, -4, 2.5, -0.5])
    outer_integral = outer.integ(2, lbnd=2)
    slope = outer_integral.deriv()(1)
    value = outer_integral(1)
    inner_integral = inner.integ(lbnd=1) + slope
    return inner_integral.integ(lbnd=1) + value, outer_integral


INNER, OUTER = _ramps()
