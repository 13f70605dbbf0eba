"""An object's window with the object less without it, the ring around it filled in.

The cheap form: the cells of the object are filled from the ring around it, each with the mean of
the ring weighted by 1 / distance^2 (Shepard 1968). It knows neither what the object hides nor its
shadow. The honest form takes the cells of the same view rendered without the object.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation

from ..frame import Frame, Thing
from .clutter import Shape, Size

RING = 0.2  # width / square root of the object's area, as of the metric `object_contrast`
FEWEST_RING = 4  # cells


class Seen(NamedTuple):
    """An object's window: its channel outputs, and what the object adds to them."""

    outputs: np.ndarray  # (channel,)
    difference: np.ndarray  # (channel,)
    render: np.ndarray | None = None  # (channel,) of the renderer's noise in `difference`


def seen(frame: Frame, thing: Thing, size: Size, shape: Shape, bare: Frame | None) -> Seen | None:
    """Return an object's window; None where nothing is left around it to fill it from.

    Parameters
    ----------
    bare : the same view rendered without objects; None: the ring fills.

    Notes
    -----
    The renderer's noise of the ring's mean is left out, for it is small. A view rendered again has
    as much noise as the first one, so its variance counts twice.
    """
    picture = frame.joined(size.level)
    own = frame.mask(size.level, thing.instance)
    grown = binary_dilation(own)  # the border cells that its light blurs into
    if bare is not None:
        change = np.where(grown, picture - bare.joined(size.level), 0.0)
    else:
        filled = ring_filled(picture, grown, frame.mask(size.level))
        if filled is None:
            return None
        change = np.where(grown, picture - filled, 0.0)
    left = round((thing.box[1] + thing.box[3] / 2) / 2**size.level - shape.channels.shape[1] / 2)
    inside = np.ones((1, *picture.shape[1:]))
    added = window_at(change, shape, left) * window_at(inside, shape, left, "constant")
    noise = frame.render_joined(size.level)
    render = None
    if noise is not None:
        of_object = window_at(np.where(grown, noise, 0.0), shape, left, "constant")
        render = shape.channels.of(of_object) * (np.sqrt(2) if bare is not None else 1.0)
    return Seen(
        shape.channels.of(window_at(picture, shape, left)), shape.channels.of(added), render
    )


def ring_filled(picture: np.ndarray, own: np.ndarray, users: np.ndarray) -> np.ndarray | None:
    """Return a picture with the cells of an object filled from the ring around it; None where the
    ring has too few cells without road users.

    Parameters
    ----------
    picture : (colour, y, x). `own` : (y, x) bool, cells to fill. `users` : of all road users.
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
    to = np.argwhere(inner)
    of = np.argwhere(around)
    weights = 1.0 / ((to[:, None, :] - of[None, :, :]) ** 2).sum(-1)
    weights /= weights.sum(1, keepdims=True)
    filled = picture.copy()
    part = filled[(slice(None), *window)]
    part[:, inner] = part[:, around] @ weights.T
    return filled


def window_at(layer: np.ndarray, shape: Shape, left: int, beyond: str = "edge") -> np.ndarray:
    """Return the window (colour, y, x) of a layer whose first column is `left`.

    Parameters
    ----------
    beyond : cells outside the layer: edge repeats its border, constant is 0.
    """
    height, width = shape.channels.shape
    rows = shape.top + np.arange(height)[:, None]
    columns = left + np.arange(width)
    values = layer[:, np.clip(rows, 0, layer.shape[1] - 1), np.clip(columns, 0, layer.shape[2] - 1)]
    if beyond == "edge":
        return values
    within = (rows >= 0) & (rows < layer.shape[1]) & (columns >= 0) & (columns < layer.shape[2])
    return np.where(within, values, 0.0)
