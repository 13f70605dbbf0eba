"""Mean and covariance of the channels over windows without objects, road by road.

Objects with similar boxes at similar rows share their windows: sizes are rounded to steps of a
factor of 1.2, and the row of the middle to a quarter of the height. A window at the same row and of
the same size shows the road at the same distance, because the camera has the same height.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..frame import Frame, SceneObjects, level_of
from .channels import REACH, Channels, channels

STEP = 1.2  # ratio between neighbouring sizes of boxes
ROW_STEP = 0.25  # distance between neighbouring rows of boxes, as a share of the box's height
LEAST_CELLS = 3.0  # least height and width of a box, cells; smaller boxes count as this large
TRIES = 6  # number of places that are tried for each wanted window
KEPT_SHAPES = 4096  # largest number of shapes that are kept in memory
JITTER = 0.1  # largest shift of a window up or down, as a share of the box's height


class Size(NamedTuple):
    """A rounded box: level of joined cells, and in joined cells its height, width and the row of
    its middle.
    """

    level: int
    height: float
    width: float
    middle: float


@dataclass(frozen=True, eq=False)
class Moments:
    """Sums over the windows of one road."""

    count: int
    total: np.ndarray  # (channel,)
    squares: np.ndarray  # (channel, channel)


@dataclass(frozen=True, eq=False)
class Shape:
    """The window of a size: its channels, its first row, and the box within it."""

    channels: Channels
    top: int
    box: tuple[int, int, int, int]  # top, left, height, width in the window


def size_of(box: tuple[int, int, int, int]) -> Size:
    """Return the rounded size of a box (top, left, height, width) in cells."""
    level = level_of(box)
    scale = 2**level
    height, width = (
        STEP ** round(np.log(max(v / scale, LEAST_CELLS)) / np.log(STEP)) for v in box[2:]
    )
    step = ROW_STEP * height
    middle = round((box[0] + box[2] / 2) / scale / step) * step
    return Size(level, float(height), float(width), float(middle))


@lru_cache(maxsize=KEPT_SHAPES)
def shape_of(size: Size, rows: int, order: int) -> Shape:
    """Return the window of a size in a frame. Cameras and levels of light share it.

    Parameters
    ----------
    size : size of the box.
    rows : rows of the frame, in joined cells. A window is cut at the upper and the lower border.
    order : highest order of the channels.
    """
    top = max(int(np.floor(size.middle - REACH * size.height)), 0)
    bottom = min(int(np.ceil(size.middle + REACH * size.height)), rows)
    width = 2 * int(np.ceil(REACH * size.width)) + 1
    middle = (size.middle - top, width / 2)
    made = channels((max(bottom - top, 1), width), middle, (size.height, size.width), order)
    box_top = int(max(np.floor(middle[0] - size.height / 2), 0))
    box_left = int(max(np.floor(middle[1] - size.width / 2), 0))
    return Shape(
        made, top, (box_top, box_left, int(np.ceil(size.height)), int(np.ceil(size.width)))
    )


class Places(NamedTuple):
    """First rows and columns (window,) of windows in a picture."""

    top: np.ndarray
    left: np.ndarray


class Search(NamedTuple):
    """The windows that the observer reads in each scene of one kind of light.

    Parameters
    ----------
    sizes : sizes of the objects of all scenes.
    rows : rows of cells of a frame.
    order : highest order of the channels.
    wanted : number of windows of each scene and size.
    """

    sizes: tuple[Size, ...]
    rows: int
    order: int
    wanted: int

    def shape(self, size: Size) -> Shape:
        """Return the window of a size."""
        return shape_of(size, self.rows >> size.level, self.order)


def searches(scenes: Sequence[SceneObjects], order: int, wanted: int) -> dict[str, Search]:
    """Return {kind of light: windows that are read}.

    Parameters
    ----------
    scenes : scenes through one camera.
    order : highest order of the channels.
    wanted : number of windows of each scene and size.
    """
    found = {}
    for condition in dict.fromkeys(scene.condition for scene in scenes):
        alike = [scene for scene in scenes if scene.condition == condition]
        sizes = dict.fromkeys(size_of(thing.box) for scene in alike for thing in scene.things)
        rows = alike[0].layout.size(0)[0]
        found[condition] = Search(tuple(sizes), rows, order, wanted)
    return found


def places(scene: SceneObjects, size: Size, search: Search) -> Places:
    """Return the places of windows of a scene that have no road user in the box. There are fewer
    than wanted if the frame has no room. The places depend on the scene and the size alone, so all
    light levels get the same ones, and all cameras get the same columns.

    Parameters
    ----------
    scene : scene through a camera.
    size : size of the box.
    search : windows of this size, and their number.
    """
    known = scene.layout.places
    if (size, search) not in known:
        used: dict[int, np.ndarray] = {}  # running sums are large, so they are not kept
        for each in dict.fromkeys((size, *search.sizes)):
            if each.level not in used:
                used[each.level] = scene.layout.used(each.level)
            known[each, search] = _places(scene, each, search, used[each.level])
    return known[size, search]


def _places(scene: SceneObjects, size: Size, search: Search, used: np.ndarray) -> Places:
    shape = search.shape(size)
    height, width = shape.channels.shape
    rows, columns = scene.layout.size(size.level)
    if width > columns or height > rows:
        return Places(np.zeros(0, int), np.zeros(0, int))
    random = np.random.default_rng([scene.number, size.level, round(size.middle * 64)])
    left = random.integers(0, columns - width + 1, search.wanted * TRIES)
    jitter = np.round(random.uniform(-JITTER, JITTER, left.size) * size.height).astype(int)
    top = np.clip(shape.top + jitter, 0, rows - height)
    y = np.minimum(top + shape.box[0], rows)
    x = left + shape.box[1]
    y_end = np.minimum(y + shape.box[2], rows)
    x_end = np.minimum(x + shape.box[3], columns)
    taken = used[y_end, x_end] - used[y, x_end] - used[y_end, x] + used[y, x]
    free = np.flatnonzero(taken == 0)[: search.wanted]
    return Places(top[free], left[free])


def window_rows(scene: SceneObjects, size: Size, search: Search) -> slice:
    """Return the rows of joined cells that hold the windows of a size, with and without objects.

    Parameters
    ----------
    scene : scene through a camera.
    size : size of the box.
    search : windows of this size.
    """
    shape = search.shape(size)
    height = shape.channels.shape[0]
    rows = scene.layout.size(size.level)[0]
    tops = [shape.top, *places(scene, size, search).top]
    # a window beyond the border repeats the row at the border
    first = min(int(min(tops)), rows - 1)
    return slice(first, min(int(max(tops)) + height, rows))


def outputs_at(picture: np.ndarray, at: Places, channels: Channels) -> np.ndarray:
    """Return the channel outputs (window, colour * channel) of windows of a picture.

    The windows have few different first rows. So the functions along y are applied to whole strips
    of the picture, and only the functions along x window by window.

    Parameters
    ----------
    picture : (colour, y, x) joined cells; float64 is fastest, because other types are converted
        for each row.
    at : first rows and columns of the windows.
    channels : channels on a window.
    """
    height, width = channels.shape
    tops, which = np.unique(at.top, return_inverse=True)
    strips = np.stack([channels.rows.T @ picture[:, top : top + height] for top in tops])
    # strips are (first row, colour, order along y, x); then windows of them at every x
    sliding = np.lib.stride_tricks.sliding_window_view(strips, width, axis=-1)
    return channels.chosen(sliding[which, :, :, at.left] @ channels.columns)


def outputs(frame: Frame, size: Size, search: Search, picture: np.ndarray) -> np.ndarray:
    """Return the channel outputs (window, channel) of a frame's windows of a size.

    Parameters
    ----------
    frame : scene through a camera.
    size : size of the box.
    search : windows of this size.
    picture : (colour, y, x) joined cells of the frame, at the level of the size.
    """
    shape = search.shape(size)
    at = places(frame, size, search)
    if not len(at.top):
        return np.zeros((0, len(picture) * len(shape.channels.pairs)))
    return outputs_at(picture, at, shape.channels)


def moments_of(windows: np.ndarray) -> Moments:
    """Return the sums over the windows of one scene, from channel outputs (window, channel)."""
    return Moments(len(windows), windows.sum(0), windows.T @ windows)


class Clutter:
    """The windows without objects of all scenes of one camera, one level and one condition."""

    def __init__(self, scenes: Sequence[tuple[str, dict[Size, Moments]]]) -> None:
        """Add up the windows of each road.

        Parameters
        ----------
        scenes : road and sums of each scene.
        """
        self._moments: dict[Size, dict[str, Moments]] = {}
        for road, of_sizes in scenes:
            for size, mine in of_sizes.items():
                roads = self._moments.setdefault(size, {})
                before = roads.get(road)
                roads[road] = mine if before is None else _sum(before, mine)

    def others(self, size: Size, road: str) -> Moments:
        """Return the sums over the windows of a size on all roads except `road`."""
        kept = [moments for name, moments in self._moments[size].items() if name != road]
        if not kept:
            return Moments(0, np.zeros(0), np.zeros((0, 0)))
        return Moments(
            sum(m.count for m in kept),
            np.sum([m.total for m in kept], axis=0),
            np.sum([m.squares for m in kept], axis=0),
        )


def _sum(one: Moments, other: Moments) -> Moments:
    return Moments(one.count + other.count, one.total + other.total, one.squares + other.squares)


def covariance(moments: Moments) -> np.ndarray:
    """Return the sample covariance (channel, channel) of at least two windows."""
    mean = moments.total / moments.count
    spread = moments.squares - moments.count * np.outer(mean, mean)
    return spread / (moments.count - 1)
