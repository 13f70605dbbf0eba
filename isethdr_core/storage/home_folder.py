"""The folder of all that is stored."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ..errors import CatalogError, ConfigError, did_you_mean
from .object_home.address import MARK, Address, is_address, scratch_folder
from .object_home.calls import follow_home

HOME = "ISETHDR_HOME"
OTHER_HOMES = "ISETHDR_OTHER_HOMES"  # further homes that queries read, one on each line
# folders of a home; any one of them marks the folder around it as a home
PARTS = (
    *("scenes", "runs", "studies", "sweeps", "intermediate", "kernels", "failed"),
    *("datasets", "training", "experiments"),
)
# further folders of a home, whose names other folders have too
COMMON_PARTS = ("arrays", "comparisons", "pairs", "questions", "spectra", "without_people")


@dataclass(frozen=True)
class StoredHome:
    """An existing home, from which stores are read."""

    name: str  # its folder or address, as it is typed
    folder: Path


def working_folder() -> Path:
    """Return the working folder.

    Raises
    ------
    ConfigError : it was deleted.
    """
    try:
        return Path.cwd()
    except FileNotFoundError:
        raise ConfigError(
            "the working folder was deleted; expected a folder that exists; type for example cd ~"
        ) from None


def home() -> Path:
    """Return the folder that holds `scenes/` and `runs/`: the variable ISETHDR_HOME, or ./runs.
    For an address such as s3://bucket/prefix it is the scratch folder of that object home.

    Raises
    ------
    ConfigError : an address of another kind.
    """
    return _folder_of(os.environ.get(HOME) or "runs")


def _folder_of(named: str) -> Path:
    return scratch_folder(Address.parsed(named)) if is_address(named) else Path(named)


def is_home(folder: Path) -> bool:
    """Return whether a folder is a home: it holds one of `PARTS`, or nothing but parts of a
    home.
    """
    if not folder.is_dir():
        return False
    visible = {name for name in os.listdir(folder) if not name.startswith(".")}
    if visible <= {*PARTS, *COMMON_PARTS}:
        return True
    return MARK in visible or any((folder / part).is_dir() for part in PARTS)


def existing_home() -> Path:
    """Return the home folder, for commands that only read one home. The scratch folder of an object
    home is brought up to date with its bucket first.

    Raises
    ------
    CatalogError : there is no such folder, it is one of other files, the bucket cannot be read, or
        several homes are named.
    """
    if others := _others():
        raise CatalogError(
            f"{1 + len(others)} homes are named, but this command works in one; type --home once,"
            f" or unset {OTHER_HOMES}; find, sql, show, compare, report, score, export and"
            " reproduce read several homes"
        )
    return _existing(home())


def existing_homes(names: str | os.PathLike[str] | Iterable[object] = ()) -> tuple[StoredHome, ...]:
    """Return the homes to read, each brought up to date; one that is named twice counts once.

    Parameters
    ----------
    names : folders and addresses; without any, those of the variables ISETHDR_HOME and
        ISETHDR_OTHER_HOMES.

    Raises
    ------
    CatalogError : one of them is no home, or a bucket cannot be read.
    ConfigError : an address of another kind.
    """
    named = [names] if isinstance(names, str | os.PathLike) else list(names)
    others = [] if named else _others()
    texts = [str(name) for name in named] or [os.environ.get(HOME) or "runs"]
    found: dict[Path, StoredHome] = {}
    for position, text in enumerate([*texts, *others]):
        folder = _existing(_folder_of(text), is_other=position >= len(texts))
        found.setdefault(folder.resolve(), StoredHome(text, folder))
    return tuple(found.values())


def _others() -> list[str]:
    return list(filter(None, map(str.strip, os.environ.get(OTHER_HOMES, "").splitlines())))


@contextmanager
def readable(folder: Path) -> Iterator[None]:
    """Turn a refusal to read a home folder, or a folder above it, into an error that names it.

    Raises
    ------
    CatalogError : no permission to read.
    """
    try:
        yield
    except PermissionError as error:
        raise CatalogError(
            f"no permission to read {error.filename}, for the home folder {folder}; expected a home"
            " that you may read; type --home PATH"
        ) from error


def _existing(folder: Path, is_other: bool = False) -> Path:
    """Return the folder of a home, after checking that it is a home.

    Parameters
    ----------
    folder : the folder.
    is_other : whether the variable ISETHDR_OTHER_HOMES names it.

    Raises
    ------
    CatalogError : it is no home.
    ConfigError : it is a relative path, and the working folder was deleted.
    """
    follow_home(folder)
    with readable(folder):
        if not (folder.is_dir() and is_home(folder)):
            if not folder.is_absolute():
                working_folder()  # its error states the cause, if it was deleted
            raise _no_other_home(folder) if is_other else _no_home(folder)
    return folder


def _no_other_home(folder: Path) -> CatalogError:
    """Return the error about a further home that is none, with the homes near it."""
    what = "is no home folder" if folder.is_dir() else "does not exist"
    return CatalogError(
        f"{folder}, which {OTHER_HOMES} or a further --home names, {what}; expected home folders of"
        f" stored runs{_homes_near(folder, [folder.parent])}; type --home PATH for each of them, or"
        f" {OTHER_HOMES}=/path"
    )


def _no_home(folder: Path) -> CatalogError:
    """Return the error about a folder that is no home, with the homes near it."""
    if folder.is_dir():
        return CatalogError(
            f"{folder} is no home folder: it holds none of {', '.join(PARTS[:3])}"
            f"{_homes_near(folder, [folder, folder.parent])}; type for example"
            " isethdr catalog find --home PATH"
        )
    return CatalogError(
        f"there is no folder {folder}; expected the home folder of stored runs"
        f"{_homes_near(folder, [folder.parent])}; type for example ISETHDR_HOME=/path isethdr"
        " catalog find, isethdr catalog find --home PATH, or `isethdr run` to make one"
    )


def _homes_near(folder: Path, places: list[Path]) -> str:
    """Return the homes in `places` as a part of a message; "" if there are none."""
    found = [
        path
        for place in places
        if place.is_dir()
        for path in sorted(place.iterdir())
        if any((path / part).is_dir() for part in PARTS)
    ]
    return did_you_mean(str(folder), found) if found else ""
