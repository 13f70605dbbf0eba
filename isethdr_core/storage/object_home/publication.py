"""Publication: a complete store is uploaded, and made visible by one conditional write.

If the upload fails before that write, it leaves objects that no catalog names. They are removed at
once if this process can do so, otherwise by `isethdr catalog gc`. The store stays complete in the
scratch folder, and the next command that writes to the home publishes it.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import uuid
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ...errors import CatalogError
from ..atomic_write import temporary_path, write_whole
from ..manifest import MANIFEST_FILE, METADATA, read_manifest
from .address import STUB, Address
from .bucket import Content, bucket_of
from .index_segment import Version
from .shared_index import add
from .shared_labels import labels_key

CATALOG = "catalog"  # prefix in a bucket, with one object for each published store
PUBLISHED = ".published"  # folder in a scratch folder, with one file for each of these objects
PARTS = ("scenes", "runs", "studies")


@dataclass(frozen=True)
class Published:
    """A published store, as its object in the catalog states it."""

    location: str  # start of the keys of its files
    size: int  # bytes of all files
    root: str  # text of the root metadata
    manifest: str  # text of the manifest

    def encoded(self) -> bytes:
        """Return the content of the object in the catalog."""
        return json.dumps({"format": 1, **self.__dict__}).encode()

    @classmethod
    def decoded(cls, text: bytes, name: str) -> Published:
        """Return the content of an object of the catalog.

        Raises
        ------
        CatalogError : it is damaged, or of a later format.
        """
        try:
            content = json.loads(text)
            if content.pop("format") == 1:
                return cls(**content)
        except (ValueError, TypeError, KeyError, AttributeError):
            pass
        raise CatalogError(
            f"the entry {name!r} in the catalog of the object home cannot be read; install the"
            " isethdr that wrote it"
        )


def catalog_key(path: Path) -> str:
    """Return the key of the object that makes the store `path` of a scratch folder visible."""
    return f"{CATALOG}/{path.parent.name}/{path.stem}.json"


def published(path: Path) -> Published | None:
    """Return what this machine has recorded of a published store; None if it is not published."""
    for file in _records(path):
        with suppress(FileNotFoundError):  # another process has just replaced it
            return Published.decoded(file.read_bytes(), path.stem)
    return None


def publish(path: Path, address: Address) -> None:
    """Upload a complete store of the scratch folder of `address`, unless it is published.

    If another writer has published a store of that name, the published store replaces this one.
    Both have the same inputs.

    Raises
    ------
    CatalogError : a request fails; the store stays in the scratch folder.
    """
    if published(path) is not None:
        return
    manifest = read_manifest(path)
    if manifest is None:
        raise CatalogError(
            f"the store {path} has no manifest; expected one, because an object home holds only"
            " stores with a manifest; type isethdr catalog adopt"
        )
    bucket = bucket_of(address)
    location = f"{path.parent.name}/{path.stem}-{uuid.uuid4().hex[:12]}.zarr"
    keys = [*manifest.files, MANIFEST_FILE]
    texts = {key: (path / key).read_text(encoding="utf-8") for key in (METADATA, MANIFEST_FILE)}
    size = sum(record.size for record in manifest.files.values()) + len(texts[MANIFEST_FILE])
    ours = Published(location, size, texts[METADATA], texts[MANIFEST_FILE])
    settled = True  # whether it is certain that the catalog does not name the files in `keys`
    try:
        bucket.put_files((f"{location}/{key}", path / key) for key in keys)
        settled = False
        bucket.create(catalog_key(path), ours.encoded())
        # A request is sent again if its answer was lost. It is then refused, because its own first
        # try made the entry. Reading the entry shows who wrote it.
        entry = bucket.get(catalog_key(path))
        settled = True
        if entry is not None and Published.decoded(entry.content, path.stem) == ours:
            keys = []
    except CatalogError as error:
        raise CatalogError(
            f"{error}; the store is kept in {path}, and the next command that writes to"
            f" {address.url} publishes it"
        ) from error
    finally:
        if settled:
            with suppress(CatalogError):
                bucket.delete(f"{location}/{key}" for key in keys)
    if entry is None:
        raise CatalogError(
            f"{address.url} lost the entry of {path.stem} right after it was written; another"
            f" process may have removed it; the store is kept in {path}"
        )
    # before the record of this machine: if the process is killed in between, the next one reads the
    # entry again and adds it
    add(bucket, [Version(catalog_key(path), entry.etag, entry.content)])
    remember(path, entry, _records(path))


def withdraw(path: Path, labels: Path, address: Address) -> None:
    """Take a store out of the catalog of its object home, then remove its labels and files there.

    In this order no store loses its labels or files if this process ends in between.

    Parameters
    ----------
    path : path of the store in the scratch folder.
    labels : file of its labels there; stores other than runs have none.
    address : bucket and prefix of the object home.
    """
    known = published(path)
    if known is None:
        return
    bucket = bucket_of(address)
    bucket.delete([catalog_key(path)])
    bucket.delete([labels_key(labels)])
    bucket.delete(entry.key for entry in bucket.listing(f"{known.location}/"))
    for file in _records(path):
        file.unlink(missing_ok=True)


def remember(path: Path, entry: Content | Version, earlier: Iterable[Path]) -> None:
    """Record in the scratch folder that a store is published. If this machine has no store of this
    name, or one with other files, a stub is made in its place.

    Parameters
    ----------
    path : path of the store in the scratch folder.
    entry : the object of the catalog.
    earlier : records of other versions of this store, which are removed.
    """
    found = Published.decoded(entry.content, path.stem)
    if not _holds(path, found):
        _make_stub(path, found)
    record = record_path(path, entry.etag)
    record.parent.mkdir(parents=True, exist_ok=True)
    write_whole(record, entry.content)
    for file in earlier:
        if file != record:
            file.unlink(missing_ok=True)


def is_copy(path: Path) -> bool:
    """Return whether this machine has all files of a published store."""
    return not (path / STUB).exists() and published(path) is not None


def release(path: Path) -> None:
    """Replace the files of a published store on this machine by a stub.

    Raises
    ------
    CatalogError : it is not published.
    """
    found = published(path)
    if found is None:
        raise CatalogError(
            f"the store {path} is not in the bucket yet; its files on this machine are kept"
        )
    _make_stub(path, found)


def forget(path: Path) -> None:
    """Remove a store from the scratch folder that the bucket no longer has."""
    if path.exists():
        hidden = temporary_path(path.parent, path.name)
        with suppress(FileNotFoundError):
            path.rename(hidden)
        shutil.rmtree(hidden, ignore_errors=True)
    for file in _records(path):
        file.unlink(missing_ok=True)


def record_path(path: Path, etag: str) -> Path:
    """Return the file that records that a store is published. Its name holds the version of the
    object in the catalog. One listing of the folder therefore tells which versions are known.
    """
    version = hashlib.sha256(etag.encode()).hexdigest()[:16]
    return path.parent.parent / PUBLISHED / path.parent.name / f"{path.stem}.{version}.json"


def _records(path: Path) -> list[Path]:
    folder = path.parent.parent / PUBLISHED / path.parent.name
    start = f"{path.stem}."
    try:
        names = os.listdir(folder)
    except FileNotFoundError:
        return []
    return [
        folder / name
        for name in names
        if name.startswith(start) and "." not in name[len(start) :].removesuffix(".json")
    ]


def _holds(path: Path, found: Published) -> bool:
    try:
        return (path / MANIFEST_FILE).read_bytes() == found.manifest.encode()
    except OSError:
        return False


def _make_stub(path: Path, found: Published) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = temporary_path(path.parent, path.name)
    (fresh / MANIFEST_FILE).parent.mkdir(parents=True)
    (fresh / METADATA).write_bytes(found.root.encode())
    (fresh / MANIFEST_FILE).write_bytes(found.manifest.encode())
    (fresh / STUB).touch()
    earlier = temporary_path(path.parent, path.name)
    try:
        if path.exists():
            path.rename(earlier)
        fresh.rename(path)
    except OSError:
        # another process of this machine has made it
        if not path.exists():
            raise
    finally:
        shutil.rmtree(fresh, ignore_errors=True)
        shutil.rmtree(earlier, ignore_errors=True)
