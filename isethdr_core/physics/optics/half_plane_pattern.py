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
from typing import Any

import numpy as np
import scipy.fft as sf

from ..convolution import fourier
from .lattice import ORDER, lattice_pitch_mm, spline_response, spline_taps
from .pupil import GAUSS, Chords, gauss_chords, strip_blocks

PERIOD = 2.4  # period of the field, in reaches; two reaches are the image itself
# least distance from the image to its repetition, over the longer reach: light there is hardly
# fainter
BESIDE = 0.75
# strips per row of cells, with two chords each; a wide image adds its width / height
STRIPS = 1.2
BLOCK = 64  # rows or columns of a transform at a time
CHORDS = 3 << 20  # chords drawn at a time: each takes some 250 bytes meanwhile


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
    # of a cell, as `STRIPS`. More of them, for patterns right to 1e-3: slanted edges of a blade
    # then draw the spike as it is hundreds of tiles out
    strips: float = STRIPS

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
    half = _along_x(draw(pupil, cell, lattice.period, lattice.strips), px, far_x + 1, apply)
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
    pupil: RealPupil, cell_mm: tuple[float, float], period: tuple[int, int], strips: float = STRIPS
) -> np.ndarray:
    """Return the pupil (y, x), float32, in cells smoothed by B-splines.

    A pupil wider than `period` cells is folded: its cells are summed modulo the period.

    Parameters
    ----------
    pupil : shapes and their weights.
    cell_mm : (y, x) sides of a cell, mm.
    period : cells of the result along y and x.
    strips : rows of chords per row of cells.

    Notes
    -----
    Each chord adds its two ends to rows of differences; one cumulative sum then fills all rows. An
    end in a later period also changes all earlier periods: it is subtracted from column 0, once
    per period passed.
    """
    dy, dx = cell_mm
    pad = (ORDER + 1) // 2
    rows, columns = (2 * (int(np.ceil(pupil.radius_mm / d)) + pad) for d in cell_mm)
    height = min(rows, period[0])
    width = min(columns, period[1])
    # Chords of slanted edges turn the faster from row to row the wider the image
    count = int(np.ceil(strips + dy / dx))
    out = np.zeros(height * width, np.float32)
    for left, right, weight, level in chord_blocks(pupil, dy, rows, count, CHORDS):
        row = np.floor(level).astype(np.intp)
        down = spline_taps(level - row, ORDER - 1)
        for end, sign in ((left, 1), (right, -1)):
            at = end / dx + columns / 2
            column = np.floor(at).astype(np.intp)
            across = spline_taps(at - column, ORDER)
            for k, share in enumerate(down):
                start = (row + k - ORDER // 2) % height * width
                share = share * (sign * weight)
                for t, part in enumerate(across):
                    passed, place = np.divmod(column + t - (ORDER - 1) // 2, width)
                    value = share * part
                    np.add.at(out, start + place, value.astype(np.float32))
                    if passed.any():
                        np.add.at(out, start, (-passed * value).astype(np.float32))
    out = out.reshape(height, width)
    return np.cumsum(out, axis=1, out=out)


def chord_blocks(
    pupil: RealPupil, cell_mm: float, rows: int, strips: int, most: int
) -> Iterator[Chords]:
    """Yield `pupil.gauss_chords` of all shapes in rows of cells, from the top of the pupil down.

    A large pupil with much dirt has a hundred million chords.

    Parameters
    ----------
    pupil : pupil without phase, mm.
    cell_mm : height of a row of cells, mm.
    rows : rows of cells, evenly about the axis.
    strips : strips per row of cells.
    most : approximate number of chords per block.
    """
    top = -rows / 2 * cell_mm
    height = cell_mm / strips
    for block in strip_blocks(pupil.terms, top, height, rows * strips, most / len(GAUSS)):
        low_mm = top + block.start * height
        high_mm = top + block.stop * height
        pieces = []
        for shape, amplitude in pupil.terms:
            if shape.high < low_mm or shape.low > high_mm:
                continue
            for chords in gauss_chords((shape, amplitude), top, height, rows * strips, block):
                pieces.append(
                    (chords.left, chords.right, chords.weight / strips, chords.level / strips)
                )
        if pieces:
            yield Chords(*(np.concatenate(part) for part in zip(*pieces)))


def _apply_to_each(apply: Callable[..., Any], function: Callable[..., Any], count: int) -> None:
    for _ in apply(function, range(0, count, BLOCK)):
        pass
