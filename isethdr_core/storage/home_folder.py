"""The folder of all that is stored."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import CatalogError


def home() -> Path:
    """Return the folder that holds `scenes/` and `runs/`: the variable ISETHDR_HOME, or ./runs."""
    return Path(os.environ.get("ISETHDR_HOME") or "runs")


def existing_home() -> Path:
    """Return the folder that holds what is stored, for those who only read.

    Raises
    ------
    CatalogError : there is no such folder.
    """
    folder = home()
    if not folder.is_dir():
        raise CatalogError(
            f"there is no folder {folder}; expected the home folder of stored runs; type for"
            " example ISETHDR_HOME=/path isethdr catalog find, or `isethdr run` to make one"
        )
    return folder
