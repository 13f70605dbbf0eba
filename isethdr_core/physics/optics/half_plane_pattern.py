"""Half-plane pattern: the diffraction pattern of a pupil without phase, sampled once on a square
lattice.

The transform of a real pupil is Hermitian, so its squared magnitude equals its own mirror image:
half of the image plane is all of it. The pattern of a wavelength w is P(x; w) = u^2 P(u x; w0) with
u = w0 / w, so one lattice serves every wavelength longer than w0.

The pupil is drawn in cells smoothed by B-splines, which hold back light from beyond one period of
the field; their response is divided out again (`lattice`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.fft as sf
from scipy.sparse import csc_array

from ..convolution import fourier
from .lattice import ORDER, lattice_pitch_mm, spline_response, spline_taps
from .pupil import GAUSS, Chords, gauss_chords, strip_blocks

PERIOD = 2.4  # period of the field, in reaches; two reaches are the image itself
# least distance from the image to its repetition, over the longer reach: light there is hardly
# fainter
BESIDE = 0.75
# strips per row of cells, with two chords each, more where edges are slanted (`gauss_chords`)
STRIPS = 1.2
BLOCK = 64  # rows or columns of a transform at a time
CHORDS = 1 << 17  # chords drawn at a time by one thread: each takes a kilobyte meanwhile
DIVIDED = 1.5  # times as many chords, about, because strips are divided where edges are slanted


@dataclass(frozen=True, eq=False)
class HalfPattern:
    """Fraction of the pupil's energy per um2 of the image, `density[x, y]` at (x, y - middle) *
    step_um, x >= 0.
    """

    density: np.ndarray
    step_um: float
    middle: int
    wavelength_nm: float


@dataclass(frozen=True)
class RealPupil:
    """A pupil without phase, and what its pattern is measured in."""

    terms: list  # of (Convex, weight), as `pupil.opening` returns; mm
    radius_mm: float  # half the width of a square that holds it
    distance_mm: float  # to the image
    energy_mm2: float  # integral of the squared amplitude


@dataclass(frozen=True)
class HalfLattice:
    """Points of a half plane and the period of the field that they are part of; all pairs are (y,
    x).
    """

    step_um: float
    samples_to_border: tuple[int, int]  # samples from the axis to the border
    period: tuple[int, int]
    strips: float = STRIPS  # per row of cells

    @property
    def bytes(self) -> float:
        """Peak memory while the pattern is made: the drawn pupil and half of its transform, at 0.7
        of the period each.
        """
        return 1.4 * 4.0 * self.period[0] * self.period[1]


def half_lattice(
    extent_um: Sequence[float], step_um: float, period: float = PERIOD, strips: float = STRIPS
) -> HalfLattice:
    """Return a lattice that reaches the given distances from the axis.

    Parameters
    ----------
    extent_um : (y, x) distance from the axis to the border, um.
    step_um : distance between samples, um.
    period : distance after which the field repeats, in reaches.
    strips : strips per row of cells, as in `HalfLattice`.
    """
    samples_to_border = tuple(int(np.ceil(e / step_um)) + 1 for e in extent_um)
    beside = BESIDE * max(samples_to_border)
    size = tuple(
        sf.next_fast_len(int(np.ceil(max(period * n, n + beside))), real=True)
        for n in samples_to_border
    )
    return HalfLattice(step_um, samples_to_border, size, strips)


def half_pattern(
    pupil: RealPupil,
    wavelength_nm: float,
    lattice: HalfLattice,
    apply: Callable = map,
) -> HalfPattern:
    """Return the pattern of a real pupil at one wavelength over the half plane x >= 0.

    Parameters
    ----------
    pupil : pupil without phase, mm.
    wavelength_nm : wavelength, nm.
    lattice : points of the half plane and the period of the field.
    apply : how to call a function for every block of rows or columns: `map`, or the `map` of a pool
        of threads.

    Notes
    -----
    Intensity |F|^2 / (wavelength distance)^2 / energy with F the transform of the amplitude
    (Goodman 2005, eq. 5-14).
    """
    far_y, far_x = lattice.samples_to_border
    py, px = lattice.period
    cell = lattice_pitch_mm(
        wavelength_nm, lattice.period, pupil.distance_mm, (lattice.step_um,) * 2
    )
    drawn = draw(pupil, cell, lattice.period, lattice.strips, apply)
    half = _along_x(drawn, px, far_x + 1, apply)
    del drawn
    rows = half.shape[1]
    y = np.arange(-far_y, far_y + 1)
    x = np.arange(far_x + 1)
    scale = (cell[0] * cell[1]) ** 2 * 1e-6  # per um2
    scale /= (wavelength_nm * 1e-6 * pupil.distance_mm) ** 2 * pupil.energy_mm2
    gain_y = (scale * spline_response(y / py) ** -2).astype(np.float32)
    gain_x = (spline_response(x / px) ** -2).astype(np.float32)
    density = np.empty((far_x + 1, 2 * far_y + 1), np.float32)

    def along_y(start: int) -> None:
        cut = slice(start, min(start + BLOCK, far_x + 1))
        padded = np.zeros((cut.stop - cut.start, py), np.complex64)
        padded[:, :rows] = half[cut]
        field = fourier.fft_rows(padded)
        for out, part in (
            (density[cut, far_y:], field[:, : far_y + 1]),
            (density[cut, :far_y], field[:, py - far_y :]),
        ):
            np.square(part.real, out=out)
            out += np.square(part.imag)
        density[cut] *= gain_y
        density[cut] *= gain_x[cut, None]

    _apply_to_each(apply, along_y, far_x + 1)
    return HalfPattern(density, lattice.step_um, far_y, wavelength_nm)


def _along_x(drawn: np.ndarray, period: int, count: int, apply: Callable[..., Any]) -> np.ndarray:
    """Return transforms along x, (x of the image, y of the pupil), from the axis on."""
    rows, columns = drawn.shape
    half = np.empty((count, rows), np.complex64)

    def block(start: int) -> None:
        cut = slice(start, min(start + BLOCK, rows))
        padded = np.zeros((cut.stop - cut.start, period), np.float32)
        padded[:, :columns] = drawn[cut]
        lines = np.empty((len(padded), period // 2 + 1), np.complex64)
        fourier.rfft(padded, lines)
        half[:, cut] = lines[:, :count].T

    _apply_to_each(apply, block, rows)
    return half


def draw(
    pupil: RealPupil,
    cell_mm: tuple[float, float],
    period: tuple[int, int],
    strips: float = STRIPS,
    apply: Callable = map,
) -> np.ndarray:
    """Return the pupil (y, x), float32, in cells smoothed by B-splines.

    A pupil wider than `period` cells is folded: its cells are summed modulo the period.

    Parameters
    ----------
    pupil : shapes and their weights.
    cell_mm : (y, x) sides of a cell, mm.
    period : cells of the result along y and x.
    strips : rows of chords per row of cells.
    apply : `map`, or the `map` of a pool of threads. The result does not depend on it.

    Notes
    -----
    Each chord adds its two ends to rows of differences; one cumulative sum then fills all rows. An
    end in a later period also changes all earlier periods: it is subtracted from column 0, once
    per period passed. Blocks of chords are drawn into rows of their own, and added in order.
    """
    dy, dx = cell_mm
    pad = (ORDER + 1) // 2
    rows, columns = (2 * (int(np.ceil(pupil.radius_mm / d)) + pad) for d in cell_mm)
    height = min(rows, period[0])
    width = min(columns, period[1])
    out = np.zeros((height, width), np.float32)
    strips_of_pupil = Strips(pupil, dy, rows, int(np.ceil(strips)), dx)

    def drawn(block: slice) -> _Rows | None:
        lines = chords_of(strips_of_pupil, block)
        return None if lines is None else _ends_in_cells(lines, dx, columns, width)

    for part in apply(drawn, blocks_of(strips_of_pupil, CHORDS)):
        for first, cells in () if part is None else part.folded(height):
            out[first : first + len(cells)] += cells
    return np.cumsum(out, axis=1, out=out)


class _Rows(NamedTuple):
    """Rows of a drawn pupil, before they are folded."""

    first: int
    cells: np.ndarray  # (y, x)

    def folded(self, height: int) -> Iterator[tuple[int, np.ndarray]]:
        """Yield (first row, rows) within a height that the rows are folded to."""
        done = 0
        while done < len(self.cells):
            first = (self.first + done) % height
            part = self.cells[done : done + height - first]
            yield first, part
            done += len(part)


def _ends_in_cells(lines: Chords, cell_mm: float, columns: int, width: int) -> _Rows:
    """Return the rows of differences that chords add their ends to.

    Parameters
    ----------
    lines : chords, in rows of cells.
    cell_mm : width of a cell, mm.
    columns : cells across the pupil; `width` : columns that they are folded to.
    """
    row = np.floor(lines.level).astype(np.int32)
    first = int(row.min()) - ORDER // 2
    down = np.stack(spline_taps(lines.level - row, ORDER - 1), axis=1)
    start = ((row - ORDER // 2 - first)[:, None] + np.arange(ORDER, dtype=np.int32)) * width
    size = int(row.max()) + ORDER - ORDER // 2 - first, width
    total = np.zeros(size[0] * width, np.float32)
    for end, sign in ((lines.left, 1), (lines.right, -1)):
        at = end / cell_mm + columns / 2
        column = np.floor(at).astype(np.int32)
        across = np.stack(spline_taps(at - column, ORDER), axis=1)
        taps = np.arange(ORDER + 1, dtype=np.int32) - (ORDER - 1) // 2
        passed, place = np.divmod(column[:, None] + taps, np.int32(width))
        share = down * (sign * lines.weight)[:, None]
        value = (share[:, :, None] * across[:, None, :]).astype(np.float32)
        total += _summed(value, start[:, :, None] + place[:, None, :], len(total))
        if passed.any():
            value *= -passed[:, None, :]
            total += _summed(value, np.broadcast_to(start[:, :, None], value.shape), len(total))
    return _Rows(first, total.reshape(size))


def _summed(value: np.ndarray, place: np.ndarray, size: int) -> np.ndarray:
    """Return sums of float32 values by place; other threads work meanwhile, as `np.add.at` does not
    let them.
    """
    ends = np.array([0, value.size], np.int32)
    column = csc_array((value.ravel(), place.ravel(), ends), (size, 1))
    return column @ np.ones(1, np.float32)


class Strips(NamedTuple):
    """Strips of a pupil that chords lie in, from its top down."""

    pupil: RealPupil
    cell_mm: float  # height of a row of cells
    rows: int  # of cells, evenly about the axis
    per_row: int  # strips of a row of cells
    apart_mm: float  # between the ends of chords that follow each other, at most


def blocks_of(strips: Strips, most: int) -> list[slice]:
    """Return blocks of strips with about `most` chords each: a large pupil with much dirt has a
    hundred million chords.
    """
    return strip_blocks(strips.pupil.terms, *_even(strips), most / (len(GAUSS) * DIVIDED))


def chords_of(strips: Strips, block: slice) -> Chords | None:
    """Return `pupil.gauss_chords` of all shapes in a block of strips, in rows of cells; None where
    there are none.
    """
    top, height, count = _even(strips)
    low_mm = top + block.start * height
    high_mm = top + block.stop * height
    each = strips.per_row
    pieces = []
    for shape, amplitude in strips.pupil.terms:
        if shape.high < low_mm or shape.low > high_mm:
            continue
        term = (shape, amplitude / each)
        chords = gauss_chords(term, top, height, count, block, strips.apart_mm)
        if len(chords.left):
            pieces.append(chords._replace(level=chords.level / each))
    return Chords(*(np.concatenate(part) for part in zip(*pieces))) if pieces else None


def _even(strips: Strips) -> tuple[float, float, int]:
    """Return the top of the first strip and the height of all, mm, and their number."""
    height = strips.cell_mm / strips.per_row
    return -strips.rows / 2 * strips.cell_mm, height, strips.rows * strips.per_row


def _apply_to_each(apply: Callable[..., Any], function: Callable[..., Any], count: int) -> None:
    for _ in apply(function, range(0, count, BLOCK)):
        pass
