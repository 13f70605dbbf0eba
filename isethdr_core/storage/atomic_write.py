"""Temporary names of files that are being written, and removal of the temporary files of
interrupted writers.

A store or a file is written under a hidden name that identifies its writer, and then renamed. The
next writer in a folder removes the temporary files of writers that have ended.
"""

from __future__ import annotations

import os
import re
import shutil
import socket
import uuid
from pathlib import Path


def temporary_path(folder: Path, name: str) -> Path:
    """Return the path under which this process writes `name` into `folder` until it is complete."""
    process = f"{os.getpid()}-{_namespace()}"
    return folder / f".{name}.{socket.gethostname()}-{process}-{uuid.uuid4().hex[:6]}.tmp"


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
    # Whether a writer on another machine is alive cannot be checked. The name of that machine may
    # begin with the name of this one, for example node and node-12. Earlier versions wrote no
    # namespace.
    host = re.escape(socket.gethostname())
    of_this_machine = re.compile(rf"\..+\.{host}-(\d+)(?:-(\d+))?-[0-9a-f]+\.tmp")
    for path in Path(folder).glob(".*.tmp"):
        match = of_this_machine.fullmatch(path.name)
        if match and match[2] in (None, _namespace()) and not _alive(int(match[1])):
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)
            removed.append(path)
    return removed


def _namespace() -> str:
    """Return the number of the namespace of this process: containers of one machine, which may all
    have its name, have process numbers of their own.
    """
    try:
        return re.sub(r"\D", "", os.readlink("/proc/self/ns/pid"))
    except OSError:  # systems other than Linux have one namespace
        return "0"


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # the process is alive and belongs to another user
        pass
    return True
