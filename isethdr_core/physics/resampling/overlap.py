"""Overlap: areas that tiles seen through a distortion share with the tiles of a regular grid.

The preimages of the output tiles are quadrilaterals that tile the input plane: neighbours share
their corners, so no light is lost or counted twice, and every weight is an area of overlap, never
negative.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array, vstack

if TYPE_CHECKING:
    from ..optics.distortion import AngleTable, BrownConrady, KannalaBrandt, OnAngles

SLIVER = 1e-11  # of a tile's area: overlaps that small are rounding
SLACK = 1e-9  # of the grid: how far a corner may reach outside by rounding alone
ROWS = 32  # of output tiles at a time: intermediate arrays are ten times the result


def borders(centres: np.ndarray, pitch: float) -> np.ndarray:
    """Return the borders (n + 1,) of evenly spaced tiles."""
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

    The area is that of an input tile within the preimage of an output tile.

    Parameters
    ----------
    x_in, y_in : borders (n + 1,) of evenly spaced input tiles, field coordinates.
    x_out, y_out : borders (n + 1,) of evenly spaced output tiles, focal lengths.
    distortion : a map with `inverse(x, y)`.

    Raises
    ------
    ValueError : where an output tile reaches beyond the input, or the map turns tiles over.

    Notes
    -----
    Green's theorem: the part of a polygon in one tile column is the integral of (x - left border)
    dy along its border inside the column, plus the column's width times dy where the border runs
    further right.
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
    # in tiles, from the first border
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
    # columns left of this hold none of the quadrilateral
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
            "the map turns tiles over; expected a distortion that is one to one over the output"
        )
    matrix.data = np.where(matrix.data > SLIVER, matrix.data, 0.0) * (pitch_x * pitch_y)
    matrix.eliminate_zeros()
    return matrix


def _edge(
    start: tuple[np.ndarray, np.ndarray], end: tuple[np.ndarray, np.ndarray], first: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return (quadrilateral, column, row, signed area) that one side of every quadrilateral adds,
    in tiles.
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
