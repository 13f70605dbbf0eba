"""Bounded cache: files of results that may be removed at any time, the least recently used first.

A result is one file below `<home>/intermediate`. Its name is the hash of the inputs of the result,
and it is written under a temporary name first. It ends with a SHA-256 of its content. A file that
is missing, unreadable, or different from its SHA-256 counts as absent: the result is computed
again. Writes do not wait for the disk: a power cut may damage a file, and the SHA-256 detects this.

Any number of processes may use one folder. Each of them keeps the folder below its own bound.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .atomic_write import remove_leftovers, temporary_path
from .exact_encoding import NotExact, Types

SUFFIX = ".result"
FORMAT = b"isethdr result 1"  # start of every file; the number rises when the encoding changes
BEGINS = 64  # bytes before the encoded value, for the format and the name
DIGEST = 32  # bytes at the end of every file, a SHA-256
BLOCK = 4096  # bytes that a small file takes on disk
# share of the bound that may be written before the folder is measured again
BETWEEN_LOOKS = 0.02


class Entry(NamedTuple):
    """One file of the cache."""

    path: Path
    used_ns: int  # when it was last read or written
    size: int  # bytes that it takes on disk


@dataclass
class BoundedCache:
    """Results by name.

    Parameters
    ----------
    folder : folder of the files; made on the first write.
    most_bytes : largest total size of the files on disk.
    types : the classes of which results consist.
    """

    folder: Path
    most_bytes: int
    types: Types = field(default_factory=Types)
    # bytes written since the folder was measured; None: not measured yet
    _since: int | None = field(default=None, init=False)

    def get(self, name: str) -> Any:
        """Return the result `name`; None if it is absent or damaged."""
        path = self._path(name)
        try:
            with open(path, "rb") as file:
                content = np.empty(os.fstat(file.fileno()).st_size, np.uint8)
                whole = file.readinto(content.data) == content.size
        except OSError:
            return None
        if not (whole and _is_intact(content, name)):
            with suppress(OSError):  # the folder is read-only
                path.unlink(missing_ok=True)
            return None
        with suppress(OSError):  # the folder is read-only, or was just removed
            os.utime(path)
        return self.types.decoded(content[BEGINS:-DIGEST])

    def put(self, name: str, value: Any, worth_bytes: float = float("inf")) -> bool:
        """Keep a result, and return whether it was kept.

        Parameters
        ----------
        name : name of the result.
        value : the result.
        worth_bytes : a larger result is not kept.

        Notes
        -----
        A result is not kept either if it could not be restored exactly, if it would take more than
        a fourth of the cache, or if the folder cannot be written.
        """
        try:
            buffers = [FORMAT.ljust(BEGINS - len(name)) + name.encode(), *self.types.encoded(value)]
        except NotExact:
            return False
        size = sum(map(len, buffers)) + DIGEST
        if size > min(worth_bytes, self.most_bytes / 4):
            return False
        digest = hashlib.sha256()
        for buffer in buffers:
            digest.update(buffer)
        temporary = temporary_path(self.folder, name)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._make_room(size)
            with open(temporary, "wb") as file:
                file.writelines([*buffers, digest.digest()])
            os.replace(temporary, self._path(name))
        except OSError:  # a full disk, or no permission: the run continues without the cache
            return False
        finally:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)
        return True

    def _make_room(self, size: int) -> None:
        """Remove the least recently used files, so that `size` more bytes stay within the bound."""
        block_size = -(-size // BLOCK) * BLOCK
        step = int(BETWEEN_LOOKS * self.most_bytes)
        if self._since is not None and self._since + block_size <= step:
            self._since += block_size
            return
        remove_leftovers(self.folder)
        trim(self.folder, self.most_bytes - step - block_size)
        self._since = 0

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}{SUFFIX}"


def entries(folder: Path) -> Iterator[Entry]:
    """Yield the files of a cache; none if the folder does not exist."""
    with suppress(FileNotFoundError, NotADirectoryError), os.scandir(folder) as directory:
        for file in directory:
            if not file.name.endswith(SUFFIX):
                continue
            with suppress(FileNotFoundError):  # removed by another process just now
                state = file.stat()
                yield Entry(Path(file.path), state.st_mtime_ns, 512 * state.st_blocks)


def trim(folder: Path, most_bytes: int) -> list[Entry]:
    """Remove the least recently used files until the rest has at most `most_bytes`.

    Returns
    -------
    The removed files.
    """
    known = sorted(entries(folder), key=lambda entry: entry.used_ns)
    total_bytes = sum(entry.size for entry in known)
    removed = []
    for entry in known:
        if total_bytes <= most_bytes:
            break
        entry.path.unlink(missing_ok=True)
        total_bytes -= entry.size
        removed.append(entry)
    return removed


def _is_intact(content: np.ndarray, name: str) -> bool:
    """Return whether a file is of this format and name, and as it was written."""
    if content.size < BEGINS + DIGEST:
        return False
    head = content[:BEGINS].tobytes()
    if not (head.startswith(FORMAT + b" ") and head.endswith(b" " + name.encode())):
        return False
    return hashlib.sha256(content[:-DIGEST].data).digest() == content[-DIGEST:].tobytes()
