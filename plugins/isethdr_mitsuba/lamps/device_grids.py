"""Grids of luminance on the device: the pattern of lamps that have a table of candela."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .intensity_grid import COLUMNS, ROWS
from .placed_lamps import PlacedLamp

NONE = -1.0  # marks a lamp without a grid, in place of the number of its first cell


class DeviceGrids:
    """Device tables of the grids of lamps. If no lamp has a grid, no code is compiled for them."""

    def __init__(self, lamps: list[PlacedLamp]) -> None:
        """Make the tables of the grids of `lamps`, in their order."""
        with_grid = [p for p in lamps if p.grid is not None]
        self.any = bool(with_grid)
        if not self.any:
            return
        rows = []
        quads = []
        shared = {}
        for placed in lamps:
            grid = placed.grid
            if grid is None:
                rows += [[0, 0, 0, NONE], [0, 0, 0, 0]]
                continue
            own = grid.quads().astype(np.float32)
            first = shared.setdefault(own.tobytes(), len(shared))
            if first == len(quads):
                quads.append(own)
            # float32 holds these integers exactly for up to a thousand lamps
            rows.append([*grid.left, first * COLUMNS * ROWS])
            rows.append([COLUMNS / 2 / grid.reach[0], ROWS / 2 / grid.reach[1], *grid.bends])
        rows += [[0, 0, 0, NONE], [0, 0, 0, 0]]  # for "no lamp"
        # Passed as lists, which Dr.Jit copies into aligned memory. NumPy arrays would be used in
        # place; they are aligned only by chance, and unaligned ones need another kernel.
        self.rows = mi.Float(np.ravel(rows).tolist())
        self.quads = mi.Float(np.concatenate(quads).ravel().tolist())
        dr.eval(self.rows, self.quads)

    def pattern(self, lamp: Any, direction: Any, axis: Any, otherwise: Any, active: Any) -> Any:
        """Return a lamp's luminance in a direction relative to its largest luminance.

        Parameters
        ----------
        lamp : number of the lamp.
        direction : unit vector that leaves the lamp.
        axis : unit vector of the lamp's axis.
        otherwise : value returned for lamps without a grid.
        active : lanes that take part.
        """
        if not self.any:
            return otherwise
        row = dr.gather(mi.Vector4f, self.rows, 2 * lamp, active)
        has_grid = active & (row.w > NONE)
        scale = dr.gather(mi.Vector4f, self.rows, 2 * lamp + 1, has_grid)
        left = mi.Vector3f(row.x, row.y, row.z)
        forward = dr.dot(direction, axis)
        aside = dr.dot(direction, left)
        above = dr.dot(direction, dr.cross(axis, left))
        level = dr.sqrt(forward * forward + aside * aside)
        x = aside / dr.maximum(dr.maximum(forward, 0) + scale.z * dr.abs(aside), 1e-12) * scale.x
        y = above / dr.maximum(level + scale.w * dr.abs(above), 1e-12) * scale.y
        inside = has_grid & (forward > 0)
        inside &= (dr.abs(x) <= COLUMNS / 2) & (dr.abs(y) <= ROWS / 2)
        column, right = _cell(x, COLUMNS)
        line, over = _cell(y, ROWS)
        cell = mi.UInt32(dr.maximum(row.w, 0)) + line * COLUMNS + column
        corner = dr.gather(mi.Vector4f, self.quads, cell, inside)
        low = dr.lerp(corner.x, corner.y, right)
        high = dr.lerp(corner.z, corner.w, right)
        return dr.select(has_grid, dr.select(inside, dr.lerp(low, high, over), 0), otherwise)


def _cell(place: Any, count: int) -> tuple[Any, Any]:
    """Return the cell number and the position in it, 0..1, of `place`, -count / 2..count / 2."""
    along = dr.clip(place + count / 2, 0, count)
    cell = dr.minimum(mi.UInt32(along), count - 1)
    return cell, along - mi.Float(cell)
