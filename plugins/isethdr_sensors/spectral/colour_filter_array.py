"""Colour filter array: a small text pattern, repeated from the upper left pixel of the sensor.

| array            | pattern                          |
|------------------|----------------------------------|
| Bayer, 4 orders  | RGGB, BGGR, GRBG, GBRG           |
| clear, 2 x 2     | RG/WB (RGBW), RCCB, RCCC, RYYC   |
| RGBW, 4 x 4      | WGWR/GWRW/WBWG/BWGW              |
| quad Bayer       | RRGG/RRGG/GGBB/GGBB              |
| monochrome       | W                                |

Lower case letters stand for less sensitive pixels under the same filter (`interleaved`).
"""

from __future__ import annotations

from math import isqrt

import numpy as np

from isethdr_core.errors import ConfigError

ORDER = "RGBWCYM"  # order of the channels; other letters follow


def cell(pattern: str) -> tuple[str, ...]:
    """Return the rows of a pattern: "RGGB" is ("RG", "GB"), "RG/WB" is ("RG", "WB"), "W" is
    ("W",).
    """
    rows = tuple(pattern.split("/"))
    if len(rows) == 1:  # a pattern without / must be a square; stripes are "RGB/RGB"
        side = isqrt(len(pattern))
        rows = (
            tuple(pattern[k * side : (k + 1) * side] for k in range(side))
            if side**2 == len(pattern)
            else ()
        )
    if not rows or not all(rows) or len({len(row) for row in rows}) > 1:
        raise ConfigError(
            f"sensor.cfa={pattern!r} is no rectangle of letters; expected rows parted by /, e.g."
            " RG/WB, or a square, e.g. RGGB"
        )
    return rows


def channels(pattern: str) -> tuple[str, ...]:
    """Return the filters of a pattern, each once, in the order R, G, B, W, C, Y, M, others."""
    letters = sorted(set("".join(cell(pattern))))
    return tuple(sorted(letters, key=lambda c: (ORDER.find(c) % (len(ORDER) + 1), c)))


def filter_map(pattern: str, rows: int, columns: int) -> np.ndarray:
    """Return the (y, x) uint8 index into `channels(pattern)` of every pixel's filter.

    Parameters
    ----------
    pattern : letters of the repeated cell, row by row, such as RGGB.
    rows, columns : size of the sensor, pixels.
    """
    names = channels(pattern)
    tile = np.array([[names.index(c) for c in row] for row in cell(pattern)], np.uint8)
    return np.tile(tile, (-(-rows // tile.shape[0]), -(-columns // tile.shape[1])))[:rows, :columns]
