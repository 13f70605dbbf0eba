"""Optical black rows: pixels behind metal, read after the last row, that show black level and dark
charge.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

NAME = "optical_black"  # variable of the captures


def with_black_rows(light_e: Sequence[np.ndarray], black_rows: int) -> list[np.ndarray]:
    """Return the mean light electrons (y, x) of each photodiode with `black_rows` rows of zeros
    added below.
    """
    if not black_rows:
        return light_e
    dark = np.zeros((black_rows, light_e[0].shape[1]))
    return [np.concatenate([electrons, dark.astype(electrons.dtype)]) for electrons in light_e]


def parted(values: np.ndarray, black_rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (image rows, black rows) of values (capture, y, x)."""
    rows = values.shape[1] - black_rows
    return values[:, :rows], values[:, rows:]


def with_optical_black(captures: xr.Dataset, black: np.ndarray) -> xr.Dataset:
    """Return captures with the raw values (capture, black_row, x) of the black rows."""
    captures[NAME] = ("capture", "black_row", "x"), black, {"units": "DN"}
    return captures
