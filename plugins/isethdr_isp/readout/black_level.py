"""Black level: as the sensor states it, or measured on its optical black rows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import UnitError

from .electrons import linear_dn

if TYPE_CHECKING:
    import xarray as xr

BLACK = "optical_black"  # variable of the captures, (capture, black_row, x) DN


def with_black_level(captures: xr.Dataset, source: str) -> xr.Dataset:
    """Return captures with `black_dn` from the given source.

    The mean linear DN of a capture's optical black pixels is the sum of black level and mean dark
    charge. The dark charge that the sensor states (`dark_e`) is subtracted. The ledger gets the
    largest standard error of the captures.

    Parameters
    ----------
    captures : captures Dataset.
    source : "stated", which returns the captures unchanged, or "optical".

    Raises
    ------
    UnitError : `source` is "optical", and the captures have no optical black pixels.
    """
    if source == "stated":
        return captures
    if BLACK not in captures or not captures[BLACK].size:
        raise UnitError(
            f"captures have no {BLACK!r}, on which isp.black=optical measures; expected a sensor"
            " with sensor.black_rows above 0; or type isp.black=stated"
        )
    raw = captures[BLACK].values.astype(float)
    gain = captures["gain_dn_per_e"].values
    linear = np.array([linear_dn(captures, i, codes)[0] for i, codes in enumerate(raw)])
    pixels = linear[0].size
    error_e = np.array([standard_error(values) for values in linear]) / gain
    ledger.error(
        float(error_e.max()),
        "electrons",
        "statistical",
        f"black level measured on {pixels} optical black pixels, standard error",
    )
    black = linear.mean(axis=(1, 2)) - gain * captures["dark_e"].values
    moved = black - captures["black_dn"].values
    corrected = captures.assign(black_dn=captures["black_dn"].copy(data=black))
    if "response_dn" in captures:
        table = captures["response_dn"]
        corrected = corrected.assign(response_dn=table.copy(data=_moved(table.values, moved)))
    return corrected


def standard_error(values: np.ndarray) -> float:
    """Return the standard error of the mean of black pixels, in the unit of the values.

    Parameters
    ----------
    values : (black_row, x), any unit.

    Notes
    -----
    All pixels of a row share its offset, and all pixels of a column share theirs. The variance of
    the mean therefore follows from the mean squares of rows, columns and residuals (two-way
    analysis of variance): (rows + columns - residuals) / pixels. The mean squares of rows and
    columns count at least as those of the residuals. The offset of a single row or column cannot be
    told from the black level, and is not included.
    """
    rows, columns = values.shape
    if min(rows, columns) < 2:
        return float(values.std() / np.sqrt(values.size))
    mean = values.mean()
    of_row = values.mean(axis=1, keepdims=True) - mean
    of_column = values.mean(axis=0, keepdims=True) - mean
    freedom = (rows - 1) * (columns - 1)
    residual = np.sum((values - mean - of_row - of_column) ** 2) / freedom
    by_row = max(columns * np.sum(of_row**2) / (rows - 1), residual)
    by_column = max(rows * np.sum(of_column**2) / (columns - 1), residual)
    return float(np.sqrt((by_row + by_column - residual) / values.size))


def _moved(dn: np.ndarray, moved_dn: np.ndarray) -> np.ndarray:
    """Return response tables moved with the black level, linear DN (capture, entry).

    A table ends at its former last entry at most. Saturated pixels have this code or a larger one
    wherever the black level is. Further entries become NaN, as those that pad a table.

    Parameters
    ----------
    dn : linear DN of the tables (capture, entry), increasing.
    moved_dn : new black level minus the former one (capture,), DN.
    """
    end = np.fmax.reduce(dn, axis=1)[:, None]
    moved = dn + moved_dn[:, None]
    behind_end = np.cumsum(moved >= end, axis=1) > 1
    return np.where(behind_end, np.nan, np.minimum(moved, end))
