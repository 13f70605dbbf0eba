"""The folder of all that is stored."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import CatalogError, did_you_mean

HOME = "ISETHDR_HOME"
# one of them marks a folder as a home
PARTS = ("scenes", "runs", "studies", "sweeps", "intermediate", "kernels", "failed")


def home() -> Path:
    """Return the folder that holds `scenes/` and `runs/`: the variable ISETHDR_HOME, or ./runs."""
    return Path(os.environ.get(HOME) or "runs")


def is_home(folder: Path) -> bool:
    """Return whether a folder is a home: it holds one of its parts, or nothing yet."""
    if not folder.is_dir():
        return False
    visible = [name for name in os.listdir(folder) if not name.startswith(".")]
    return not visible or any((folder / part).is_dir() for part in PARTS)


def existing_home() -> Path:
    """Return the folder that holds what is stored, for those who only read.

    Raises
    ------
    CatalogError : there is no such folder, or it is one of other files.
    """
    folder = home()
    if folder.is_dir() and is_home(folder):
        return folder
    if folder.is_dir():
        raise CatalogError(
            f"{folder} is no home folder: it holds none of {', '.join(PARTS[:3])}"
            f"{_homes_near(folder, [folder, folder.parent])}; type for example"
            " isethdr catalog find --home PATH"
        )
    raise CatalogError(
        f"there is no folder {folder}; expected the home folder of stored runs"
        f"{_homes_near(folder, [folder.parent])}; type for example ISETHDR_HOME=/path isethdr"
        " catalog find, isethdr catalog find --home PATH, or `isethdr run` to make one"
    )


def _homes_near(folder: Path, places: list[Path]) -> str:
    """Return which homes are in `places`, as a part of a message; "" where there is none."""
    found = [
        path
        for place in places
        if place.is_dir()
        for path in sorted(place.iterdir())
        if any((path / part).is_dir() for part in PARTS)
    ]
    return did_you_mean(str(folder), found) if found else ""
