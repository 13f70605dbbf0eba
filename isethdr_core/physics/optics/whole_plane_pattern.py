"""Whole-plane pattern: the diffraction pattern of a pupil with phase, sampled on a square lattice.

The open pupil and its dirt are rasterised once, in cells smoothed by B-splines
(`half_plane_pattern`). Each cell is then multiplied by the phase factor at its middle. The correct
order is to multiply before smoothing. The difference follows for a phase phi that is linear over a
cell, with the smoothing b, the pupil a, and the distance t:

    b * (a exp(i phi)) = exp(i phi) (b * a - i phi' (t b) * a + ...).

The first moment (t b) * a is computed from differences between cells (`MOMENT`). The remaining
error is of second order in the change of phase from cell to cell, which is `MOST_TURNS` at most.

Scaled to the size at one wavelength, the pattern is a smooth function of the wavenumber k. A
polynomial through the patterns of a few wavenumbers (`interpolation_wavenumbers`) gives all others.
"""

from __future__ import annotations

from collections.abc import Callable
from math import factorial
from typing import Any, NamedTuple

import numpy as np

from ..convolution import fourier
from . import half_plane_pattern as half
from .half_plane_pattern import HalfLattice, HalfPattern, RealPupil
from .lattice import ORDER, lattice_pitch_mm, spline_response

# effective change of phase in the error of the polynomial, over the rms change over the pupil:
# measured 0.8 to 1.36, with coma and defocus of 0.14 to 2.8 rad over the range of wavenumbers
FOLLOWED = 1.4

PERIOD = 3.0  # period of the field, in reaches
# Weights of differences over 2, 4 and 6 cells that give the first moment of a B-spline of order 7,
# times -1. They fit 7 / (2 pi) (1 / u - pi cot(pi u)), with u cycles per cell, by least squares up
# to u = 1 / `PERIOD`. The error is at most 0.06, of values up to 1.3.
MOMENT = (0.53853, -0.18845, 0.0531)
SPARE = 3  # number of dark cells on either side of the lit cells that the differences need
# largest change of phase from cell to cell, wavelengths: at most 2 % of the light at the border is
# wrong
MOST_TURNS = 1 / 64

# function((x,) and (y,) equidistant positions in mm) -> optical path in wavelengths, (y, x) float
Turns = Callable[[np.ndarray, np.ndarray], np.ndarray]


class DrawnPupil(NamedTuple):
    """A pupil without its phase in smooth cells, and the lattice of its pattern."""

    cells: np.ndarray  # (y, x) float32 amplitude
    cell_mm: tuple[float, float]  # (y, x) sides of a cell
    lattice: HalfLattice
    scale: float  # factor from the squared field to a fraction of the energy per um2
    wavelength_nm: float  # wavelength that gives the size of the pattern


class WholePattern(NamedTuple):
    """Both halves of a pattern; `left` is rotated by 180 degrees about the axis."""

    right: HalfPattern
    left: HalfPattern


def fits(pupil: RealPupil, wavelength_nm: float, lattice: HalfLattice) -> bool:
    """Return whether all of a pupil lies within one period of cells, as `drawn_pupil` needs.

    Parameters
    ----------
    pupil : the pupil without its phase, mm.
    wavelength_nm : wavelength, nm.
    lattice : points of the image and the period of the field.
    """
    cells = _cell_mm(pupil, wavelength_nm, lattice)
    return all(_count(pupil, c) <= p for c, p in zip(cells, lattice.period))


def drawn_pupil(pupil: RealPupil, wavelength_nm: float, lattice: HalfLattice) -> DrawnPupil:
    """Return a pupil rasterised for a lattice, with the size of the pattern at one wavelength.

    Parameters
    ----------
    pupil : the pupil without its phase, mm.
    wavelength_nm : wavelength, nm.
    lattice : points of the image and the period of the field.

    Raises
    ------
    ValueError : the pupil is wider than a period of its cells (`fits`).
    """
    cell = _cell_mm(pupil, wavelength_nm, lattice)
    if not fits(pupil, wavelength_nm, lattice):
        raise ValueError("the pupil is wider than a period; expected finer steps of the lattice")
    scale = (cell[0] * cell[1]) ** 2 * 1e-6
    scale /= (wavelength_nm * 1e-6 * pupil.distance_mm) ** 2 * pupil.energy_mm2
    cells = half.draw(pupil, cell, lattice.period, lattice.strips)
    return DrawnPupil(cells, cell, lattice, scale, wavelength_nm)


def whole_pattern(drawn: DrawnPupil, turns: Turns, apply: Callable = map) -> WholePattern:
    """Return the pattern of a pupil with a phase, over the whole plane.

    Parameters
    ----------
    drawn : the pupil without its phase, rasterised for a lattice.
    turns : function that gives the phase over the pupil.
    apply : `map`, or the `map` of a pool of threads.
    """
    far_y, far_x = drawn.lattice.samples_to_border
    density = densities(drawn, turns, np.arange(-far_x, far_x + 1), apply)
    sides = density[far_x:], density[far_x::-1, ::-1]
    step = drawn.lattice.step_um
    return WholePattern(*(HalfPattern(side, step, far_y, drawn.wavelength_nm) for side in sides))


def densities(
    drawn: DrawnPupil, turns: Turns, columns: np.ndarray, apply: Callable = map
) -> np.ndarray:
    """Return the fraction of the energy per um2, (column, y = -far .. far), float32.

    Parameters
    ----------
    drawn : the pupil without its phase, rasterised for a lattice.
    turns : function that gives the phase over the pupil.
    columns : (column,) columns of the image, in steps from the axis.
    apply : `map`, or the `map` of a pool of threads.

    Notes
    -----
    The intensity is |F|^2 / (wavelength distance)^2 / energy with the transform F of the amplitude
    (Goodman 2005, eq. 5-14).
    """
    samples_to_border = drawn.lattice.samples_to_border[0]
    period_y, period_x = drawn.lattice.period
    lines = _along_x(drawn, turns, columns, apply)
    rows = len(drawn.cells)
    y = np.arange(-samples_to_border, samples_to_border + 1)
    gain_y = (drawn.scale * spline_response(y / period_y) ** -2).astype(np.float32)
    gain_x = (spline_response(columns / period_x) ** -2).astype(np.float32)
    out = np.empty((len(columns), 2 * samples_to_border + 1), np.float32)

    def along_y(start: int) -> None:
        cut = slice(start, min(start + half.BLOCK, len(columns)))
        padded = np.zeros((cut.stop - cut.start, period_y), np.complex64)
        padded[:, :rows] = lines[cut]
        field = fourier.fft_rows(padded)
        for into, part in (
            (out[cut, samples_to_border:], field[:, : samples_to_border + 1]),
            (out[cut, :samples_to_border], field[:, period_y - samples_to_border :]),
        ):
            np.square(part.real, out=into)
            into += np.square(part.imag)
        out[cut] *= gain_y
        out[cut] *= gain_x[cut, None]

    _apply_to_each(apply, along_y, len(columns))
    return out


def interpolation_wavenumbers(
    first: float, last: float, change_rad: float, error: float
) -> np.ndarray:
    """Return the Chebyshev nodes for interpolating patterns from wavenumber `first` to `last`.

    Parameters
    ----------
    first, last : wavenumbers, both in the same unit.
    change_rad : change of the phase from first to last, rms over the pupil.
    error : largest relative error of the light, L1 norm.

    Notes
    -----
    Every pair of points of the pupil adds a sinusoidal function of k to the pattern. A polynomial
    through n Chebyshev nodes has the error R^n / (2^(n - 1) n!) for exp(i R t), t from -1 to 1
    (Trefethen 2013, Approximation Theory and Approximation Practice, chapter 7, for entire
    functions); R is `FOLLOWED` times the change.
    """
    count = 1
    while left_by(count, change_rad) > error:
        count += 1
    at = np.cos((np.arange(count) + 0.5) * np.pi / count)
    return (first + last) / 2 + (last - first) / 2 * at


def left_by(count: int, change_rad: float) -> float:
    """Return the relative error of the light, L1 norm, with `count` interpolation wavenumbers.

    `change_rad` is as in `interpolation_wavenumbers`.
    """
    return (FOLLOWED * change_rad) ** count / (2.0 ** (count - 1) * factorial(count))


def shares(wavenumbers: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the weight (wavenumber, point) of every pattern in the value of the polynomial
    (Lagrange).

    Parameters
    ----------
    wavenumbers : (wavenumber,) wavenumbers of the patterns.
    at : (point,) wavenumbers at which the polynomial is evaluated.
    """
    out = np.ones((len(wavenumbers), len(at)))
    for n, own in enumerate(wavenumbers):
        for m, other_wavenumber in enumerate(wavenumbers):
            if m != n:
                out[n] *= (at - other_wavenumber) / (own - other_wavenumber)
    return out


def _cell_mm(pupil: RealPupil, wavelength_nm: float, lattice: HalfLattice) -> tuple[float, float]:
    return lattice_pitch_mm(
        wavelength_nm, lattice.period, pupil.distance_mm, (lattice.step_um,) * 2
    )


def _count(pupil: RealPupil, cell_mm: float) -> int:
    """Return the number of cells across a pupil, as in `half_plane_pattern.draw`."""
    return 2 * (int(np.ceil(pupil.radius_mm / cell_mm)) + (ORDER + 1) // 2)


def _along_x(
    drawn: DrawnPupil, turns: Callable[..., Any], columns: np.ndarray, apply: Callable[..., Any]
) -> np.ndarray:
    """Return the transforms along x of the pupil's rows, (column of the image, row)."""
    rows, across = drawn.cells.shape
    period = drawn.lattice.period[1]
    y_mm, x_mm = ((np.arange(n) + 0.5 - n / 2) * c for n, c in zip((rows, across), drawn.cell_mm))
    lines = np.empty((len(columns), rows), np.complex64)
    at = columns % period

    def block(start: int) -> None:
        cut = slice(start, min(start + half.BLOCK, rows))
        lit = np.flatnonzero(drawn.cells[cut].any(axis=0))
        padded = np.zeros((cut.stop - start, period), np.complex64)
        if len(lit):
            inside = slice(max(lit[0] - SPARE, 0), min(lit[-1] + 1 + SPARE, across))
            padded[:, inside] = _turned(drawn.cells, cut, inside, turns(x_mm[inside], y_mm[cut]))
            padded = fourier.fft_rows(padded)
        lines[:, cut] = padded[:, at].T

    _apply_to_each(apply, block, rows)
    return lines


def _turned(cells: np.ndarray, rows: slice, columns: slice, turns: np.ndarray) -> np.ndarray:
    """Return a block of smooth cells with their phase, as if the phase had been applied before
    smoothing.
    """
    own = cells[rows, columns]
    slope_x = np.gradient(turns, axis=1)
    slope_y = np.gradient(turns, axis=0) if len(turns) > 1 else np.zeros_like(turns)
    # whole wavelengths are removed in float64, so that float32 keeps a precision of 1e-7
    turns = turns - np.rint(turns)
    angle = (2 * np.pi * turns).astype(np.float32)
    out = np.empty(own.shape, np.complex64)
    out.real = own
    out.imag = _moment(cells, rows, columns, 1) * (2 * np.pi * slope_x).astype(np.float32)
    out.imag += _moment(cells, rows, columns, 0) * (2 * np.pi * slope_y).astype(np.float32)
    phase = np.empty(own.shape, np.complex64)
    np.cos(angle, out=phase.real)
    np.sin(angle, out=phase.imag)
    out *= phase
    return out


def _moment(cells: np.ndarray, rows: slice, columns: slice, axis: int) -> np.ndarray:
    """Return the first moment (t b) * a of the module's text, times -1, of a block of cells."""
    total = np.float32(0.0)
    for apart, weight in enumerate(MOMENT, 1):
        ends = []
        for sign in (1, -1):
            shift = [sign * apart if a == axis else 0 for a in (0, 1)]
            ends.append(_shifted(cells, rows, columns, shift))
        total = total + np.float32(weight) * (ends[0] - ends[1])
    return total


def _shifted(cells: np.ndarray, rows: slice, columns: slice, shift: list[int]) -> np.ndarray:
    """Return a block of cells at positions shifted by `shift` (y, x); 0 beyond the border."""
    out = np.zeros((rows.stop - rows.start, columns.stop - columns.start), np.float32)
    into = []
    of = []
    for cut, move, count in zip((rows, columns), shift, cells.shape):
        low = max(cut.start + move, 0)
        high = min(cut.stop + move, count)
        of.append(slice(low, max(high, low)))
        into.append(slice(low - move - cut.start, max(high, low) - move - cut.start))
    out[tuple(into)] = cells[tuple(of)]
    return out


def _apply_to_each(apply: Callable[..., Any], function: Callable[..., Any], count: int) -> None:
    for _ in apply(function, range(0, count, half.BLOCK)):
        pass
