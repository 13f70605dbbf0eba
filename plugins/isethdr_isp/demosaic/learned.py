"""Learned demosaic: one small linear filter for every position of the filter array and every local
class.

Local, linear, learned (Jiang, Tian, Farrell, Wandell 2017): a table of 7 x 7 filters, chosen by
`local_classes`. The weights of every filter sum to 1 over the samples of its own channel and to 0
over those of each other channel. The mean of a flat field of any colour is therefore correct in
every class. Values are limited to the range of the samples around them. The classes depend on the
noise, so no variance is stated.

`isethdr study train_demosaic` trains the table on simulated pictures. `provenance` returns its
origin.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from functools import cache, lru_cache
from pathlib import Path

import numpy as np

from isethdr_core.errors import UnitError

from .local_classes import classes

RADIUS = 3  # pixels of a filter on each side of its centre
SIDE = 2 * RADIUS + 1  # rows and columns of a filter
TABLE = Path(__file__).with_name("learned_filters.npz")
# number of pixels computed at a time, so that their samples stay in the processor's cache
AT_ONCE = 1 << 11
LETTERS = "RGBW"  # order of the channels


def learned(
    mosaic: np.ndarray,
    filters: np.ndarray,
    names: list[str],
    variance: np.ndarray,
    table: dict[str, np.ndarray] | None = None,
) -> np.ndarray:
    """Return the channels (channel, y, x) of a mosaic of electrons.

    Parameters
    ----------
    mosaic, variance : (y, x) samples, electrons, and their variance, e^2; samples are independent.
    filters : (y, x) index into `names` of each pixel's channel.
    names : letters of the channels.
    table : {array: filters}, as `load` returns them; None: the shipped filters.

    Raises
    ------
    UnitError : no filters are trained for this array, or the picture is smaller than a filter.
    """
    filters = np.asarray(filters)
    if min(filters.shape) < SIDE:
        raise UnitError(
            f"a picture of {filters.shape} pixels is smaller than the learned filters; "
            f"expected {SIDE} rows and columns or more; use isp.demosaic=bilinear"
        )
    if table is None:
        trained = _shipped(filters.tobytes(), filters.dtype.str, filters.shape, tuple(names))
    else:
        trained = matching(filters, names, table)
    samples = neighbourhoods(mosaic, trained.shape[:2])
    planes = np.empty((len(names), *filters.shape))
    for weights, at in _blocks(trained, classes(mosaic, filters, variance)):
        planes[(slice(None), *at)] = weights @ samples[at].reshape(len(at[0]), -1).T
    return within_samples(planes, mosaic, filters)


def within_samples(planes: np.ndarray, mosaic: np.ndarray, filters: np.ndarray) -> np.ndarray:
    """Limit planes (channel, y, x), in place, to the range of each channel's own samples in the
    window of a filter, and return them.

    Next to a lamp that is brighter than all steps in the training, filters with negative weights
    would otherwise make pixels black.

    Parameters
    ----------
    planes : demosaiced electrons (channel, y, x); changed in place.
    mosaic : samples (y, x), electrons.
    filters : (y, x) number of the channel that each pixel samples.
    """
    for channel, plane in enumerate(planes):
        at = filters == channel
        low = _of_windows(np.minimum, np.where(at, mosaic, np.inf))
        high = _of_windows(np.maximum, np.where(at, mosaic, -np.inf))
        np.clip(plane, low, high, out=plane)
    return planes


def _of_windows(extreme: np.ufunc, values: np.ndarray) -> np.ndarray:
    """Return the smallest or largest value (y, x) in the window of a filter around every pixel,
    mirrored at the border. `extreme` is np.minimum or np.maximum.

    The values of 2, then of 4, then of 7 neighbours are compared along each axis, which takes half
    of the time of seven comparisons.
    """
    found = np.pad(values, RADIUS, mode="reflect")
    for axis in (0, 1):
        found = np.moveaxis(found, axis, 0)
        for shift in (1, 2, SIDE - 4):
            found = extreme(found[:-shift], found[shift:])
        found = np.moveaxis(found, 0, axis)
    return found


def _blocks(trained: np.ndarray, kinds: np.ndarray) -> Iterator[tuple]:
    """Yield a filter (channel, tap) and the (row, column) indices of at most `AT_ONCE` pixels that
    use it.

    Parameters
    ----------
    trained : (row, column, class, channel, tap) filters.
    kinds : (y, x) class of every pixel.
    """
    rows, columns = trained.shape[:2]
    for y, x in np.ndindex(rows, columns):
        kinds_of_phase = kinds[y::rows, x::columns].astype(np.uint8)
        order = np.argsort(kinds_of_phase, axis=None, kind="stable")  # radix sort for one byte
        counts = np.bincount(kinds_of_phase.ravel(), minlength=trained.shape[2])
        ends = np.concatenate([[0], np.cumsum(counts)])
        for kind, (first, last) in enumerate(zip(ends[:-1], ends[1:], strict=True)):
            for start in range(first, last, AT_ONCE):
                block = order[start : min(start + AT_ONCE, last)]
                row, column = np.unravel_index(block, kinds_of_phase.shape)
                yield trained[y, x, kind], (row * rows + y, column * columns + x)


def neighbourhoods(image: np.ndarray, cell_shape: tuple[int, int]) -> np.ndarray:
    """Return (y, x, 7, 7), the samples around every pixel. Beyond the border, the outermost cell is
    repeated.
    """
    inside = [_inside(n, period) for n, period in zip(image.shape, cell_shape)]
    return np.lib.stride_tricks.sliding_window_view(image[np.ix_(*inside)], (SIDE, SIDE))


def _inside(count: int, period: int) -> np.ndarray:
    """Return the indices within 0..count - 1 that replace -3..count + 2, each at the same phase of
    the array.
    """
    index = np.arange(-RADIUS, count + RADIUS)
    index[index < 0] %= period
    past_end = index >= count
    index[past_end] = count - period + (index[past_end] - count) % period
    return np.clip(index, 0, count - 1)  # for a picture smaller than a cell


def matching(filters: np.ndarray, names: list[str], table: dict[str, np.ndarray]) -> np.ndarray:
    """Return the filters (row, column, class, channel, tap) of a filter array.

    Parameters
    ----------
    filters : (y, x) number of the channel that each pixel samples.
    names : name of each channel.
    table : {repeated cell of a filter array, such as "RG/GB": trained filters}.

    Raises
    ------
    UnitError : no filters are trained for this array.
    """
    letters = np.array(names)[filters]
    for cell, trained in table.items():
        tile = cell_of(cell)
        for dy, dx in np.ndindex(tile.shape):
            rolled = np.roll(tile, (-dy, -dx), (0, 1))
            if np.array_equal(
                rolled[np.ix_(*(np.arange(n) % k for n, k in zip(letters.shape, tile.shape)))],
                letters,
            ):
                order = [channels_of(cell).index(name) for name in names]
                return np.roll(trained, (-dy, -dx), (0, 1))[:, :, :, order]
    raise UnitError(
        f"no learned filters for this filter array; expected one of {', '.join(table)}, shifted or"
        " not; use isp.demosaic=guided"
    )


@lru_cache(maxsize=8)  # every picture of a run has the same few arrays
def _shipped(data: bytes, dtype: str, shape: tuple[int, ...], names: tuple[str, ...]) -> np.ndarray:
    """Return `matching` of the shipped filters, for a filter array given as the bytes of its
    numbers. The result is cached and must not be changed.
    """
    return matching(np.frombuffer(data, dtype).reshape(shape), list(names), load())


def is_shifted(rows: Sequence[str], cell: str) -> bool:
    """Return whether an array that repeats `rows` is the array of `cell`, shifted or not."""
    tile = cell_of(cell)
    rows_of_array = np.array([list(row) for row in rows])
    size = np.lcm(tile.shape, rows_of_array.shape)
    tiled, tiled_other = (np.tile(t, size // t.shape) for t in (tile, rows_of_array))
    return any(
        np.array_equal(np.roll(tiled, s, (0, 1)), tiled_other) for s in np.ndindex(tile.shape)
    )


@cache
def arrays() -> tuple[str, ...]:
    """Return the filter arrays for which the shipped filters are trained."""
    with np.load(TABLE) as table:
        return tuple(cell for cell in table.files if cell != "provenance")


def cell_of(cell: str) -> np.ndarray:
    """Return the letters (row, column) of a cell written with its rows parted by /."""
    return np.array([list(row) for row in cell.split("/")])


def channels_of(cell: str) -> list[str]:
    """Return the letters of a cell, each once, in the order of channels."""
    return sorted(set(cell) - {"/"}, key=LETTERS.index)


def sampled(cell: str) -> np.ndarray:
    """Return which taps (row, column, channel, tap) sample which channel."""
    tile = cell_of(cell)
    names = channels_of(cell)
    is_sampled = np.empty((*tile.shape, len(names), SIDE * SIDE), bool)
    for y, x in np.ndindex(tile.shape):
        window = tile[
            np.ix_(*(np.arange(k - RADIUS, k + RADIUS + 1) % n for k, n in zip((y, x), tile.shape)))
        ]
        is_sampled[y, x] = [(window == name).ravel() for name in names]
    return is_sampled


def exact(filters: np.ndarray, cell: str) -> np.ndarray:
    """Return filters (row, column, class, channel, tap), adjusted so that their weights sum exactly
    to 1 over their own channel and to 0 over every other.
    """
    taps = sampled(cell)[:, :, None]  # row, column, 1, sampled channel, tap
    sums = np.einsum(
        "yxkct,yxkst->yxkcs",
        filters,
        np.broadcast_to(taps, (*filters.shape[:3], *taps.shape[3:])).astype(float),
    )
    lacking = np.eye(filters.shape[3]) - sums
    return filters + np.einsum(
        "yxkcs,yxst->yxkct", lacking / taps.sum(-1)[:, :, :, None, :], taps[:, :, 0].astype(float)
    )


@cache
def load() -> dict[str, np.ndarray]:
    """Return {array: shipped filters (row, column, class, channel, tap)}. They are stored in half
    precision; `exact` restores the sums of the weights.
    """
    with np.load(TABLE) as table:
        return {
            cell: exact(table[cell].astype(float), cell)
            for cell in table.files
            if cell != "provenance"
        }


def provenance() -> dict:
    """Return the origin of the shipped filters: recipe, its hash, and the training pictures."""
    with np.load(TABLE) as table:
        return json.loads(str(table["provenance"]))
