"""The difference between an object's window with the object and without it.

The cheap form estimates the background: it fills each cell of the object with the mean of the ring
around the object, weighted by 1 / distance^2 (Shepard 1968). It knows neither what the object hides
nor its shadow. The exact form takes the cells of the same view rendered without the object.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation

from ..frame import Frame, Layout, Part, Thing
from .clutter import Shape, Size

RING = 0.2  # width of the ring over the root of the object's area, as in `object_contrast`
FEWEST_RING = 4  # fewest cells in a ring from which an object is filled


class Seen(NamedTuple):
    """An object's window: its channel outputs, and what the object adds to them."""

    outputs: np.ndarray  # (channel,)
    difference: np.ndarray  # (channel,)
    render: np.ndarray | None = None  # (channel,) a value of the renderer's noise in `difference`


def seen(frame: Frame, thing: Thing, size: Size, shape: Shape, bare: Frame | None) -> Seen | None:
    """Return an object's window; None if the ring around it has too few cells to fill it from, or
    if the object lies beyond the last whole joined cells.

    Parameters
    ----------
    frame : scene through a camera.
    thing : object in the frame.
    size : rounded size of its box.
    shape : window of this size.
    bare : the same view rendered without objects; None: the object is filled from its ring.

    Notes
    -----
    The renderer's noise in the mean of the ring is small and left out. A second rendered view has
    as much noise as the first one, so the variance of the difference is doubled.
    """
    whole = frame.joined(size.level)
    outline = outline_of(frame.layout, thing, size.level)
    part = outline.part
    grown = outline.grown
    if not grown.any():
        return None
    picture = whole[:, *part]
    if bare is not None:
        change = np.where(grown, picture - bare.joined(size.level)[:, *part], 0.0)
    elif outline.ring is None:
        return None
    else:
        change = np.where(grown, picture - filled(picture, outline.ring), 0.0)
    left = round((thing.box[1] + thing.box[3] / 2) / 2**size.level - shape.channels.shape[1] / 2)
    added = part_of_window(change, part, shape, left)
    noise = frame.render_joined(size.level, part)
    render = None
    if noise is not None:
        of_object = part_of_window(np.where(grown, noise, 0.0), part, shape, left)
        render = shape.channels.of(of_object) * (np.sqrt(2) if bare is not None else 1.0)
    return Seen(shape.channels.of(window_at(whole, shape, left)), shape.channels.of(added), render)


class Ring(NamedTuple):
    """The cells of an object, and the cells around it from which they are filled."""

    window: Part  # rows and columns that hold both
    inner: np.ndarray  # (y, x) bool, cells of the object in the window
    around: np.ndarray  # (y, x) bool, cells around it in the window


class Outline(NamedTuple):
    """An object in joined cells."""

    part: Part  # rows and columns that hold the object and its ring
    grown: np.ndarray  # (y, x) bool, the object with the border cells into which its light blurs
    ring: Ring | None  # in the part; None if there are too few cells to fill the object from


def outline_of(layout: Layout, thing: Thing, level: int) -> Outline:
    """Return the outline of an object. It is the same at all levels of light.

    Parameters
    ----------
    layout : the road users in the cells.
    thing : the object.
    level : level of joined cells: 2^level x 2^level cells each.
    """
    key = thing.instance, level
    if key not in layout.outlines:
        part = around(layout.size(level), thing, level)
        grown = binary_dilation(layout.mask(level, thing.instance, part))
        # whole joined cells leave out the last rows or columns of a frame, and an object in them
        ring = ring_of(grown, layout.mask(level, 0, part)) if grown.any() else None
        layout.outlines[key] = Outline(part, grown, ring)
    return layout.outlines[key]


def around(cells: tuple[int, int], thing: Thing, level: int) -> Part:
    """Return the rows and columns of joined cells that hold an object with its border cells and the
    ring around it.

    Parameters
    ----------
    cells : number of rows and columns of joined cells.
    thing : object in the frame.
    level : level of joined cells: 2^level x 2^level cells each.
    """
    high, wide = (-(-side // 2**level) + 1 for side in thing.box[2:])
    # width of the ring for the largest area that the box with its border cells can have
    width = max(2, round(RING * math.sqrt((high + 2) * (wide + 2))))
    margin = width + 3
    ends = []
    for first, side, count in zip(thing.box[:2], thing.box[2:], cells, strict=True):
        start = max(first // 2**level - margin, 0)
        stop = min((first + side - 1) // 2**level + 1 + margin, count)
        ends.append(slice(start, stop))
    return ends[0], ends[1]


def ring_of(own: np.ndarray, users: np.ndarray) -> Ring | None:
    """Return the ring around an object; None if the ring has too few cells without road users.

    Parameters
    ----------
    own : (y, x) bool, cells to fill.
    users : (y, x) bool, cells of all road users.
    """
    width = max(2, round(RING * float(np.sqrt(own.sum()))))
    rows, columns = np.nonzero(own)
    margin = width + 1
    top = max(int(rows.min()) - margin, 0)
    left = max(int(columns.min()) - margin, 0)
    window = (
        slice(top, int(rows.max()) + margin + 1),
        slice(left, int(columns.max()) + margin + 1),
    )
    inner = own[window]
    around = binary_dilation(inner, iterations=width) & ~inner & ~users[window]
    if around.sum() < FEWEST_RING:
        return None
    return Ring(window, inner, around)


def filled(picture: np.ndarray, ring: Ring) -> np.ndarray:
    """Return a picture with the cells of an object filled from the ring around it.

    Parameters
    ----------
    picture : (colour, y, x) joined cells.
    ring : the object's cells and the ring.
    """
    to = np.argwhere(ring.inner)
    of = np.argwhere(ring.around)
    weights = 1.0 / ((to[:, None, :] - of[None, :, :]) ** 2).sum(-1)
    weights /= weights.sum(1, keepdims=True)
    whole = picture.copy()
    part = whole[(slice(None), *ring.window)]
    part[:, ring.inner] = part[:, ring.around] @ weights.T
    return whole


def window_at(layer: np.ndarray, shape: Shape, left: int) -> np.ndarray:
    """Return a window (colour, y, x) of a layer. Cells outside the layer repeat its border.

    Parameters
    ----------
    layer : (colour, y, x) joined cells.
    shape : window: its size and its first row.
    left : first column of the window.
    """
    height, width = shape.channels.shape
    rows = shape.top + np.arange(height)[:, None]
    columns = left + np.arange(width)
    return layer[:, np.clip(rows, 0, layer.shape[1] - 1), np.clip(columns, 0, layer.shape[2] - 1)]


def part_of_window(values: np.ndarray, part: Part, shape: Shape, left: int) -> np.ndarray:
    """Return a window (colour, y, x) of a layer that is 0 outside a part.

    Parameters
    ----------
    values : (colour, y, x) joined cells of the part.
    part : rows and columns of the part in the layer.
    shape : window: its size and its first row.
    left : first column of the window.
    """
    window = np.zeros((len(values), *shape.channels.shape))
    of_window = []
    of_part = []
    for first, size, cut in zip((shape.top, left), shape.channels.shape, part, strict=True):
        start = max(first, cut.start)
        stop = max(min(first + size, cut.stop), start)
        of_window.append(slice(start - first, stop - first))
        of_part.append(slice(start - cut.start, stop - cut.start))
    window[:, *of_window] = values[:, *of_part]
    return window
