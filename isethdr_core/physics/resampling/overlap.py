"""Overlap: areas that distorted tiles share with the tiles of a regular grid.

The preimages of the output tiles under the distortion are quadrilaterals that fill the input plane.
Neighbours share their corners, so that no light is lost or counted twice. Every weight is an area
of overlap, which is never negative.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array, vstack

if TYPE_CHECKING:
    from ..optics.distortion import AngleTable, BrownConrady, KannalaBrandt, OnAngles

SLIVER = 1e-11  # overlap, in tile areas, up to which it is a rounding error
SLACK = 1e-9  # distance of a corner beyond the grid that may come from rounding, in grid sizes
# number of rows of output tiles at a time: intermediate arrays are ten times as large as the result
ROWS = 32


def borders(centres: np.ndarray, pitch: float) -> np.ndarray:
    """Return the borders (n + 1,) of equidistant tiles.

    Parameters
    ----------
    centres : (n,) centres of the tiles, any unit.
    pitch : distance of the centres, same unit.
    """
    centres = np.asarray(centres, float)
    return np.concatenate([centres - pitch / 2, [centres[-1] + pitch / 2]])


def overlap_areas(
    x_in: np.ndarray,
    y_in: np.ndarray,
    distortion: AngleTable | BrownConrady | KannalaBrandt | OnAngles,
    x_out: np.ndarray,
    y_out: np.ndarray,
) -> csr_array:
    """Return the sparse matrix (output tile, input tile) of shared areas.

    A shared area is the part of an input tile within the preimage of an output tile.

    Parameters
    ----------
    x_in, y_in : (n + 1,) borders of equidistant input tiles, field coordinates.
    distortion : a map with `inverse(x, y)`.
    x_out, y_out : (n + 1,) borders of equidistant output tiles, focal lengths.

    Raises
    ------
    ValueError : an output tile extends beyond the input, or the map reverses the orientation of a
        tile.

    Notes
    -----
    By Green's theorem, the area of a polygon in one column of tiles is the integral of (x - left
    border) dy along the polygon's border inside the column, plus the column's width times dy where
    the polygon's border lies to the right of the column.
    """
    x_in, y_in, x_out, y_out = (np.asarray(b, float) for b in (x_in, y_in, x_out, y_out))
    parts = [
        _rows(x_in, y_in, distortion, x_out, y_out[top : top + ROWS + 1])
        for top in range(0, len(y_out) - 1, ROWS)
    ]
    return vstack(parts, format="csr")


def _rows(
    x_in: np.ndarray,
    y_in: np.ndarray,
    distortion: AngleTable | BrownConrady | KannalaBrandt,
    x_out: np.ndarray,
    y_out: np.ndarray,
) -> csr_array:
    nx = len(x_in) - 1
    ny = len(y_in) - 1
    pitch_x = _pitch(x_in)
    pitch_y = _pitch(y_in)
    u, v = distortion.inverse(*np.meshgrid(x_out, y_out))
    # coordinates in tiles, from the first border
    u = (u - x_in[0]) / pitch_x
    v = (v - y_in[0]) / pitch_y
    beyond = max(-u.min(), u.max() - nx, -v.min(), v.max() - ny)
    if beyond > SLACK * max(nx, ny):
        raise ValueError(
            f"the output reaches {beyond:.3g} tiles beyond the input; expected a wider input"
            " (margin) or a smaller output"
        )
    u = np.clip(u, 0, nx)
    v = np.clip(v, 0, ny)
    ring = [
        (u[:-1, :-1], v[:-1, :-1]),
        (u[:-1, 1:], v[:-1, 1:]),
        (u[1:, 1:], v[1:, 1:]),
        (u[1:, :-1], v[1:, :-1]),
    ]
    ring = [(a.ravel(), b.ravel()) for a, b in ring]
    # columns to the left of this one contain no part of the quadrilateral
    first = np.floor(np.min([a for a, _ in ring], axis=0)).astype(np.int32)
    parts = [_edge(ring[k], ring[(k + 1) % 4], first) for k in range(4)]
    quad, column, row, area = (np.concatenate(p) for p in zip(*parts))
    keep = (column < nx) & (row < ny) & (area != 0)
    matrix = csr_array(
        (area[keep], (quad[keep], row[keep] * nx + column[keep])), shape=(len(first), nx * ny)
    )
    matrix.sum_duplicates()
    if matrix.data.size and matrix.data.min() < -1e-9:
        raise ValueError(
            "the distortion mirrors or folds tiles; expected one that is one-to-one over the output"
        )
    matrix.data = np.where(matrix.data > SLIVER, matrix.data, 0.0) * (pitch_x * pitch_y)
    matrix.eliminate_zeros()
    return matrix


def _edge(
    start: tuple[np.ndarray, np.ndarray], end: tuple[np.ndarray, np.ndarray], first: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return arrays (quadrilateral, column, row, signed area in tiles) of the areas that one side
    of every quadrilateral adds.

    Parameters
    ----------
    start, end : (x, y) of the ends of the side, in tiles.
    first : leftmost column of every quadrilateral.
    """
    x0, y0 = start
    x1, y1 = end
    cuts = [np.zeros_like(x0), np.ones_like(x0)]
    for a, b in ((x0, x1), (y0, y1)):
        low = np.floor(np.minimum(a, b))
        for k in range(1, int(np.max(np.ceil(np.maximum(a, b)) - low, initial=0)) + 1):
            with np.errstate(invalid="ignore", divide="ignore"):
                t = (low + k - a) / (b - a)
            cuts.append(np.where((t > 0) & (t < 1), t, 1.0))  # a cut at the end has no length
    cuts = np.sort(np.stack(cuts), axis=0)
    middle = (cuts[1:] + cuts[:-1]) / 2
    length = np.diff(cuts, axis=0)
    x = x0 + middle * (x1 - x0)
    y = y0 + middle * (y1 - y0)
    dy = length * (y1 - y0)
    column = np.floor(x).astype(np.int32)
    row = np.floor(y).astype(np.int32)
    quad = np.broadcast_to(np.arange(len(x0), dtype=np.int32), x.shape)
    out = [(quad, column, row, (x - column) * dy)]
    for k in range(int(np.max(column - first, initial=0))):
        left = first + np.int32(k)
        out.append((quad, np.broadcast_to(left, x.shape), row, np.where(left < column, dy, 0.0)))
    return tuple(np.concatenate([np.ravel(o[i]) for o in out]) for i in range(4))


def _pitch(borders_: np.ndarray) -> float:
    return (borders_[-1] - borders_[0]) / (len(borders_) - 1)
