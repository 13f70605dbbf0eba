"""One scene through one camera: stabilised colours in cells of the filter array, and objects.

A cell is one period of the filter array. For each colour it holds the mean of its pixels'
stabilised values times the square root of their number, so that the noise of a cell is 1. Larger
objects are read in joined cells of 2 x 2, 4 x 4, ... cells, which also have a noise of 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
class Frame:
    """One scene through one camera at one level of light.

    Parameters
    ----------
    colours : (colour, y, x) stabilised cells, with noise 1.
    owners : (y, x) instance number of the road user in each cell, 0 for none.
    render : (colour, y, x) half of the difference of the renderer's half buffers, in the
        unit of `colours`; None if the scene has no half buffers.
    """

    number: int
    road: str
    condition: str
    colours: np.ndarray
    owners: np.ndarray
    things: tuple[Thing, ...]
    render: np.ndarray | None = None
    _joined: dict[int, np.ndarray] = field(default_factory=dict)
    _sums: dict[int, np.ndarray] = field(default_factory=dict)
    _renders: dict[int, np.ndarray] = field(default_factory=dict)

    def joined(self, level: int) -> np.ndarray:
        """Return the colours (colour, y, x) in joined cells of 2^level x 2^level cells, noise 1."""
        if level not in self._joined:
            self._joined[level] = self.colours if level == 0 else pairs(self.joined(level - 1))
        return self._joined[level]

    def render_joined(self, level: int) -> np.ndarray | None:
        """Return `render` in joined cells of 2^level x 2^level cells."""
        if self.render is None:
            return None
        if level not in self._renders:
            joined = self.render
            for _ in range(level):
                joined = pairs(joined)
            self._renders[level] = joined
        return self._renders[level]

    def mask(self, level: int, instance: int = 0, part: Part = EVERYWHERE) -> np.ndarray:
        """Return a mask (y, x) of the joined cells that hold a road user.

        Parameters
        ----------
        level : level of joined cells: 2^level x 2^level cells each.
        instance : number of the object; 0: all road users.
        part : rows and columns of joined cells that are wanted.
        """
        scale = 2**level
        rows, columns = (
            slice(cut.start and cut.start * scale, cut.stop and cut.stop * scale) for cut in part
        )
        owners = self.owners[rows, columns]
        own = owners == instance if instance else owners > 0
        for _ in range(level):
            height, width = (size // 2 * 2 for size in own.shape)
            even = own[:height, :width]
            own = even[::2, ::2] | even[1::2, ::2] | even[::2, 1::2] | even[1::2, 1::2]
        return own

    def used(self, level: int) -> np.ndarray:
        """Return the running sums (y + 1, x + 1) over the mask of all road users."""
        if level not in self._sums:
            sums = self.mask(level).astype(np.int32).cumsum(0).cumsum(1)
            self._sums[level] = np.pad(sums, ((1, 0), (1, 0)))
        return self._sums[level]


def noisier(frame: Frame) -> Frame:
    """Return a frame with twice the variance of the renderer's noise.

    Half of the difference of the half buffers has the same variance as the noise of their mean and
    is independent of it. Adding it to the frame gives the noise of a renderer with half the
    samples. A frame without half buffers is returned as it is.
    """
    if frame.render is None:
        return frame
    return replace(
        frame,
        colours=frame.colours + frame.render,
        render=frame.render * np.float32(np.sqrt(2)),
        _joined={},
        _sums={},
        _renders={},
    )


def pairs(colours: np.ndarray) -> np.ndarray:
    """Return sums over 2 x 2 cells, divided by 2, so that independent noise of 1 stays 1."""
    rows, columns = (size // 2 * 2 for size in colours.shape[1:])
    even = colours[:, :rows, :columns]
    return (even[:, ::2, ::2] + even[:, 1::2, ::2] + even[:, ::2, 1::2] + even[:, 1::2, 1::2]) / 2


def cells(values: np.ndarray, filters: np.ndarray, period: tuple[int, int]) -> np.ndarray:
    """Return the colours (colour, y, x) of the cells of a mosaic.

    Parameters
    ----------
    values : (y, x) stabilised pixels.
    filters : (y, x) channel of each pixel.
    period : rows and columns of a cell.
    """
    rows, columns = period
    height, width = (size // side for size, side in zip(values.shape, period, strict=True))
    cell = filters[:rows, :columns]
    out = []
    for channel in np.unique(cell):
        own = np.argwhere(cell == channel)
        total = np.zeros((height, width))
        for down, across in own:
            total += values[down : height * rows : rows, across : width * columns : columns]
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
