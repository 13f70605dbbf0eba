"""Demosaic: every channel at every pixel, for any periodic filter array, as a linear map with known
variance.

A pixel keeps its own sample. A missing sample is the value of a plane that is fitted to the nearest
samples of its channel, with tent weights. This is exact for constants and linear ramps with any
pattern, and equals the usual bilinear average for Bayer and other 2 x 2 arrays. Borders are
mirrored about the outermost pixel, which keeps the phase of the array.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from isethdr_core.errors import UnitError

from ..readout.noise_propagation import Kernel, Kernels, independent

# largest radius of the surroundings, pixels; covers arrays of period 8, while the largest in
# production is 4
LARGEST_RADIUS = 8
EXACT = 1e-9  # largest error of the moments with which a plane counts as determined


def demosaic(
    mosaic: np.ndarray,
    filters: np.ndarray,
    channels: int,
    variance: np.ndarray | None = None,
    bad: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    """Return every channel at every pixel.

    Parameters
    ----------
    mosaic : (y, x) array of samples, any unit.
    filters : (y, x) integers, the channel sampled at each pixel; periodic.
    channels : number of channels.
    variance : (y, x) variance of the samples, which are independent; None: no variances.
    bad : (y, x) bool, samples that are not valid; None: all are valid.

    Returns
    -------
    planes : (channel, y, x) values.
    variances : (channel, y, x) variances of the values, exact; None without `variance`.
    invalid : (y, x) bool, pixels with a value that uses a sample that is not valid.
    """
    mosaic = np.asarray(mosaic, float)
    filters = np.asarray(filters)
    if mosaic.shape != filters.shape:
        raise UnitError(
            f"raw has shape {mosaic.shape}, filter {filters.shape}; expected the same (y, x)"
        )
    rule = bilinear(filters, channels)
    variances = None if variance is None else rule.variance(np.eye(channels), independent(variance))
    return interpolated(rule, mosaic), variances, using_invalid(rule, bad)


def interpolated(rule: Kernels, mosaic: np.ndarray) -> np.ndarray:
    """Return the channels (channel, y, x) of a mosaic (y, x) by a linear demosaic."""
    planes = np.zeros((len(rule.kernels[0].weights), *rule.shape))
    for block in (block for kernel in rule.kernels for block in kernel.blocks()):
        pixels = block.pixels()
        for plane, weights in zip(planes, block.weights):
            for offset, weight in zip(block.offsets, weights):
                if weight:
                    plane[pixels] += weight * mosaic[block.samples(offset)]
    return planes


def using_invalid(rule: Kernels, bad: np.ndarray | None) -> np.ndarray:
    """Return which pixels (y, x) use a sample that is `bad`: (y, x) bool, or None if all samples
    are valid.
    """
    using = np.zeros(rule.shape, bool)
    if bad is None or not np.any(bad):
        return using
    for kernel in rule.kernels:
        for offset in kernel.offsets:
            using[kernel.pixels()] |= bad[kernel.samples(offset)]
    return using


def bilinear(filters: np.ndarray, channels: int) -> Kernels:
    """Return the bilinear rule for a periodic filter array (y, x).

    Raises
    ------
    UnitError : a channel is sampled nowhere, the array is not periodic, or the picture is too small
        for the array.
    """
    filters = np.ascontiguousarray(filters)
    return _rule_of(filters.tobytes(), filters.dtype.str, filters.shape, channels)


@lru_cache(maxsize=8)  # every picture of a run has the same few arrays
def _rule_of(data: bytes, dtype: str, shape: tuple[int, ...], channels: int) -> Kernels:
    """Return the bilinear rule of a filter array, given as the bytes of its numbers. The result is
    cached and must not be changed.
    """
    filters = np.frombuffer(data, dtype).reshape(shape)
    missing = sorted(set(range(channels)) - set(np.unique(filters).tolist()))
    if missing:
        raise UnitError(
            f"channel {missing[0]} of {channels} is not sampled in the filter array; expected at"
            " least one whole period of the pattern; crop it less"
        )
    if channels == 1:  # no sample is missing, even in a picture of a single pixel
        every = Kernel(*(np.arange(n) for n in filters.shape), [(0, 0)], np.ones((1, 1)))
        return Kernels([every], filters.shape)
    rows, columns, radius = places(filters)
    key = np.pad(filters, radius, mode="reflect")
    kernels = []
    for row in rows:
        for column in columns:
            window = key[row[0] : row[0] + 2 * radius + 1, column[0] : column[0] + 2 * radius + 1]
            taps = [plane_weights(window == channel) for channel in range(channels)]
            kernels.append(folded(row, column, taps, filters.shape))
    return Kernels(kernels, filters.shape)


def folded(
    row: np.ndarray,
    column: np.ndarray,
    taps: list[list[tuple[Any, ...]]],
    shape: tuple[int, int],
) -> Kernel:
    """Return the kernel of a group of pixels, with samples beyond the border mirrored inside.

    Parameters
    ----------
    row, column : regular indices of the pixels; a single index where a tap lies beyond the border.
    taps : for each channel a list of (dy, dx, weight): offset of a sample in pixels, and its
        weight.
    shape : rows and columns of the mosaic.
    """
    weights: dict[tuple[int, int], np.ndarray] = {}
    for channel, taps_of_channel in enumerate(taps):
        for dy, dx, weight in taps_of_channel:
            offset = (
                _mirrored(row[0] + dy, shape[0]) - int(row[0]),
                _mirrored(column[0] + dx, shape[1]) - int(column[0]),
            )
            weights.setdefault(offset, np.zeros(len(taps)))[channel] += weight
    return Kernel(row, column, list(weights), np.stack(list(weights.values()), -1))


def _mirrored(index: int, count: int) -> int:
    """Return the index within 0..count - 1 that replaces an index beyond the border. The mirror
    does not repeat the outermost sample.
    """
    index = abs(int(index))
    return index if index < count else 2 * (count - 1) - index


def plane_weights(where: np.ndarray) -> list[tuple[int, int, float]]:
    """Return (dy, dx, weight) of the samples that give the value at the centre.

    The weights minimise sum w^2 / tent under sum w = 1 and sum w dx = sum w dy = 0, in the smallest
    window where that is possible. `where` is a square window, True at samples.
    """
    where = np.asarray(where, bool)
    return _solved(where.tobytes(), len(where))


@lru_cache(maxsize=4096)  # a picture has the same few windows many times
def _solved(window: bytes, side: int) -> list[tuple[int, int, float]]:
    where = np.frombuffer(window, bool).reshape(side, side)
    middle = where.shape[0] // 2
    if where[middle, middle]:
        return [(0, 0, 1.0)]
    best = None
    for radius in range(1, middle + 1):
        dy, dx = np.nonzero(
            where[middle - radius : middle + radius + 1, middle - radius : middle + radius + 1]
        )
        if not len(dy):
            continue
        dy = dy - radius
        dx = dx - radius
        tent = (radius + 1 - np.abs(dy)) * (radius + 1.0 - np.abs(dx))
        moments = np.stack([np.ones(len(dy)), dx, dy])
        solved = np.linalg.pinv((moments * tent) @ moments.T, rcond=1e-10, hermitian=True) @ [
            1.0,
            0.0,
            0.0,
        ]
        weight = tent * (moments.T @ solved)
        if np.abs(moments @ weight - [1.0, 0.0, 0.0]).max() < EXACT:
            best = dy, dx, weight
            break
        # tent weights of the smallest window, used if no window determines a plane
        best = best or (
            dy,
            dx,
            tent / tent.sum(),
        )
    keep = np.abs(best[2]) > EXACT
    return list(zip(*(v[keep].tolist() for v in best)))


def places(filters: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray], int]:
    """Return the rows and the columns, each in groups with equal surroundings, and the radius of
    the surroundings.
    """
    periods = array_period(filters)
    radius = min(max(*periods, 1), LARGEST_RADIUS)
    if min(filters.shape) <= radius:
        raise UnitError(
            f"a picture of {filters.shape} pixels is smaller than its filter array needs; "
            f"expected more than {radius} rows and columns"
        )
    groups = []
    for axis, period in enumerate(periods):
        count = filters.shape[axis]
        index = np.arange(count)
        inner = [index[radius + k : count - radius : period] for k in range(period)]
        border = [index[k : k + 1] for k in index if k < radius or k >= count - radius]
        groups.append([group for group in inner if len(group)] + border)
    return (*groups, radius)


def array_period(filters: np.ndarray) -> tuple[int, int]:
    """Return the numbers of rows and columns after which a filter array (y, x) repeats.

    Raises
    ------
    UnitError : it does not repeat within 8 pixels.
    """
    filters = np.asarray(filters)
    return _period(filters), _period(filters.T)


def _period(filters: np.ndarray) -> int:
    """Return the smallest shift along the first axis that does not change the pattern."""
    for period in range(1, LARGEST_RADIUS + 1):
        if period >= len(filters) or np.array_equal(filters[period:], filters[:-period]):
            return min(period, len(filters))
    raise UnitError(
        f"the filter array does not repeat within {LARGEST_RADIUS} pixels; expected a periodic"
        " colour filter array"
    )
