"""Space: what an object home takes in its bucket, with the remains of interrupted uploads."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from typing import NamedTuple

from .address import Address
from .bucket import PROBE, Bucket, Entry, bucket_of
from .publication import CATALOG, PARTS, Published
from .shared_index import contents


class PartUse(NamedTuple):
    """Space of one part of an object home."""

    part: str
    entries: int  # stores, or uploads that were not finished
    size: int  # bytes


class Upload(NamedTuple):
    """Files of an upload that no catalog names."""

    location: str  # start of the keys of its files
    size: int  # bytes


def interrupted_uploads(address: Address, older_than: timedelta) -> list[Upload]:
    """Return the uploads that were not finished and got no file for some time, and the remains of
    tests of permission.

    Parameters
    ----------
    address : bucket and prefix of the object home.
    older_than : least time since the last file arrived. It must be far longer than the upload of
        one file. Clocks of this machine and of the server are compared, so an hour is too short.
    """
    bucket = bucket_of(address)
    files = _files(bucket)  # before the catalog: an upload that is finished meanwhile is named
    files |= {entry.key: [entry] for entry in bucket.listing(f"{PROBE}/")}
    named = _named(bucket)
    limit = datetime.now(UTC) - older_than
    return [
        Upload(place, sum(entry.size for entry in entries))
        for place, entries in files.items()
        if place not in named and max(entry.changed for entry in entries) < limit
    ]


def remove_uploads(address: Address, uploads: Iterable[Upload]) -> None:
    """Remove the files of interrupted uploads."""
    bucket = bucket_of(address)
    for upload in uploads:
        if upload.location.startswith(f"{PROBE}/"):
            bucket.delete([upload.location])
        else:
            bucket.delete(entry.key for entry in bucket.listing(f"{upload.location}/"))


def bucket_use(address: Address) -> list[PartUse]:
    """Return the space of each part in the bucket; unfinished uploads come last."""
    bucket = bucket_of(address)
    named = _named(bucket)
    files = _files(bucket)
    uses = []
    for part in PARTS:
        here = {place: f for place, f in files.items() if place.startswith(f"{part}/")}
        complete = [entries for place, entries in here.items() if place in named]
        if complete:
            uses.append(PartUse(part, len(complete), sum(e.size for f in complete for e in f)))
    rest = [entries for place, entries in files.items() if place not in named]
    if rest:
        uses.append(PartUse("", len(rest), sum(e.size for entries in rest for e in entries)))
    return uses


def _named(bucket: Bucket) -> set[str]:
    """Return the locations that the catalog names."""
    return {
        Published.decoded(entry.content, entry.key).location
        for entry in contents(bucket, bucket.listing(f"{CATALOG}/"))
    }


def _files(bucket: Bucket) -> dict[str, list[Entry]]:
    """Return all files of stores by the location of their upload."""
    found: dict[str, list[Entry]] = {}
    for part in PARTS:
        for entry in bucket.listing(f"{part}/"):
            place = "/".join(entry.key.split("/")[:2])
            found.setdefault(place, []).append(entry)
    return found
