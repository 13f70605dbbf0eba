"""Local classes: the kind of neighbourhood of every pixel of a mosaic, for the learned demosaic.

| feature  | classes                                                                |
|----------|------------------------------------------------------------------------|
| level    | local mean / noise: below 2.5, 6, 15 and 40, or above                  |
| contrast | flat if noise explains all change, else the share of change along x    |

A change is the difference of two neighbours of a pixel, left and right or above and below, if both
have the same filter. On a Bayer array all pixels have such neighbours. On an array with white on a
checkerboard, only the pixels without white do.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

SNR_EDGES = (2.5, 6.0, 15.0, 40.0)  # borders of the classes of level
SHARE_EDGES = (0.1, 0.3, 0.7, 0.9)  # borders of the classes of the share of change along x
# threshold of a change, standard deviations; noise alone exceeds it at 1 pixel in 500
SIGNIFICANT = 4.5
WINDOW = 5  # side of the local window, pixels
COUNT = (len(SNR_EDGES) + 1) * (len(SHARE_EDGES) + 2)  # number of classes


def classes(mosaic: np.ndarray, filters: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Return the class (y, x), 0..COUNT - 1, of every pixel.

    Parameters
    ----------
    mosaic : (y, x) samples, electrons; may be negative.
    filters : (y, x) integers, the channel of each pixel.
    variance : (y, x) variance of the samples, e^2.
    """
    mean = local_mean(mosaic)
    noise = np.maximum(local_mean(variance), 1e-30)
    level = _edges_below(SNR_EDGES, mean / np.sqrt(noise))
    (along_x, noise_x, count_x), (along_y, noise_y, count_y) = (
        _change(mosaic, filters, variance, axis) for axis in (1, 0)
    )
    change_x = np.maximum(along_x - noise_x, 0.0)
    change_y = np.maximum(along_y - noise_y, 0.0)
    total_change = change_x + change_y
    share = np.divide(
        change_x, total_change, out=np.full_like(total_change, 0.5), where=total_change > 0
    )
    # the standard deviation of the square of a normal number is sqrt(2) times its mean
    flat = along_x + along_y <= (noise_x + noise_y) * (
        1 + SIGNIFICANT * np.sqrt(4 / (count_x + count_y))
    )
    return level * (len(SHARE_EDGES) + 2) + np.where(flat, 0, 1 + _edges_below(SHARE_EDGES, share))


def _edges_below(edges: tuple[float, ...], values: np.ndarray) -> np.ndarray:
    """Return how many edges each value (y, x) is above: `np.searchsorted(edges, values)`, in a
    fraction of the time.
    """
    count = np.zeros(values.shape, int)
    for edge in edges:
        count += ~(values <= edge)  # NaN is above all edges
    return count


def _change(
    mosaic: np.ndarray, filters: np.ndarray, variance: np.ndarray, axis: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return three arrays (y, x): the local mean of the squared difference between the two
    neighbours along `axis` that have the same filter, its expectation from noise alone, and the
    number of differences.
    """
    (a, b), (v, w) = (_neighbours(values, axis) for values in (mosaic, variance))
    filters = np.asarray(filters)
    same, share = _same_filter(filters.tobytes(), filters.dtype.str, filters.shape, axis)
    change, noise = (
        local_mean(np.where(same, part, 0.0)) / share for part in ((a - b) ** 2, v + w)
    )
    return change, noise, share * WINDOW**2


@lru_cache(maxsize=16)  # every picture of a run has the same few arrays
def _same_filter(
    data: bytes, dtype: str, shape: tuple[int, ...], axis: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return where (y, x) both neighbours along `axis` have the same filter, and the local share of
    such pixels. The array of filters is given as the bytes of its numbers.

    The results are cached and must not be changed.
    """
    before, after = _neighbours(np.frombuffer(data, dtype).reshape(shape), axis)
    same = before == after
    return same, np.maximum(local_mean(same.astype(float)), 1e-9)


def _neighbours(values: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the values before and after every pixel along `axis`; mirrored at the border."""
    padded = np.moveaxis(
        np.pad(values, 1, mode="reflect")[(slice(None), slice(1, -1))[:: 1 if axis == 0 else -1]],
        axis,
        0,
    )
    return np.moveaxis(padded[:-2], 0, axis), np.moveaxis(padded[2:], 0, axis)


def local_mean(values: np.ndarray, side: int = WINDOW) -> np.ndarray:
    """Return the mean (y, x) over a window around every pixel; mirrored at the border.

    Parameters
    ----------
    values : (y, x), any unit.
    side : side of the window, pixels.
    """
    from scipy.ndimage import uniform_filter

    return uniform_filter(values, side, mode="mirror")
