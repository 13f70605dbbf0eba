"""Requests to an object store, through obstore. Each failure is one clear error."""

from __future__ import annotations

import hashlib
import os
import uuid
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from datetime import datetime, timedelta
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ...errors import CatalogError
from ...extras import needed
from .address import Address

with needed("a home in an object store", extra="s3"):
    import obstore
    from obstore.exceptions import (
        AlreadyExistsError,
        BaseError,
        GenericError,
        PermissionDeniedError,
        PreconditionError,
        UnauthenticatedError,
    )
    from obstore.store import S3Store

if TYPE_CHECKING:
    from obstore.store import ObjectStore

AT_ONCE = 16  # number of requests in flight
GROUP = 8 * AT_ONCE  # number of objects with contents in memory at once
PATIENCE = timedelta(seconds=30)  # longest time for repeats of a request
REPEATS = 4  # largest number of repeats of a request
PROBE = "probe"
STREAMED = 1_000_000  # bytes of an object that are in memory at once while its digest is computed


class Entry(NamedTuple):
    """One object of a listing."""

    key: str
    size: int  # bytes
    etag: str
    changed: datetime


class Content(NamedTuple):
    """Bytes of an object, and the tag of this version of it."""

    content: bytes
    etag: str


class Bucket:
    """The objects of one home.

    Raises
    ------
    CatalogError : in every method, if a request is refused or does not arrive.
    """

    def __init__(self, address: Address, objects: ObjectStore) -> None:
        self.address = address
        self.objects = objects  # keys are relative to the prefix of the home
        self._writable = False

    def get(self, key: str) -> Content | None:
        """Return an object; None if it does not exist."""
        with self.asked("read"):
            try:
                answer = obstore.get(self.objects, key)
                return Content(bytes(answer.bytes()), str(answer.meta["e_tag"] or ""))
            except FileNotFoundError:
                return None

    def get_all(self, keys: Iterable[str]) -> Iterator[Content | None]:
        """Yield objects in the order of their keys, several requests at once."""
        rest = iter(keys)
        with ThreadPoolExecutor(AT_ONCE) as pool:
            # in groups, because the pool would keep all contents in memory until they are taken
            while group := list(islice(rest, GROUP)):
                yield from pool.map(self.get, group)

    def sha256(self, key: str) -> str | None:
        """Return the SHA-256 of an object, read in pieces; None where there is none."""
        with self.asked("read"):
            digest = hashlib.sha256()
            try:
                for piece in obstore.get(self.objects, key).stream(min_chunk_size=STREAMED):
                    digest.update(piece)
            except FileNotFoundError:
                return None
            return digest.hexdigest()

    def sha256_all(self, keys: Iterable[str]) -> Iterator[str | None]:
        """Yield the SHA-256 of objects in the order of their keys, several at once."""
        with ThreadPoolExecutor(AT_ONCE) as pool:
            yield from pool.map(self.sha256, keys)

    def put_files(self, files: Iterable[tuple[str, Path]]) -> None:
        """Write objects from files, several at once."""
        with ThreadPoolExecutor(AT_ONCE) as pool:
            for _ in pool.map(lambda pair: self._put_file(*pair), files):
                pass

    def create(self, key: str, content: bytes) -> str | None:
        """Write an object if there is none of that key; return its tag, None if there is one."""
        return self._conditional(key, content, "create")

    def replace(self, key: str, content: bytes, etag: str) -> str | None:
        """Write an object if it still has its tag; return its new tag, None if it was not written.

        Parameters
        ----------
        key : name of the object in the bucket.
        content : bytes to write.
        etag : tag of the content that was read.
        """
        return self._conditional(key, content, {"e_tag": etag})

    def listing(self, prefix: str) -> list[Entry]:
        """Return all objects below a prefix that ends at a slash."""
        with self.asked("list"):
            try:
                found = obstore.list(self.objects, prefix).collect()
            except GenericError:
                # the error of a listing states no reason; that of a read does: no permission or no
                # bucket
                obstore.get(self.objects, PROBE)
                raise
        return [Entry(m["path"], m["size"], m["e_tag"] or "", m["last_modified"]) for m in found]

    def delete(self, keys: Iterable[str]) -> None:
        """Remove objects; those that are gone are no error."""
        listed = list(keys)
        if listed:
            with self.asked("remove"):
                obstore.delete(self.objects, listed)

    def check_writable(self) -> None:
        """Raise CatalogError if this process may not write, or if the server ignores the condition
        of a write. The check takes three small requests, once per process.
        """
        if self._writable:
            return
        key = f"{PROBE}/{uuid.uuid4().hex}"
        self.create(key, b"")
        try:
            if self.create(key, b"") is not None:
                raise CatalogError(
                    f"the server of {self.address.url} ignores the condition If-None-Match of a"
                    " write, so that two writers could lose stores; expected a server with"
                    " conditional writes, as Amazon S3 has them"
                )
        finally:
            self.delete([key])
        self._writable = True

    def _put_file(self, key: str, path: Path) -> None:
        with self.asked("write"):
            obstore.put(self.objects, key, path)

    def _conditional(self, key: str, content: bytes, mode: Any) -> str | None:
        with self.asked("write"):
            try:
                return obstore.put(self.objects, key, content, mode=mode)["e_tag"] or ""
            except (AlreadyExistsError, PreconditionError):
                return None

    @contextmanager
    def asked(self, action: str) -> Iterator[None]:
        """Turn each failure of a request into one error of one line."""
        url = self.address.url
        try:
            yield
        except (PermissionDeniedError, UnauthenticatedError, PermissionError) as error:
            raise CatalogError(
                f"no permission to {action} objects in {url}; expected credentials that may list,"
                " read, write and remove there, for example AWS_ACCESS_KEY_ID and"
                f" AWS_SECRET_ACCESS_KEY ({_first_line(error)})"
            ) from error
        except FileNotFoundError as error:
            raise CatalogError(
                f"there is no bucket {self.address.bucket!r}; looked for {url}; make the bucket,"
                f" or type --home with another one ({_first_line(error)})"
            ) from error
        except (BaseError, OSError) as error:
            raise CatalogError(
                f"cannot {action} objects in {url}: {_first_line(error)}; see that AWS_REGION,"
                " AWS_ENDPOINT_URL and the credentials are those of this bucket"
            ) from error


def bucket_of(address: Address) -> Bucket:
    """Return the bucket of an object home, one for each process and its settings.

    Credentials, region and server are read from the variables AWS_ACCESS_KEY_ID,
    AWS_SECRET_ACCESS_KEY, AWS_SESSION_TOKEN, AWS_REGION, AWS_ENDPOINT_URL, AWS_ALLOW_HTTP and
    AWS_SKIP_SIGNATURE, as obstore names them. Without a key, obstore asks the services of the cloud
    machine for credentials.
    """
    settings = tuple(sorted(item for item in os.environ.items() if item[0].startswith("AWS_")))
    return _bucket(address, os.getpid(), settings)


@lru_cache(maxsize=8)
def _bucket(address: Address, process: int, settings: tuple[tuple[str, str], ...]) -> Bucket:
    try:
        objects = S3Store.from_url(
            address.url,
            retry_config={"max_retries": REPEATS, "retry_timeout": PATIENCE},
        )
    except (BaseError, ValueError) as error:
        raise CatalogError(
            f"cannot open {address.url}: {_first_line(error)}; see the variables that begin with"
            " AWS_"
        ) from error
    return Bucket(address, objects)


def _first_line(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return lines[0][:300] if lines else type(error).__name__
