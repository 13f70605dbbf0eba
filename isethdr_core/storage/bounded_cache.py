"""Bounded cache: files of results that may be removed at any time, the least recently used first.

A result is one file below `<home>/intermediate`, called by the hash of what made it, and written
under a temporary name first. It ends with a SHA-256 of all before it. What does not agree with
that, what cannot be read, and what is not there are all the same: the result is computed again.
Nothing waits for the disk: after a power cut a file may be damaged, which its SHA-256 tells.

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
FORMAT = b"isethdr result 1"  # first in every file; raised when the encoding changes
BEGINS = 64  # bytes before the encoded value: the format, then the name
DIGEST = 32  # bytes of a SHA-256, the last of every file
BLOCK = 4096  # bytes: what a small file takes on disk
# of the bound: what may be written before the folder is looked through again
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
    folder : of the files; made when something is written.
    most_bytes : that the files may take together, on disk.
    types : the classes that results are made of.
    """

    folder: Path
    most_bytes: int
    types: Types = field(default_factory=Types)
    # bytes written since the folder was looked through; None: it has not been
    _since: int | None = field(default=None, init=False)

    def get(self, name: str) -> Any:
        """Return the result `name`; None where it is not kept, or damaged."""
        path = self._path(name)
        try:
            with open(path, "rb") as file:
                content = np.empty(os.fstat(file.fileno()).st_size, np.uint8)
                whole = file.readinto(content.data) == content.size
        except OSError:
            return None
        if not (whole and _is_intact(content, name)):
            path.unlink(missing_ok=True)
            return None
        with suppress(OSError):  # a folder that may only be read, or just removed
            os.utime(path)
        return self.types.decoded(content[BEGINS:-DIGEST])

    def put(self, name: str, value: Any, worth_bytes: float = float("inf")) -> bool:
        """Keep a result, and return whether it is kept.

        Parameters
        ----------
        worth_bytes : a larger result is not worth its space.

        It is not kept either where it would not come back exactly as it is, where it takes more
        than a fourth of the cache, and where the folder cannot be written.
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
        except OSError:  # a full disk, or no permission: the run goes on without
            return False
        finally:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)
        return True

    def _make_room(self, size: int) -> None:
        """Remove what was used longest ago, so that `size` bytes more stay within the bound."""
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
    """Yield the files of a cache; nothing where there is no such folder."""
    with suppress(FileNotFoundError, NotADirectoryError), os.scandir(folder) as directory:
        for file in directory:
            if not file.name.endswith(SUFFIX):
                continue
            with suppress(FileNotFoundError):  # removed by another process just now
                state = file.stat()
                yield Entry(Path(file.path), state.st_mtime_ns, 512 * state.st_blocks)


def trim(folder: Path, most_bytes: int) -> list[Entry]:
    """Remove the files used longest ago until the rest takes `most_bytes` at most.

    Returns
    -------
    What was removed.
    """
    known = sorted(entries(folder), key=lambda entry: entry.used_ns)
    total_bytes, removed = sum(entry.size for entry in known), []
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
