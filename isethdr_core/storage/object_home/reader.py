"""Reads of a published store: its files in the bucket, compared with its manifest."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from zarr.abc.store import ByteRequest
from zarr.core.buffer import Buffer, BufferPrototype, default_buffer_prototype
from zarr.storage import ObjectStore

from ...errors import CatalogError
from ..manifest import (
    MANIFEST_FILE,
    OTHER_BYTES,
    Manifest,
    check_sizes,
    check_whole,
    damaged,
    in_group,
    read_manifest,
)
from ..reader import CheckedReads
from .address import Address
from .bucket import Bucket, bucket_of
from .publication import Published, published, release


class PublishedStore(CheckedReads, ObjectStore[Any]):
    """The files of a published store, read only; each read is compared with the manifest."""

    def __init__(self, root: Path, manifest: Manifest, bucket: Bucket, location: str) -> None:
        super().__init__(bucket.objects, read_only=True)
        self.root = root
        self.manifest = manifest
        self.bucket = bucket
        self.location = location
        self._whole: set[str] = set()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PublishedStore) and other.location == self.location

    def with_read_only(self, read_only: bool = True) -> PublishedStore:
        """Return the same store, which is always read-only."""
        return self

    async def exists(self, key: str) -> bool:
        """Return whether the manifest lists a file."""
        return key in self.manifest.files

    async def _stored(
        self, key: str, prototype: BufferPrototype | None, byte_range: ByteRequest | None
    ) -> Buffer | None:
        wanted = prototype or default_buffer_prototype()
        with self.bucket.asked("read"):
            return await ObjectStore.get(self, f"{self.location}/{key}", wanted, byte_range)

    def _check_once(self, key: str) -> None:
        """Compare a whole file with the manifest, once: published files never change."""
        if key not in self._whole:
            found = self.bucket.sha256(f"{self.location}/{key}")
            if found is None:
                raise damaged(self.root, key, "is missing")
            if found != self.manifest.files[key].sha256:
                raise damaged(self.root, key, OTHER_BYTES)
            self._whole.add(key)


def published_store(root: Path, manifest: Manifest, address: Address, group: str) -> PublishedStore:
    """Return a published store for reading a group, whose metadata are compared with the manifest.

    Parameters
    ----------
    root : local folder of the store.
    manifest : manifest of the store.
    address : bucket and prefix of the object home.
    group : path of the group to read; empty for the root.

    Raises
    ------
    CatalogError : the metadata are damaged, the store is not in the catalog, or a request fails.
    """
    bucket = bucket_of(address)
    known = _known(root, address)
    keys = in_group(manifest, group)
    contents = bucket.get_all(f"{known.location}/{key}" for key in keys)
    for key, content in zip(keys, contents, strict=True):
        if content is None:
            raise damaged(root, key, "is missing")
        check_whole(root, key, manifest.files[key], content.content)
    return PublishedStore(root, manifest, bucket, known.location)


def check_published(root: Path, manifest: Manifest, address: Address) -> None:
    """Raise CatalogError unless every file is in the bucket with its size. The check takes one
    listing request.

    Parameters
    ----------
    root : local folder of the store.
    manifest : manifest of the store.
    address : bucket and prefix of the object home.
    """
    if problem := next(iter(_problems_of_sizes(root, manifest, address)), None):
        raise damaged(root, *problem)


def release_copy(root: Path, address: Address) -> None:
    """Replace the files of a published store on this machine by a stub.

    Raises
    ------
    CatalogError : a file is missing in the bucket or has another size, or the request fails.
    """
    manifest = read_manifest(root)
    if manifest is not None:
        check_published(root, manifest, address)
        release(root)


def published_problems(root: Path, manifest: Manifest, address: Address) -> list[str] | None:
    """Read every file of a published store and return its problems, one line per file; None if the
    store is not published.

    Parameters
    ----------
    root : local folder of the store.
    manifest : manifest of the store.
    address : bucket and prefix of the object home.
    """
    bucket = bucket_of(address)
    known = published(root)
    if known is None:
        return None
    wrong = dict(_problems_of_sizes(root, manifest, address))
    keys = [key for key in manifest.files if key not in wrong]
    digests = bucket.sha256_all(f"{known.location}/{key}" for key in keys)
    for key, digest in zip(keys, digests, strict=True):
        if digest is None:
            wrong[key] = "is missing"
        elif digest != manifest.files[key].sha256:
            wrong[key] = OTHER_BYTES
    return [f"{key} {problem}" for key, problem in wrong.items()]


def _problems_of_sizes(root: Path, manifest: Manifest, address: Address) -> list[tuple[str, str]]:
    known = _known(root, address)
    start = f"{known.location}/"
    listed = bucket_of(address).listing(start)
    sizes = {entry.key.removeprefix(start): entry.size for entry in listed}
    sizes.pop(MANIFEST_FILE, None)
    return check_sizes(manifest, sizes)


def _known(root: Path, address: Address) -> Published:
    known = published(root)
    if known is None:
        raise CatalogError(
            f"the store {root.stem} is not in {address.url}; type isethdr catalog find --home"
            f" {address.url}"
        )
    return known
