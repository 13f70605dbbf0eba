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

# of a row of cells. With 3 single tiles along y, 150 tiles from the axis, err by 2e-4, with 5 by
# 6e-5
STRIPS = 5.0
# of direct sums. Beside the axis light falls so steeply that they take half the step, and twice the
# strips for the ends of the columns
FINE_COLUMNS = {"step": 0.1, "moves": 0.25, "period": 6.0, "strips": 3.0}
NEAREST_COLUMNS = {**FINE_COLUMNS, "step": 0.05, "strips": 6.0}
# over wide tiles, as `WIDE`
WIDE_FINE_COLUMNS = {"step": 0.5, "moves": 0.5, "period": 6.0, "strips": 3.0}
NEAREST = 8  # tiles from the axis: nearer, no error of a wider core was found
MOST_SUMS = 1e11  # of a wider core: some 6 CPU seconds
USUAL_SUMS = 8e3  # for every value of the kernels: as long as the other rings take


class Core(NamedTuple):
    """An exact core wider than the usual one."""

    reach: tuple[int, int]  # (y, x) tiles from the axis
    halves: np.ndarray  # as `exact_halves`
    relative: np.ndarray  # mean magnitude of the error per tile, per octave
    deviation: np.ndarray  # of light of any pattern, as `kernel_sampling_error.deviation`


def wider_core(frame: Frame, tiles: int, apply: Callable = map) -> Core:
    """Return an exact core of `tiles`, with its error against direct sums over the pupil.

    Direct sums are finer than in `errors`, because the error of the core is smaller.

    Parameters
    ----------
    frame : of the kernels.
    tiles : from the axis to the border of the core. `apply` : `map`, or that of a pool of threads.
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
    """Return the reach (y, x) of an exact core of `tiles`, at most that of the frame."""
    return tuple(min(tiles, r) for r in frame.reach)


class CoreSize(NamedTuple):
    """A size that an exact core can have, and what it takes."""

    tiles: int
    quick: bool  # it takes no longer than the rings of the usual kernels


def wider_cores(frame: Frame) -> list[CoreSize]:
    """Return the sizes that an exact core of a frame can have: each time the root of two wider than
    the usual one, as far as `MOST_SUMS` lets it.
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
