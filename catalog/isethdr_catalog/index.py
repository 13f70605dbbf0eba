"""Index: `index.parquet`, a cache of all records. Queries include every store, whether it is in the
index or not.

The stores are authoritative. Stores and records are compared by path and by the state of the root
metadata file (inode, time, size), never by the order of times, so a clock that is set back does no
harm. Writers of stores do not touch the index, so it needs no lock. It can be deleted at any time.
"""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from isethdr_core.errors import CatalogError
from isethdr_core.extras import needed
from isethdr_core.runs.labels import SUFFIX as LABELS
from isethdr_core.storage.atomic_write import remove_leftovers, temporary_path

from .record import COLUMNS, SCHEMA, records

if TYPE_CHECKING:
    import duckdb

FOLDERS = ("scenes", "runs", "studies")
DETAILS = ("objects", "scores", "ledger", "assets")  # columns that `find` does not need
STORED_COLUMNS = COLUMNS | {"stamp": "VARCHAR"}
FROM_BATCH = f"SELECT unnest(from_json(?, '{json.dumps([STORED_COLUMNS])}'), recursive := true)"
BATCH_BYTES = (
    1_000_000  # of records that are handed to DuckDB at once; ten times as much takes 200 MB
)
ROWS_AT_ONCE = 2048  # of a Parquet row group, the least possible: DuckDB holds one in memory
# scratch folders without a writer's name, of an older version, are left alone for so long
OLD_SCRATCH_S = 3600.0


@dataclass(frozen=True)
class Refreshed:
    """What a refresh found: how many records, and every store that was skipped, with the reason."""

    path: Path
    records: int
    skipped: dict[str, str]


@dataclass
class _Reading:
    """Records of stores, read in batches, and which stores were skipped on the way."""

    folder: Path
    stamps: dict[str, str]  # of the stores to read, by path
    skipped: dict[str, str] = field(default_factory=dict)

    def batches(self) -> Iterator[str]:
        """Yield JSON arrays of records; damaged stores are named in `skipped`."""
        batch, size = [], 0
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
                self.skipped[str(self.folder / path)] = str(error) or type(error).__name__
                continue
            batch += [json.dumps(_finite(row | {"stamp": stamp}), allow_nan=False) for row in rows]
            size += sum(map(len, batch[-len(rows) :]))
            if size > BATCH_BYTES:
                yield f"[{','.join(batch)}]"
                batch, size = [], 0
        if batch:
            yield f"[{','.join(batch)}]"


def stores(folder) -> list[Path]:
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


def refresh(folder) -> Refreshed:
    """Bring `<folder>/index.parquet` up to date: read new stores only, forget those that are gone.

    Damaged stores are named and skipped. Records pass through one at a time, so memory does not
    grow with them.

    Raises
    ------
    CatalogError : the index cannot be written.
    """
    folder = Path(folder)
    return _refresh(folder, stamps(folder))


def _refresh(folder: Path, current: dict[str, str]) -> Refreshed:
    with needed("the index of the catalog", extra="catalog"):
        import duckdb

    index = folder / "index.parquet"
    with duckdb.connect() as base:
        # one row group in memory at a time
        base.execute("SET threads=1")
        base.execute("SET preserve_insertion_order=false")
        _current_table(base, current)
        known = _known(base, index)
        reading = _Reading(
            folder, {path: stamp for path, stamp in current.items() if known.get(path) != stamp}
        )
        try:
            _remove_scratch(folder)
            stale = any(current.get(path) != stamp for path, stamp in known.items())
            if reading.stamps or stale:
                _rewrite(
                    base, index, reading, keep=_still_current(index) if known else "", stale=stale
                )
        except OSError as error:
            raise CatalogError(
                f"cannot write {index}: {error}; choose a folder you may write with"
                " ISETHDR_HOME=/path"
            ) from error
        count = (
            base.execute(f"SELECT count(*) FROM {_file(index)}").fetchone()[0]
            if index.exists()
            else 0
        )
    return Refreshed(index, count, reading.skipped)


def load(base: duckdb.DuckDBPyConnection, folder, details: bool = True) -> None:
    """Make the table `shots` of all records in memory.

    The index is brought up to date first. Where it cannot be written, or was replaced meanwhile by
    a process that knew fewer stores, the records that it lacks are read from the stores.

    Parameters
    ----------
    details : False leaves the columns `DETAILS` empty, which are most of the memory.
    """
    folder = Path(folder)
    index, current = folder / "index.parquet", stamps(folder)
    with suppress(CatalogError):  # a home that cannot be written is queried all the same
        _refresh(folder, current)
    columns = ", ".join(f"{name} {kind}" for name, kind in STORED_COLUMNS.items())
    base.execute(f"CREATE TABLE shots ({columns})")
    _current_table(base, current)
    selected = "*" if details else f"* REPLACE ({', '.join(f'NULL AS {name}' for name in DETAILS)})"
    if _known(base, index):
        base.execute(f"INSERT INTO shots SELECT {selected} FROM ({_still_current(index)})")
    indexed = dict(base.execute("SELECT DISTINCT path, stamp FROM shots").fetchall())
    missing = _Reading(
        folder, {path: stamp for path, stamp in current.items() if indexed.get(path) != stamp}
    )
    for batch in missing.batches():
        base.execute(f"INSERT INTO shots SELECT {selected} FROM ({FROM_BATCH})", [batch])
    base.execute("DROP TABLE current")
    base.execute("ALTER TABLE shots DROP COLUMN stamp")
    _pass_on_lighting(base)


def _stamp(file: str) -> str:
    try:
        status = os.stat(file)
    except OSError:
        return ""
    return f"{status.st_ino}-{status.st_mtime_ns}-{status.st_size}"


def _known(base: duckdb.DuckDBPyConnection, index: Path) -> dict[str, str]:
    """Return the stamp of every store that the index holds, by path; nothing where the index cannot
    be used.
    """
    with needed("the index of the catalog", extra="catalog"):
        import duckdb

    columns = ", ".join(STORED_COLUMNS)
    try:
        base.execute(f"SELECT {columns} FROM {_file(index)} LIMIT 0")
        rows = base.execute(
            f"SELECT DISTINCT path, stamp FROM {_file(index)} WHERE schema = {SCHEMA}"
        )
        return dict(rows.fetchall())
    except duckdb.Error:  # missing, cut off, or of another version
        return {}


def _rewrite(
    base: duckdb.DuckDBPyConnection, index: Path, reading: _Reading, keep: str, stale: bool
) -> None:
    """Write the index anew: records of the query `keep`, and those of stores that are read now.

    `stale` : the index holds records that `keep` leaves out.
    """
    index.parent.mkdir(parents=True, exist_ok=True)
    scratch = temporary_path(index.parent, "index")
    scratch.mkdir()
    try:
        queries = [keep] if keep else []
        for number, batch in enumerate(reading.batches()):
            part = scratch / f"{number}.parquet"
            base.execute(f"COPY ({FROM_BATCH}) TO '{_quoted(part)}' (FORMAT parquet)", [batch])
        if any(scratch.iterdir()):
            queries.append(f"SELECT * FROM read_parquet('{_quoted(scratch)}/*.parquet')")
        if not (stale or len(queries) > bool(keep)):
            return
        fresh = scratch / "index"
        base.execute(
            f"COPY ({' UNION ALL '.join(queries)}) TO '{_quoted(fresh)}' (FORMAT parquet,"
            f" ROW_GROUP_SIZE {ROWS_AT_ONCE})"
        )
        os.replace(fresh, index)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _current_table(base: duckdb.DuckDBPyConnection, current: dict[str, str]) -> None:
    base.execute("CREATE OR REPLACE TABLE current (path VARCHAR, stamp VARCHAR)")
    base.execute(
        "INSERT INTO current SELECT unnest(?), unnest(?)", [list(current), list(current.values())]
    )


def _still_current(index: Path) -> str:
    columns = ", ".join(
        f"CAST({name} AS {kind}) AS {name}" for name, kind in STORED_COLUMNS.items()
    )
    return (
        f"SELECT {columns} FROM {_file(index)} SEMI JOIN current USING (path, stamp) WHERE schema ="
        f" {SCHEMA}"
    )


def _file(index: Path) -> str:
    return f"read_parquet('{_quoted(index)}')"


def _remove_scratch(folder: Path) -> None:
    """Remove the scratch folders of interrupted refreshes."""
    remove_leftovers(folder)
    for path in folder.glob(".index-*"):
        with suppress(OSError):
            if folder.stat().st_mtime - path.stat().st_mtime > OLD_SCRATCH_S:
                shutil.rmtree(path, ignore_errors=True)


def _pass_on_lighting(base: duckdb.DuckDBPyConnection) -> None:
    """Give each scene the lightings its runs used: night and day are versions of one stored
    scene.
    """
    base.execute("""
        CREATE TEMP TABLE used AS
        SELECT scene, list_sort(list(DISTINCT lighting)) AS lightings
        FROM (SELECT properties->>'lighting' AS lighting,
                     unnest(CASE WHEN json_array_length(properties, '/scene_ids') > 0
                            THEN from_json(properties->'/scene_ids', '["VARCHAR"]')
                             ELSE [derived_from] END) AS scene
              FROM shots WHERE kind = 'run')
        WHERE lighting IS NOT NULL GROUP BY scene
    """)
    base.execute("""
        UPDATE shots
        SET properties = json_merge_patch(properties, json_object('lighting', lightings))
        FROM (SELECT DISTINCT id, coalesce(lightings, []) AS lightings
              FROM shots LEFT JOIN used ON id = scene WHERE kind = 'scene') AS scenes
        WHERE shots.id = scenes.id AND shots.kind = 'scene'
    """)
    base.execute("DROP TABLE used")


def _finite(value):
    """Return `value` with NaN as null, which SQL knows how to skip, and infinity as a number beyond
    all others.
    """
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else math.copysign(1e308, value)
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    return [_finite(v) for v in value] if isinstance(value, list) else value


def _quoted(path) -> str:
    return str(path).replace("'", "''")
