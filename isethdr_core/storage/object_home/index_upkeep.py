"""Upkeep of the index of a bucket: adds what it lacks, drops stale versions, merges segments.

New segments are written before old ones are removed, so the index lacks nothing meanwhile. An old
segment is closed before it is removed, by compare-and-swap: one that a writer has changed stays.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

from .address import Address
from .bucket import Bucket, Entry, bucket_of
from .index_segment import PACK_BYTES, Segment, Version, packs
from .publication import CATALOG
from .shared_index import begin_segment, decoded, read_versions, segments
from .shared_labels import LABELS


class IndexUpkeep(NamedTuple):
    """Work on the index of a bucket."""

    added: int  # number of versions that the index lacks
    removed: int  # number of stale versions in the index
    merged: int  # number of segments that are written anew


@dataclass(frozen=True)
class _Plan:
    current: dict[str, str]  # tags of all objects that the index shall hold
    lacking: list[str]  # keys of objects that the index does not hold
    stale: int  # number of stale versions
    staying: set[str]  # keys of objects in segments that stay unchanged
    replaced: list[Entry]  # segments that are written anew


class _Summary(NamedTuple):
    segment: Entry
    versions: list[tuple[str, str]]  # key and tag
    size: int  # bytes of their contents


def tidy_index(address: Address, dry_run: bool = False) -> IndexUpkeep:
    """Complete the index of a home and remove what is stale or damaged in it.

    Parameters
    ----------
    address : bucket and prefix of the object home.
    dry_run : whether to write nothing.

    Raises
    ------
    CatalogError : a request fails.
    """
    bucket = bucket_of(address)
    plan = _planned(bucket)
    if not dry_run:
        _apply(bucket, plan)
    return IndexUpkeep(len(plan.lacking), plan.stale, len(plan.replaced))


def _planned(bucket: Bucket) -> _Plan:
    # before the listings, so that a store that is published meanwhile is not stale
    summaries = list(_summaries(bucket))
    listed = chain(bucket.listing(f"{CATALOG}/"), bucket.listing(f"{LABELS}/"))
    current = {entry.key: entry.etag for entry in listed}
    held: set[str] = set()
    staying: set[str] = set()
    small = []
    wasteful = []  # segments with stale versions, and damaged ones
    stale = 0
    for segment, versions, size in summaries:
        fresh = {key for key, etag in versions if current.get(key) == etag} - staying
        held |= fresh
        stale += len(versions) - len(fresh)
        if not versions or len(fresh) < len(versions):
            wasteful.append(segment)
        elif size < PACK_BYTES // 2:
            small.append(segment)
        else:
            staying |= fresh
    lacking = [key for key in current if key not in held]
    # a single small segment stays: the last one is rarely full
    replaced = wasteful + small if wasteful or lacking or len(small) > 1 else []
    return _Plan(current, lacking, stale, staying, replaced)


def _summaries(bucket: Bucket) -> Iterator[_Summary]:
    listed = segments(bucket)
    contents = bucket.get_all(entry.key for entry in listed)
    for entry, stored in zip(listed, contents, strict=True):
        versions = decoded(bucket, entry.key, stored).versions
        tags = [(key, etag) for key, etag, _ in versions]
        yield _Summary(entry, tags, sum(len(version.content) for version in versions))


def _apply(bucket: Bucket, plan: _Plan) -> None:
    for pack in packs(chain(_moved(bucket, plan), read_versions(bucket, plan.lacking))):
        begin_segment(bucket, pack)
    closed = Segment(closed=True).encoded()
    for segment in plan.replaced:
        if bucket.replace(segment.key, closed, segment.etag) is not None:
            bucket.delete([segment.key])


def _moved(bucket: Bucket, plan: _Plan) -> Iterator[Version]:
    """Yield the current versions of the segments that are written anew, each object once."""
    seen = set(plan.staying)
    contents = bucket.get_all(entry.key for entry in plan.replaced)
    for entry, stored in zip(plan.replaced, contents, strict=True):
        unchanged = stored is not None and stored.etag == entry.etag
        segment = Segment.decoded(stored.content) if stored and unchanged else None
        for version in segment.versions if segment else ():
            if plan.current.get(version.key) == version.etag and version.key not in seen:
                seen.add(version.key)
                yield version
