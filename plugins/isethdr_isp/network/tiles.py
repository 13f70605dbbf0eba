"""Tiles: a network over a picture of any size, in overlapping tiles without seams.

The picture is padded to whole tiles. Pixels beyond the border keep the phase of the filter array:
whole cells are mirrored, and each sample stays at its place within the cell. On a 2 x 2 array this
is a mirror about the outermost pixel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

Arrays = Mapping[str, np.ndarray]


class Padding(NamedTuple):
    """Rows, or columns, of a padded picture."""

    before: int  # of the padded picture, before the first pixel
    index: np.ndarray  # pixel of the picture at every place of the padded one


class Window(NamedTuple):
    """One tile along an axis: what goes in, and what of the result is kept."""

    start: int
    stop: int
    keep_from: int
    keep_to: int


@dataclass(frozen=True)
class Grid:
    """How a network wants its input cut."""

    cell: tuple[int, int]  # rows and columns of the filter array's period
    multiple: int  # rows and columns of an input are multiples of it
    overlap: int  # pixels at a tile's edge whose result is not used
    tile: tuple[int, int]  # rows and columns of the largest tile, multiples of `multiple`
    fixed: bool = False  # whether every tile has exactly this size


def padding(count: int, phase: int, period: int, target: int) -> Padding:
    """Return how an axis is padded to `target` places.

    Parameters
    ----------
    count : pixels of the picture along the axis.
    phase : place within the cell of the first pixel; so many pixels are put before it.
    period : of the filter array.
    target : places of the padded axis, `phase` + `count` or more.
    """
    place = np.arange(-phase, target - phase)
    last = count - 1
    while np.any((place < 0) | (place > last)):  # again for a picture of few cells
        cells_before = -(np.minimum(place, 0) // period)
        place = np.where(place < 0, place % period + period * (cells_before - 1), place)
        cells_after = -(-np.maximum(place - last, 0) // period)
        inside = place - period * cells_after
        place = np.where(place > last, inside - period * (cells_after - 1), place)
        if count < period:  # there is no pixel of every phase
            place = np.clip(place, 0, last)
    return Padding(phase, place)


def windows(size: int, tile: int, overlap: int) -> list[Window]:
    """Return the tiles along an axis of `size` places, which the kept parts cover once.

    Parameters
    ----------
    tile : places of a tile, more than twice `overlap`; one tile holds all where it is not smaller.
    overlap : at an edge inside the picture, so many results are not kept.
    size : places along the axis.
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
    size : places along the axis.
    grid : the largest tile, its overlap and multiples.
    axis : 0 of rows, 1 of columns.
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
    network : takes and returns arrays (1, plane, y, x) by name.
    planes : (plane, y, x) by name.
    phase : row and column of the cell at the first pixel.
    grid : how the network wants its input cut.
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
    """Return the padded size of an axis."""
    size = -(-count // multiple) * multiple
    return max(size, tile) if fixed else size


def _kept(window: Window, before: int, count: int) -> tuple[slice, slice]:
    """Return the pixels of the picture that a tile gives, and their places in the tile."""
    first = max(window.keep_from - before, 0)
    last = max(min(window.keep_to - before, count), first)
    shift = before - window.start
    return slice(first, last), slice(first + shift, last + shift)
