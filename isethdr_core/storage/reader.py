"""Reader of zarr files with a manifest: a difference from the manifest is an error, never a fill
value.
"""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import AsyncGenerator, AsyncIterator, Sequence
from pathlib import Path
from typing import Any

from zarr.abc.store import ByteRequest, OffsetByteRequest, RangeByteRequest
from zarr.core.buffer import Buffer, BufferPrototype
from zarr.storage import LocalStore

from .manifest import Manifest, check_parts, check_whole, damaged


class CheckedReads(ABC):
    """Reads of zarr files, each compared with the manifest.

    Small files are compared by their SHA-256, chunks of a shard by their CRC-32C. Files that the
    manifest does not list do not exist for zarr.
    """

    root: Path
    manifest: Manifest

    async def get(
        self,
        key: str,
        prototype: BufferPrototype | None = None,
        byte_range: ByteRequest | None = None,
    ) -> Buffer | None:
        """Return the bytes of a file, or of a range of it; None if the manifest has no
        such file.

        Parameters
        ----------
        key : path of the file below the store.
        prototype : kind of buffer to return; None: the default of zarr.
        byte_range : bytes to read; None: the whole file.
        """
        if key not in self.manifest.files:
            return None
        return self._checked(key, byte_range, await self._stored(key, prototype, byte_range))

    async def get_ranges(
        self,
        key: str,
        byte_ranges: Sequence[ByteRequest | None],
        *,
        prototype: BufferPrototype,
        **_: Any,
    ) -> AsyncIterator[Sequence[tuple[int, Buffer | None]]]:
        """Yield ranges of a file one by one.

        The method of zarr would wrap an error of `get` in an exception group.

        Parameters
        ----------
        key : path of the file below the store.
        byte_ranges : bytes to read in each request; None: the whole file.
        prototype : kind of buffer to return.
        _ : further options of zarr, which do not change the result.
        """
        for index, byte_range in enumerate(byte_ranges):
            yield [(index, await self.get(key, prototype, byte_range))]

    async def list_dir(self, prefix: str) -> AsyncGenerator[str, None]:
        """Yield the names of the files and folders directly below `prefix`, from the manifest."""
        start = f"{prefix.rstrip('/')}/" if prefix else ""
        below = (key[len(start) :] for key in self.manifest.files if key.startswith(start))
        for name in dict.fromkeys(path_below.partition("/")[0] for path_below in below):
            yield name

    @abstractmethod
    async def _stored(
        self, key: str, prototype: BufferPrototype | None, byte_range: ByteRequest | None
    ) -> Buffer | None:
        """Return the bytes as they are stored; None if they are missing."""

    @abstractmethod
    def _check_once(self, key: str) -> None:
        """Compare a whole file with the manifest, unless that was done before."""

    def _checked(self, key: str, byte_range: ByteRequest | None, content: Buffer | None) -> Buffer:
        record = self.manifest.files[key]
        if content is None:
            raise damaged(self.root, key, "is missing")
        view = content.as_numpy_array()
        if byte_range is None:
            check_whole(self.root, key, record, view)
            return content
        if isinstance(byte_range, RangeByteRequest):
            start = byte_range.start
            expected = byte_range.end - byte_range.start
        elif isinstance(byte_range, OffsetByteRequest):
            start = byte_range.offset
            expected = record.size - byte_range.offset
        else:
            start = record.size - byte_range.suffix
            expected = byte_range.suffix
        if len(view) != expected:
            raise damaged(self.root, key, "is shorter than it was written")
        if not check_parts(self.root, key, record, start, view):
            self._check_once(key)
        return content


class ManifestStore(CheckedReads, LocalStore):
    """A folder of zarr files, read only; each read is compared with the manifest."""

    def __init__(self, root: Path, manifest: Manifest, *, read_only: bool = True) -> None:
        super().__init__(root, read_only=True)
        self.manifest = manifest
        self._whole: dict[str, tuple[int, ...]] = {}  # shards read as a whole: state of the file

    def with_read_only(self, read_only: bool = True) -> ManifestStore:
        """Return the same store, which is always read-only."""
        return type(self)(self.root, self.manifest)

    def get_sync(
        self,
        key: str,
        *,
        prototype: BufferPrototype | None = None,
        byte_range: ByteRequest | None = None,
    ) -> Buffer | None:
        """Return the same as `get`, without an event loop.

        Parameters
        ----------
        key : path of the file below the store.
        prototype : kind of buffer to return; None: the default of zarr.
        byte_range : bytes to read; None: the whole file.
        """
        if key not in self.manifest.files:
            return None
        content = super().get_sync(key, prototype=prototype, byte_range=byte_range)
        return self._checked(key, byte_range, content)

    def get_ranges_sync(
        self,
        key: str,
        byte_ranges: Sequence[ByteRequest | None],
        *,
        prototype: BufferPrototype,
        **_: Any,
    ) -> Sequence[tuple[int, Buffer | None]]:
        """Return the same as `get_ranges`, without an event loop.

        Parameters
        ----------
        key : path of the file below the store.
        byte_ranges : bytes to read in each request; None: the whole file.
        prototype : kind of buffer to return.
        _ : further options of zarr, which do not change the result.
        """
        return [
            (index, self.get_sync(key, prototype=prototype, byte_range=byte_range))
            for index, byte_range in enumerate(byte_ranges)
        ]

    async def _stored(
        self, key: str, prototype: BufferPrototype | None, byte_range: ByteRequest | None
    ) -> Buffer | None:
        return await LocalStore.get(self, key, prototype, byte_range)

    def _check_once(self, key: str) -> None:
        """Compare a whole file with the manifest, unless it was compared since its last change."""
        path = self.root / key
        status = os.stat(path)
        state = (status.st_ino, status.st_mtime_ns, status.st_size)
        if self._whole.get(key) != state:
            check_whole(self.root, key, self.manifest.files[key], path.read_bytes())
            self._whole[key] = state
