"""Core sizes: exact cores beyond the usual size, their errors, and the sizes they can have."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .. import kernel_sampling_error
from .column_errors import ELSEWHERE, columns_together, wrong_columns
from .core_halves import exact_halves, exact_sums

if TYPE_CHECKING:
    from .frame import Frame

# Number of strips per row of pupil cells. With 3 strips, single tiles along y, 150 tiles from the
# axis, have an error of 2e-4; with 5 strips, 6e-5.
STRIPS = 5.0
# Sampling of direct sums, fields of `pattern_columns.Place`. Next to the axis light falls so
# steeply that they need half the step, and twice the strips for the ends of the columns.
FINE_COLUMNS = {"step": 0.1, "moves": 0.25, "period": 6.0, "strips": 3.0}
NEAREST_COLUMNS = {**FINE_COLUMNS, "step": 0.05, "strips": 6.0}
# the same for wide tiles, as in `rings.WIDE`
WIDE_FINE_COLUMNS = {"step": 0.5, "moves": 0.5, "period": 6.0, "strips": 3.0}
# first compared column, tiles from the axis: no error of a wider core was found nearer to the axis
NEAREST = 8
MOST_SUMS = 1e11  # largest number of multiplications of a wider core: about 6 CPU seconds
# multiplications of a wider core per value of the kernels that take as long as the usual rings
USUAL_SUMS = 8e3


class Core(NamedTuple):
    """An exact core wider than the usual one."""

    reach: tuple[int, int]  # (y, x) tiles from the axis to the border
    halves: np.ndarray  # as returned by `exact_halves`
    relative: np.ndarray  # (octave,) relative mean magnitude of the error per tile
    deviation: np.ndarray  # (octave,) as `kernel_sampling_error.deviation`


def wider_core(frame: Frame, tiles: int, apply: Callable = map) -> Core:
    """Return an exact core of `tiles`, with its error against direct sums over the pupil.

    Direct sums are finer than in `errors`, because the error of the core is smaller.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    tiles : tiles from the axis to the border of the core.
    apply : `map`, or the `map` of a pool of threads.
    """
    reach = wider_reach(frame, tiles)
    exact = exact_halves(frame, reach, apply, STRIPS)
    order = np.argsort(frame.edges_nm[:, 0])
    last = max(2, reach[1] + 1 - columns_together(frame))
    wide = frame.has_wide_tiles
    inside = frame.resized(reach, (NEAREST, NEAREST))
    places_checked = {(min(f, last), b) for f in (NEAREST, last) for b in (order[0], order[-1])}

    def one(first: int, band: int) -> tuple[np.ndarray, np.ndarray]:
        fine = NEAREST_COLUMNS if first == NEAREST else FINE_COLUMNS
        if wide:
            fine = WIDE_FINE_COLUMNS
        wrong, light = wrong_columns(inside, exact[band], first, band, apply, **fine)
        column_errors = kernel_sampling_error.ColumnErrors()
        column_errors.add(wrong, light, first, inside.core)
        return column_errors.relative(), column_errors.deviation()

    relative, deviation = (
        np.max(part, axis=0) for part in zip(*(one(*place) for place in sorted(places_checked)))
    )
    return Core(reach, exact, relative, ELSEWHERE * deviation)


def wider_reach(frame: Frame, tiles: int) -> tuple[int, int]:
    """Return the reach (y, x) of an exact core of `tiles`; it is at most that of the frame."""
    return tuple(min(tiles, r) for r in frame.reach)


class CoreSize(NamedTuple):
    """A possible size of an exact core, and its cost."""

    tiles: int  # from the axis to the border
    quick: bool  # computing it takes no longer than the rings of the usual kernels


def wider_cores(frame: Frame) -> list[CoreSize]:
    """Return the possible sizes of an exact core larger than the usual one. Each is larger than the
    one before by the root of two; `MOST_SUMS` limits them.
    """
    sizes = []
    tiles = float(max(frame.core))
    usual = USUAL_SUMS * len(frame.edges_nm) * np.prod([r + 1.0 for r in frame.reach])
    while tiles < max(frame.reach):
        tiles = min(tiles * np.sqrt(2), max(frame.reach))
        sums = exact_sums(frame, wider_reach(frame, int(tiles)))
        if sums > MOST_SUMS:
            break
        sizes.append(CoreSize(int(tiles), sums <= usual))
    return sizes
