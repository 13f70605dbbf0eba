"""Verify: read every chunk of every store, so that what is damaged is known before it is needed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from isethdr_core.store import holes, read_attrs
from isethdr_core.store_encoding import LIGHT

from .index import stores


@dataclass(frozen=True)
class Report:
    """The state of one store: `problems` is empty where all of it was read, checksums included."""

    path: Path
    arrays: int
    problems: tuple[str, ...]


def verify(folder) -> list[Report]:
    """Return a report for every store of a home folder, and one for every temporary name a killed writer left."""
    left = [Report(p, 0, ("a writer was killed here; the next writer removes it",))
            for sub in ("scenes", "runs") for p in sorted((Path(folder) / sub).glob(".*.tmp"))]
    return [verify_store(path) for path in stores(folder)] + left


def verify_store(path) -> Report:
    """Return what is wrong with one store: the mark, the metadata, the checksum of every chunk, holes in its light."""
    import zarr

    path, count, problems = Path(path), 0, []
    try:
        read_attrs(path)
    except Exception as error:
        problems.append(str(error))
    for metadata in sorted(path.glob("**/zarr.json")):
        name = str(metadata.parent.relative_to(path))
        try:
            node = zarr.open(metadata.parent, mode="r")
            if not isinstance(node, zarr.Array):
                continue
            count += 1
            if metadata.parent.name in LIGHT and (hole := holes(node)):
                problems.append(f"{name}: NaN at {hole}; a chunk is missing")
            elif metadata.parent.name not in LIGHT:
                node[...]
        except Exception as error:      # each codec raises its own kind
            problems.append(f"{name}: {error or type(error).__name__}")
    return Report(path, count, tuple(problems))
