"""Optical black rows: pixels behind metal, read after the last row, that show black level and dark
charge.
"""

from __future__ import annotations

import numpy as np

NAME = "optical_black"  # variable of the captures


def with_black_rows(light_e, black_rows: int) -> list[np.ndarray]:
    """Return the mean light electrons (y, x) of each photodiode with rows without light below."""
    if not black_rows:
        return light_e
    dark = np.zeros((black_rows, light_e[0].shape[1]))
    return [np.concatenate([electrons, dark.astype(electrons.dtype)]) for electrons in light_e]


def parted(values, black_rows: int):
    """Return (image rows, black rows) of values (capture, y, x)."""
    rows = values.shape[1] - black_rows
    return values[:, :rows], values[:, rows:]


def with_optical_black(captures, black):
    """Return captures with the raw values (capture, black_row, x) of the black rows."""
    captures[NAME] = ("capture", "black_row", "x"), black, {"units": "DN"}
    return captures
