"""Manifest of a store: size and checksum of every file, so that damage is an error and never read
as data.

zarr returns the fill value if a chunk file is missing: 0, False or NaN, which are plausible data.
The manifest therefore lists all files that were written. It is an empty zarr group,
`manifest/zarr.json`, with the attributes

    store    name of the store, so that exchanged stores are detected
    files    {path: {size, sha256, parts}} of every other file, including the root attributes
    digest   SHA-256 of `store` and `files`

A changed file contradicts the manifest, a changed manifest contradicts its digest, and a store of
this format without a manifest is refused. An edit of any single file is therefore detected. A
consistent change of both a file and the manifest is not: checksums protect against damage, not
against forgery.

`parts` serves reads of single chunks of a shard. Each chunk, and the index behind the last one,
ends with a CRC-32C, which the manifest repeats. A damaged chunk is detected without reading the
rest of the shard. A CRC-32C over a whole file would be useless: after data that end with their own
CRC, the register is the same for all data of one length (Koopman, 32-bit cyclic redundancy codes
for Internet applications, 2002). Whole files therefore have a SHA-256.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import accumulate
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import CatalogError

MANIFEST = "manifest"  # the group's name: no dataset may use it
METADATA = "zarr.json"
MANIFEST_FILE = f"{MANIFEST}/{METADATA}"
OTHER_BYTES = "holds other bytes than were written"  # what is wrong with a file
CRC_BYTES = 4
ADVICE = (
    "see `isethdr catalog verify`; remove a store that cannot be repaired, and compute it again"
)


class Part(NamedTuple):
    """One chunk of a shard, or its index: size in bytes, and the CRC-32C in its last four bytes."""

    size: int
    crc32c: int


@dataclass(frozen=True)
class FileRecord:
    """Entry of the manifest for one file; `parts` is empty if the file is read as a whole."""

    size: int
    sha256: str
    parts: tuple[Part, ...] = ()

    @cached_property
    def borders(self) -> list[int]:
        """First byte of each part, and the end of the last."""
        return list(accumulate((part.size for part in self.parts), initial=0))


@dataclass(frozen=True)
class Manifest:
    """All files of a store except the manifest itself, by their paths below the store."""

    store: str
    files: dict[str, FileRecord]


def file_record(buffers: list[bytes], sharded: bool = False) -> FileRecord:
    """Describe a file that consists of `buffers`.

    Parameters
    ----------
    buffers : bytes in the order of the file. For a shard: data, CRC-32C, data, CRC-32C, ...
    sharded : whether the file is a shard.
    """
    digest = hashlib.sha256()
    for buffer in buffers:
        digest.update(buffer)
    pairs = zip(buffers[::2], buffers[1::2], strict=True) if sharded else ()
    parts = tuple(
        Part(len(chunk) + CRC_BYTES, int.from_bytes(crc, "little")) for chunk, crc in pairs
    )
    return FileRecord(sum(map(len, buffers)), digest.hexdigest(), parts)


def serialized(manifest: Manifest) -> bytes:
    """Return the bytes of `manifest/zarr.json`."""
    files = {}
    for key, record in sorted(manifest.files.items()):
        files[key] = {"size": record.size, "sha256": record.sha256}
        if record.parts:
            files[key]["parts"] = [list(part) for part in record.parts]
    content = {"store": manifest.store, "files": files}
    attributes = content | {"digest": hashlib.sha256(_json(content)).hexdigest()}
    return _json({"zarr_format": 3, "node_type": "group", "attributes": attributes})


def write_manifest(root: Path, manifest: Manifest) -> None:
    """Write the manifest of the store `root`, as a whole or not at all."""
    file = root / MANIFEST_FILE
    file.parent.mkdir(exist_ok=True)
    temporary = file.with_suffix(f".{os.getpid()}.tmp")
    try:
        temporary.write_bytes(serialized(manifest))
        temporary.replace(file)
    finally:
        temporary.unlink(missing_ok=True)


def read_manifest(root: Path) -> Manifest | None:
    """Return the manifest of a store; None if it has none.

    Raises
    ------
    CatalogError : the manifest was changed or cannot be read, or belongs to a store of another
        name.
    """
    try:
        status = os.stat(root / MANIFEST_FILE)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise damaged(root, MANIFEST_FILE, f"cannot be read ({error})") from None
    manifest = _parsed(root, status.st_ino, status.st_mtime_ns, status.st_size)
    if manifest.store not in (root.stem, root.resolve().stem):
        raise CatalogError(
            f"the store {root} holds the data of {manifest.store!r}: it was renamed or exchanged; "
            f"rename it to {manifest.store}.zarr, or see `isethdr catalog verify`"
        )
    return manifest


@lru_cache(maxsize=64)
def _parsed(root: Path, *_state: int) -> Manifest:
    """Read a manifest, once per process as long as the file does not change."""
    try:
        text = (root / MANIFEST_FILE).read_bytes()
        attributes = json.loads(text)["attributes"]
        files = {}
        for key, entry in attributes["files"].items():
            parts = tuple(Part(*part) for part in entry.get("parts", ()))
            files[key] = FileRecord(entry["size"], entry["sha256"], parts)
        manifest = Manifest(attributes["store"], files)
        same = serialized(manifest) == text and METADATA in files
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise damaged(root, MANIFEST_FILE, f"cannot be read ({error})") from None
    if not same:
        raise damaged(root, MANIFEST_FILE, "was changed: it contradicts its own digest")
    return manifest


def check_files(root: Path, manifest: Manifest) -> None:
    """Raise CatalogError unless every file is there with its size; contents are not read."""
    for key, record in manifest.files.items():
        if problem := _missing(root, key, record):
            raise damaged(root, key, problem)


def check_sizes(manifest: Manifest, sizes: dict[str, int]) -> list[tuple[str, str]]:
    """Return (file, problem) of each file that is missing, has another size, or is not listed.

    Parameters
    ----------
    manifest : manifest of the store.
    sizes : {path of a file below the store: its size in bytes}, of all files that exist.
    """
    wrong = [
        (key, _other_size(sizes[key], record.size) if key in sizes else "is missing")
        for key, record in manifest.files.items()
        if sizes.get(key) != record.size
    ]
    extra = sorted(sizes.keys() - manifest.files.keys())
    return wrong + [(key, "is not part of the store") for key in extra]


def in_group(manifest: Manifest, group: str) -> list[str]:
    """Return the files with the metadata of a group and of its arrays."""
    keys = []
    for key in manifest.files:
        folder, _, name = key.rpartition("/")
        if name == METADATA and group in (folder, folder.rpartition("/")[0]):
            keys.append(key)
    return keys


def check_metadata(root: Path, manifest: Manifest, group: str) -> None:
    """Raise CatalogError if the metadata of a group or of its arrays differ from the manifest.

    Parameters
    ----------
    root : folder of the store.
    manifest : manifest of the store.
    group : path of the group below the store; empty for the root.
    """
    for key in in_group(manifest, group):
        try:
            content = (root / key).read_bytes()
        except OSError as error:
            raise damaged(root, key, f"cannot be read ({error.strerror})") from None
        check_whole(root, key, manifest.files[key], content)


def problems(root: Path, manifest: Manifest) -> list[str]:
    """Read every file of a store and return its problems, one line per file."""
    lines = []
    for key, record in manifest.files.items():
        problem = _missing(root, key, record)
        if not problem:
            try:
                with open(root / key, "rb") as file:
                    same = hashlib.file_digest(file, "sha256").hexdigest() == record.sha256
                problem = "" if same else OTHER_BYTES
            except OSError as error:
                problem = f"cannot be read ({error})"
        if problem:
            lines.append(f"{key} {problem}")
    extra = set(stored_files(root)) - manifest.files.keys() - {MANIFEST_FILE}
    return lines + [f"{key} is not part of the store" for key in sorted(extra)]


def stored_files(root: Path) -> Iterable[str]:
    """Yield the path below `root` of every file there."""
    for folder, _, names in os.walk(root):
        for name in names:
            yield Path(folder, name).relative_to(root).as_posix()


def check_whole(root: Path, key: str, record: FileRecord, content: bytes | np.ndarray) -> None:
    """Raise CatalogError if a file differs from what was written.

    Parameters
    ----------
    root : folder of the store.
    key : path of the file below the store.
    record : entry of the file in the manifest.
    content : the whole file, as a buffer of bytes.
    """
    view = memoryview(content)
    if len(view) != record.size:
        raise damaged(root, key, _other_size(len(view), record.size))
    if record.parts:
        check_parts(root, key, record, 0, view)
    elif hashlib.sha256(view).hexdigest() != record.sha256:
        raise damaged(root, key, OTHER_BYTES)


def check_parts(root: Path, key: str, record: FileRecord, start: int, content: Any) -> bool:
    """Compare the CRC-32C of parts of a shard with the manifest.

    Parameters
    ----------
    root : folder of the store.
    key : path of the file below the store.
    record : entry of the file in the manifest.
    start : first byte of `content` in the file.
    content : a buffer that holds a whole number of parts.

    Returns
    -------
    bool : False if `content` does not begin and end with a part, so that nothing was compared.

    Raises
    ------
    CatalogError : a part differs from the written one.
    """
    import google_crc32c

    view = np.frombuffer(content, np.uint8)
    covered = _covered(record, start, start + len(view))
    if covered is None:
        return False
    first = 0
    for part in covered:
        end = first + part.size
        crc = google_crc32c.value(view[first : end - CRC_BYTES])
        stored_crc = int.from_bytes(view[end - CRC_BYTES : end].tobytes(), "little")
        first = end
        if not crc == stored_crc == part.crc32c:
            raise damaged(root, key, "holds other chunks than were written")
    return True


def damaged(root: Path, key: str, problem: str) -> CatalogError:
    """Return the error that names a damaged file of a store.

    Parameters
    ----------
    root : folder of the store.
    key : path of the damaged file below the store.
    problem : the damage, as the rest of a sentence after the path.
    """
    return CatalogError(f"the store {root} is damaged: {key} {problem}; {ADVICE}")


def _covered(record: FileRecord, start: int, end: int) -> tuple[Part, ...] | None:
    """Return the parts from byte `start` to `end`; None if these are not borders of parts."""
    first = bisect_left(record.borders, start)
    last = bisect_left(record.borders, end)
    borders = record.borders[first : first + 1] + record.borders[last : last + 1]
    return record.parts[first:last] if borders == [start, end] else None


def _missing(root: Path, key: str, record: FileRecord) -> str:
    try:
        status = os.stat(root / key)
    except OSError as error:
        return f"is missing ({error.strerror})"
    if not stat.S_ISREG(status.st_mode):
        return "is not a file"
    return "" if status.st_size == record.size else _other_size(status.st_size, record.size)


def _other_size(size: int, expected: int) -> str:
    return f"has {size} bytes, {expected} were written"


def _json(content: dict[str, Any]) -> bytes:
    return json.dumps(content, allow_nan=False).encode()
