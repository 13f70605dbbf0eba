"""Code cache: facts about files and digests of components, kept in the process and between
processes.

Facts are cached by the content of a file. Digests are cached by the state (time of change, size) of
all files and folders that they depend on. Both caches are files in the user's cache folder, and may
be deleted at any time. In a folder without write permission nothing is cached.
"""

from __future__ import annotations

import json
import os
import sqlite3
import sys
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from .code_facts import RULES, Facts, digest_of, facts_of

MOST_ENTRIES = 4000  # largest number of records in a cache file; the newest ones stay
LONGEST_WAIT_S = 5.0  # longest wait for another process that writes; then nothing is cached

Stamp = tuple[int, int]  # time of the last change (ns) and size (bytes)


def stamp_of(path: str) -> Stamp:
    """Return the state of a file or folder; (0, 0) where there is none."""
    try:
        state = os.stat(path)
    except OSError:
        return 0, 0
    return state.st_mtime_ns, state.st_size


class KeptTable:
    """A table of JSON records in one SQLite file. A process reads only the records that it needs.

    A file that cannot be read or written counts as empty: a cache must never stop a run.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._read: dict[str, Any] = {}
        self._new: dict[str, Any] = {}

    def get(self, key: str) -> Any:
        """Return a record, None where there is none."""
        if key in self._new:
            return self._new[key]
        if key not in self._read:
            self._read[key] = self._stored(key)
        return self._read[key]

    def put(self, key: str, record: Any) -> None:
        """Add a record; `save` writes it."""
        self._new[key] = record

    def save(self) -> None:
        """Add the new records to the file; records of other processes stay."""
        if not self._new or self._path is None:
            return
        new = [(key, json.dumps(record)) for key, record in self._new.items()]
        self._read |= self._new
        self._new = {}
        with suppress(OSError, sqlite3.Error):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            try:
                self._write(new)
            except sqlite3.OperationalError:
                raise  # locked for long, a full disk, no permission: the file itself is sound
            except sqlite3.DatabaseError:
                self._path.unlink(missing_ok=True)
                self._write(new)

    def _write(self, records: list[tuple[str, str]]) -> None:
        with closing(self._connected()) as file, file:
            file.execute(
                "CREATE TABLE IF NOT EXISTS records"
                " (number INTEGER PRIMARY KEY, key TEXT UNIQUE, record TEXT)"
            )
            file.executemany("INSERT OR REPLACE INTO records (key, record) VALUES (?, ?)", records)
            file.execute(
                "DELETE FROM records WHERE number <= (SELECT max(number) FROM records) - ?",
                [MOST_ENTRIES],
            )

    def _stored(self, key: str) -> Any:
        if self._path is None or not self._path.exists():
            return None
        with suppress(sqlite3.Error, ValueError), closing(self._connected()) as file:
            row = file.execute("SELECT record FROM records WHERE key = ?", [key]).fetchone()
            return None if row is None else json.loads(row[0])
        return None

    def _connected(self) -> sqlite3.Connection:
        """Return a new connection for each call, because forked processes must not share one."""
        connection = sqlite3.connect(self._path or "", timeout=LONGEST_WAIT_S)
        # without waiting for the disk: a cache that a power cut damaged is made again
        connection.execute("PRAGMA synchronous = OFF")
        return connection


class CodeCache:
    """Facts and digests.

    Parameters
    ----------
    folder : folder in which they are kept between processes; None: they are not kept.
    """

    def __init__(self, folder: Path | None) -> None:
        version = f"{RULES}_{sys.version_info.major}.{sys.version_info.minor}"
        self._kept_facts = KeptTable(folder and folder / f"code_facts_{version}.sqlite")
        self._kept_digests = KeptTable(folder and folder / f"code_digests_{version}.sqlite")
        self._facts: dict[str, Facts] = {}
        self._contents: dict[str, tuple[Stamp, str]] = {}

    def content(self, path: str) -> str:
        """Return the digest of a file's bytes. The file is read again only if its state has
        changed.
        """
        stamp = stamp_of(path)
        stored = self._contents.get(path)
        if stored is None or stored[0] != stamp:
            with open(path, "rb") as file:
                stored = self._contents[path] = stamp, digest_of(file.read())
        return stored[1]

    def facts(self, path: str) -> Facts:
        """Return the facts of a Python file."""
        key = self.content(path)
        if key not in self._facts:
            record = self._kept_facts.get(key)
            if record is None:
                with open(path, "rb") as file:
                    self._facts[key] = facts_of(file.read())
                self._kept_facts.put(key, asdict(self._facts[key]))
            else:
                self._facts[key] = Facts.from_record(record)
        return self._facts[key]

    def digest(
        self, key: str, make: Callable[[], tuple[dict[str, Any], list[str]]]
    ) -> dict[str, Any]:
        """Return the record of `key`; compute it again if a file or folder that it depends on has
        changed.

        Parameters
        ----------
        key : name of the record.
        make : function that returns the record, and the paths that it depends on.
        """
        entry = self._kept_digests.get(key)
        if entry is not None:
            if all(stamp_of(path) == tuple(stamp) for path, stamp in entry["stamps"].items()):
                kept_record: dict[str, Any] = entry["record"]
                return kept_record
        record, paths = make()
        # the stamp of a file is from the time when it was read
        stamps = {path: self._contents.get(path, (stamp_of(path),))[0] for path in sorted(paths)}
        self._kept_digests.put(key, {"record": record, "stamps": stamps})
        return record

    def save(self) -> None:
        """Store new records for later processes."""
        self._kept_facts.save()
        self._kept_digests.save()


def cache_folder() -> Path:
    """Return the folder of the user's caches."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "isethdr"
