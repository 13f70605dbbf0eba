"""Fixed pattern: differences between pixels that stay from shot to shot. Their random numbers
depend on the device only.

PRNU scales the light's electrons, the dark spread scales the dark electrons, DSNU, column and row
offsets add to a reading, and hot pixels add dark electrons.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from isethdr_core.physics.detector import noise, random_words


@lru_cache(maxsize=8)
def pixel_map(stream: tuple, rows: int, columns: int) -> np.ndarray:
    """Return a (y, x) float32 map of standard normals; pixel (y, x) of a device has one value at
    any sensor size.

    Parameters
    ----------
    stream : key of the device's random numbers.
    rows, columns : size of the sensor, pixels.
    """
    out = np.empty((rows, columns), np.float32)
    block = noise.rows_per_block(columns)
    for y in range(0, rows, block):
        last = min(y + block, rows)
        out[y:last] = noise.normal_float32(random_words.words(stream, y, last, 0, columns))
    out.flags.writeable = False
    return out


def factor(relative_rms: float, stream: tuple, rows: int, columns: int) -> float | np.ndarray:
    """Return factors around 1, (y, x) float32 and never negative, or the number 1 if there is no
    spread.

    Parameters
    ----------
    relative_rms : standard deviation over the pixels, relative to the mean; 0: no spread.
    stream : key of the device's random numbers.
    rows, columns : size of the sensor, pixels.
    """
    if relative_rms == 0:
        return np.float32(1.0)
    out = np.float32(relative_rms) * pixel_map(stream, rows, columns)
    out += np.float32(1.0)
    return np.maximum(out, np.float32(0.0), out=out)


def below(share: float) -> int:
    """Return the signed 64-bit word below which a `share` of all words lies."""
    return min(int(share * 2.0**64), 2**64 - 1) - 2**63


def chosen(share: float, stream: tuple, rows: int, columns: int) -> np.ndarray:
    """Return (y, x) bool: each pixel of the device is true with probability `share`,
    independently.

    Parameters
    ----------
    share : probability, 0 to 1.
    stream : key of the device's random numbers.
    rows, columns : size of the sensor, pixels.
    """
    out = np.empty((rows, columns), bool)
    block = noise.rows_per_block(columns)
    for y in range(0, rows, block):
        last = min(y + block, rows)
        out[y:last] = random_words.words(stream, y, last, 0, columns) < below(share)
    return out


@lru_cache(maxsize=8)
def hot_dark(share: float, stream: tuple, rows: int, columns: int) -> np.ndarray:
    """Return (y, x) float32: the additional dark charge of each pixel, relative to the mean of the
    hot pixels.

    It is 0 for all pixels that are not hot. For hot pixels it is exponentially distributed with
    mean 1, because published histograms of dark current end in straight lines on a logarithmic
    axis.

    Parameters
    ----------
    share : share of hot pixels, 0 to 1.
    stream : key of the device's random numbers.
    rows, columns : size of the sensor, pixels.
    """
    hot = chosen(share, stream, rows, columns)
    out = np.zeros((rows, columns), np.float32)
    for y in np.flatnonzero(hot.any(1)):
        p, upper = random_words.tail(
            random_words.words((*stream, "depth"), y, y + 1, 0, columns)[0, hot[y]]
        )
        out[y, hot[y]] = -np.log(np.where(upper, p, 1.0 - p))
    out.flags.writeable = False
    return out


class OffsetSpread(NamedTuple):
    """Normally distributed offsets of the pixels, columns or rows of a device."""

    rms_e: float  # standard deviation, electrons; 0: no offsets
    stream: tuple = ()  # key of their random numbers


def offset_e(
    pixel: OffsetSpread, column: OffsetSpread, row: OffsetSpread, rows: int, columns: int
) -> float | np.ndarray:
    """Return the persistent offset of a reading, electrons: (y, x), (1, x) or the number 0.

    Parameters
    ----------
    pixel, column, row : offsets of single pixels, of whole columns and of whole rows.
    rows, columns : size of the sensor, pixels.
    """
    offset = np.float32(0.0)
    if pixel.rms_e:
        offset = offset + np.float32(pixel.rms_e) * pixel_map(pixel.stream, rows, columns)
    if column.rms_e:
        offset = offset + np.float32(column.rms_e) * pixel_map(column.stream, 1, columns)
    if row.rms_e:  # a full map, because the shape (y, 1) of one row could also mean one column
        offset = (
            offset
            + np.float32(row.rms_e) * pixel_map(row.stream, rows, 1)
            + np.zeros((rows, columns), np.float32)
        )
    return offset
