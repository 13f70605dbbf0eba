"""Index of a bucket: the contents of many small objects in a few segments.

A new machine reads these segments instead of one object for each store and each label. The objects
stay authoritative: a version counts only if the listing of the objects names its tag and its size.
Removed stores and changed labels are therefore never read from the index, and versions that the
index lacks are read from the objects. The index may be incomplete, damaged or missing; this only
costs more requests.

Segments are changed by compare-and-swap. A writer adds to one of the segments that are not full,
chosen at random. If another writer is faster several times, the writer begins its own segment, so
that there are as many open segments as simultaneous writers.
"""

from __future__ import annotations

import logging
import random
import re
import time
import uuid
from collections.abc import Iterable, Iterator, Sequence
from datetime import timedelta
from functools import lru_cache

from ...errors import CatalogError
from .bucket import AT_ONCE, Bucket, Content, Entry
from .index_segment import Segment, Version, packs

INDEX = "index/1"  # prefix in a bucket; the number is the format of the segments
# size of a compressed segment from which nothing more is added: 70 runs, 0.1 CPU s for a change
FULL_BYTES = 256_000
FEW = AT_ONCE  # up to this number, objects are read in one step, and an index would not be faster
TRIES = 4  # number of tries of a writer before it begins its own segment
PAUSE_S = 0.05  # longest pause after the first lost try; doubled with each
# a server may run on several machines, whose clocks differ by less than this
CLOCKS = timedelta(minutes=1)

log = logging.getLogger(__name__)


def contents(bucket: Bucket, wanted: Sequence[Entry], complete: bool = False) -> Iterator[Version]:
    """Yield the current versions of listed objects, in any order. Objects that are gone are left
    out.

    Parameters
    ----------
    bucket : objects of the home.
    wanted : objects of a listing, which tells their current versions.
    complete : whether versions that the index lacks are added to it, which needs the permission to
        write.

    Raises
    ------
    CatalogError : a request fails.
    """
    rest = {entry.key: entry for entry in wanted}
    if len(rest) > FEW or (complete and rest):
        for segment in _read_segments(bucket, _useful(bucket, wanted, complete)):
            for version in segment.versions:
                entry = rest.get(version.key)
                if entry is not None and _is_current(version, entry):
                    del rest[version.key]
                    yield version
    for pack in packs(read_versions(bucket, list(rest))):
        yield from pack
        if complete:
            add(bucket, pack)


def add(bucket: Bucket, versions: Iterable[Version]) -> None:
    """Add versions of objects to the index. A failure is only logged, because it costs readers no
    more than one request.
    """
    try:
        for pack in packs(versions):
            _add(bucket, pack)
    except CatalogError as error:
        log.warning(
            "the index of %s lacks an entry, so that each reader needs one more request: %s",
            bucket.address.url,
            error,
        )


def read_versions(bucket: Bucket, keys: list[str]) -> Iterator[Version]:
    """Yield the versions of objects that are read one by one; those that are gone are left out."""
    for key, stored in zip(keys, bucket.get_all(keys), strict=True):
        if stored is not None:
            yield Version(key, stored.etag, stored.content)


def segments(bucket: Bucket) -> list[Entry]:
    """Return the objects that hold the index. Other objects below its prefix are logged."""
    found = []
    for entry in bucket.listing(f"{INDEX}/"):
        if re.fullmatch(r"[0-9a-f]{32}\.zst", entry.key.removeprefix(f"{INDEX}/")):
            found.append(entry)
        else:
            _say_ignored(bucket.address.url, entry.key, "it is no part of the index")
    return found


def begin_segment(bucket: Bucket, versions: Iterable[Version]) -> None:
    """Write a new segment under a unique name."""
    key = f"{INDEX}/{uuid.uuid4().hex}.zst"
    bucket.create(key, Segment(tuple(versions)).encoded())


def decoded(bucket: Bucket, key: str, stored: Content | None) -> Segment:
    """Return a segment that was read. A damaged segment is logged and returned empty.

    Parameters
    ----------
    bucket : objects of the home, for the message.
    key : name of the segment's object.
    stored : the object; None if it is gone, which counts as a closed segment.
    """
    if stored is None:
        return Segment(closed=True)
    segment = Segment.decoded(stored.content)
    if segment is None:
        _say_ignored(
            bucket.address.url, key, "it is damaged; type isethdr catalog gc to repair the index"
        )
    return segment or Segment()


def _add(bucket: Bucket, pack: list[Version]) -> None:
    for attempt in range(TRIES):
        not_full = [entry.key for entry in segments(bucket) if entry.size < FULL_BYTES]
        if not not_full:
            break
        key = random.choice(not_full)
        stored = bucket.get(key)
        segment = decoded(bucket, key, stored)
        if stored is not None and not segment.closed:
            content = segment.with_versions(pack).encoded()
            if bucket.replace(key, content, stored.etag) is not None:
                return
        time.sleep(random.uniform(0, PAUSE_S * 2**attempt))
    begin_segment(bucket, pack)


def _useful(bucket: Bucket, wanted: Sequence[Entry], complete: bool) -> list[str]:
    """Return the segments that may hold current versions of objects; none if reading the objects
    takes fewer requests.
    """
    # A version is added to a segment after its object was written.
    oldest = min(entry.changed for entry in wanted) - CLOCKS
    keys = [entry.key for entry in segments(bucket) if entry.changed >= oldest]
    return keys if complete or len(keys) < len(wanted) else []


def _read_segments(bucket: Bucket, keys: list[str]) -> Iterator[Segment]:
    for key, stored in zip(keys, bucket.get_all(keys), strict=True):
        yield decoded(bucket, key, stored)


def _is_current(version: Version, entry: Entry) -> bool:
    same = version.etag == entry.etag and len(version.content) == entry.size
    return same and entry.etag != ""


@lru_cache
def _say_ignored(url: str, key: str, why: str) -> None:
    """Log a warning about an object, once per process."""
    log.warning("ignored %s in %s: %s", key, url, why)
