"""Tiles: a network over a picture of any size, in overlapping tiles without seams.

The picture is padded to whole tiles. Pixels beyond the border keep the phase of the filter array:
whole cells are mirrored, and each sample keeps its position within the cell. On a 2 x 2 array, the
first row or column beyond the border is that of a mirror about the outermost pixel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

Arrays = Mapping[str, np.ndarray]


class Padding(NamedTuple):
    """Padding of a picture along one axis."""

    before: int  # number of rows or columns added before the first pixel
    index: np.ndarray  # index of the picture's row or column at each position of the padded picture


class Window(NamedTuple):
    """One tile along an axis: the input range, and the range of results that are kept."""

    start: int
    stop: int  # exclusive
    keep_from: int
    keep_to: int  # exclusive


@dataclass(frozen=True)
class Grid:
    """Rules for dividing the input of a network into tiles."""

    cell: tuple[int, int]  # rows and columns of the filter array's period
    multiple: int  # rows and columns of a tile are multiples of this number
    overlap: int  # number of pixels at an inner edge of a tile with results that are not used
    tile: tuple[int, int]  # rows and columns of the largest tile, multiples of `multiple`
    fixed: bool = False  # whether every tile has exactly this size


def padding(count: int, phase: int, period: int, target: int) -> Padding:
    """Return the padding of an axis to the length `target`.

    Parameters
    ----------
    count : number of pixels of the picture along the axis.
    phase : position of the first pixel within the cell; this number of pixels is added before it.
    period : period of the filter array.
    target : length of the padded axis, at least `phase` + `count`.
    """
    place = np.arange(-phase, target - phase)
    last = count - 1
    while np.any((place < 0) | (place > last)):  # more than once for a picture of few cells
        cells_before = -(np.minimum(place, 0) // period)
        place = np.where(place < 0, place % period + period * (cells_before - 1), place)
        cells_after = -(-np.maximum(place - last, 0) // period)
        inside = place - period * cells_after
        place = np.where(place > last, inside - period * (cells_after - 1), place)
        if count < period:  # some phases have no pixel
            place = np.clip(place, 0, last)
    return Padding(phase, place)


def windows(size: int, tile: int, overlap: int) -> list[Window]:
    """Return the tiles along an axis. Their kept parts cover each position once.

    Parameters
    ----------
    size : length of the axis.
    tile : length of a tile, more than twice `overlap`. If it is at least `size`, there is one tile.
    overlap : number of results at an edge inside the picture that are not kept.
    """
    if size <= tile:
        return [Window(0, size, 0, size)]
    step = tile - 2 * overlap
    starts = [*range(0, size - tile, step), size - tile]
    edges = [0, *(start + overlap for start in starts[1:]), size]
    return [
        Window(start, start + tile, first, last)
        for start, first, last in zip(starts, edges[:-1], edges[1:], strict=True)
    ]


def even_tile(size: int, grid: Grid, axis: int) -> int:
    """Return the smallest tile along an axis that needs no more tiles than the largest one.

    Parameters
    ----------
    size : length of the axis.
    grid : the largest tile, its overlap and multiples.
    axis : 0 for rows, 1 for columns.
    """
    largest = grid.tile[axis]
    if size <= largest or grid.fixed:
        return largest
    shared = size - 2 * grid.overlap
    count = -(-shared // (largest - 2 * grid.overlap))
    tile = -(-shared // count) + 2 * grid.overlap
    return -(-tile // grid.multiple) * grid.multiple


def tiled(
    network: Callable[[Arrays], Arrays], planes: Arrays, phase: tuple[int, int], grid: Grid
) -> dict[str, np.ndarray]:
    """Return the results (plane, y, x) of a network on planes of any size.

    Parameters
    ----------
    network : function from arrays (1, plane, y, x) by name to such arrays by name.
    planes : (plane, y, x) by name.
    phase : row and column of the cell at the first pixel.
    grid : rules for dividing the input into tiles.
    """
    height, width = next(iter(planes.values())).shape[1:]
    whole = [
        _whole(n + first, grid.multiple, side, grid.fixed)
        for n, first, side in zip((height, width), phase, grid.tile)
    ]
    rows, columns = (
        padding(n, first, period, target)
        for n, first, period, target in zip((height, width), phase, grid.cell, whole)
    )
    results: dict[str, np.ndarray] = {}
    for down, across in _tiles(whole, grid):
        index = np.ix_(
            rows.index[down.start : down.stop], columns.index[across.start : across.stop]
        )
        seen = network({name: plane[(slice(None), *index)][None] for name, plane in planes.items()})
        into, of = zip(
            *(
                _kept(w, pad.before, n)
                for w, pad, n in ((down, rows, height), (across, columns, width))
            )
        )
        for name, values in seen.items():
            shape = (values.shape[1], height, width)
            target = results.setdefault(name, np.empty(shape, values.dtype))
            target[(slice(None), *into)] = values[(0, slice(None), *of)]
    return results


def _tiles(size: list[int], grid: Grid) -> Iterator[tuple[Window, Window]]:
    across = windows(size[1], even_tile(size[1], grid, 1), grid.overlap)
    for down in windows(size[0], even_tile(size[0], grid, 0), grid.overlap):
        for window in across:
            yield down, window


def _whole(count: int, multiple: int, tile: int, fixed: bool) -> int:
    """Return the padded length of an axis."""
    size = -(-count // multiple) * multiple
    return max(size, tile) if fixed else size


def _kept(window: Window, before: int, count: int) -> tuple[slice, slice]:
    """Return the slice of the picture that a tile fills, and the slice of the tile's results."""
    first = max(window.keep_from - before, 0)
    last = max(min(window.keep_to - before, count), first)
    shift = before - window.start
    return slice(first, last), slice(first + shift, last + shift)
