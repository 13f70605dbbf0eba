"""Verify: read every chunk of every store, to detect damage before the data is needed."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from isethdr_core.errors import CatalogError
from isethdr_core.storage.encoding import LIGHT
from isethdr_core.storage.manifest import problems, read_manifest
from isethdr_core.storage.object_home.calls import home_of_stub, problems_in_bucket
from isethdr_core.store import holes, read_attrs

from .index import FOLDERS, stores

UNFINISHED = "being written, or left by a killed process; the next command that writes removes it"


@dataclass(frozen=True)
class Report:
    """The state of one store. `problems` is empty if all files were read and all checksums
    agree."""

    path: Path
    arrays: int
    problems: tuple[str, ...]
    protected: bool = True  # whether a manifest protects it
    remark: str = ""  # state of a file that is no store

    @property
    def state(self) -> str:
        """The problems in one line, or that there are none."""
        whole = (
            "whole"
            if self.protected
            else "readable, but without a manifest: type isethdr catalog adopt"
        )
        return "; ".join(self.problems) or self.remark or whole


def verify(folder: Path) -> list[Report]:
    """Return a report for every store of a home folder, and one without problems for every
    temporary file: a process writes it, or was interrupted. No temporary file is ever read.
    """
    unfinished = [
        Report(p, 0, (), remark=UNFINISHED)
        for sub in FOLDERS
        for p in sorted((Path(folder) / sub).glob(".*.tmp"))
    ]
    return [verify_store(path) for path in stores(folder)] + unfinished


def verify_store(path: Path) -> Report:
    """Return the problems of one store: its attributes, its manifest, the bytes of every file.

    A store without a manifest (format 1) is decoded instead. Its chunks have checksums, but a
    missing or exchanged file may go unnoticed.
    """
    path = Path(path)
    problems_found = []
    try:
        read_attrs(path)
    except Exception as error:
        problems_found.append(str(error))
    try:
        manifest = read_manifest(path)
    except CatalogError as error:
        problems_found += [] if str(error) in problems_found else [str(error)]
        return Report(path, 0, tuple(problems_found))
    if manifest is not None:
        # files of a published store are read in its bucket, and also here if this machine has them
        here = [] if home_of_stub(path) else problems(path, manifest)
        there = problems_in_bucket(path, manifest) or []
        return Report(path, _arrays(path), (*problems_found, *here, *there))
    count, more = _decoded(path)
    return Report(path, count, (*problems_found, *more), protected=False)


def _arrays(path: Path) -> int:
    """Return the number of arrays in the metadata of a store; 0 if the metadata is damaged."""
    try:
        nodes = json.loads((path / "zarr.json").read_bytes())["consolidated_metadata"]["metadata"]
        return sum(node["node_type"] == "array" for node in nodes.values())
    except KeyError:  # metadata of an earlier version
        return sum(map(_is_array, path.glob("**/zarr.json")))
    except (OSError, ValueError, TypeError, AttributeError):
        return 0  # named as a problem already


def _is_array(metadata: Path) -> bool:
    try:
        return json.loads(metadata.read_bytes())["node_type"] == "array"
    except (OSError, ValueError, KeyError, TypeError):
        return False  # named as a problem already


def _decoded(path: Path) -> tuple[int, list[str]]:
    """Decode every chunk of a store; return the number of arrays, and the problems found."""
    import zarr

    count = 0
    problems_found = []
    for metadata in sorted(path.glob("**/zarr.json")):
        name = str(metadata.parent.relative_to(path))
        try:
            node = zarr.open(metadata.parent, mode="r")
            if not isinstance(node, zarr.Array):
                continue
            count += 1
            if metadata.parent.name in LIGHT and (hole := holes(node)):
                problems_found.append(f"{name}: NaN at {hole}; a chunk is missing")
            elif metadata.parent.name not in LIGHT:
                node[...]
        except Exception as error:  # each codec raises its own kind
            problems_found.append(f"{name}: {error or type(error).__name__}")
    return count, problems_found
