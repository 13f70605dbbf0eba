"""Files of a training, which are written completely or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from isethdr_core.errors import CatalogError
from isethdr_core.storage.atomic_write import remove_leftovers, temporary_path


def write_file(path: Path, parts: Iterable[bytes | memoryview]) -> None:
    """Write a file of a training, completely or not at all.

    Parameters
    ----------
    path : path of the file; its folder is made.
    parts : parts of the content, one after the other.

    Raises
    ------
    CatalogError : the file cannot be written. An earlier file of this name is kept.
    """
    temporary = temporary_path(path.parent, path.name)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        remove_leftovers(path.parent)
        with open(temporary, "wb") as file:
            for part in parts:
                file.write(part)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as err:
        raise CatalogError(
            f"cannot write {path}: {err.strerror or err}; the training is kept as it was last"
            " stored; make room and type the same command again"
        ) from err
    finally:
        temporary.unlink(missing_ok=True)
