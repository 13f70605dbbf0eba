"""Local classes: the kind of neighbourhood of every pixel of a mosaic, for the learned demosaic.

| feature  | classes                                                                |
|----------|------------------------------------------------------------------------|
| level    | local mean over its noise: below 2.5, 6, 15, 40, above                 |
| contrast | flat where noise explains all change, else the share of change along x |

A change is the difference of the two neighbours of a pixel, left and right or above and below,
where both have the same filter. On a Bayer array that is everywhere; on an array with white on a
checkerboard it is at all other pixels.
"""

from __future__ import annotations

import numpy as np

SNR_EDGES = (2.5, 6.0, 15.0, 40.0)
SHARE_EDGES = (0.1, 0.3, 0.7, 0.9)  # of the change along x
SIGNIFICANT = 4.5  # standard deviations: noise alone passes for a change at 1 pixel in 500
WINDOW = 5  # pixels
COUNT = (len(SNR_EDGES) + 1) * (len(SHARE_EDGES) + 2)


def classes(mosaic: np.ndarray, filters: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Return the class (y, x), 0..COUNT - 1, of every pixel.

    Parameters
    ----------
    mosaic : (y, x) samples, electrons; may be negative.
    filters : (y, x) integers, the channel of each pixel.
    variance : (y, x) of the samples.
    """
    mean = local_mean(mosaic)
    noise = np.maximum(local_mean(variance), 1e-30)
    level = np.searchsorted(SNR_EDGES, mean / np.sqrt(noise))
    (along_x, noise_x, count_x), (along_y, noise_y, count_y) = (
        _change(mosaic, filters, variance, axis) for axis in (1, 0)
    )
    change_x = np.maximum(along_x - noise_x, 0.0)
    change_y = np.maximum(along_y - noise_y, 0.0)
    total_change = change_x + change_y
    share = np.divide(
        change_x, total_change, out=np.full_like(total_change, 0.5), where=total_change > 0
    )
    # squares of normal numbers spread by sqrt(2) of their mean
    flat = along_x + along_y <= (noise_x + noise_y) * (
        1 + SIGNIFICANT * np.sqrt(4 / (count_x + count_y))
    )
    return level * (len(SHARE_EDGES) + 2) + np.where(
        flat, 0, 1 + np.searchsorted(SHARE_EDGES, share)
    )


def _change(
    mosaic: np.ndarray, filters: np.ndarray, variance: np.ndarray, axis: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the local mean of the squared difference between the two neighbours along `axis`,
    where they have the same filter; its expectation from noise alone; and the number of
    differences.
    """
    (a, b), (before, after), (v, w) = (
        _neighbours(values, axis) for values in (mosaic, filters, variance)
    )
    same = before == after
    share = np.maximum(local_mean(same.astype(float)), 1e-9)
    change, noise = (
        local_mean(np.where(same, part, 0.0)) / share for part in ((a - b) ** 2, v + w)
    )
    return change, noise, share * WINDOW**2


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
    side : of the window, pixels.
    """
    from scipy.ndimage import uniform_filter

    return uniform_filter(values, side, mode="mirror")
