"""A folder that is replaced completely or not at all.

The files are written into a hidden folder in the same parent folder. The last step is one call of
the operating system: a rename, or an exchange of two names (renameat2 of Linux, renamex_np of
macOS).
"""

from __future__ import annotations

import ctypes
import errno
import json
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from isethdr_core.errors import CatalogError
from isethdr_core.storage.atomic_write import remove_leftovers, temporary_path

MANIFEST = "manifest.json"
MARK = "isethdr_export"  # key of the manifest: the version of its layout
# constants of renameat2; macOS calls the second one RENAME_SWAP
AT_FDCWD = -100
EXCHANGE = 2


def check_target(folder: Path, force: bool) -> None:
    """Check that a folder may be made or replaced.

    Parameters
    ----------
    folder : folder of the export.
    force : whether an earlier export in it may be replaced.

    Raises
    ------
    CatalogError : it is a file; it is not empty and `force` is not set; it holds files that are not
        part of an export; or its parent folder is missing or not writable.
    """
    if folder.exists() and not folder.is_dir():
        raise CatalogError(f"{folder} is a file; expected the name of a folder to make")
    held = sorted(_files(folder)) if folder.is_dir() else []
    if held and not force:
        raise CatalogError(
            f"the folder {folder} is not empty; expected a new one; type another name, or --force"
            " to replace an earlier export"
        )
    if held and (foreign := sorted(set(held) - _of_export(folder))):
        raise CatalogError(
            f"the folder {folder} holds {foreign[0]!r}, which no export wrote"
            f" ({len(foreign)} such files); --force replaces exports alone; choose another folder"
        )
    beside = folder.resolve().parent
    if not beside.is_dir():
        raise CatalogError(f"there is no folder {beside}; make it first: mkdir -p {beside}")
    if not os.access(beside, os.W_OK):
        raise CatalogError(f"cannot write into {beside}: no permission; choose another folder")


@contextmanager
def replaced(folder: Path) -> Iterator[Path]:
    """Yield an empty folder that replaces `folder` when the block ends without an error. A symbolic
    link is kept, and the folder that it names is replaced.

    Raises
    ------
    CatalogError : the files cannot be written, for example because the disk is full.
    """
    target = folder.resolve()
    remove_leftovers(target.parent)
    temporary = temporary_path(target.parent, target.name)
    try:
        temporary.mkdir()
        yield temporary
        if target.exists():
            exchange(temporary, target)
        else:
            temporary.rename(target)
    except OSError as error:
        raise CatalogError(
            f"cannot write {folder}: {error.strerror or error}; {folder} is as it was; make room or"
            " choose another folder"
        ) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)  # the old folder, or the rest after an error


@contextmanager
def errors_of_openexr() -> Iterator[None]:
    """Raise OSError for an EXR file that cannot be written, for which OpenEXR raises RuntimeError.

    Raises
    ------
    OSError : the block raised RuntimeError, for example because the disk is full.
    """
    try:
        yield
    except RuntimeError as error:
        raise OSError(str(error)) from error


def exchange(a: Path, b: Path) -> None:
    """Exchange the names of two folders of one file system, in one step if the system can do so.

    Parameters
    ----------
    a, b : the folders.

    Raises
    ------
    OSError : a name does not exist, or may not be changed.
    """
    library = ctypes.CDLL(None, use_errno=True)
    names = os.fsencode(a), os.fsencode(b)
    if sys.platform == "darwin":
        failed = library.renamex_np(*names, ctypes.c_uint(EXCHANGE))
    elif sys.platform == "linux":
        failed = library.renameat2(AT_FDCWD, names[0], AT_FDCWD, names[1], ctypes.c_uint(EXCHANGE))
    else:
        failed = -1
        ctypes.set_errno(errno.ENOSYS)
    if not failed:
        return
    number = ctypes.get_errno()
    if number not in (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP):
        raise OSError(number, os.strerror(number), str(b))
    # file systems such as NFS cannot exchange names; for an instant there is no folder `b`
    aside = temporary_path(b.parent, b.name)
    b.rename(aside)
    a.rename(b)
    aside.rename(a)


def _files(folder: Path) -> Iterator[str]:
    for path in folder.rglob("*"):
        if not path.is_dir() or path.is_symlink():
            yield path.relative_to(folder).as_posix()


def _of_export(folder: Path) -> set[str]:
    """Return the paths of the manifest and of the files that it lists; none without a manifest."""
    try:
        manifest = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        assert MARK in manifest
        return {MANIFEST, *(str(row["path"]) for row in manifest["files"])}
    except (OSError, ValueError, KeyError, TypeError, AssertionError):
        return set()
