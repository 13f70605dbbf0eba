"""Calls of the storage: each does nothing for a home that is a folder, and loads no library."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import timedelta
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from .address import STUB, Address, address_of

if TYPE_CHECKING:
    from ..manifest import Manifest
    from .index_upkeep import IndexUpkeep
    from .space import Upload


def follow_home(folder: Path) -> None:
    """Bring a scratch folder up to date with the catalog of its bucket.

    Raises
    ------
    CatalogError : a request fails, or an entry of the catalog is damaged.
    """
    address = address_of(folder)
    if address is not None:
        _operations().follow(folder, address)


def prepare_writing(folder: Path) -> None:
    """Check that stores can be published later, publish stores whose publication was interrupted,
    and add to the index of the bucket the entries that are new on this machine and missing there.

    Parameters
    ----------
    folder : folder of a home, or of one part of it.

    Raises
    ------
    CatalogError : no permission, no bucket, or a server without conditional writes.
    """
    for home in (folder, folder.parent):
        address = address_of(home)
        if address is not None:
            _operations().check_writable(address)
            _operations().follow(home, address, complete=True)
            _operations().publish_pending(home, address)


def publish_store(path: Path) -> None:
    """Publish a complete store of a scratch folder.

    Raises
    ------
    CatalogError : a request fails; the store stays in the scratch folder.
    """
    address = address_of(path.parent.parent)
    if address is not None:
        _operations().publish(path, address)


def share_labels(path: Path, merged: Callable[[str], str]) -> bool:
    """Change the labels of a run in its object home; return False for a home that is a folder.

    Parameters
    ----------
    path : file of the labels in the scratch folder.
    merged : function(stored text, "" for none) -> text to store.
    """
    address = address_of(path.parent.parent)
    if address is None:
        return False
    _operations().merge_labels(path, address, merged)
    return True


def withdraw_store(path: Path, labels: Path) -> None:
    """Remove a published store and its labels from its object home, not yet from this machine.

    Parameters
    ----------
    path : path of the store in the scratch folder.
    labels : file of its labels there; stores other than runs have none.

    Raises
    ------
    CatalogError : a request fails.
    """
    address = address_of(path.parent.parent)
    if address is not None:
        _operations().withdraw(path, labels, address)


def problems_in_bucket(path: Path, manifest: Manifest) -> list[str] | None:
    """Read every file of a published store in its bucket and return its problems; None for a
    store that is not published.
    """
    address = address_of(path.parent.parent)
    if address is None:
        return None
    problems: list[str] | None = _operations().published_problems(path, manifest, address)
    return problems


def check_files_in_bucket(path: Path, manifest: Manifest, address: Address) -> None:
    """Raise CatalogError unless every file of a stub is in the bucket with its size.

    Parameters
    ----------
    path : folder of the stub.
    manifest : manifest of the store.
    address : bucket and prefix of the object home.
    """
    _operations().check_published(path, manifest, address)


def source_in_bucket(path: Path, manifest: Manifest, address: Address, group: str) -> Any:
    """Return the source from which zarr reads the files of a stub, each compared with the
    manifest.

    Parameters
    ----------
    path : folder of the stub.
    manifest : manifest of the store.
    address : bucket and prefix of the object home.
    group : path of the group to read; empty for the root.

    Raises
    ------
    CatalogError : the metadata of the group are damaged, or a request fails.
    """
    return _operations().published_store(path, manifest, address, group)


def use_of_bucket(folder: Path) -> tuple[str, list[tuple[str, int, int]]] | None:
    """Return the address of an object home, and (part, entries, bytes) of each part in its bucket;
    "" stands for uploads that are not finished. None for a home that is a folder.
    """
    address = address_of(folder)
    if address is None:
        return None
    return address.url, list(_operations().bucket_use(address))


def interrupted_uploads(folder: Path, older_than: timedelta) -> list[Upload]:
    """Return the uploads in a bucket that were not finished and got no file for some time; none of
    a home that is a folder.

    Raises
    ------
    CatalogError : a request fails.
    """
    address = address_of(folder)
    if address is None:
        return []
    found: list[Upload] = _operations().interrupted_uploads(address, older_than)
    return found


def remove_uploads(folder: Path, uploads: Sequence[Upload]) -> None:
    """Remove the files of interrupted uploads from the bucket of a home."""
    address = address_of(folder)
    if address is not None and uploads:
        _operations().remove_uploads(address, uploads)


def tidy_index(folder: Path, dry_run: bool = False) -> IndexUpkeep | None:
    """Complete the index in the bucket of a home and remove what is stale in it; None for a home
    that is a folder.

    Parameters
    ----------
    folder : folder of a home.
    dry_run : whether to write nothing.

    Raises
    ------
    CatalogError : a request fails.
    """
    address = address_of(folder)
    if address is None:
        return None
    done: IndexUpkeep = _operations().tidy_index(address, dry_run)
    return done


def is_copy(path: Path) -> bool:
    """Return whether a store is published, and all of its files are on this machine as well."""
    return address_of(path.parent.parent) is not None and bool(_operations().is_copy(path))


def release_copy(path: Path) -> None:
    """Replace the files of a published store on this machine by a stub, after checking that the
    bucket has all of them.

    Raises
    ------
    CatalogError : a file is missing in the bucket or has another size, or a request fails.
    """
    address = address_of(path.parent.parent)
    if address is not None:
        _operations().release_copy(path, address)


def kept_here(label: str, path: Path) -> str:
    """Return the label of a page. In an object home, it states that only this machine has the page.

    Parameters
    ----------
    label : label of the page.
    path : path of the page, at most three folders below the home.
    """
    for folder in list(path.parents)[:3]:
        address = address_of(folder)
        if address is not None:
            return f"{label} (on this machine only, not in {address.url})"
    return label


def home_of_stub(path: Path) -> Address | None:
    """Return the object home with the files of a stub; None for a store with its files here."""
    if not (path / STUB).exists():
        return None
    return address_of(path.parent.parent)


def _operations() -> ModuleType:
    from . import operations  # obstore is an extra

    return operations
