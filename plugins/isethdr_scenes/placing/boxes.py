"""Oriented boxes on the ground: what a thing occupies, and whether two of them overlap.

Two boxes are apart where one of the four directions of their sides, or the vertical, separates them
(separating axes; Gottschalk, Lin and Manocha 1996, in plan).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..things.furniture.street_lamps import POLE_RADIUS_M, pole_x_m
from ..things.furniture.traffic_lights import MAST_M, pole_y_m
from ..things.people.riders import Rider
from ..things.thing import Thing

FIELDS = 9  # values of a box: x, y, half length, half width, cos, sin, bottom, top, level
# height from the top of a mast to the lowest point of its arm and of what hangs from the arm
MAST_CLEARANCE_M = 1.1


class Solid(NamedTuple):
    """A box of a thing in the thing's own axes: middle and size in plan, bottom and top, m."""

    x_m: float
    y_m: float
    length_m: float
    width_m: float
    bottom_m: float
    top_m: float


def solids(thing: Thing) -> tuple[Solid, ...]:
    """Return the boxes that a thing occupies.

    Most things have one box. A mast has a box of its post and a box of what hangs over the ground.
    """
    length, width, height = thing.size_m
    if isinstance(thing, Rider) and not thing.vehicle_shown:
        x, y, z = thing.centre_m
        return (Solid(x, y, length, width, z - height / 2, z + height / 2),)
    under = height - MAST_CLEARANCE_M
    if thing.family == "mast_arm":
        side = 2 * POLE_RADIUS_M
        return (
            Solid(pole_x_m(thing), 0.0, side, side, 0.0, height),
            Solid(0.0, 0.0, length, width, under, height),
        )
    if thing.family == "signal_mast":
        side = 2 * MAST_M
        return (
            Solid(side / 2 - length / 2, pole_y_m(thing), side, side, 0.0, height),
            Solid(0.0, 0.0, length, width, under, height),
        )
    if thing.family == "high_mast":
        return (
            Solid(0.0, 0.0, 0.4, 0.4, 0.0, height),
            Solid(0.0, 0.0, length, width, height - 0.6, height),
        )
    return (Solid(0.0, 0.0, length, width, 0.0, height),)


def rows(
    parts: tuple[Solid, ...], at: tuple[float, float, float], scale: float = 1.0, level: int = 0
) -> np.ndarray:
    """Return boxes (n, FIELDS) of a thing at its place in the world.

    Parameters
    ----------
    parts : boxes of the thing in its own axes, m.
    at : place x and y of the thing, m, and its heading, radians.
    scale : factor on all lengths.
    level : 1 on a bridge, else 0.
    """
    x, y, heading = at
    cos = np.cos(heading)
    sin = np.sin(heading)
    s = scale * np.asarray(parts, float)
    out = np.empty((len(s), FIELDS))
    out[:, 0] = x + cos * s[:, 0] - sin * s[:, 1]
    out[:, 1] = y + sin * s[:, 0] + cos * s[:, 1]
    out[:, 2:4] = s[:, 2:4] / 2
    out[:, 4], out[:, 5], out[:, 8] = cos, sin, level
    out[:, 6:8] = s[:, 4:6]
    return out


def overlapping(one: np.ndarray, many: np.ndarray, gap_m: float = 0.0) -> np.ndarray:
    """Return which boxes (n,) of `many` are closer than `gap_m` to the box `one`.

    Parameters
    ----------
    one : (FIELDS,) a box, as a row of `rows`.
    many : (n, FIELDS) boxes.
    gap_m : distance in plan below which two boxes overlap, m.
    """
    x, y, hx, hy, cos, sin, bottom, top, level = one
    mx, my, mhx, mhy, mcos, msin, mbottom, mtop, mlevel = many.T
    dx = mx - x
    dy = my - y
    c = np.abs(cos * mcos + sin * msin)
    s = np.abs(cos * msin - sin * mcos)
    apart = np.abs(dx * cos + dy * sin) >= hx + mhx * c + mhy * s + gap_m
    apart |= np.abs(dy * cos - dx * sin) >= hy + mhx * s + mhy * c + gap_m
    apart |= np.abs(dx * mcos + dy * msin) >= mhx + hx * c + hy * s + gap_m
    apart |= np.abs(dy * mcos - dx * msin) >= mhy + hx * s + hy * c + gap_m
    apart |= (bottom >= mtop) | (mbottom >= top) | (level != mlevel)
    return ~apart


def carrier(thing: Thing) -> Thing:
    """Return what carries a thing: the vehicle of a rider, else the thing itself."""
    if isinstance(thing, Rider) and thing.vehicle is not None:
        return thing.vehicle
    return thing


class Taken:
    """The boxes that are occupied already."""

    def __init__(self) -> None:
        self._rows = np.empty((256, FIELDS))
        self._count = 0

    @property
    def boxes(self) -> np.ndarray:
        """Return the boxes (n, FIELDS) that are occupied."""
        return self._rows[: self._count]

    def free(self, boxes: np.ndarray, gap_m: float) -> bool:
        """Return whether `boxes` (n, FIELDS) are at least `gap_m`, m, from all occupied boxes."""
        return not any(overlapping(box, self.boxes, gap_m).any() for box in boxes)

    def add(self, boxes: np.ndarray) -> None:
        """Mark boxes (n, FIELDS) as occupied."""
        needed = self._count + len(boxes)
        while needed > len(self._rows):
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        self._rows[self._count : needed] = boxes
        self._count = needed


def corners(boxes: np.ndarray) -> np.ndarray:
    """Return the corners and the middles of the sides (n, 8, 2) of boxes (n, FIELDS) in plan."""
    sides = np.array([(1, 1), (1, -1), (-1, -1), (-1, 1), (1, 0), (-1, 0), (0, 1), (0, -1)], float)
    along = sides[None] * boxes[:, None, 2:4]
    cos = boxes[:, 4, None]
    sin = boxes[:, 5, None]
    return np.stack(
        [
            boxes[:, 0, None] + cos * along[..., 0] - sin * along[..., 1],
            boxes[:, 1, None] + sin * along[..., 0] + cos * along[..., 1],
        ],
        -1,
    )
