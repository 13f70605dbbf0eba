"""Labels of runs in an object home: one small object for each run, merged by compare-and-swap."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from ...errors import CatalogError
from ..atomic_write import write_text
from .address import Address
from .bucket import Bucket, bucket_of

LABELS = "labels"  # of a bucket
KNOWN = ".labels"  # of a scratch folder: the version of each object that was read
MOST_TRIES = 50


def merge_labels(path: Path, address: Address, merged: Callable[[str], str]) -> None:
    """Change the labels of a run in its object home and in the scratch folder.

    Parameters
    ----------
    path : file of the labels in the scratch folder.
    address : bucket and prefix of the object home.
    merged : function(stored text, "" for none) -> text to store. It is called again if another
        writer was faster.

    Raises
    ------
    CatalogError : a request fails, or other writers were faster each time.
    """
    bucket = bucket_of(address)
    key = f"{LABELS}/{path.name}"
    for _ in range(MOST_TRIES):
        stored = bucket.get(key)
        text = merged(stored.content.decode() if stored else "")
        if stored and stored.content.decode() == text:
            write_text(path, text)
            return
        content = text.encode()
        written = (
            bucket.replace(key, content, stored.etag) if stored else bucket.create(key, content)
        )
        if written:
            write_text(path, text)
            return
    raise CatalogError(
        f"{key} in {address.url} was changed by others {MOST_TRIES} times in a row; run it again"
    )


def follow_labels(folder: Path, bucket: Bucket) -> None:
    """Write the labels that have changed in the bucket to the scratch folder."""
    known = _known(folder)
    current = {entry.key: entry.etag for entry in bucket.listing(f"{LABELS}/")}
    changed = [key for key, etag in current.items() if known.get(key) != etag]
    for key, content in zip(changed, bucket.get_all(changed), strict=True):
        if content is not None:
            (folder / "runs").mkdir(exist_ok=True)
            write_text(folder / "runs" / key.removeprefix(f"{LABELS}/"), content.content.decode())
    for key in known.keys() - current.keys():
        (folder / "runs" / key.removeprefix(f"{LABELS}/")).unlink(missing_ok=True)
    if known != current:
        write_text(folder / KNOWN, json.dumps(current))


def _known(folder: Path) -> dict[str, str]:
    with suppress(OSError, ValueError):
        stored = json.loads((folder / KNOWN).read_text(encoding="utf-8"))
        if isinstance(stored, dict):
            return stored
    return {}
