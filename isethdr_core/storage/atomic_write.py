"""Temporary names of files that are being written, and removal of the temporary files of
interrupted writers.

A store or a file is written under a hidden name that identifies its writer, and then renamed. The
next writer in a folder removes the temporary files of writers that have ended.
"""

from __future__ import annotations

import os
import shutil
import socket
import uuid
from pathlib import Path


def temporary_path(folder: Path, name: str) -> Path:
    """Return the path under which this process writes `name` into `folder` until it is complete."""
    return folder / f".{name}.{socket.gethostname()}-{os.getpid()}-{uuid.uuid4().hex[:6]}.tmp"


def write_text(path: Path, text: str) -> None:
    """Write a text file, UTF-8, as a whole or not at all, and remove temporary files of ended
    writers from its folder.
    """
    remove_leftovers(path.parent)
    write_whole(path, text.encode())


def write_whole(path: Path, content: bytes) -> None:
    """Write a file as a whole or not at all, in a time that does not grow with its folder."""
    temporary = temporary_path(path.parent, path.name)
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def remove_leftovers(folder: Path) -> list[Path]:
    """Remove the temporary files of ended writers of this machine from `folder`, and return their
    paths.
    """
    removed = []
    for path in Path(folder).glob(".*.tmp"):
        owner, _, suffix = path.name.removesuffix(".tmp").partition(f".{socket.gethostname()}-")
        pid = suffix.partition("-")[0]
        # whether a writer on another machine is alive cannot be checked
        if owner and pid.isdigit() and not _alive(int(pid)):
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)
            removed.append(path)
    return removed


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # the process is alive and belongs to another user
        pass
    return True
