"""Chord transforms: Fourier transforms along x of the chords of a pupil, summed over rows of
cells.

The integral of exp(-2 pi i f x) over a chord is the difference of this function at both ends,
divided by -2 pi i f. The ends lie anywhere on x. Each end is therefore spread over the nearest
points of a comb by a B-spline, the comb is transformed by a fast Fourier transform, and the
response of the B-spline is divided out (Dutt and Rokhlin 1993; Beylkin 1995, with B-splines).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import scipy.fft as sf

from ..convolution import fourier
from .lattice import ORDER, spline_taps, summed
from .pupil import Chords

DEGREE = 5  # degree of the B-spline along x
# Least period of the transform, as a multiple of the number of frequencies. The transform mixes the
# fields of frequencies that differ by a period. With 4, at most (1 / 7)^6 = 8e-6 of the amplitude
# of another frequency is added; for dirty pupils the relative error was 2e-6.
LEAST_PERIOD = 4
TOGETHER = 4096  # number of chords that are spread at a time: their values fit into the cache


class _Comb(NamedTuple):
    """Evenly spaced points along x, over which the ends of chords are spread, and the frequencies
    at which the points are transformed.
    """

    points: int  # number of points in one period
    step_mm: float  # distance between points
    shift: float  # frequency that becomes 0, cycles per mm: the middle one
    numbers: np.ndarray  # (frequency,) numbers of the frequencies, 0 at `shift`


def chord_transforms(lines: Chords, frequency: np.ndarray) -> tuple[int, np.ndarray]:
    """Return the transforms of rows of cells along x, times 2 pi i frequency. At the frequency 0
    the factor is 2 pi i.

    Rows are smoothed along y by B-splines of `lattice.ORDER`.

    Parameters
    ----------
    lines : chords; their levels are in rows of cells.
    frequency : (frequency,) equidistant frequencies, cycles per mm; at least two.

    Returns
    -------
    The number of the first row to which chords add, and the transforms (frequency, row), complex64.
    """
    comb = _comb(frequency)
    lowest, highest = (int(np.floor(level)) for level in (lines.level.min(), lines.level.max()))
    begin = lowest - ORDER // 2
    fields = np.zeros((highest - lowest + ORDER, len(frequency)), np.complex64)
    response = (np.sinc(comb.numbers / comb.points) ** (DEGREE + 1)).astype(np.float32)
    # both ends cancel at the frequency 0, where the integral of a chord is its length
    axis = np.flatnonzero(frequency == 0)
    for part in _in_order(lines):
        rows = _rows_of(part)
        cells = _spread(part.left, rows, comb) - _spread(part.right, rows, comb)
        own = fourier.fft_rows(cells)[:, comb.numbers % comb.points] / response
        own[:, axis] = 2j * np.pi * _lengths(part, rows)[:, None]
        fields[rows.first - begin : rows.first - begin + rows.count] += own
    return begin, fields.T


def _comb(frequency: np.ndarray) -> _Comb:
    """Return the comb for equidistant frequencies.

    The transform mixes the fields of frequencies that differ by multiples of the period. The field
    at the frequency 0 is by far the strongest. The period is therefore chosen such that no
    requested frequency lies a multiple of it away from 0.
    """
    count = len(frequency)
    step = (frequency[-1] - frequency[0]) / (count - 1)
    middle = count // 2
    from_axis = round(abs(frequency[middle] / step))
    points = sf.next_fast_len(LEAST_PERIOD * count)
    while from_axis > points - count and not count <= from_axis % points <= points - count:
        points = sf.next_fast_len(points + 1)
    numbers = np.arange(count) - middle
    return _Comb(points, 1 / (points * step), frequency[middle], numbers)


def _in_order(lines: Chords) -> Iterator[Chords]:
    """Yield blocks of `TOGETHER` chords, from the top of the pupil down."""
    order = np.argsort(lines.level, kind="stable")
    for start in range(0, len(order), TOGETHER):
        yield Chords(*(part[order[start : start + TOGETHER]] for part in lines))


class _Rows(NamedTuple):
    """Rows of cells to which chords add."""

    first: int  # number of the first row
    count: int  # number of rows
    rows: np.ndarray  # (tap, chord) int32 row, counted from the first
    weights: np.ndarray  # (tap, chord) weight of a chord in that row


def _rows_of(lines: Chords) -> _Rows:
    """Return the rows of cells, smoothed by B-splines along y, of chords in order."""
    row = np.floor(lines.level).astype(np.int32)
    first = int(row[0]) - ORDER // 2
    rows = row - ORDER // 2 - first + np.arange(ORDER, dtype=np.int32)[:, None]
    weights = np.array(spline_taps(lines.level - row, ORDER - 1)) * lines.weight
    return _Rows(first, int(rows.max()) + 1, rows, weights)


def _spread(end_mm: np.ndarray, rows: _Rows, comb: _Comb) -> np.ndarray:
    """Return cells (row, point), complex64, with one end of every chord, multiplied by
    exp(-2 pi i shift x).

    Parameters
    ----------
    end_mm : (chord,) position of the ends.
    rows : rows of cells to which the chords add.
    comb : points along x.
    """
    at = end_mm / comb.step_mm
    column = np.floor(at)
    across = np.array(spline_taps(at - column, DEGREE), np.complex64)
    taps = np.arange(DEGREE + 1, dtype=np.int32)[:, None] - (DEGREE - 1) // 2
    point = (column.astype(np.int32) + taps) % np.int32(comb.points)
    share = (rows.weights * np.exp(-2j * np.pi * comb.shift * end_mm)).astype(np.complex64)
    value = share[:, None] * across
    place = (rows.rows * np.int32(comb.points))[:, None] + point
    return summed(value, place, rows.count * comb.points).reshape(rows.count, comb.points)


def _lengths(lines: Chords, rows: _Rows) -> np.ndarray:
    """Return the sum (row,) of the lengths of chords in each row, mm."""
    value = rows.weights * (lines.right - lines.left)
    return np.bincount(rows.rows.ravel(), value.ravel(), rows.count)
