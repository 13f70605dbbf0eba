"""Lattice: the diffraction pattern of a pupil over a whole frame, one point per step of a square
lattice.

A field that is sampled at some step is the Fourier transform of the folded pupil, which is the
pupil summed modulo wavelength * distance / step. It is exact at these points, and ten times cheaper
than a chirp-z transform of that size. Light from beyond one period of the field wraps into the
frame, in amplitude. Averaging the pupil over cells with smooth weights suppresses that light: it
multiplies the field by the response of the cells, which falls towards the border of the period. In
the frame, the response is divided out again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import comb
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.fft as sf
from scipy.sparse import csc_array

from .pupil import chord_ends, strip_blocks

if TYPE_CHECKING:
    from .pupil import Convex

CHORDS = 1 << 18  # number of chords that are folded at a time; each needs about 700 bytes
CHORDS_PER_CELL = 8  # number of rows of chords per row of cells of a folded pupil
ORDER = 7  # order of the B-spline weights: number of boxes that are convolved with each other


def spline_taps(place: np.ndarray, degree: int) -> list[np.ndarray]:
    """Return the values of the `degree` + 1 uniform B-splines that are not 0 at a position; they
    sum to 1.

    The recursion of Cox and de Boor is used (Piegl and Tiller 1997, The NURBS Book, algorithm 2.2).

    Parameters
    ----------
    place : position after the last knot, 0 to 1, any shape.
    degree : degree of the B-splines.

    Returns
    -------
    List of values with the shape of `place`, starting with the B-spline that begins first.
    """
    taps = [np.ones(np.shape(place))]
    for j in range(1, degree + 1):
        saved = 0.0
        for r in range(j):
            part = taps[r] / j
            taps[r] = saved + (r + 1 - place) * part
            saved = (place + (j - r - 1)) * part
        taps.append(saved)
    return taps


def spline_response(cycles_per_cell: np.ndarray) -> np.ndarray:
    """Return the factor by which cells of `fold_shapes` multiply the field."""
    return np.sinc(cycles_per_cell) ** ORDER


def binomial_response(cycles_per_cell: np.ndarray) -> np.ndarray:
    """Return the factor by which cells of `fold_cells` multiply the field: means over half a cell,
    summed in pairs `ORDER` times.
    """
    return np.sinc(cycles_per_cell / 2) * np.cos(np.pi * cycles_per_cell / 2) ** ORDER


def summed(value: np.ndarray, place: np.ndarray, size: int) -> np.ndarray:
    """Return sums (size,) of the values that belong to each place, in the type of the values.

    The sparse product lets other threads run meanwhile; `np.add.at` would block them.

    Parameters
    ----------
    value : real or complex values, any shape.
    place : place of each value, 0 to size - 1, int32, same shape.
    size : number of places.
    """
    ends = np.array([0, value.size], np.int32)
    column = csc_array((value.ravel(), place.ravel(), ends), (size, 1))
    return column @ np.ones(1, value.dtype)


def fold_shapes(
    terms: list[tuple[Convex, float]],
    radius: float,
    step: tuple[float, float],
    period: tuple[int, int],
    offset: tuple[float, float],
    chords_per_cell: int = CHORDS_PER_CELL,
) -> np.ndarray:
    """Return the pupil of convex shapes in smooth cells, summed modulo `period`. The whole pupil is
    never in memory.

    A chord adds its two ends to rows of differences: a B-spline of `ORDER` across each end, and a
    B-spline of the next lower order across the rows. A chord that crosses the border of the period
    continues at the other side, multiplied by exp(-2 pi i offset). The cost does not depend on the
    f-number.

    Parameters
    ----------
    terms : list of (shape, weight), as `pupil.opening` returns; mm.
    radius : half width of the pupil, mm.
    step : (y, x) sides of a cell, mm.
    period : (y, x) period of the result, cells.
    offset : (y, x) position between image samples, -1 to 1.
    chords_per_cell : number of rows of chords per row of cells.

    Returns
    -------
    (period_y, period_x) complex64: the sum of weighted transmission, in cells.
    """
    dy, dx = step
    py, px = period
    sub = chords_per_cell
    pad = (ORDER + 1) // 2
    rows, cols = (2 * (int(np.ceil(radius / d)) + pad) for d in step)
    turned = np.exp(-2j * np.pi * offset[1] * np.arange(cols // px + 2))
    # sums of the factors of all periods before each period
    passed = np.concatenate([[0], np.cumsum(turned)])
    out = np.zeros((py, px + 2), np.complex64)
    strips = -rows / 2 * dy, dy / sub, rows * sub
    for block in strip_blocks(terms, *strips, CHORDS):
        near = _between(terms, *(strips[0] + s * strips[1] for s in (block.start, block.stop)))
        chords = list(chord_ends(near, *strips, block=block))
        if not chords:
            continue
        strip, left, right, weight = (np.concatenate([c[i] for c in chords]) for i in range(4))
        strip = np.tile(strip, 2)
        end = np.concatenate([left, right])
        weight = np.concatenate([weight, -weight])
        column = end / dx + cols / 2
        whole_columns = np.floor(column).astype(np.intp)
        parts = spline_taps(column - whole_columns, ORDER)
        taps = [
            (*np.divmod(whole_columns + t - (ORDER - 1) // 2, px), part)
            for t, part in enumerate(parts)
        ]
        # Each end stands for light from there to infinity: the rest of its own period, and all
        # later periods in full. The sum over all periods cancels between both ends of a chord, so
        # that the periods up to its own are subtracted instead of adding the later ones.
        before = sum(passed[p + 1] * part for p, _, part in taps)
        level = (strip + 0.5) / sub
        cell = np.floor(level).astype(np.intp)
        for k, part in enumerate(spline_taps(level - cell, ORDER - 1)):
            row = cell + k - ORDER // 2
            share = weight / sub * part * np.exp(-2j * np.pi * offset[0] * (row // py))
            start = (row % py) * (px + 2)
            _add(out, start, -share * before)
            for period_of_tap, inside, part in taps:
                _add(out, start + inside, share * part * turned[period_of_tap])
    np.cumsum(out, axis=1, out=out)
    return _tilted(out[:, :px], period, offset)


def _between(terms: list[tuple[Convex, float]], low: float, high: float) -> list:
    """Return the terms with shapes that overlap the range between two levels."""
    return [(shape, weight) for shape, weight in terms if shape.high >= low and shape.low <= high]


def _add(out: np.ndarray, position: np.ndarray, value: np.ndarray) -> None:
    """Add complex values at flat positions. Real and imaginary parts are added separately, which is
    ten times faster in NumPy.
    """
    flat = out.reshape(-1).view(np.float32)
    np.add.at(flat, 2 * position, value.real.astype(np.float32))
    if np.any(value.imag):
        np.add.at(flat, 2 * position + 1, value.imag.astype(np.float32))


def fold_cells(
    blocks: Iterator[Any], period: tuple[int, int], offsets: Sequence[tuple[float, float]]
) -> list[np.ndarray]:
    """Return a pupil that is given in half cells, averaged over smooth weights and summed modulo
    `period`, for every offset.

    Parameters
    ----------
    blocks : yields (first row, first column, complex (y, x) means over half cells) of disjoint
        parts of the pupil. The whole grid of half cells is even and centred on the axis.
    period : (y, x) period of the result, cells.
    offsets : (y, x) positions between image samples, -1 to 1.

    Returns
    -------
    list of (period_y, period_x) complex64, one per offset.
    """
    weights = np.array([comb(ORDER, k) for k in range(ORDER + 1)], np.float32) / 2**ORDER
    reach = ORDER // 2  # half cells on either side of a cell's own two that also count
    out = [np.zeros(period, np.complex64) for _ in offsets]
    for first_row, first_column, block in blocks:
        column, columns = _gathered(block, 1, first_column, weights, reach)
        row, cells = _gathered(columns, 0, first_row, weights, reach)
        for (oy, ox), into in zip(offsets, out):
            for wrap_y, py, rows in _wraps(row, cells.shape[0], period[0]):
                for wrap_x, px, cols in _wraps(column, cells.shape[1], period[1]):
                    turn = np.complex64(np.exp(-2j * np.pi * (oy * wrap_y + ox * wrap_x)))
                    into[py, px] += cells[rows, cols] if turn == 1 else turn * cells[rows, cols]
    return [_tilted(pupil, period, offset) for pupil, offset in zip(out, offsets)]


def _gathered(
    block: np.ndarray, axis: int, first: int, weights: np.ndarray, reach: int
) -> tuple[int, np.ndarray]:
    """Return (index of the first cell, cells) along `axis`: cell j is the sum of the half cells
    2 j - reach to 2 j + 1 + reach, times `weights`.
    """
    low = (first - 1 - reach) // 2  # the first cell that contains half cell `first`
    high = (first + block.shape[axis] - 1 + reach) // 2
    pad = [(0, 0), (0, 0)]
    pad[axis] = (first - (2 * low - reach), 2 * high + 1 + reach - (first + block.shape[axis] - 1))
    block = np.pad(block, pad)
    count = high - low + 1
    cut = [slice(None)] * 2
    total = 0.0
    for t, weight in enumerate(weights):
        cut[axis] = slice(t, t + 2 * count - 1, 2)
        total = total + weight * block[tuple(cut)]
    return low, total


def _wraps(first: int, count: int, period: int) -> Iterator[tuple[int, slice, slice]]:
    """Yield (number of the period, slice of the period, slice of the cells) of every piece of cells
    that lies in one period.

    Parameters
    ----------
    first : index of the first cell.
    count : number of cells.
    period : period, cells.
    """
    start = 0
    while start < count:
        wrap, inside = divmod(first + start, period)
        length = min(period - inside, count - start)
        yield wrap, slice(inside, inside + length), slice(start, start + length)
        start += length


def _tilted(pupil: np.ndarray, period: tuple[int, int], offset: tuple[float, float]) -> np.ndarray:
    """Shift the image by `offset` samples: multiply the folded pupil by a phase ramp within one
    period. The factor from period to period was applied when it was folded.
    """
    for axis, (o, p) in enumerate(zip(offset, period)):
        if o:
            ramp = np.exp(-2j * np.pi * o / p * np.arange(p)).astype(np.complex64)
            pupil *= ramp[:, None] if axis == 0 else ramp
    return pupil


@dataclass(frozen=True)
class ImageSamples:
    """The samples of an image at one wavelength."""

    wavelength_nm: float
    distance_mm: float  # distance from the pupil
    pitch_um: tuple[float, float]  # (y, x) distance between samples
    offset: tuple[float, float]  # (y, x) position between samples, -1 to 1


def lattice_psf(
    folded: np.ndarray,
    samples: ImageSamples,
    reach: tuple[int, int],
    energy_mm2: float,
    response: Callable[..., Any],
) -> np.ndarray:
    """Return intensity times the area of a lattice cell at samples -reach .. reach of a whole
    frame.

    Parameters
    ----------
    folded : (period_y, period_x) complex64 from `fold_shapes` or `fold_cells` with the same offset;
        it is overwritten.
    samples : samples of the image.
    reach : (y, x) samples on either side of the axis.
    energy_mm2 : the integral of the squared amplitude, mm2.
    response : function(cycles per cell) -> factor by which the cells multiply the field; it is
        divided out.

    Returns
    -------
    (2 reach_y + 1, 2 reach_x + 1) float32, fraction of the energy per sample.
    """
    period = folded.shape
    ry, rx = reach
    field = sf.fft2(folded, overwrite_x=True)
    offset = samples.offset
    step = lattice_pitch_mm(samples.wavelength_nm, period, samples.distance_mm, samples.pitch_um)
    index = [np.arange(-r, r + 1) for r in reach]
    gain_y, gain_x = (response((k + o) / p) ** -2 for k, o, p in zip(index, offset, period))
    gain_y = gain_y * (step[0] * step[1] / (period[0] * period[1] * energy_mm2))
    out = np.empty((2 * ry + 1, 2 * rx + 1), np.float32)
    for rows_out, rows_in in (
        (slice(0, ry), slice(period[0] - ry, None)),
        (slice(ry, None), slice(0, ry + 1)),
    ):
        for cols_out, cols_in in (
            (slice(0, rx), slice(period[1] - rx, None)),
            (slice(rx, None), slice(0, rx + 1)),
        ):
            part = field[rows_in, cols_in]
            np.square(part.real, out=out[rows_out, cols_out])
            out[rows_out, cols_out] += np.square(part.imag)
    out *= gain_y.astype(np.float32)[:, None]
    out *= gain_x.astype(np.float32)
    return out


def lattice_pitch_mm(
    wavelength_nm: float, period: tuple[int, int], distance_mm: float, pitch_um: tuple[float, float]
) -> tuple[float, float]:
    """Return the (y, x) pupil pitch, mm, for which the field repeats after one period: wavelength *
    distance / (period * pitch).

    Parameters
    ----------
    wavelength_nm : wavelength, nm.
    period : (y, x) period of the field, image samples.
    distance_mm : distance from the pupil to the image, mm.
    pitch_um : (y, x) distance between image samples, um.
    """
    return tuple(wavelength_nm * 1e-3 * distance_mm / (n * p) for n, p in zip(period, pitch_um))
