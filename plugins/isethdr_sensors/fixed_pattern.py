"""Fixed pattern: what differs from pixel to pixel and stays from shot to shot, keyed by the device alone.

PRNU scales the light's electrons, the dark spread scales the dark electrons, DSNU and column offsets add to a reading.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from isethdr_core.physics import noise, random_words


@lru_cache(maxsize=8)
def pixel_map(stream: tuple, rows: int, columns: int) -> np.ndarray:
    """Return a (y, x) float32 map of standard normals; pixel (y, x) of a device has one value at any sensor size."""
    out = np.empty((rows, columns), np.float32)
    block = noise.rows_per_block(columns)
    for y in range(0, rows, block):
        last = min(y + block, rows)
        out[y:last] = noise.normal_float32(random_words.words(stream, y, last, 0, columns))
    out.flags.writeable = False
    return out


def factor(relative_rms: float, stream: tuple, rows: int, columns: int):
    """Return factors around 1, (y, x) float32 and never negative, or the number 1 where there is no spread."""
    if relative_rms == 0:
        return np.float32(1.0)
    return np.maximum(1.0 + np.float32(relative_rms) * pixel_map(stream, rows, columns), np.float32(0.0))


def offset_e(dsnu_e: float, column_e: float, dsnu_stream: tuple, column_stream: tuple, rows: int, columns: int):
    """Return the persistent offset of a reading, electrons: (y, x), (1, x) or the number 0."""
    out = np.float32(0.0)
    if dsnu_e:
        out = out + np.float32(dsnu_e) * pixel_map(dsnu_stream, rows, columns)
    if column_e:
        out = out + np.float32(column_e) * pixel_map(column_stream, 1, columns)
    return out
