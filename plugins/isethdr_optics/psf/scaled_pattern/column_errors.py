"""Column errors: how wrong kernels are, by direct sums over the pupil in a few columns of tiles."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.physics.optics import pattern_columns

from ...pupil import sampled_pupil
from .. import kernel_sampling_error
from .rings import USUAL, Rings

if TYPE_CHECKING:
    from .frame import Frame

COLUMNS = 8  # of tiles, looked at together; of wide ones, which hold more speckles,
WIDE_COLUMNS = 2
# times their errors' deviation is stated: whole kernels showed up to 1.5, most below 1.2
ELSEWHERE = 1.25


class Errors(NamedTuple):
    """How wrong kernels are beyond the exact core, per octave of radius; the largest of the bands
    looked at.
    """

    relative: np.ndarray  # mean magnitude per tile
    deviation: np.ndarray  # as `kernel_sampling_error.deviation`
    mean: float  # largest relative error of an octave's light as a whole


def errors(
    frame: Frame,
    half_kernels: np.ndarray,
    read: Rings = USUAL,
    apply: Callable = map,
) -> Errors:
    """Return what direct sums over the pupil say of kernels, in four groups of eight columns of
    tiles, and a fifth for clean round pupils.

    Columns cross all octaves beyond their own. Long wavelengths err most near the core, where they
    hold the fewest speckles, short ones far from it, where they ask most of the lattice.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    half_kernels : (band, y, x) of `halves`: the half plane from the axis on.
    read : how finely rings are read.
    apply : `map`, or the `map` of a pool of threads.
    """
    if frame.core == frame.reach:
        return Errors(*np.zeros((2, kernel_sampling_error.OCTAVES)), 0.0)
    order = np.argsort(frame.edges_nm[:, 0])
    near_column, middle_column, far_column = _checked_columns(frame)
    short = order[0]
    long = order[-1]
    far = (far_column, *_border_columns(frame))
    places_checked = {
        ((near_column,), short),
        ((near_column,), long),
        ((middle_column,), long),
        (far, short),
    }

    def one(columns: tuple[int, ...], band: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        column_errors = kernel_sampling_error.ColumnErrors()
        half = half_kernels[band]
        for first in columns:
            wrong, light = wrong_columns(frame, half, first, band, apply, **read.columns)
            column_errors.add(wrong, light, first, frame.core)
        return column_errors.relative(), column_errors.deviation(), np.abs(column_errors.mean())

    relative, deviation, mean = (
        np.max(part, axis=0) for part in zip(*(one(*place) for place in sorted(places_checked)))
    )
    return of_whole_kernels(relative, deviation, float(mean.max()))


def _checked_columns(frame: Frame) -> tuple[int, int, int]:
    """Return the first tiles of columns near the core, in the middle, and far out."""
    reach = frame.reach[1]
    last = max(2, reach + 1 - columns_together(frame))
    near_column = min(frame.core[1] + 1, last)
    far_column = min(max(near_column, int(0.75 * reach)), last)
    return near_column, int(np.sqrt(near_column * far_column)), far_column


def _border_columns(frame: Frame) -> list[int]:
    """Return the first tile of columns at the border of a clean round pupil's frame, whose rings of
    light err alike in many tiles: there they err three times as much as in the far columns.
    """
    if not sampled_pupil.round_and_clean(frame.lens, frame.flares):
        return []
    return [max(2, frame.reach[1] + 1 - columns_together(frame))]


def checked_columns(frame: Frame) -> list[int]:
    """Return the first tile of every group of columns that `errors` compares with direct sums."""
    if frame.core == frame.reach:
        return []
    near_column, middle_column, far_column = _checked_columns(frame)
    return [near_column, near_column, middle_column, far_column, *_border_columns(frame)]


def of_whole_kernels(relative: np.ndarray, deviation: np.ndarray, mean: float) -> Errors:
    """Return the errors of kernels from the largest, per octave, of a few columns of tiles.

    Parameters
    ----------
    relative : largest error per tile of a few columns, per octave of distance, relative; changed in
        place.
    deviation : the same of `kernel_sampling_error.deviation`.
    mean : relative error of the mean of the tiles of a column.
    """
    # of a small frame, corners lie in an octave that no column crosses: as wrong as the one before
    outermost = int(np.flatnonzero(relative).max(initial=0))
    for values in (relative, deviation):
        values[outermost + 1 :] = values[outermost]
    return Errors(relative, ELSEWHERE * deviation, mean)


def columns_together(frame: Frame) -> int:
    """Return how many columns of tiles are looked at together."""
    return WIDE_COLUMNS if frame.has_wide_tiles else COLUMNS


def wrong_columns(
    frame: Frame,
    half: np.ndarray,
    first: int,
    band: int,
    apply: Callable = map,
    **fine: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the error and the light, (y, column), of a few columns of tiles.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    half : (y, x) half plane of one band's kernel.
    first : column, tiles from the axis.
    band : index of the band.
    apply : `map`, or the `map` of a pool of threads.
    **fine : fields of a `pattern_columns.Place`: how finely light is summed.
    """
    count = min(columns_together(frame), frame.reach[1] + 1 - first)
    edges = tuple(float(sampled_pupil.scaled_nm(frame.lens, w)) for w in frame.edges_nm[band])
    place = pattern_columns.Place(first, count, frame.reach[0], frame.pitch_um, edges, **fine)
    light = pattern_columns.columns(frame.pupil(frame.shortest_nm), place, apply)
    middle = frame.reach[1]
    right = half[:, middle + first : middle + first + count]
    mirrored = half[:0:-1, middle - first - count + 1 : middle - first + 1][:, ::-1]
    return np.concatenate([mirrored, right]) - light, light
