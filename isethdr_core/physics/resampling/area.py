"""Area: exact integrals of uniform tiles over the rectangles of another regular grid.

Both grids are separable, so that the integral is a product with two banded matrices of overlap
lengths, one per axis.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

SLACK = 1e-9  # largest rounding error of a border, tiles


def resample_mean(  # noqa: PLR0913 - plugins call it with these arguments
    values: npt.ArrayLike,
    x_in: npt.ArrayLike,
    y_in: npt.ArrayLike,
    x_out: npt.ArrayLike,
    y_out: npt.ArrayLike,
    width_out: float,
    height_out: float,
) -> np.ndarray:
    """Return the mean of uniform tiles over each output rectangle.

    Parameters
    ----------
    values : (..., y, x) array; each value is constant over its tile.
    x_in, y_in : (x,) and (y,) equidistant tile centres, increasing, any unit of length.
    x_out, y_out : (x_out,) and (y_out,) centres of the output rectangles, same unit, any order;
        they may overlap.
    width_out, height_out : full size of an output rectangle, same unit.

    Returns
    -------
    (..., y_out, x_out) float64 array in the unit of `values`. Its product with width and height is
    the integral.

    Raises
    ------
    ValueError : a rectangle extends beyond the tiles, where the light is not known.
    """
    return integrate_tiles(values, x_in, y_in, x_out, y_out, width_out, height_out) / (
        width_out * height_out
    )


def integrate_tiles(  # noqa: PLR0913 - plugins call it with these arguments
    values: npt.ArrayLike,
    x_in: npt.ArrayLike,
    y_in: npt.ArrayLike,
    x_out: npt.ArrayLike,
    y_out: npt.ArrayLike,
    width_out: float,
    height_out: float,
) -> np.ndarray:
    """Return the integral of uniform tiles over each output rectangle.

    Parameters
    ----------
    values : (..., y, x) array, any unit; each value is constant over its tile.
    x_in, y_in : (x,) and (y,) equidistant tile centres, increasing, any unit of length.
    x_out, y_out : (x_out,) and (y_out,) centres of the output rectangles, same unit, any order;
        they may overlap.
    width_out, height_out : full size of an output rectangle, same unit.

    Returns
    -------
    (..., y_out, x_out) float64 array, unit of `values` times the square of the coordinates' unit.

    Raises
    ------
    ValueError : as `overlaps`, or `values` has another number of tiles than the centres.
    """
    values = np.asarray(values)
    along_x = overlaps(x_in, x_out, width_out, "x")
    along_y = overlaps(y_in, y_out, height_out, "y")
    if values.shape[-2:] != (along_y.shape[1], along_x.shape[1]):
        raise ValueError(
            f"values of shape {values.shape} do not end in (y, x) ="
            f" {(along_y.shape[1], along_x.shape[1])}, the number of tile centres given"
        )
    out = np.empty((*values.shape[:-2], along_y.shape[0], along_x.shape[0]))
    # one band at a time, to avoid a float64 copy of the whole cube
    for band in np.ndindex(values.shape[:-2]):
        rows = _product(along_y, values[band].astype(np.float64, copy=False))
        out[band] = _product(along_x, rows.T).T
    return out


def _product(lengths: csr_array, values: np.ndarray) -> np.ndarray:
    """Return `lengths @ values`, the same bit for bit.

    If every output interval lies within one tile, for example if pixels are tiles, rows are only
    selected and scaled, in a third of the time. If these rows are also equidistant, as for the
    pixels of one colour filter, it takes a fifth of the time.
    """
    if lengths.nnz == lengths.shape[0] and (np.diff(lengths.indptr) == 1).all():
        chosen = lengths.indices
        step = int(chosen[1] - chosen[0]) if len(chosen) > 1 else 1
        if step > 0 and (np.diff(chosen) == step).all():
            scaled: np.ndarray = values[chosen[0] : chosen[-1] + 1 : step] * lengths.data[:, None]
            return scaled
        rows = values.take(chosen, axis=0)
        rows *= lengths.data[:, None]
        return rows
    return lengths @ values


def detail_error(  # noqa: PLR0913 - plugins call it with these arguments
    deviation: npt.ArrayLike,
    x_in: npt.ArrayLike,
    y_in: npt.ArrayLike,
    x_out: npt.ArrayLike,
    y_out: npt.ArrayLike,
    width_out: float,
    height_out: float,
) -> np.ndarray:
    """Return the error of the mean over each output rectangle from the assumption of uniform tiles.

    Parameters
    ----------
    deviation : (y, x) standard deviation of the values within each tile.
    x_in, y_in : (x,) and (y,) equidistant tile centres, increasing, any unit of length.
    x_out, y_out : (x_out,) and (y_out,) centres of the output rectangles, same unit.
    width_out, height_out : full size of an output rectangle, same unit.

    Returns
    -------
    (y_out, x_out) in the unit of `deviation`.

    Raises
    ------
    ValueError : as `overlaps`.

    Notes
    -----
    If a rectangle covers the fraction f of a tile, its error there is the covariance of its
    indicator function and the values. This is at most sqrt(f (1 - f)) times their deviation
    (Cauchy-Schwarz inequality), and 0 for f = 0 and f = 1. The squares of the errors of different
    tiles add up. With the fractions g and h along both axes, f = g h and f (1 - f) <=
    g h ((1 - g) + (1 - h)).
    """
    # these calls come first: they refuse a single tile, whose width is not known
    along_x = overlaps(x_in, x_out, width_out, "x")
    along_y = overlaps(y_in, y_out, height_out, "y")
    tile_x, tile_y = (
        float(c[-1] - c[0]) / (len(c) - 1) for c in (np.asarray(x_in), np.asarray(y_in))
    )
    whole_x, divided_x = _fractions(along_x, tile_x)
    whole_y, divided_y = _fractions(along_y, tile_y)
    variance = np.asarray(deviation, float) ** 2
    squares = (divided_x @ (whole_y @ variance).T).T + (whole_x @ (divided_y @ variance).T).T
    return np.sqrt(squares) * (tile_x * tile_y / (width_out * height_out))


def _fractions(lengths: csr_array, tile: float) -> tuple[csr_array, csr_array]:
    """Return matrices of g and g (1 - g), where g is the fraction of a tile that an overlap covers.

    Parameters
    ----------
    lengths : matrix of `overlaps`.
    tile : width of a tile, in the unit of `lengths`.
    """
    whole_lengths = lengths.copy()
    divided = lengths.copy()
    whole_lengths.data = np.clip(lengths.data / tile, 0.0, 1.0)
    divided.data = whole_lengths.data * np.where(
        1 - whole_lengths.data > SLACK, 1 - whole_lengths.data, 0.0
    )
    return whole_lengths, divided


def overlaps(
    centres_in: npt.ArrayLike, centres_out: npt.ArrayLike, width_out: float, axis: str = "x"
) -> csr_array:
    """Return the (out, in) matrix of the lengths that each output interval shares with each tile.

    Parameters
    ----------
    centres_in : (in,) equidistant tile centres, increasing, at least two, any unit of length.
    centres_out : (out,) centres of the output intervals, same unit.
    width_out : width of all output intervals, same unit.
    axis : name of the axis, for the error message.

    Raises
    ------
    ValueError : the tile centres are not equidistant and increasing, there is only one, an output
        interval extends beyond the tiles, or `width_out` is not above 0.
    """
    centres_in = np.asarray(centres_in, float)
    centres_out = np.asarray(centres_out, float)
    count = len(centres_in)
    if not width_out > 0:
        raise ValueError(f"output width {width_out!r} along {axis}; expected a length above 0")
    if count == 1:
        raise ValueError(f"one tile along {axis} has no known width; expected at least two centres")
    pitch = (centres_in[-1] - centres_in[0]) / (count - 1)
    # 1e-3 of a tile, so that coordinates that were stored as float32 are accepted
    if not pitch > 0 or np.abs(np.diff(centres_in) - pitch).max() > 1e-3 * pitch:
        raise ValueError(f"tile centres along {axis} are not evenly spaced and increasing")
    # borders of the intervals, in tiles from the left border of the first tile
    low = (centres_out - width_out / 2 - centres_in[0]) / pitch + 0.5
    high = (centres_out + width_out / 2 - centres_in[0]) / pitch + 0.5
    outside = max(-low.min(), high.max() - count)
    if not outside <= SLACK * count:  # NaN compares false
        raise ValueError(
            f"output rectangles reach {outside * pitch:.6g} ({outside:.3g} tiles) beyond the input"
            f" along {axis}; the tiles cover {centres_in[0] - pitch / 2:.6g} to"
            f" {centres_in[-1] + pitch / 2:.6g}"
        )
    low = np.clip(_snapped(low), 0, count)
    high = np.clip(_snapped(high), 0, count)
    first = np.minimum(np.floor(low).astype(int), count - 1)
    reach = int(np.max(np.ceil(high).astype(int) - first))
    tile = first[:, None] + np.arange(max(reach, 1))
    length = np.minimum(high[:, None], tile + 1) - np.maximum(low[:, None], tile)
    keep = (length > 0) & (tile < count)
    ends = np.concatenate([[0], np.cumsum(keep.sum(axis=1))])
    return csr_array((length[keep] * pitch, tile[keep], ends), shape=(len(low), count))


def _snapped(border: np.ndarray) -> np.ndarray:
    """Return borders, in tiles. Borders that are within `SLACK` of a tile's border are moved
    exactly there.

    Rounding would otherwise leave overlaps of 1e-15 of a tile, which are visible next to light that
    is 1e12 times brighter.
    """
    nearest = np.rint(border)
    return np.where(np.abs(border - nearest) < SLACK, nearest, border)
