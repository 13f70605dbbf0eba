"""One scene through one camera: stabilised colours in cells of the filter array, and objects.

A cell is one period of the filter array. For each colour it holds the mean of its pixels'
stabilised values times the square root of their number, so that the noise of a cell is 1. Larger
objects are read in joined cells of 2 x 2, 4 x 4, ... cells, which also have a noise of 1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.ndimage import find_objects

MOST_CELLS = 24  # most cells along the longer side of a box; for larger boxes, cells are joined
CLASSES = {
    "car": ("car",),
    "truck": ("truck", "bus"),
    "person": ("person",),
    "rider": (),
    "animal": ("cat", "dog", "horse", "sheep", "cow", "deer", "boar", "fox"),
}
ROAD_USERS = tuple(name for names in CLASSES.values() for name in names)
OTHER_USERS = ("bicycle", "motorcycle")
Part = tuple[slice, slice]  # rows and columns, joined cells
EVERYWHERE: Part = (slice(None), slice(None))
# half differences (colour, y, x) of the cells in some rows and columns
RenderOf = Callable[[slice, slice], np.ndarray]
# stabilised pixels (y, x) at one row and column of all cells, of one channel
PixelsOf = Callable[[int, int, int], np.ndarray]
Boxes = dict[int, tuple[int, int, int, int]]  # {number: (top, left, height, width)}
RIDER = "rider of "  # the name of a rider is this text and the name of the bicycle


@dataclass(frozen=True)
class Thing:
    """An object of one of the five classes in a frame.

    Parameters
    ----------
    box : (top, left, height, width) of its visible part, in cells.
    height_px : height of its visible part, pixels.
    illuminance_lx : vertical illuminance towards the camera; NaN if it is not known.
    near_lamp : whether a bright lamp is seen within 3 degrees of its middle.
    """

    instance: int
    name: str
    kind: str
    distance_m: float
    illuminance_lx: float
    near_lamp: bool
    box: tuple[int, int, int, int]
    height_px: float


@dataclass(eq=False)
class Layout:
    """The road users in the cells of a camera. Frames of one scene at all levels of light share it,
    and so do cameras with the same cells.

    Parameters
    ----------
    owners : (y, x) instance number of the road user in each cell, 0 for none.
    places : first rows and columns of windows without road users, by size and number of windows.
    outlines : masks of an object and of the ring around it, by instance and level of joined cells.
    """

    owners: np.ndarray
    places: dict[Any, Any] = field(default_factory=dict)
    outlines: dict[tuple[int, int], Any] = field(default_factory=dict)

    def size(self, level: int) -> tuple[int, int]:
        """Return the numbers of rows and columns of the frame in joined cells. A joined cell has
        2^level x 2^level cells.
        """
        rows, columns = self.owners.shape
        return rows >> level, columns >> level

    def mask(self, level: int, instance: int = 0, part: Part = EVERYWHERE) -> np.ndarray:
        """Return a mask (y, x) of the joined cells that hold a road user.

        Parameters
        ----------
        level : level of joined cells: 2^level x 2^level cells each.
        instance : number of the object; 0: all road users.
        part : rows and columns of joined cells that are wanted.
        """
        owners = self.owners[in_cells(part[0], level), in_cells(part[1], level)]
        own = owners == instance if instance else owners > 0
        for _ in range(level):
            height, width = (size // 2 * 2 for size in own.shape)
            even = own[:height, :width]
            own = even[::2, ::2] | even[1::2, ::2] | even[::2, 1::2] | even[1::2, 1::2]
        return own

    def used(self, level: int) -> np.ndarray:
        """Return the running sums (y + 1, x + 1) over the mask of all road users."""
        sums = self.mask(level).astype(np.int32).cumsum(0).cumsum(1)
        return np.pad(sums, ((1, 0), (1, 0)))


@dataclass(eq=False, kw_only=True)
class SceneObjects:
    """One scene through one camera: its light, its objects, and the cells that they take.

    Parameters
    ----------
    condition : kind of light.
    layout : the road users in the cells.
    things : the objects that the observer looks for.
    """

    number: int
    road: str
    condition: str
    layout: Layout
    things: tuple[Thing, ...]


@dataclass(eq=False, kw_only=True)
class Frame(SceneObjects):
    """One scene through one camera at one level of light.

    Parameters
    ----------
    colours : (colour, y, x) stabilised cells, with noise 1; NaN outside `rows`.
    render : (colour, y, x) half of the difference of the renderer's half buffers, in the
        unit of `colours`; or a function that returns it for some rows and columns of cells; None
        if the scene has no half buffers.
    rows : rows of cells that are known. Both ends are the border, or multiples of the largest
        joined cells that are read.
    """

    colours: np.ndarray
    render: np.ndarray | RenderOf | None = None
    rows: slice = field(default_factory=lambda: slice(None))
    _joined: dict[int, np.ndarray] = field(default_factory=dict)

    def joined(self, level: int) -> np.ndarray:
        """Return the colours (colour, y, x) of joined cells, each of 2^level x 2^level cells. Their
        noise has a standard deviation of 1.
        """
        if level not in self._joined:
            self._joined[level] = self.colours if level == 0 else self._next(level)
        return self._joined[level]

    def _next(self, level: int) -> np.ndarray:
        finer = self.joined(level - 1)
        start, stop, _ = self.rows.indices(self.colours.shape[1])
        known = slice(start >> level, stop >> level)
        out = np.full((len(finer), *self.layout.size(level)), np.nan, finer.dtype)
        out[:, known] = pairs(finer[:, 2 * known.start : 2 * known.stop])
        return out

    def render_joined(self, level: int, part: Part = EVERYWHERE) -> np.ndarray | None:
        """Return `render` in joined cells of 2^level x 2^level cells.

        Parameters
        ----------
        level : level of joined cells.
        part : rows and columns of joined cells that are wanted.
        """
        if self.render is None:
            return None
        rows = in_cells(part[0], level)
        columns = in_cells(part[1], level)
        if isinstance(self.render, np.ndarray):
            joined = self.render[:, rows, columns]
        else:
            joined = self.render(rows, columns)
        for _ in range(level):
            joined = pairs(joined)
        return joined


def in_cells(cut: slice, level: int) -> slice:
    """Return the rows or columns of cells of a slice of joined cells."""
    scale = 2**level
    return slice(cut.start and cut.start * scale, cut.stop and cut.stop * scale)


def noisier(frame: Frame) -> Frame:
    """Return a frame with twice the variance of the renderer's noise.

    Half of the difference of the half buffers has the same variance as the noise of their mean and
    is independent of it. Adding it to the frame gives the noise of a renderer with half the
    samples. A frame without half buffers is returned as it is.
    """
    start, stop, _ = frame.rows.indices(frame.colours.shape[1])
    if start >= stop:  # no object is looked for, so no cell is read
        return frame
    known = slice(start, stop)
    half = frame.render_joined(0, (known, slice(None)))
    if half is None:
        return frame
    render = np.full(frame.colours.shape, np.nan, half.dtype)
    render[:, known] = half
    return replace(
        frame,
        colours=frame.colours + render,
        render=render * np.float32(np.sqrt(2)),
        _joined={},
    )


def pairs(colours: np.ndarray) -> np.ndarray:
    """Return sums over 2 x 2 cells, divided by 2, so that independent noise of 1 stays 1."""
    rows, columns = (size // 2 * 2 for size in colours.shape[1:])
    even = colours[:, :rows, :columns]
    return (even[:, ::2, ::2] + even[:, 1::2, ::2] + even[:, ::2, 1::2] + even[:, 1::2, 1::2]) / 2


def cells(pixels: PixelsOf, cell: np.ndarray) -> np.ndarray:
    """Return the colours (colour, y, x) of the cells of a mosaic.

    Parameters
    ----------
    pixels : function(row, column, channel) of the stabilised pixels (y, x) at one row and column of
        all cells.
    cell : (y, x) channel of each pixel of a cell.
    """
    out = []
    for channel in np.unique(cell):
        own = np.argwhere(cell == channel)
        total: np.ndarray | float = 0.0
        for down, across in own:
            total = total + pixels(int(down), int(across), int(channel))
        out.append(total / np.sqrt(len(own)))
    return np.stack(out)


def owners_of(instance: np.ndarray, objects: Sequence[Mapping[str, Any]]) -> np.ndarray:
    """Return the number (y, x) of the road user in each pixel, 0 for none.

    A bicycle with a rider counts as part of its rider.

    Parameters
    ----------
    instance : (y, x) labels.
    objects : table of objects.
    """
    by_name = {str(row["name"]): int(row["instance"]) for row in objects}
    table = np.zeros(int(instance.max(initial=0)) + 1, np.int32)
    for row in objects:
        number = int(row["instance"])
        if number >= len(table) or row["category"] not in (*ROAD_USERS, *OTHER_USERS):
            continue
        table[number] = by_name.get(RIDER + str(row["name"]), number)
    return table[instance]


def kind_of(row: Mapping[str, Any]) -> str:
    """Return the class of an object; empty if it is none of the five."""
    if str(row["name"]).startswith(RIDER):
        return "rider"
    return next((kind for kind, of in CLASSES.items() if row["category"] in of), "")


def boxes(owners: np.ndarray) -> Boxes:
    """Return {number: (top, left, height, width)} of the visible part of each road user."""
    numbers, rank = np.unique(owners.ravel(), return_inverse=True)
    found = find_objects(rank.reshape(owners.shape) + 1)
    return {
        int(number): (
            window[0].start,
            window[1].start,
            window[0].stop - window[0].start,
            window[1].stop - window[1].start,
        )
        for number, window in zip(numbers, found, strict=True)
        if number
    }


def level_of(box: tuple[int, int, int, int]) -> int:
    """Return how often cells are joined, so that a box is at most `MOST_CELLS` of them long."""
    return max(0, int(np.ceil(np.log2(max(box[2:]) / MOST_CELLS))))
