"""Index: `index.duckdb`, a cache of all records. Queries include every store, whether it is in the
index or not.

The stores are authoritative. Stores and records are compared by path and by the state of the root
metadata file (inode, time, size), never by the order of times, so a clock that is set back does no
harm. If the folders of the stores have not changed since the last comparison, no comparison is
made. Writers of stores do not touch the index, so it needs no lock. It can be deleted at any time.
"""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from isethdr_core.errors import CatalogError
from isethdr_core.runs.labels import SUFFIX as LABELS
from isethdr_core.storage.atomic_write import remove_leftovers, temporary_path

from . import index_file
from .record import records

if TYPE_CHECKING:
    import duckdb

FOLDERS = ("scenes", "runs", "studies")
INDEX = "index.duckdb"
STATE = "index.state.json"  # state of the folders at the last comparison with the index
EARLIER = "index.parquet"  # the index of earlier versions
# Least time between a folder's last change and the comparison for which its time of change proves
# that it is unchanged: two changes within one tick of a file system's clock have the same time.
SETTLED_S = 3.0
# least age at which scratch folders of an older version, which do not name their writer, are
# removed
OLD_SCRATCH_S = 3600.0


@dataclass(frozen=True)
class Refreshed:
    """Result of a refresh: the number of records, and the skipped stores with the reasons."""

    path: Path
    records: int
    skipped: dict[str, str]


@dataclass
class _Reading:
    """Iterable over the records of stores; it collects the stores that it skips."""

    folder: Path
    stamps: dict[str, str]  # stamps of the stores to read, by path
    skipped: dict[str, str] = field(default_factory=dict)

    def __iter__(self) -> Iterator[tuple[str, str, list[dict[str, Any]]]]:
        """Yield path, stamp and records of each store; damaged ones are named in `skipped`."""
        for path, stamp in self.stamps.items():
            try:
                rows = records(self.folder / path, self.folder)
            except (
                CatalogError,
                AttributeError,
                TypeError,
                KeyError,
                ValueError,
            ) as error:  # readable JSON of an unexpected shape
                self.skipped[path] = str(error) or type(error).__name__
                continue
            yield path, stamp, rows


def stores(folder: str | os.PathLike[str]) -> list[Path]:
    """Return the paths of all stores of a home folder, complete or not."""
    return [path for part in FOLDERS for path in sorted(Path(folder).glob(f"{part}/*.zarr"))]


def stamps(folder: Path) -> dict[str, str]:
    """Return the state of each store's root metadata file, and of the file with its labels, by the
    store's path below `folder`.
    """
    found = {}
    for part in FOLDERS:
        with suppress(FileNotFoundError, NotADirectoryError), os.scandir(folder / part) as entries:
            named = sorted(
                (entry.name, entry.path)
                for entry in entries
                if entry.name.endswith((".zarr", LABELS))
            )
            labelled = {name for name, _ in named if name.endswith(LABELS)}
            for name, path in named:
                if not name.endswith(".zarr"):
                    continue
                labels = name.removesuffix(".zarr") + LABELS
                found[f"{part}/{name}"] = _stamp(f"{path}/zarr.json") + (
                    f" {_stamp(f'{folder / part / labels}')}" if labels in labelled else ""
                )
    return found


def refresh(folder: str | os.PathLike[str]) -> Refreshed:
    """Bring `<folder>/index.duckdb` up to date: read new and changed stores, and remove the records
    of missing ones.

    Damaged stores are skipped and listed. Records are written in batches, so memory does not grow
    with their number.

    Raises
    ------
    CatalogError : the index cannot be written.
    """
    folder = Path(folder)
    with index_file.connected() as base:
        return _refresh(_changes(base, folder, stamps(folder)))


def attach(
    base: duckdb.DuckDBPyConnection,
    folder: str | os.PathLike[str],
    alias: str = index_file.ALIAS,
) -> dict[str, Any] | None:
    """Attach an index of all stores of a home folder, and bring it up to date first.

    If the file cannot be written, or another process has replaced it by one with fewer stores, a
    temporary copy is attached instead.

    Parameters
    ----------
    base : DuckDB connection.
    folder : home folder, with `scenes/` and `runs/`.
    alias : name of the attached database in SQL.

    Returns
    -------
    The state of the home for which the attached file is valid, as long as `state` returns the same;
    None if the file is valid at this moment only.

    Raises
    ------
    CatalogError : neither the home nor the folder of temporary files can be written.
    """
    folder = Path(folder)
    before = state(folder)
    if before is not None:
        if index_file.attach(base, folder / INDEX, alias):
            if state(folder) == before:
                return before
            index_file.detach(base, alias)
    compared = _begin_comparison(folder)
    current = stamps(folder)
    skipped: dict[str, str] = {}
    with suppress(CatalogError):  # a home that cannot be written is queried all the same
        skipped = _refresh(_changes(base, folder, current, alias)).skipped
    index = _stamp(folder / INDEX)
    wanted = {p: s for p, s in current.items() if str(folder / p) not in skipped}
    if index_file.attach(base, folder / INDEX, alias):
        if index_file.known(base, alias) == wanted:
            if compared is not None and _stamp(folder / INDEX) == index:
                _remember(folder, compared | {"index": index})
            return None
        index_file.detach(base, alias)
    try:
        with tempfile.TemporaryDirectory(prefix="isethdr-index-") as scratch:
            copy = Path(scratch) / INDEX
            changes = _changes(base, folder, current, alias)
            _write(changes, copy, changes.reading)
            index_file.attach(base, copy, alias)  # stays open after its name is gone
    except OSError as error:
        raise CatalogError(
            f"cannot write an index of {folder} into the folder of temporary files: {error}; make"
            " room, or choose another one with TMPDIR=/path"
        ) from error
    return None


def state(folder: Path) -> dict[str, Any] | None:
    """Return the state of a home that has not changed since its index was compared with its stores;
    None if it has changed, or may have.
    """
    try:
        remembered = json.loads((folder / STATE).read_bytes())
    except (OSError, ValueError):
        return None
    now = {part: _folder_state(folder / part) for part in FOLDERS}
    same = remembered == now | {"index": _stamp(folder / INDEX)}
    return remembered if same else None


def forget(folder: Path) -> None:
    """Make the next query compare the index with all stores; needed if a store changed in place."""
    (folder / STATE).unlink(missing_ok=True)


@dataclass
class _Changes:
    """Stores that an index file lacks, and stores that it must not hold any more."""

    index: Path
    records: int  # number of records in the file
    stale: list[str]  # paths of stores that are missing or changed
    reading: _Reading  # records of the stores that the file lacks


def _changes(
    base: duckdb.DuckDBPyConnection,
    folder: Path,
    current: dict[str, str],
    alias: str = index_file.ALIAS,
) -> _Changes:
    """Return the changes that the index of a home needs.

    `base` attaches the index file for reading and detaches it again. It is the connection of a
    query, because a new one would take 30 ms.
    """
    index = folder / INDEX
    known = {}
    records_in_file = 0
    if index_file.attach(base, index, alias):
        known = index_file.known(base, alias)
        records_in_file = index_file.count(base, alias)
        index_file.detach(base, alias)
    stale = [path for path, stamp in known.items() if current.get(path) != stamp]
    missing = {path: stamp for path, stamp in current.items() if known.get(path) != stamp}
    return _Changes(index, records_in_file, stale, _Reading(folder, missing))


def _refresh(changes: _Changes) -> Refreshed:
    index = changes.index
    folder = index.parent
    reading = changes.reading
    arriving = iter(reading)
    count = changes.records
    try:
        _remove_scratch(folder)
        first = next(arriving, None)
        if first is not None or changes.stale:
            folder.mkdir(parents=True, exist_ok=True)
            scratch = temporary_path(folder, "index")
            scratch.mkdir()
            try:
                found = chain([first], arriving) if first else arriving
                count = _write(changes, scratch / INDEX, found)
                os.replace(scratch / INDEX, index)
            finally:
                shutil.rmtree(scratch, ignore_errors=True)
        (folder / EARLIER).unlink(missing_ok=True)
    except OSError as error:
        raise CatalogError(
            f"cannot write {index}: {error}; choose a folder you may write with ISETHDR_HOME=/path"
        ) from error
    return Refreshed(index, count, {str(folder / p): why for p, why in reading.skipped.items()})


def _write(
    changes: _Changes, fresh: Path, stores: Iterable[tuple[str, str, list[dict[str, Any]]]]
) -> int:
    """Write `fresh`, the index with its changes, and return the number of its records.

    Raises
    ------
    OSError : it cannot be written, for example because the disk is full.
    """
    if changes.records:
        shutil.copyfile(changes.index, fresh)
    with index_file.errors_of_duckdb(), index_file.connected() as base:
        writer = index_file.Writer(base, fresh)
        # another process may have replaced the file by one that holds some of the new stores
        held = index_file.known(base).keys() & changes.reading.stamps.keys()
        writer.remove({*changes.stale, *held})
        writer.add(stores)
        return writer.close()


def _begin_comparison(folder: Path) -> dict[str, Any] | None:
    """Return the state of the folders of stores before they are read; None if one of them changed a
    moment ago, or is on another file system with an unknown clock.
    """
    found: dict[str, Any] = {}
    try:
        mark = temporary_path(folder, "index.state")
        mark.touch()
        try:
            now = mark.stat()
        finally:
            mark.unlink()
        for part in FOLDERS:
            found[part] = _folder_state(folder / part)
            if found[part]:
                status = (folder / part).stat()
                if status.st_dev != now.st_dev or status.st_ctime > now.st_mtime - SETTLED_S:
                    return None
    except OSError:
        return None
    return found


def _remember(folder: Path, compared: dict[str, Any]) -> None:
    temporary = temporary_path(folder, STATE)
    with suppress(OSError):
        try:
            temporary.write_text(json.dumps(compared))
            temporary.replace(folder / STATE)
        finally:
            temporary.unlink(missing_ok=True)


def _folder_state(folder: Path) -> str:
    """Return a text that changes whenever an entry of a folder is added, renamed or removed."""
    try:
        status = os.stat(folder)
    except OSError:
        return ""
    return f"{status.st_ino}-{status.st_mtime_ns}-{status.st_ctime_ns}"


def _stamp(file: str | os.PathLike[str]) -> str:
    try:
        status = os.stat(file)
    except OSError:
        return ""
    return f"{status.st_ino}-{status.st_mtime_ns}-{status.st_size}"


def _remove_scratch(folder: Path) -> None:
    """Remove the scratch folders of interrupted refreshes."""
    remove_leftovers(folder)
    for path in folder.glob(".index-*"):
        with suppress(OSError):
            if folder.stat().st_mtime - path.stat().st_mtime > OLD_SCRATCH_S:
                shutil.rmtree(path, ignore_errors=True)
