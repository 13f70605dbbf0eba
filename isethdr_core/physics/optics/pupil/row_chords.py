"""Row chords: chords of a shape at two Gauss-Legendre positions in every row, or part of a row.

Rows are divided where the ends of chords move fast along x, so that few rows are enough elsewhere.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .convex import Convex
from .strip_chords import GAUSS

# Number of parts of a row for each distance `apart` by which a side deviates from a straight line.
# Without these parts, errors of dirty pupils are three times as large; 10 parts reduce them no
# further.
TURN = 4.0
PLACES = np.array(GAUSS)[:, None]  # (place, part of a row)
# The lower of two positions in a shape that lies within one row, as a share of its height. Chords
# there, with equal weights, integrate discs and shapes with straight sides exactly.
HALF_DISC = (1 - (1 - np.pi**2 / 16) ** 0.5) / 2
WITHIN_A_ROW = np.array([[HALF_DISC], [1 - HALF_DISC]])  # (place, shape)


class Chords(NamedTuple):
    """Chords of a shape on level lines, each (chord,)."""

    left: np.ndarray  # x where the chord begins, in the unit of the shape
    right: np.ndarray  # x where it ends
    weight: np.ndarray  # amplitude times the share of a row's height that the chord stands for
    level: np.ndarray  # distance from the top of the first row, in rows


def gauss_chords(
    term: tuple[Convex, float], y0: float, step: float, count: int, block: slice, apart: float
) -> Chords:
    """Return the chords of one shape at Gauss's two places in every row, or every part of a row.

    The places are Gauss's in the root of the distance to the nearer end of the shape, lower or
    upper. Chords of a round shape grow with that root; chords between straight sides are integrated
    as exactly. The phase of the field in an image follows the ends of the chords. A row is
    therefore divided in two cases: where a side is so slanted that an end moves by more than
    `apart` within the row, as near the lower and upper end of a round shape; and where a side
    changes its direction, as at the corners of an iris.

    Parameters
    ----------
    term : (shape, weight).
    y0 : top of the first row, in the unit of the shapes.
    step : height of a row, same unit.
    count : number of rows.
    block : rows to take, one of `strip_blocks`.
    apart : largest distance along x, same unit, by which an end moves within a part of a row.
    """
    shape, weight = term
    border = _row_borders(shape, y0, step, count, block)
    if len(border) < 2:
        return Chords(*np.empty((4, 0)))
    parts = np.ceil(_moves(shape, border) / apart).clip(1).astype(np.intp)
    height = shape.high - shape.low
    if len(parts) == 1 == parts[0] and border[1] - border[0] == height:
        # all of the shape lies in one row
        level = shape.low + WITHIN_A_ROW * height
        share = np.full((2, 1), 0.5 * height)
    else:
        level, share = _levels(shape, border, parts)
    left, right = shape.chords(level)
    hit = left < right
    return Chords(left[hit], right[hit], share[hit] * (weight / step), (level[hit] - y0) / step)


def _row_borders(shape: Convex, y0: float, step: float, count: int, block: slice) -> np.ndarray:
    """Return the borders (y) of the rows that a shape fills, from its lower to its upper end."""
    first, last = (np.clip((bound - y0) / step, 0, count) for bound in (shape.low, shape.high))
    row = np.arange(max(int(first) - 1, block.start), min(int(last) + 2, block.stop) + 1)
    border = np.clip(y0 + row * step, shape.low, shape.high)
    begin = max(int(np.searchsorted(border, shape.low, "right")) - 1, 0)
    return border[begin : int(np.searchsorted(border, shape.high)) + 1]


def _levels(shape: Convex, border: np.ndarray, parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (level, share), each (2, part), of Gauss's two places in every part of the rows.

    Parameters
    ----------
    shape : the shape; places are counted from the nearer one of its lower and upper end.
    border : (row + 1,) borders of the rows, in the unit of the shape.
    parts : (row,) number of parts of each row.

    Returns
    -------
    The levels, and the height that each of them stands for; both in the unit of the shape.
    """
    is_nearer_low = border[:-1] - shape.low < shape.high - border[1:]
    from_low = np.sqrt(border - shape.low)
    from_high = np.sqrt(shape.high - border)
    near = np.where(is_nearer_low, from_low[:-1], from_high[1:])  # root of the shorter distance
    length = np.where(is_nearer_low, from_low[1:], from_high[:-1]) - near
    end = np.where(is_nearer_low, shape.low, shape.high)
    sign = np.where(is_nearer_low, 1.0, -1.0)
    if parts.max() > 1:
        before = np.repeat(np.cumsum(parts) - parts, parts)
        length = np.repeat(length / parts, parts)
        near = np.repeat(near, parts) + (np.arange(len(before)) - before) * length
        end = np.repeat(end, parts)
        sign = np.repeat(sign, parts)
    root = near + PLACES * length
    return end + sign * root**2, root * length


def _moves(shape: Convex, border: np.ndarray) -> np.ndarray:
    """Return the distance along x by which the ends of chords move within each row.

    Where a side changes its direction, it is at least `TURN` times the deviation from a straight
    line. `border` are the borders (y) of the rows.
    """
    ends = np.array(shape.chords(border))
    steps = ends[:, 1:] - ends[:, :-1]
    if not np.isfinite(ends).all():  # without a chord at a border, no end moves
        steps[~(np.isfinite(ends[:, 1:]) & np.isfinite(ends[:, :-1]))] = 0.0
    moves = np.abs(steps).max(axis=0)
    if len(moves) > 1:
        turns = TURN * np.abs(steps[:, 1:] - steps[:, :-1]).max(axis=0)
        np.maximum(moves[1:], turns, out=moves[1:])
        np.maximum(moves[:-1], turns, out=moves[:-1])
    return moves
