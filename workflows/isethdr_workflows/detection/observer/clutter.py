"""Mean and covariance of the channels over windows without objects, road by road.

Objects with similar boxes at similar rows share their windows: sizes are rounded to steps of a
factor of 1.2, and the row of the middle to a quarter of the height. A window at the same row and of
the same size shows the road at the same distance, because the camera has the same height.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..frame import Frame, level_of
from ..threads import at_once
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


def places(frame: Frame, size: Size, shape: Shape, wanted: int) -> Places:
    """Return the places of windows of a frame that have no road user in the box.

    Parameters
    ----------
    frame : scene through a camera.
    size : size of the box.
    shape : window of this size.
    wanted : number of windows; there are fewer if the frame has no room. Their places depend on the
        scene and the size alone, so all cameras and light levels get the same places.
    """
    height, width = shape.channels.shape
    rows, columns = frame.joined(size.level).shape[1:]
    if width > columns or height > rows:
        return Places(np.zeros(0, int), np.zeros(0, int))
    random = np.random.default_rng([frame.number, size.level, round(size.middle * 64)])
    left = random.integers(0, columns - width + 1, wanted * TRIES)
    jitter = np.round(random.uniform(-JITTER, JITTER, left.size) * size.height).astype(int)
    top = np.clip(shape.top + jitter, 0, rows - height)
    used = frame.used(size.level)
    y = np.minimum(top + shape.box[0], rows)
    x = left + shape.box[1]
    y_end = np.minimum(y + shape.box[2], rows)
    x_end = np.minimum(x + shape.box[3], columns)
    taken = used[y_end, x_end] - used[y, x_end] - used[y_end, x] + used[y, x]
    free = np.flatnonzero(taken == 0)[:wanted]
    return Places(top[free], left[free])


def outputs_at(picture: np.ndarray, at: Places, channels: Channels) -> np.ndarray:
    """Return the channel outputs (window, colour * channel) of windows of a picture.

    The windows have few different first rows. So the functions along y are applied to whole strips
    of the picture, and only the functions along x window by window.

    Parameters
    ----------
    picture : (colour, y, x) joined cells.
    at : first rows and columns of the windows.
    channels : channels on a window.
    """
    height, width = channels.shape
    tops, which = np.unique(at.top, return_inverse=True)
    strips = np.stack([channels.rows.T @ picture[:, top : top + height] for top in tops])
    # strips are (first row, colour, order along y, x); then windows of them at every x
    sliding = np.lib.stride_tricks.sliding_window_view(strips, width, axis=-1)
    return channels.chosen(sliding[which, :, :, at.left] @ channels.columns)


class Clutter:
    """The windows without objects of all frames of one camera, one level and one condition."""

    def __init__(self, frames: list[Frame], order: int, wanted: int) -> None:
        """Keep the frames. Windows are read when they are needed.

        Parameters
        ----------
        frames : frames of one camera, at one level of light and in one condition.
        order : highest order of the channels.
        wanted : number of windows of each scene and size.
        """
        self.frames = frames
        self.order = order
        self.wanted = wanted
        self._moments: dict[Size, dict[str, Moments]] = {}

    def shape(self, size: Size) -> Shape:
        """Return the window of a size."""
        return shape_of(size, self.frames[0].joined(size.level).shape[1], self.order)

    def outputs(self, frame: Frame, size: Size) -> np.ndarray:
        """Return the channel outputs (window, channel) of a frame's windows of a size."""
        shape = self.shape(size)
        at = places(frame, size, shape, self.wanted)
        picture = frame.joined(size.level)
        if not len(at.top):
            return np.zeros((0, len(picture) * len(shape.channels.pairs)))
        return outputs_at(picture, at, shape.channels)

    def prepare(self, sizes: Iterable[Size]) -> None:
        """Read the windows of some sizes, with as many threads as there are processors."""
        missing = [size for size in dict.fromkeys(sizes) if size not in self._moments]
        for level in {size.level for size in missing}:
            for frame in self.frames:
                frame.used(level)  # make shared tables first, or several threads would make them
                frame.joined(level)
        self._moments.update(zip(missing, at_once(self._of_roads, missing), strict=True))

    def others(self, size: Size, road: str) -> Moments:
        """Return the sums over the windows of a size on all roads except `road`."""
        if size not in self._moments:
            self._moments[size] = self._of_roads(size)
        kept = [moments for name, moments in self._moments[size].items() if name != road]
        if not kept:
            return Moments(0, np.zeros(0), np.zeros((0, 0)))
        return Moments(
            sum(m.count for m in kept),
            np.sum([m.total for m in kept], axis=0),
            np.sum([m.squares for m in kept], axis=0),
        )

    def _of_roads(self, size: Size) -> dict[str, Moments]:
        found: dict[str, Moments] = {}
        for frame in self.frames:
            seen = self.outputs(frame, size)
            mine = Moments(len(seen), seen.sum(0), seen.T @ seen)
            if (before := found.get(frame.road)) is not None:
                mine = Moments(
                    before.count + mine.count,
                    before.total + mine.total,
                    before.squares + mine.squares,
                )
            found[frame.road] = mine
        return found


def covariance(moments: Moments) -> np.ndarray:
    """Return the sample covariance (channel, channel) of at least two windows."""
    mean = moments.total / moments.count
    spread = moments.squares - moments.count * np.outer(mean, mean)
    return spread / (moments.count - 1)
