"""Resampling along a distortion map: light keeps its energy exactly, labels their numbers, boxes enclose what they enclosed.

The preimages of the output tiles are quadrilaterals that tile the input plane: neighbours share their corners, so no light is
lost or
counted twice, and every weight is an area of overlap, never negative.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

SLIVER = 1e-11  # of a tile's area: overlaps that small are rounding
EDGE_POINTS = 65  # along each side of a box


def resample_light(values, x_in, y_in, distortion, x_out, y_out) -> np.ndarray:
    """Return irradiance after distortion, (..., y, x), in the unit of `values`.

    Parameters
    ----------
    values : (..., y, x) irradiance without distortion, constant over each tile.
    x_in, y_in, x_out, y_out : evenly spaced tile centres, in focal lengths (ideal tangents in, distorted ones out).
    distortion : a map with `inverse(x, y)`.

    Raises
    ------
    ValueError : where an output tile reaches beyond the input; no light is known there.
    """
    matrix = overlap_areas(x_in, y_in, distortion, x_out, y_out)
    values = np.asarray(values)
    area = _pitch(x_out) * _pitch(y_out)
    flat = values.reshape(-1, values.shape[-2] * values.shape[-1]).astype(float)
    return (matrix @ flat.T).T.reshape(*values.shape[:-2], len(y_out), len(x_out)) / area


def resample_labels(labels, x_in, y_in, distortion, x_out, y_out) -> np.ndarray:
    """Return labels (y, x) after distortion, each from the input tile that holds the middle of its own tile."""
    u, v = distortion.inverse(*np.meshgrid(x_out, y_out))
    column, row = (np.rint((w - c[0]) / _pitch(c)).astype(int) for w, c in ((u, np.asarray(x_in)), (v, np.asarray(y_in))))
    shape = np.shape(labels)
    if column.min() < 0 or row.min() < 0 or column.max() >= shape[1] or row.max() >= shape[0]:
        raise ValueError("the output reaches beyond the labels; expected a wider input or a smaller output")
    return np.asarray(labels)[row, column]


def resample_box(box, x_in, y_in, distortion, x_out, y_out) -> tuple[float, float, float, float]:
    """Return (x, y, width, height), in output tiles, of the smallest box around the image of a box given in input tiles."""
    x, y, width, height = box
    side = np.linspace(0, 1, EDGE_POINTS)
    along = np.concatenate([side, np.ones_like(side), side, np.zeros_like(side)]) * width + x
    down = np.concatenate([np.zeros_like(side), side, np.ones_like(side), side]) * height + y
    u, v = distortion.forward(x_in[0] + (along - 0.5) * _pitch(x_in), y_in[0] + (down - 0.5) * _pitch(y_in))
    column, row = (u - x_out[0]) / _pitch(x_out) + 0.5, (v - y_out[0]) / _pitch(y_out) + 0.5
    return float(column.min()), float(row.min()), float(np.ptp(column)), float(np.ptp(row))


def overlap_areas(x_in, y_in, distortion, x_out, y_out) -> csr_array:
    """Return the (output tile, input tile) matrix of the areas that preimages of output tiles share with input tiles.

    Notes
    -----
    Green's theorem: the part of a polygon in one tile column is the integral of (x - left border) dy along its border inside
    the column,
    plus the column's width times dy where the border runs further right.
    """
    x_in, y_in = np.asarray(x_in, float), np.asarray(y_in, float)
    corner_x, corner_y = (
        np.concatenate([c - _pitch(c) / 2, [c[-1] + _pitch(c) / 2]]) for c in (np.asarray(x_out, float), np.asarray(y_out, float))
    )
    u, v = distortion.inverse(*np.meshgrid(corner_x, corner_y))
    u, v = (u - x_in[0]) / _pitch(x_in) + 0.5, (v - y_in[0]) / _pitch(y_in) + 0.5  # in tiles, from the first border
    nx, ny = len(x_in), len(y_in)
    beyond = max(-u.min(), u.max() - nx, -v.min(), v.max() - ny)
    if beyond > 1e-9 * max(nx, ny):
        raise ValueError(
            f"the output reaches {beyond:.3g} tiles beyond the input; expected a wider input (margin) or a smaller output"
        )
    u, v = np.clip(u, 0, nx), np.clip(v, 0, ny)
    ring = [(u[:-1, :-1], v[:-1, :-1]), (u[:-1, 1:], v[:-1, 1:]), (u[1:, 1:], v[1:, 1:]), (u[1:, :-1], v[1:, :-1])]
    ring = [(a.ravel(), b.ravel()) for a, b in ring]
    first = np.floor(np.min([a for a, _ in ring], axis=0)).astype(int)  # columns left of this hold no part of the quadrilateral
    parts = [_edge(ring[k], ring[(k + 1) % 4], first) for k in range(4)]
    quad, column, row, area = (np.concatenate(p) for p in zip(*parts))
    keep = (column < nx) & (row < ny)
    matrix = csr_array((area[keep], (quad[keep], row[keep] * nx + column[keep])), shape=(len(first), nx * ny))
    matrix.sum_duplicates()
    if matrix.data.size and matrix.data.min() < -1e-9:
        raise ValueError("the map turns tiles over; expected a distortion that is one to one over the output")
    matrix.data = np.where(matrix.data > SLIVER, matrix.data, 0.0) * _pitch(x_in) * _pitch(y_in)
    matrix.eliminate_zeros()
    return matrix


def _edge(start, end, first):
    """Return (quadrilateral, column, row, signed area) that one side of every quadrilateral adds, in tiles."""
    (x0, y0), (x1, y1) = start, end
    cuts = [np.zeros_like(x0), np.ones_like(x0)]
    for a, b in ((x0, x1), (y0, y1)):
        low = np.floor(np.minimum(a, b))
        for k in range(1, int(np.max(np.ceil(np.maximum(a, b)) - low, initial=0)) + 1):
            with np.errstate(invalid="ignore", divide="ignore"):
                t = (low + k - a) / (b - a)
            cuts.append(np.where((t > 0) & (t < 1), t, 1.0))  # a cut at the end has no length
    cuts = np.sort(np.stack(cuts), axis=0)
    middle, length = (cuts[1:] + cuts[:-1]) / 2, np.diff(cuts, axis=0)
    x, y, dy = x0 + middle * (x1 - x0), y0 + middle * (y1 - y0), length * (y1 - y0)
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    quad = np.broadcast_to(np.arange(len(x0)), x.shape)
    out = [(quad, column, row, (x - column) * dy)]
    for k in range(int(np.max(column - first, initial=0))):
        left = first + k
        out.append((quad, np.broadcast_to(left, x.shape), row, np.where(left < column, dy, 0.0)))
    return tuple(np.concatenate([np.ravel(o[i]) for o in out]) for i in range(4))


def _pitch(centres):
    return (centres[-1] - centres[0]) / (len(centres) - 1)
