"""The scratch folder of an object home follows the catalog of its bucket."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from ...errors import CatalogError
from .address import Address
from .bucket import Bucket, Entry, bucket_of
from .publication import (
    CATALOG,
    PARTS,
    PUBLISHED,
    forget,
    publish,
    published,
    record_path,
    remember,
)
from .shared_index import contents
from .shared_labels import LABELS, FollowedLabels


def follow(folder: Path, address: Address, complete: bool = False) -> None:
    """Make stubs of the stores that other machines have published, remove stores that are gone in
    the bucket, and update the labels.

    This takes one listing request for each 1000 stores. Entries that are new on this machine are
    read from the index of the bucket, or object by object if the index lacks them.

    Parameters
    ----------
    folder : scratch folder.
    address : bucket and prefix of the object home.
    complete : whether entries that the index lacks are added to it, which needs the permission to
        write.

    Raises
    ------
    CatalogError : a request fails, or an entry of the catalog is damaged.
    """
    bucket = bucket_of(address)
    known: dict[Path, list[Path]] = {}
    # a store may be gone although it is recorded: somebody has removed visible files only
    here = {path for part in PARTS for path in _files(folder / part)}
    for part in PARTS:
        for file in _files(folder / PUBLISHED / part):
            store = folder / part / f"{file.name.rsplit('.', 2)[0]}.zarr"
            known.setdefault(store, []).append(file)
    current = _published_stores(folder, bucket)
    fresh = {
        entry.key: path
        for path, entry in current.items()
        if path not in here or record_path(path, entry.etag) not in known.get(path, ())
    }
    labels = FollowedLabels(folder, bucket.listing(f"{LABELS}/"))
    wanted = [*(current[path] for path in fresh.values()), *labels.changed()]
    for version in contents(bucket, wanted, complete):
        if version.key in fresh:
            path = fresh[version.key]
            remember(path, version, known.get(path, ()))
        else:
            labels.take(version)
    for path in known:
        if path not in current:
            forget(path)
    labels.finish()


def _published_stores(folder: Path, bucket: Bucket) -> dict[Path, Entry]:
    """Return the entries of the catalog by the path of their store in the scratch folder."""
    found = {}
    for entry in bucket.listing(f"{CATALOG}/"):
        part, _, name = entry.key.removeprefix(f"{CATALOG}/").partition("/")
        if part in PARTS and name.endswith(".json") and "/" not in name:
            found[folder / part / f"{name.removesuffix('.json')}.zarr"] = entry
    return found


def pending(folder: Path) -> list[Path]:
    """Return the complete stores of a scratch folder that are not published yet."""
    return [
        path
        for part in PARTS
        for path in sorted((folder / part).glob("*.zarr"))
        if not path.name.startswith(".") and published(path) is None
    ]


def publish_pending(folder: Path, address: Address) -> list[Path]:
    """Publish the stores whose publication was interrupted; return them.

    Raises
    ------
    CatalogError : a request fails.
    """
    paths = pending(folder)
    for path in paths:
        publish(path, address)
    return paths


def check_writable(address: Address) -> None:
    """Raise CatalogError if a store could not be published later."""
    bucket_of(address).check_writable()


def _files(folder: Path) -> Iterator[Path]:
    try:
        yield from (folder / name for name in os.listdir(folder) if not name.startswith("."))
    except FileNotFoundError:
        return
    except OSError as error:
        raise CatalogError(f"cannot read the scratch folder {folder}: {error.strerror}") from error
