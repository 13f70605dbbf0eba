"""Tables of a question: means with their intervals, and the page with the tables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.storage.atomic_write import write_text

from ..dataset.study.intervals import Mean


def columns(name: str, mean: Mean) -> dict[str, float]:
    """Return a mean and its interval as three columns of a row.

    Parameters
    ----------
    name : name of the column of the mean.
    mean : the mean with its interval.
    """
    return {name: mean.value, f"{name}_low": mean.low, f"{name}_high": mean.high}


def shown(row: Mapping[str, Any], name: str) -> str:
    """Return a value of a row with its interval as text, `0.12 (0.05 to 0.19)`; a dash for NaN.

    Parameters
    ----------
    row : row with the columns of `columns`.
    name : name of the column of the mean.
    """
    value = row[name]
    if math.isnan(value):
        return "–"
    if math.isnan(row[f"{name}_low"]):
        return f"{value:.3g}"
    return f"{value:.3g} ({row[f'{name}_low']:.3g} to {row[f'{name}_high']:.3g})"


def checked_page(page: str) -> None:
    """Check that a page can be written, before hours of computation.

    Raises
    ------
    ConfigError : the folder of the page does not exist.
    """
    if page and not Path(page).resolve().parent.is_dir():
        raise ConfigError(
            f"page is {page}; expected a file in a folder that exists; make the folder first"
        )


def write_page(page: str, text: str) -> None:
    """Write a page.

    Parameters
    ----------
    page : file to write.
    text : content of the page.

    Raises
    ------
    CatalogError : the page cannot be written.
    """
    try:
        write_text(Path(page), text)
    except OSError as err:
        raise CatalogError(f"cannot write {page}: {err.strerror or err}; make room") from err


def for_people(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return rows with each mean and its interval in one column."""
    return [
        {
            name: shown(row, name) if f"{name}_low" in row else value
            for name, value in row.items()
            if not name.endswith(("_low", "_high"))
        }
        for row in rows
    ]
