"""The report of a stored run, written if it is missing."""

from __future__ import annotations

from pathlib import Path

from isethdr_catalog.compare import stored_run
from isethdr_catalog.query import Homes

from . import write_report


def named_report(homes: Homes, name: str) -> Path:
    """Return the path of the report of a run, next to its store; write a missing report.

    Parameters
    ----------
    homes : home folder, or several homes.
    name : first digits of the key of a run, or its name.

    Raises
    ------
    CatalogError : the store is no run or is damaged, or several stores match.
    """
    result = stored_run(homes, name)
    path = result.path.with_suffix(".html")
    return path if path.exists() else write_report(result)
