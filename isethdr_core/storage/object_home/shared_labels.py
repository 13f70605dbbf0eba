"""Labels of runs in an object home: one small object for each run, merged by compare-and-swap."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

from ...errors import CatalogError
from ..atomic_write import write_text, write_whole
from .address import Address
from .bucket import Entry, bucket_of
from .index_segment import Version
from .shared_index import add

LABELS = "labels"  # prefix in a bucket
KNOWN = ".labels"  # file of a scratch folder with the version of each object that was read
MOST_TRIES = 50  # largest number of tries of one change


def labels_key(path: Path) -> str:
    """Return the key of the object that holds the labels of the file `path`."""
    return f"{LABELS}/{path.name}"


def merge_labels(path: Path, address: Address, merged: Callable[[str], str]) -> None:
    """Change the labels of a run in its object home and in the scratch folder.

    Parameters
    ----------
    path : file of the labels in the scratch folder.
    address : bucket and prefix of the object home.
    merged : function(stored text, "" for none) -> text to store. It is called again if another
        writer was faster.

    Raises
    ------
    CatalogError : a request fails, or other writers were faster each time.
    """
    bucket = bucket_of(address)
    key = labels_key(path)
    for _ in range(MOST_TRIES):
        stored = bucket.get(key)
        text = merged(stored.content.decode() if stored else "")
        if stored and stored.content.decode() == text:
            write_text(path, text)
            return
        content = text.encode()
        etag = bucket.replace(key, content, stored.etag) if stored else bucket.create(key, content)
        if etag is not None:
            write_text(path, text)
            add(bucket, [Version(key, etag, content)])
            return
    raise CatalogError(
        f"{key} in {address.url} was changed by others {MOST_TRIES} times in a row; run it again"
    )


class FollowedLabels:
    """Brings the labels of a scratch folder up to date with those of the bucket.

    Parameters
    ----------
    folder : scratch folder.
    listed : listing of the labels in the bucket.
    """

    def __init__(self, folder: Path, listed: Iterable[Entry]) -> None:
        self.folder = folder
        self._known = _known(folder)
        self._current = {entry.key: entry for entry in listed}

    def changed(self) -> list[Entry]:
        """Return the labels with a version in the bucket that this machine has not read, or whose
        file is gone on this machine.
        """
        with suppress(OSError):
            here = set(os.listdir(self.folder / "runs"))
            return [
                entry
                for key, entry in self._current.items()
                if self._known.get(key) != entry.etag or self._path(key).name not in here
            ]
        return list(self._current.values())

    def take(self, version: Version) -> None:
        """Write labels from the bucket to the scratch folder."""
        self._path(version.key).parent.mkdir(exist_ok=True)
        write_whole(self._path(version.key), version.content)

    def finish(self) -> None:
        """Remove labels that are gone in the bucket, and record which versions were read."""
        current = {key: entry.etag for key, entry in self._current.items()}
        for key in self._known.keys() - current.keys():
            self._path(key).unlink(missing_ok=True)
        if self._known != current:
            write_text(self.folder / KNOWN, json.dumps(current))

    def _path(self, key: str) -> Path:
        return self.folder / "runs" / key.removeprefix(f"{LABELS}/")


def _known(folder: Path) -> dict[str, str]:
    with suppress(OSError, ValueError):
        stored = json.loads((folder / KNOWN).read_text(encoding="utf-8"))
        if isinstance(stored, dict):
            return stored
    return {}
