"""Windows and doors of a front, lit or not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.mesh.piece import Piece
from ..thing import Detail
from .parts import boxes, quads, shining

FRAME_M = 0.07  # width of a frame
SILL_M = 0.12  # depth of a sill in front of its wall
BAR_M = 0.05  # width of a bar
# distance of a pane in front of its wall
PANE_OUT_M = {"near": 0.035, "middle": 0.035, "far": 0.012}


@dataclass(frozen=True)
class Front:
    """A wall that faces along an axis: the middle of its foot, its outward normal, its width."""

    name: str
    foot: tuple[float, float]  # x and y of the middle of its foot, m
    outward: tuple[int, int]  # (1, 0), (-1, 0), (0, 1) or (0, -1)
    width_m: float

    @property
    def right(self) -> np.ndarray:
        """Return the unit vector to the right, as seen by a viewer in front of the wall."""
        return np.array([-self.outward[1], self.outward[0], 0.0])

    @property
    def normal(self) -> np.ndarray:
        """Return the outward unit vector."""
        return np.array([*self.outward, 0.0], float)

    def at(
        self, right_m: float | np.ndarray, up_m: float | np.ndarray, out_m: float = 0.0
    ) -> np.ndarray:
        """Return points (..., 3), m, on the wall or in front of it.

        Parameters
        ----------
        right_m : distance to the right of the wall's middle, as seen from outside, m; any shape.
        up_m : height above its foot, m; broadcasts with `right_m`.
        out_m : distance in front of the wall, m; broadcasts with both.
        """
        right, up, out = np.broadcast_arrays(np.asarray(right_m, float), up_m, out_m)
        foot = np.array([*self.foot, 0.0])
        height = np.stack([0 * up, 0 * up, up], -1)
        return foot + right[..., None] * self.right + out[..., None] * self.normal + height

    def size(self, width_m: float, height_m: float, depth_m: float) -> np.ndarray:
        """Return the size (3,) of a box along x, y and z, m.

        Parameters
        ----------
        width_m : size along the wall, m.
        height_m : size upwards, m.
        depth_m : size across the wall, m.
        """
        return np.abs(self.right) * width_m + np.abs(self.normal) * depth_m + [0, 0, height_m]


@dataclass(frozen=True)
class Openings:
    """Windows of the same size: their middles on the front, and which of them are lit."""

    right_m: np.ndarray  # (n,) distances of their middles to the right of the wall's middle
    up_m: np.ndarray  # (n,) heights of their middles
    width_m: float
    height_m: float
    lit: np.ndarray  # (n,) bool
    kind: str = "window"  # kind of lamp of the lit panes
    cd_m2: float = 10.0


def windows(front: Front, openings: Openings, detail: Detail) -> list[Piece]:
    """Return the windows of a front: panes, frames, bars and sills. The lit panes are one lamp.

    Parameters
    ----------
    front : the wall.
    openings : places and sizes of its windows, and which of them are lit.
    detail : level of detail; `far` has only panes.
    """
    o = openings
    if not len(o.right_m):
        return []
    out = PANE_OUT_M[detail]
    half_w = o.width_m / 2
    half_h = o.height_m / 2
    corners = np.stack(
        [
            front.at(o.right_m + sign_r * half_w, o.up_m + sign_z * half_h, out)
            for sign_r, sign_z in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ],
        1,
    )
    pieces = []
    if (~o.lit).any():
        pieces.append(quads(corners[~o.lit], "pane", "window_dark"))
    if o.lit.any():
        panes = quads(corners[o.lit], f"{o.kind} {front.name}", "window_dark")
        area = 4 * half_w * half_h * int(o.lit.sum())
        pieces.append(shining(panes, o.kind, front.normal, o.cd_m2 * area))
    if detail == "far":
        return pieces
    middle = front.at(o.right_m, o.up_m, 0.0)
    frame = front.size(o.width_m + 2 * FRAME_M, o.height_m + 2 * FRAME_M, 0.05)
    pieces.append(boxes(middle, frame, "frame", "lamp_white"))
    if detail == "near" and o.kind == "window":
        before = front.at(o.right_m, o.up_m, out + 0.01)
        bar = front.size(BAR_M, o.height_m, 0.03)
        sill = front.size(o.width_m + 0.2, 0.05, 2 * SILL_M)
        under = front.at(o.right_m, o.up_m - half_h - 0.06, 0.0)
        pieces += [
            boxes(before, bar, "bar", "lamp_white"),
            boxes(under, sill, "sill", "concrete"),
        ]
    return pieces


def door(front: Front, right_m: float, width_m: float, height_m: float, material: str) -> Piece:
    """Return a door in a front.

    Parameters
    ----------
    front : the wall.
    right_m : middle of the door, to the right of the wall's middle, m.
    width_m, height_m : size of the door, m.
    material : name of its material.
    """
    size = front.size(width_m, height_m, 0.12)
    return boxes(front.at(right_m, height_m / 2, 0.0), size, "door", material)


def fronts(depth_m: float, width_m: float) -> tuple[Front, Front, Front, Front]:
    """Return the front, back, left and right wall of a building with its front towards +x."""
    return (
        Front("front", (depth_m / 2, 0.0), (1, 0), width_m),
        Front("back", (-depth_m / 2, 0.0), (-1, 0), width_m),
        Front("left", (0.0, width_m / 2), (0, 1), depth_m),
        Front("right", (0.0, -width_m / 2), (0, -1), depth_m),
    )
