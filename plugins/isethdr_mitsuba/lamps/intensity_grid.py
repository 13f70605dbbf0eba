"""Lamps with a table of candela: their luminance by direction, on a grid that compiled code reads.

Luminance is candela over the projected area of the lamp's faces. It is computed at the nodes of a
grid and interpolated linearly. The grid is even in x = l / (f + a |l|) and y = u / (sqrt(f^2 + l^2)
+ b |u|), where f, l, u are the components of a direction forward, to the left and up. Looking up a
direction therefore needs no search and no angle.

The bends a and b set how much denser the nodes are near the axis. With BENDS, nodes near the axis
are 0.4 degrees apart horizontally and 0.07 degrees vertically, as a dipped beam needs. A table that
extends far to all sides, such as that of a luminaire, has light and detail far off its axis. Its
bends are chosen so that the nodes near the axis are as far apart as the angles of the table.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import IntensityTable

BENDS = (4.0, 12.0)  # bends a and b of a table that is not wide
LEAST_BEND = 1.0  # smallest bend
WIDE_DEG = 80.0  # a table that reaches at least this far up, down and to both sides is wide
# Number of cells across and down; even, so that the axis is a node
COLUMNS = 72
ROWS = 136
# Smallest projected area by which candela is divided, relative to the largest over all directions.
# Where the faces show less area, the candela of the lamp falls below the table with it.
LEAST_AREA = 0.05


@dataclass(frozen=True, eq=False)
class IntensityGrid:
    """Luminance of one lamp, cd/m2, at the nodes of its grid, in its own axes (unit vectors)."""

    axis: np.ndarray  # (3,) forward
    left: np.ndarray  # (3,)
    value: np.ndarray  # (ROWS + 1, COLUMNS + 1) cd/m2
    reach: tuple[float, float]  # x and y of the last nodes
    bends: tuple[float, float] = BENDS  # a and b

    def at(self, direction: np.ndarray) -> np.ndarray:
        """Return the luminance, cd/m2, towards unit vectors (..., 3); 0 outside the grid."""
        place = [np.asarray(direction, float) @ v for v in (self.axis, self.left, self.up)]
        forward, aside, above = place
        ahead = forward > 0
        level = np.maximum(np.hypot(forward, aside), 1e-12)
        x = aside / (np.maximum(forward, 1e-12) + self.bends[0] * np.abs(aside))
        y = above / (level + self.bends[1] * np.abs(above))
        column, right = _cell(x / self.reach[0], COLUMNS)
        row, over = _cell(y / self.reach[1], ROWS)
        low = self.value[row, column] * (1 - right) + self.value[row, column + 1] * right
        high = self.value[row + 1, column] * (1 - right) + self.value[row + 1, column + 1] * right
        inside = ahead & (np.abs(x) <= self.reach[0]) & (np.abs(y) <= self.reach[1])
        return np.where(inside, low * (1 - over) + high * over, 0.0)

    @property
    def up(self) -> np.ndarray:
        """Unit vector (3,) upwards."""
        return np.cross(self.axis, self.left)

    def quads(self) -> np.ndarray:
        """Return (ROWS * COLUMNS, 4) values at the corners of each cell, relative to the largest
        value. One memory access then serves a direction.
        """
        v = self.value / max(self.value.max(), 1e-300)
        corners = [v[:-1, :-1], v[:-1, 1:], v[1:, :-1], v[1:, 1:]]
        return np.stack(corners, -1).reshape(-1, 4)


def _cell(place: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the cell number and the position in it, 0..1, of `place`, -1..1 across the grid."""
    along = (np.clip(place, -1, 1) + 1) * (count / 2)
    cell = np.minimum(along.astype(int), count - 1)
    return cell, along - cell


def intensity_grid(
    table: IntensityTable,
    intensity_cd: float,
    axis: np.ndarray,
    left: np.ndarray,
    area_vectors: np.ndarray,
) -> IntensityGrid:
    """Return the grid of a lamp.

    Parameters
    ----------
    table : luminous intensity by direction, relative to `intensity_cd`.
    intensity_cd : luminous intensity where the table is 1, cd.
    axis, left : (3,) unit vectors forward and to the left, at right angles.
    area_vectors : (n, 3) normals of the faces times their areas, m2.
    """
    ends = [np.abs(np.asarray(v)[[0, -1]]).max() for v in (table.left_deg, table.up_deg)]
    tangents = np.tan(np.radians(np.minimum(ends, 89.9)))
    bends = _bends(table)
    reach = tangents / (1 + bends * tangents)
    nodes = [reach[k] * np.linspace(-1, 1, n + 1) for k, n in enumerate((COLUMNS, ROWS))]
    aside, above = (t / (1 - b * np.abs(t)) for t, b in zip(nodes, bends))  # tangents of angles
    left_rad, up_rad = np.meshgrid(np.arctan(aside), np.arctan(above))
    value = intensity_cd * table.at(np.degrees(left_rad), np.degrees(up_rad))
    level = np.cos(up_rad)
    parts = [level * np.cos(left_rad), level * np.sin(left_rad), np.sin(up_rad)]
    axes = [axis, left, np.cross(axis, left)]
    direction = sum(p[..., None] * v for p, v in zip(parts, axes))
    area = np.zeros(value.shape)
    for chunk in np.array_split(area_vectors, max(1, len(area_vectors) // 64)):
        area += np.maximum(direction @ chunk.T, 0).sum(-1)
    area = np.maximum(area, LEAST_AREA * area.max())
    return IntensityGrid(
        np.asarray(axis),
        np.asarray(left),
        value / area,
        tuple(reach.tolist()),
        tuple(bends.tolist()),
    )


def _bends(table: IntensityTable) -> np.ndarray:
    """Return the bends (2,) of the grid of a table."""
    angles = [np.asarray(table.left_deg), np.asarray(table.up_deg)]
    if min(min(-v[0], v[-1]) for v in angles) < WIDE_DEG:
        return np.array(BENDS)
    step_rad = np.radians([np.diff(v).min() for v in angles])
    # The grid spans x from -1 / a to 1 / a in COLUMNS cells. Near the axis, x is the angle in
    # radians, so a cell is 2 / (a COLUMNS) wide; y likewise.
    return np.clip(2 / (np.array([COLUMNS, ROWS]) * step_rad), LEAST_BEND, BENDS)
