"""Demosaic: every channel at every pixel, for any periodic filter array, as a linear map with known variance.

A pixel keeps its own sample. A missing one is the value at that place of a plane fitted to the nearest samples of its
channel, with tent weights: exact on constants and on linear ramps for any pattern, and the usual bilinear average on
Bayer and on other 2 x 2 arrays. Borders are mirrored about the outermost pixel, which keeps the phase of the array.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from isethdr_core.errors import UnitError

LARGEST_RADIUS = 8   # pixels; covers arrays of period 8, the largest in production is 4
EXACT = 1e-9         # how well a plane's moments must be met to count as determined


def demosaic(mosaic, filters, channels: int, variance=None, bad=None):
    """Return every channel at every pixel.

    Parameters
    ----------
    mosaic : (y, x) array of samples, any unit.
    filters : (y, x) integers, the channel sampled at each pixel; periodic.
    channels : number of channels.
    variance : (y, x) variance of the samples, independent of each other; None for none.
    bad : (y, x) bool, samples not to be trusted; None for none.

    Returns
    -------
    planes : (channel, y, x) values.
    variances : same shape, the exact variance of the linear map, or None.
    touched : (y, x) bool, pixels any of whose channels uses a bad sample.
    """
    mosaic, filters = np.asarray(mosaic, float), np.asarray(filters)
    if mosaic.shape != filters.shape:
        raise UnitError(f"raw has shape {mosaic.shape}, filter {filters.shape}; expected the same (y, x)")
    missing = sorted(set(range(channels)) - set(np.unique(filters).tolist()))
    if missing:
        raise UnitError(f"channel {missing[0]} of {channels} is sampled nowhere in the filter array; "
                        "a cropped pattern? use at least one whole period")
    if channels == 1:  # nothing is missing, be it a single pixel
        values = None if variance is None else np.array(variance, float)[None]
        return mosaic[None].copy(), values, np.zeros(mosaic.shape, bool) if bad is None else np.asarray(bad, bool)
    rows, columns, radius = _classes(filters)
    pad = ((radius, radius), (radius, radius))
    source = np.pad(mosaic, pad, mode="reflect")
    source_var = None if variance is None else np.pad(np.asarray(variance, float), pad, mode="reflect")
    source_bad = None if bad is None or not np.any(bad) else np.pad(bad, pad, mode="reflect")
    key = np.pad(filters, pad, mode="reflect")
    planes = np.empty((channels, *mosaic.shape))
    variances = None if variance is None else np.empty_like(planes)
    touched = np.zeros(mosaic.shape, bool)
    for row in rows:
        for column in columns:
            window = key[row[0]:row[0] + 2 * radius + 1, column[0]:column[0] + 2 * radius + 1]
            here = _index(row, column)
            for channel in range(channels):
                value, var, spoilt = 0.0, 0.0, False
                for dy, dx, weight in plane_weights(window == channel):
                    there = _index(row + radius + dy, column + radius + dx)
                    value = value + weight * source[there]
                    if variances is not None:
                        var = var + weight**2 * source_var[there]
                    if source_bad is not None:
                        spoilt = spoilt | source_bad[there]
                planes[(channel, *here)] = value
                if variances is not None:
                    variances[(channel, *here)] = var
                touched[here] |= spoilt
    return planes, variances, touched


def plane_weights(where) -> list[tuple[int, int, float]]:
    """Return (dy, dx, weight) of the samples `where` (square window, True at samples) that give the centre's value.

    Minimises sum w^2 / tent under sum w = 1, sum w dx = sum w dy = 0, in the smallest window that can meet them.
    """
    where = np.asarray(where, bool)
    return _solved(where.tobytes(), len(where))


@lru_cache(maxsize=4096)  # a picture asks for the same few windows again and again
def _solved(window: bytes, side: int) -> list[tuple[int, int, float]]:
    where = np.frombuffer(window, bool).reshape(side, side)
    middle = where.shape[0] // 2
    if where[middle, middle]:
        return [(0, 0, 1.0)]
    best = None
    for radius in range(1, middle + 1):
        dy, dx = np.nonzero(where[middle - radius:middle + radius + 1, middle - radius:middle + radius + 1])
        if not len(dy):
            continue
        dy, dx = dy - radius, dx - radius
        tent = (radius + 1 - np.abs(dy)) * (radius + 1.0 - np.abs(dx))
        moments = np.stack([np.ones(len(dy)), dx, dy])
        solved = np.linalg.pinv((moments * tent) @ moments.T, rcond=1e-10, hermitian=True) @ [1.0, 0.0, 0.0]
        weight = tent * (moments.T @ solved)
        if np.abs(moments @ weight - [1.0, 0.0, 0.0]).max() < EXACT:
            best = dy, dx, weight
            break
        best = best or (dy, dx, tent / tent.sum())  # nothing better may follow at a border of a large pattern
    keep = np.abs(best[2]) > EXACT
    return list(zip(*(v[keep].tolist() for v in best)))


def _classes(filters):
    """Return the rows and the columns grouped by equal surroundings, and the radius of the surroundings."""
    periods = array_period(filters)
    radius = min(max(*periods, 1), LARGEST_RADIUS)
    if min(filters.shape) <= radius:
        raise UnitError(f"a picture of {filters.shape} pixels is smaller than its filter array needs; "
                        f"expected more than {radius} rows and columns")
    groups = []
    for axis, period in enumerate(periods):
        count = filters.shape[axis]
        index = np.arange(count)
        inner = [index[radius + k:count - radius:period] for k in range(period)]
        border = [index[k:k + 1] for k in index if k < radius or k >= count - radius]
        groups.append([group for group in inner if len(group)] + border)
    return (*groups, radius)


def array_period(filters) -> tuple[int, int]:
    """Return rows and columns after which a filter array (y, x) repeats; UnitError where it does not within 8."""
    filters = np.asarray(filters)
    return _period(filters), _period(filters.T)


def _period(filters) -> int:
    """Return the smallest shift along the first axis that leaves the pattern as it is."""
    for period in range(1, LARGEST_RADIUS + 1):
        if period >= len(filters) or np.array_equal(filters[period:], filters[:-period]):
            return min(period, len(filters))
    raise UnitError(f"the filter array does not repeat within {LARGEST_RADIUS} pixels; expected a periodic colour filter array")


def _index(rows, columns):
    """Return a pair of slices where both index arrays are regular: a view instead of a gather."""
    return tuple(slice(int(i[0]), int(i[-1]) + 1, int(i[1] - i[0]) if len(i) > 1 else 1) for i in (rows, columns))
