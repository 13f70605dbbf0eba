"""Cell means: the mean amplitude transmission of a pupil over each cell of a grid.

A raster adds the two ends of each chord to a row of differences, and one cumulative sum fills all
shapes: exact along x, a few lines per cell along y.
"""

from __future__ import annotations

import numpy as np

from .convex import Convex
from .strip_chords import GAUSS, chord_ends


def raster(
    terms: list[tuple[Convex, complex]], x: np.ndarray, y: np.ndarray, strips: int = 2
) -> np.ndarray:
    """Return the mean amplitude transmission of each cell of a grid.

    Parameters
    ----------
    terms : list of (shape, weight), as `opening` returns.
    x, y : evenly spaced cell centres, mm.
    strips : number of strips per cell along y, with two chords each at Gauss's places. The mean is
        exact along x; along y its error falls with the fourth power of a strip's height.

    Returns
    -------
    (y, x) float32 array, 0 to 1; complex64 where a weight is complex.
    """
    real = not any(isinstance(weight, complex) for _, weight in terms)
    dtype = np.float32 if real else np.complex64
    dx = x[1] - x[0]
    dy = y[1] - y[0]
    sub = strips
    position = []
    change = []
    for k, left, right, weight in chord_ends(terms, y[0] - dy / 2, dy / sub, len(y) * sub, GAUSS):
        for end, sign in ((left, 1), (right, -1)):
            cell = np.clip((end - x[0]) / dx + 0.5, 0.0, len(x))
            whole_cells = cell.astype(np.intp)
            start = (k // sub) * (len(x) + 2) + whole_cells
            position += [start, start + 1]
            change += [
                sign * weight / sub * (1 - (cell - whole_cells)),
                sign * weight / sub * (cell - whole_cells),
            ]
    ends = np.zeros(len(y) * (len(x) + 2), dtype)
    if position:
        np.add.at(ends, np.concatenate(position), np.concatenate(change).astype(dtype))
    ends = ends.reshape(len(y), len(x) + 2)
    np.cumsum(ends, axis=1, out=ends)
    ends = ends[:, : len(x)]
    return np.maximum(ends, 0.0, out=ends) if real else ends  # rounding leaves +-1e-7
