"""Column errors: errors of kernels against direct sums over the pupil in a few columns of tiles."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isethdr_core.physics.optics import pattern_columns

from ...pupil import pupil_phase, pupil_size
from .. import kernel_sampling_error
from .rings import USUAL, Rings

if TYPE_CHECKING:
    from .frame import Frame

COLUMNS = 8  # number of adjacent columns of tiles that are compared together
WIDE_COLUMNS = 2  # the same for wide tiles, which hold more speckles
# factor on the deviation of errors in the columns, to state that of whole kernels: ratios up to 1.5
# were found, most below 1.2
ELSEWHERE = 1.25


class Errors(NamedTuple):
    """Relative errors of kernels beyond the exact core, per octave of radius; the largest of all
    bands that were compared.
    """

    relative: np.ndarray  # (octave,) mean magnitude per tile
    deviation: np.ndarray  # (octave,) as `kernel_sampling_error.deviation`
    mean: float  # largest relative error of the total light of an octave


class Checked(NamedTuple):
    """Groups of columns of one band, and their light by direct sums."""

    band: int  # index of the band
    firsts: tuple[int, ...]  # first column of each group, tiles from the axis
    light: tuple[np.ndarray, ...]  # (y, column) light of each group


def direct_sums(frame: Frame, read: Rings = USUAL, apply: Callable = map) -> list[Checked]:
    """Return the light of a few columns of tiles, computed by direct sums over the pupil. The list
    is empty if the exact core covers the frame.

    There are four groups of `columns_together` columns, and a fifth for clean round pupils. Columns
    cross all octaves beyond their own. Errors of long wavelengths are largest near the core, where
    a tile holds the fewest of their speckles. Errors of short wavelengths are largest far from it,
    where the lattice resolves them least.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    read : sampling of the rings and of the direct sums.
    apply : `map`, or the `map` of a pool of threads.
    """
    if frame.core == frame.reach:
        return []
    order = np.argsort(frame.edges_nm[:, 0])
    near_column, middle_column, far_column = _checked_columns(frame)
    short = int(order[0])
    long = int(order[-1])
    far = (far_column, *_border_columns(frame))
    places = {
        ((near_column,), short),
        ((near_column,), long),
        ((middle_column,), long),
        (far, short),
    }
    return [
        Checked(
            band,
            firsts,
            tuple(_light(frame, first, band, apply, **read.columns) for first in firsts),
        )
        for firsts, band in sorted(places)
    ]


def errors(frame: Frame, half_kernels: np.ndarray, sums: list[Checked]) -> Errors:
    """Return the errors of kernels against direct sums over the pupil.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    half_kernels : (band, y, x) result of `halves`: the half plane from the axis on.
    sums : result of `direct_sums`.
    """
    if not sums:
        return Errors(*np.zeros((2, kernel_sampling_error.OCTAVES)), 0.0)

    def one(checked: Checked) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        column_errors = kernel_sampling_error.ColumnErrors()
        half = half_kernels[checked.band]
        for first, light in zip(checked.firsts, checked.light, strict=True):
            wrong = _columns_of(frame, half, first, light.shape[1]) - light
            column_errors.add(wrong, light, first, frame.core)
        return column_errors.relative(), column_errors.deviation(), np.abs(column_errors.mean())

    relative, deviation, mean = (np.max(part, axis=0) for part in zip(*map(one, sums)))
    return of_whole_kernels(relative, deviation, float(mean.max()))


def _checked_columns(frame: Frame) -> tuple[int, int, int]:
    """Return the first columns, in tiles from the axis, of the groups near the core, in the middle,
    and far out.
    """
    reach = frame.reach[1]
    last = max(2, reach + 1 - columns_together(frame))
    near_column = min(frame.core[1] + 1, last)
    far_column = min(max(near_column, int(0.75 * reach)), last)
    return near_column, int(np.sqrt(near_column * far_column)), far_column


def _border_columns(frame: Frame) -> list[int]:
    """Return the first column of the group at the border of a clean round pupil's frame; none for
    other pupils.

    The errors of such a pupil's diffraction rings are correlated over many tiles. At the border
    they are three times as large as in the far columns.
    """
    if not pupil_phase.round_and_clean(frame.lens, frame.flares):
        return []
    return [max(2, frame.reach[1] + 1 - columns_together(frame))]


def checked_columns(frame: Frame) -> list[int]:
    """Return the first column, in tiles from the axis, of every group of columns that `errors`
    compares with direct sums.
    """
    if frame.core == frame.reach:
        return []
    near_column, middle_column, far_column = _checked_columns(frame)
    return [near_column, near_column, middle_column, far_column, *_border_columns(frame)]


def of_whole_kernels(relative: np.ndarray, deviation: np.ndarray, mean: float) -> Errors:
    """Return the errors of whole kernels from those of a few columns of tiles.

    Parameters
    ----------
    relative : (octave,) largest relative error per tile of the columns; it is changed in place.
    deviation : (octave,) the same for `kernel_sampling_error.deviation`; it is changed in place.
    mean : largest relative error of the total light of an octave.
    """
    # the corners of a small frame lie in an octave that no column crosses: it gets the error of the
    # octave before
    outermost = int(np.flatnonzero(relative).max(initial=0))
    for values in (relative, deviation):
        values[outermost + 1 :] = values[outermost]
    return Errors(relative, ELSEWHERE * deviation, mean)


def columns_together(frame: Frame) -> int:
    """Return the number of adjacent columns of tiles that are compared together."""
    return WIDE_COLUMNS if frame.has_wide_tiles else COLUMNS


def wrong_columns(
    frame: Frame,
    half: np.ndarray,
    first: int,
    band: int,
    apply: Callable = map,
    **fine: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the error and the light, each (y, column), of a few columns of tiles.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    half : (y, x) half plane of one band's kernel.
    first : first column, tiles from the axis.
    band : index of the band.
    apply : `map`, or the `map` of a pool of threads.
    **fine : fields of a `pattern_columns.Place`: sampling of the direct sums.
    """
    light = _light(frame, first, band, apply, **fine)
    return _columns_of(frame, half, first, light.shape[1]) - light, light


def _light(
    frame: Frame, first: int, band: int, apply: Callable[..., Any], **fine: float
) -> np.ndarray:
    """Return the light (y, column) of a few columns of tiles by direct sums; parameters as in
    `wrong_columns`.
    """
    count = min(columns_together(frame), frame.reach[1] + 1 - first)
    edges = tuple(float(pupil_size.scaled_nm(frame.lens, w)) for w in frame.edges_nm[band])
    place = pattern_columns.Place(first, count, frame.reach[0], frame.pitch_um, edges, **fine)
    return pattern_columns.columns(frame.pupil(frame.shortest_nm), place, apply)


def _columns_of(frame: Frame, half: np.ndarray, first: int, count: int) -> np.ndarray:
    """Return columns (y, column) of a whole kernel, of which `half` (y, x) is the half plane.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    half : (y, x) half plane of the kernel.
    first : first column, tiles from the axis.
    count : number of columns.
    """
    middle = frame.reach[1]
    right = half[:, middle + first : middle + first + count]
    mirrored = half[:0:-1, middle - first - count + 1 : middle - first + 1][:, ::-1]
    return np.concatenate([mirrored, right])
