"""Half-plane pattern: the diffraction pattern of a pupil without phase, sampled once on a square
lattice.

The transform of a real pupil is Hermitian, so that its squared magnitude equals its own mirror
image: half of the image plane determines all of it. The pattern of a wavelength w is P(x; w) =
u^2 P(u x; w0) with u = w0 / w, so that one lattice serves every wavelength longer than w0.

The pupil is rasterised in cells smoothed by B-splines, which suppress light from beyond one period
of the field; their response is divided out again (`lattice`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.fft as sf

from ..convolution import fourier
from .lattice import ORDER, lattice_pitch_mm, spline_response, spline_taps, summed
from .pupil import GAUSS, Chords, gauss_chords, strip_blocks

PERIOD = 2.4  # period of the field, in reaches; the image itself is two reaches wide
# least distance from the border of the image to the axis of its repetition, over the longer reach;
# it matters along the shorter axis, where the light beyond the border is hardly fainter
BESIDE = 0.75
# strips per row of cells, with two chords each; more where edges are slanted (`gauss_chords`)
STRIPS = 1.2
BLOCK = 64  # number of rows or columns that are transformed at a time
CHORDS = 1 << 17  # number of chords that one thread rasterises at a time; each needs 1 kB
# approximate factor on the number of chords, because strips are divided where edges are slanted
DIVIDED = 1.5


@dataclass(frozen=True, eq=False)
class HalfPattern:
    """The pattern over the half plane x >= 0: `density[x, y]` is the value at (x, y - middle) *
    step_um.
    """

    density: np.ndarray  # fraction of the pupil's energy per um2 of the image
    step_um: float  # distance between samples
    middle: int  # index of y = 0
    wavelength_nm: float  # wavelength of the pattern


@dataclass(frozen=True)
class RealPupil:
    """A pupil without phase, its distance to the image, and its energy."""

    terms: list  # [(Convex, weight), ...], as `pupil.opening` returns; mm
    radius_mm: float  # half the width of a square that holds the pupil
    distance_mm: float  # distance to the image
    energy_mm2: float  # integral of the squared amplitude


@dataclass(frozen=True)
class HalfLattice:
    """Points of a half plane, and the period of the field; all pairs are (y, x)."""

    step_um: float  # distance between points
    samples_to_border: tuple[int, int]  # points from the axis to the border
    period: tuple[int, int]  # period of the field, points
    strips: float = STRIPS  # strips per row of cells

    @property
    def bytes(self) -> float:
        """Peak memory while the pattern is computed, bytes: the rasterised pupil and half of its
        transform, at 0.7 of the period each.
        """
        return 1.4 * 4.0 * self.period[0] * self.period[1]


def half_lattice(
    extent_um: Sequence[float], step_um: float, period: float = PERIOD, strips: float = STRIPS
) -> HalfLattice:
    """Return a lattice that extends to the given distances from the axis.

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
    apply : `map`, or the `map` of a pool of threads.

    Notes
    -----
    The intensity is |F|^2 / (wavelength distance)^2 / energy with the transform F of the amplitude
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
    """Return transforms along x, (x of the image, y of the pupil), for `count` samples from the
    axis on.
    """
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
    period : (y, x) largest number of cells of the result.
    strips : rows of chords per row of cells.
    apply : `map`, or the `map` of a pool of threads. The result does not depend on it.

    Notes
    -----
    Each chord adds its two ends to rows of differences; one cumulative sum then fills all rows. An
    end in a later period also changes all earlier periods: it is subtracted from column 0, once per
    period that lies before it. Each block of chords has its own rows; these are added in order.
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
    """Rows of a rasterised pupil, before they are folded."""

    first: int  # index of the first row
    cells: np.ndarray  # (y, x)

    def folded(self, height: int) -> Iterator[tuple[int, np.ndarray]]:
        """Yield (index of the first row, rows) of the pieces of the rows, folded modulo
        `height`.
        """
        done = 0
        while done < len(self.cells):
            first = (self.first + done) % height
            part = self.cells[done : done + height - first]
            yield first, part
            done += len(part)


def _ends_in_cells(lines: Chords, cell_mm: float, columns: int, width: int) -> _Rows:
    """Return rows of differences with the ends of chords.

    Parameters
    ----------
    lines : chords; their levels are in rows of cells.
    cell_mm : width of a cell, mm.
    columns : number of cells across the pupil.
    width : number of columns to which the pupil is folded.
    """
    row = np.floor(lines.level).astype(np.int32)
    first = int(row.min()) - ORDER // 2
    # arrays (tap along y, tap along x, chord): NumPy is fastest along the many chords
    down = np.array(spline_taps(lines.level - row, ORDER - 1))
    start = (row - ORDER // 2 - first + np.arange(ORDER, dtype=np.int32)[:, None]) * np.int32(width)
    size = int(row.max()) + ORDER - ORDER // 2 - first, width
    total = np.zeros(size[0] * width, np.float32)
    for end, sign in ((lines.left, 1), (lines.right, -1)):
        at = end / cell_mm + columns / 2
        column = np.floor(at).astype(np.int32)
        across = np.array(spline_taps(at - column, ORDER), np.float32)
        taps = np.arange(ORDER + 1, dtype=np.int32)[:, None] - (ORDER - 1) // 2
        passed, place = np.divmod(column + taps, np.int32(width))
        share = (down * (sign * lines.weight)).astype(np.float32)
        value = share[:, None] * across
        total += summed(value, start[:, None] + place, len(total))
        if passed.any():
            value *= -passed
            total += summed(value, np.broadcast_to(start[:, None], value.shape), len(total))
    return _Rows(first, total.reshape(size))


class Strips(NamedTuple):
    """Strips of a pupil, in which chords lie, from the top of the pupil down."""

    pupil: RealPupil
    cell_mm: float  # height of a row of cells
    rows: int  # number of rows of cells, symmetric about the axis
    per_row: int  # number of strips per row of cells
    apart_mm: float  # largest distance between the ends of successive chords


def blocks_of(strips: Strips, most: int) -> list[slice]:
    """Return blocks of strips with about `most` chords each. A large pupil with much dirt has a
    hundred million chords.
    """
    return strip_blocks(strips.pupil.terms, *_even(strips), most / (len(GAUSS) * DIVIDED))


def chords_of(strips: Strips, block: slice) -> Chords | None:
    """Return `pupil.gauss_chords` of all shapes in a block of strips, with levels in rows of cells;
    None if there are none.
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
    """Return (top of the first strip mm, height of each strip mm, number of strips)."""
    height = strips.cell_mm / strips.per_row
    return -strips.rows / 2 * strips.cell_mm, height, strips.rows * strips.per_row


def _apply_to_each(apply: Callable[..., Any], function: Callable[..., Any], count: int) -> None:
    for _ in apply(function, range(0, count, BLOCK)):
        pass
