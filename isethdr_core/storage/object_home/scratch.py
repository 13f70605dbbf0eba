"""The scratch folder of an object home follows the catalog of its bucket."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from ...errors import CatalogError
from .address import Address
from .bucket import Entry, bucket_of
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
from .shared_labels import follow_labels


def follow(folder: Path, address: Address) -> None:
    """Make stubs of the stores that other machines have published, and remove those that are gone.

    One listing request for each 1000 stores, and one request for each store that is new here.

    Raises
    ------
    CatalogError : a request fails, or an entry of the catalog is damaged.
    """
    bucket = bucket_of(address)
    known = {file for part in PARTS for file in _files(folder / PUBLISHED / part)}
    current: dict[Path, Entry] = {}
    for entry in bucket.listing(f"{CATALOG}/"):
        part, _, name = entry.key.removeprefix(f"{CATALOG}/").partition("/")
        if part in PARTS and name.endswith(".json") and "/" not in name:
            path = folder / part / f"{name.removesuffix('.json')}.zarr"
            current[path] = entry
    fresh = [path for path, entry in current.items() if record_path(path, entry.etag) not in known]
    contents = bucket.get_all(current[path].key for path in fresh)
    for path, content in zip(fresh, contents, strict=True):
        if content is not None:  # removed since the listing
            remember(path, content)
    for file in known:
        path = folder / file.parent.name / f"{file.name.rsplit('.', 2)[0]}.zarr"
        if path not in current:
            forget(path)
    follow_labels(folder, bucket)


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
    """Raise CatalogError where a store could not be published later."""
    bucket_of(address).check_writable()


def _files(folder: Path) -> Iterator[Path]:
    try:
        yield from (folder / name for name in os.listdir(folder) if not name.startswith("."))
    except FileNotFoundError:
        return
    except OSError as error:
        raise CatalogError(f"cannot read the scratch folder {folder}: {error.strerror}") from error
