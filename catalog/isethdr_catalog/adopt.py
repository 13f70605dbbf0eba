"""Adopt: give stores of format 1 a manifest, without computing anything.

Each store is first decoded as a whole. A store that is damaged, incomplete, or lacks a file that
may have been deleted is not adopted, because a manifest certifies the content.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from isethdr_core.errors import CatalogError
from isethdr_core.storage.manifest import (
    CRC_BYTES,
    FileRecord,
    Manifest,
    Part,
    file_record,
    read_manifest,
    write_manifest,
)
from isethdr_core.store import FORMAT, ROOT_FILE, WITHOUT_MANIFEST

from .index import forget, stores
from .verify import verify_store


@dataclass(frozen=True)
class Adoption:
    """Result for one store: `reason` states why it was not adopted; "" if it was."""

    path: Path
    reason: str


def adopt(folder: Path) -> list[Adoption]:
    """Give every store of format 1 in a home folder a manifest. Stores with a manifest are
    skipped.
    """
    adoptions = []
    for path in stores(folder):
        try:
            if adopt_store(path):
                adoptions.append(Adoption(path, ""))
        except CatalogError as error:
            adoptions.append(Adoption(path, str(error)))
    forget(Path(folder))
    return adoptions


def adopt_store(path: Path) -> bool:
    """Give one store a manifest.

    Returns
    -------
    bool : False if the store has one already.

    Raises
    ------
    CatalogError : the store is damaged or incomplete, lacks a file, or cannot be written.
    """
    path = Path(path)
    content = _root(path)
    if content["attributes"].get("format") != WITHOUT_MANIFEST:
        if problems := verify_store(path).problems:
            raise CatalogError("; ".join(problems))
        return False
    # only the format changes, so that an interrupted adoption can be distinguished from damage
    content["attributes"]["format"] = FORMAT
    root = json.dumps(content, allow_nan=False).encode()
    manifest = read_manifest(path)
    if manifest is None:
        manifest = Manifest(path.stem, _files(path) | {ROOT_FILE: file_record([root])})
        _write(path, write_manifest, manifest)
    elif manifest.files[ROOT_FILE] != file_record([root]):
        raise CatalogError(f"{ROOT_FILE} holds other bytes than the manifest says")
    _write(path, _replace_root, root)
    return True


def _root(path: Path) -> dict:
    try:
        content = json.loads((path / ROOT_FILE).read_bytes())
        complete = content["attributes"].get("complete")
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise CatalogError(f"{ROOT_FILE} cannot be read ({error})") from None
    if complete is not True:
        raise CatalogError("incomplete: it lacks the mark that is written last")
    return content


def _files(path: Path) -> dict[str, FileRecord]:
    """Return all files of a store of format 1 that decodes without an error."""
    import zarr

    if problems := verify_store(path).problems:
        raise CatalogError("; ".join(problems))
    files = {}
    for metadata in sorted(path.glob("**/zarr.json")):
        files[metadata.relative_to(path).as_posix()] = file_record([metadata.read_bytes()])
        node = zarr.open(metadata.parent, mode="r", zarr_format=3)
        if not isinstance(node, zarr.Array):
            continue
        parts = node.shards or node.chunks
        grid = (-(-size // part) for size, part in zip(node.shape, parts, strict=True))
        for index in np.ndindex(*grid):
            file = metadata.parent / node.metadata.encode_chunk_key(index)
            key = file.relative_to(path).as_posix()
            if not file.is_file():
                raise CatalogError(
                    f"{key} is missing: it was deleted, or never written because all its values are"
                    " the fill value; these cannot be told apart"
                )
            chunks = (
                math.prod(map(int, node.shards)) // math.prod(node.chunks) if node.shards else 0
            )
            files[key] = _sharded_record(file.read_bytes(), chunks)
    return files


def _sharded_record(data: bytes, chunks: int) -> FileRecord:
    """Return the record of a file; `chunks` is the number of chunks in a shard, 0 without shards.

    If chunks do not follow each other, the record has no parts: reads then compare the whole file.
    """
    whole = file_record([data])
    start = len(data) - 16 * chunks - CRC_BYTES
    if not chunks or start < 0:
        return whole
    index = np.frombuffer(data, "<u8", 2 * chunks, start).reshape(-1, 2)
    index = index[np.argsort(index[:, 0], kind="stable")]
    ends = np.cumsum(index[:, 1])
    if not np.array_equal(index[:, 0], ends - index[:, 1]) or int(ends[-1]) != start:
        return whole
    borders = [*map(int, ends), len(data)]
    sizes = np.diff(borders, prepend=0)
    crcs = [int.from_bytes(data[end - CRC_BYTES : end], "little") for end in borders]
    return FileRecord(whole.size, whole.sha256, tuple(map(Part, map(int, sizes), crcs)))


def _replace_root(path: Path, data: bytes) -> None:
    temporary = path / f"{ROOT_FILE}.tmp"
    temporary.write_bytes(data)
    temporary.replace(path / ROOT_FILE)


def _write(path: Path, write: Callable[..., Any], content: Manifest | bytes) -> None:
    try:
        write(path, content)
    except OSError as error:
        raise CatalogError(f"cannot be written ({error.strerror})") from None
