"""The report of a stored run, written where it is not there."""

from __future__ import annotations

from pathlib import Path

from isethdr_catalog.compare import stored_run
from isethdr_catalog.query import Homes

from . import write_report


def named_report(homes: Homes, name: str) -> Path:
    """Return the path of the report of a run, beside its store.

    Parameters
    ----------
    homes : the home folder, or several homes.
    name : the first digits of a run, or its name.

    Raises
    ------
    CatalogError : it is no run, several are called so, or its store is damaged.
    """
    result = stored_run(homes, name)
    path = result.path.with_suffix(".html")
    return path if path.exists() else write_report(result)
