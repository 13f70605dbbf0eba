"""One segment of the index of a bucket: contents of small objects, compressed together."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

from numcodecs.zstd import compress, decompress

MARK = b"isethdr index segment\n"  # first bytes of a segment; a SHA-256 of the rest follows
LEVEL = 3  # level of zstd; 70 runs with 56 kB each take 0.26 MB
DIGEST_BYTES = 32
PACK_BYTES = 8_000_000  # size of the contents that are compressed together: 140 runs
ANY_BYTES = "surrogateescape"  # a damaged object may not be UTF-8; its bytes are kept unchanged


class Version(NamedTuple):
    """One version of an object."""

    key: str  # name of the object in the bucket
    etag: str  # tag that the server gave to this version
    content: bytes


@dataclass(frozen=True)
class Segment:
    """Versions of objects. Nothing is added to a closed segment, which is about to be removed."""

    versions: tuple[Version, ...] = ()
    closed: bool = False

    def with_versions(self, added: Iterable[Version]) -> Segment:
        """Return this segment with further versions. Earlier versions of their objects stay: only
        the listing of the objects tells which one is current.
        """
        together = {(v.key, v.etag): v for v in (*self.versions, *added)}
        return Segment(tuple(together.values()), self.closed)

    def encoded(self) -> bytes:
        """Return the content of the object that holds this segment."""
        rows = [
            (key, etag, content.decode("utf-8", ANY_BYTES)) for key, etag, content in self.versions
        ]
        text = json.dumps({"closed": self.closed, "versions": rows})
        packed = bytes(compress(text.encode(), LEVEL))
        return MARK + hashlib.sha256(packed).digest() + packed

    @classmethod
    def decoded(cls, content: bytes) -> Segment | None:
        """Return the segment that an object holds; None if it is damaged, or is no segment."""
        packed = content[len(MARK) + DIGEST_BYTES :]
        if content[: -len(packed)] != MARK + hashlib.sha256(packed).digest():
            return None
        stored = json.loads(bytes(decompress(packed)))
        rows = stored["versions"]
        versions = (Version(key, etag, text.encode("utf-8", ANY_BYTES)) for key, etag, text in rows)
        return cls(tuple(versions), stored["closed"])


def packs(versions: Iterable[Version]) -> Iterator[list[Version]]:
    """Yield versions in lists of about 8 MB, none of them empty."""
    pack: list[Version] = []
    size = 0
    for version in versions:
        pack.append(version)
        size += len(version.content)
        if size >= PACK_BYTES:
            yield pack
            pack = []
            size = 0
    if pack:
        yield pack
