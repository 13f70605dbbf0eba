"""Space: the disk space of each part of the home folder, and its removal.

Rendered radiance and runs stay until a user removes them. `collect` removes files that are made
again when they are needed. A store gets a temporary name before it is removed, so that no process
reads an incomplete store.
"""

from __future__ import annotations

import json
import os
import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from isethdr_core.errors import MOST_LISTED, CatalogError, did_you_mean
from isethdr_core.runs.labels import SUFFIX as LABELS
from isethdr_core.runs.reuse import FOLDER as INTERMEDIATE
from isethdr_core.sequence.equal_radiance import remove_stale_notes
from isethdr_core.storage.atomic_write import remove_leftovers, temporary_path
from isethdr_core.storage.object_home.address import MARK
from isethdr_core.storage.object_home.calls import (
    is_copy,
    release_copy,
    use_of_bucket,
    withdraw_store,
)
from isethdr_core.store import read_attrs

from .index import INDEX, STATE, stores

COMPARISONS = "comparisons"
PARTS = {  # parts of a home folder, with their description
    "scenes": "rendered radiance",
    "runs": "runs, with their reports and labels",
    "studies": "tables of studies",
    INTERMEDIATE: "results that later runs may reuse; computed again when needed",
    "kernels": "point spread functions; computed again when needed",
    "spectra": "measured spectra of lamps; looked up again when needed",
    "sweeps": "pages and tables of sweeps",
    "datasets": "records, pages and tables of datasets",
    "pairs": "training pairs of datasets",
    "training": "trained networks, and their training data",
    "experiments": "tables and pictures of the experiments",
    "questions": "scores of the studies dirt, render_noise and picture_noise",
    "without_people": "rendered radiance without people, of question=removal",
    "arrays": "arrays from Python that are scenes of runs",
    COMPARISONS: "pages of comparisons; type isethdr catalog compare to write one again",
    "failed": "tracebacks of runs that failed",
    INDEX: "index of the catalog; rebuilt when needed",
    STATE: "state of the index; rebuilt when needed",
    MARK: "address of the object home",
}
HIDDEN = (".published", ".labels")  # notes of a scratch folder about its bucket
MADE_AGAIN = (INTERMEDIATE, "kernels", COMPARISONS)  # parts that `collect` empties
OTHER = "other files"
REPORT = ".html"
# least age of a store that may be removed; a younger one may belong to a run in progress
MAY_BE_IN_USE_S = 3600.0


@dataclass(frozen=True)
class Usage:
    """Disk space of one part of a home folder."""

    part: str
    what: str
    entries: int  # number of stores or files directly in it
    size: int  # bytes


@dataclass(frozen=True)
class Removable:
    """One file or folder that may be removed, the reason, and its size on disk."""

    path: Path
    why: str
    size: int  # bytes


@dataclass(frozen=True)
class Dependents:
    """The runs that depend on a store, damaged runs that may depend on it, and the datasets that
    hold it.
    """

    readers: tuple[str, ...]
    unknown: tuple[str, ...] = ()
    datasets: tuple[str, ...] = ()

    @property
    def is_any(self) -> bool:
        """Whether something depends on the store, or may."""
        return bool(self.readers or self.unknown or self.datasets)


def usage(folder: str | os.PathLike[str]) -> list[Usage]:
    """Return the disk space of each existing part of a home folder. For an object home the parts in
    its bucket come first.
    """
    root = Path(folder)
    usages = _in_bucket(Path(folder))
    for part, description in PARTS.items():
        path = root / part
        if path.exists():
            entries = sum(1 for _ in path.iterdir()) if path.is_dir() else 1
            usages.append(Usage(part, description, entries, size_of(path)))
    visible = root.iterdir() if root.is_dir() else ()
    others = [p for p in visible if p.name not in (*PARTS, *HIDDEN)]
    if others:
        usages.append(
            Usage(
                OTHER,
                "not made by isethdr, or left by an interrupted command",
                len(others),
                _sum(others),
            )
        )
    return usages


def _in_bucket(folder: Path) -> list[Usage]:
    used = use_of_bucket(folder)
    if used is None:
        return []
    url, parts = used
    unfinished = "uploads that are not finished"
    return [
        Usage(f"{url}/{part}", PARTS[part] if part else unfinished, entries, size)
        for part, entries, size in parts
    ]


def size_of(path: Path) -> int:
    """Return the size on disk of a file, or of a folder with all its files, bytes."""
    if not path.is_dir():
        return _blocks(path)
    return sum(
        _blocks(Path(subfolder, name)) for subfolder, _, names in os.walk(path) for name in names
    )


def removable(folder: str | os.PathLike[str], scenes: bool = False) -> list[Removable]:
    """Return the files and folders that may be removed without losing a result.

    Parameters
    ----------
    folder : home folder.
    scenes : include rendered radiance that no stored run has read and no dataset holds. It takes
        long to render.

    Raises
    ------
    CatalogError : with `scenes`, if a run is damaged and does not state what it has read.
    """
    root = Path(folder)
    candidates = [
        Removable(path, PARTS[part], size_of(path))
        for part in MADE_AGAIN
        for path in _visible(root / part)
    ]
    for end, what in ((REPORT, "report"), (LABELS, "labels")):
        for page in sorted((root / "runs").glob(f"*{end}")):
            if not page.with_name(page.name.removesuffix(end) + ".zarr").exists():
                why = f"{what} of a run that no longer exists"
                candidates.append(Removable(page, why, size_of(page)))
    return candidates + (unread_scenes(root) if scenes else [])


def unread_scenes(folder: str | os.PathLike[str]) -> list[Removable]:
    """Return the radiance that no stored run has read, no dataset holds, and no run in progress can
    be using.

    Raises
    ------
    CatalogError : a run is damaged and does not state what it has read.
    """
    root = Path(folder)
    read_by = _readers(root)
    if unknown := read_by.pop("", []):
        raise CatalogError(
            f"the run {unknown[0]} is damaged and does not state which radiance it has read; remove"
            f" it first: type isethdr catalog rm {unknown[0]}"
        )
    kept = {*read_by, *_datasets(root)}
    unread = []
    for path in sorted((root / "scenes").glob("*.zarr")):
        if path.stem not in kept and _age_s(path) > MAY_BE_IN_USE_S:
            unread.append(Removable(path, "radiance that no run has read", size_of(path)))
    return unread


def local_copies(folder: str | os.PathLike[str]) -> list[Removable]:
    """Return the stores of an object home with files both in its bucket and on this machine, which
    no run in progress can be using. The list is empty for a home that is a folder.
    """
    return [
        Removable(path, "local copy of a store in the bucket", size_of(path))
        for path in stores(folder)
        if is_copy(path) and _age_s(path) > MAY_BE_IN_USE_S
    ]


def release_copies(copies: list[Removable]) -> int:
    """Remove the local files of stores that are in the bucket, and return the freed bytes.

    Raises
    ------
    CatalogError : the bucket lacks a file of a store; that store stays.
    """
    for copy in copies:
        release_copy(copy.path)
    return sum(copy.size for copy in copies)


def collect(folder: str | os.PathLike[str], items: list[Removable]) -> int:
    """Remove the items that `removable` listed, temporary files of interrupted writes, and notes of
    equal radiance about missing stores.

    Returns
    -------
    Freed bytes, without temporary files.
    """
    root = Path(folder)
    free = 0
    for part in ("", *PARTS):
        remove_leftovers(root / part)
    for item in items:
        _remove(item.path)
        free += item.size
    remove_stale_notes(root / "scenes")
    return free


def dependents(folder: str | os.PathLike[str], path: Path) -> Dependents:
    """Return the stored runs that have read a store of radiance, and the datasets that hold it;
    nothing depends on other stores.
    """
    if path.parent.name != "scenes":
        return Dependents(())
    read_by = _readers(Path(folder))
    return Dependents(
        tuple(read_by.get(path.stem, ())),
        tuple(read_by.get("", ())),
        tuple(sorted(_datasets(Path(folder)).get(path.stem, ()))),
    )


def find_one(folder: str | os.PathLike[str], name: str) -> Path:
    """Return the path of the store with a key that is or begins with `name`, intact or damaged.

    Raises
    ------
    CatalogError : no store matches, or several do.
    """
    known = stores(folder)
    matches = [p for p in known if p.stem.startswith(name.removesuffix(".zarr"))]
    matches = [p for p in matches if p.stem == name.removesuffix(".zarr")] or matches
    if not name or len(matches) != 1:
        some = ", ".join(p.stem for p in matches[:MOST_LISTED])
        more = len(matches) - MOST_LISTED
        several = f"could be any of {some}" + (f" and {more} more" if more > 0 else "")
        none = f"begins the key of no store{did_you_mean(name, [p.stem for p in known])}"
        raise CatalogError(
            f"{name!r} {several if matches else none}; looked in {folder}; type the first digits of"
            " one key, which isethdr catalog find prints"
        )
    return matches[0]


def remove_store(folder: str | os.PathLike[str], path: Path, force: bool = False) -> int:
    """Remove a store, and the report and the labels next to a run.

    Parameters
    ----------
    folder : home folder.
    path : path of the store.
    force : also remove radiance that runs have read or datasets hold. The runs stay complete;
        missing radiance is rendered again.

    Returns
    -------
    Freed bytes.

    Raises
    ------
    CatalogError : without `force`, if runs have read the store, a damaged run may have, or a
        dataset holds it.
    """
    users = dependents(folder, path)
    if users.datasets and not force:
        raise CatalogError(
            f"the radiance {path.stem} is a scene of the dataset {', '.join(users.datasets[:4])},"
            " which would have to render it again; type --force to remove it all the same"
        )
    if not force and (users.readers or users.unknown):
        runs = ", ".join((users.readers + users.unknown)[:4])
        count = len(users.readers) + len(users.unknown)
        read_by = "was read by" if users.readers else "may have been read by damaged runs,"
        raise CatalogError(
            f"the radiance {path.stem} {read_by} {count} run{'s' * (count > 1)}: {runs}; a later"
            " run that needs it would render it again; type --force to remove it all the same"
        )
    page = path.with_suffix(REPORT)
    free = size_of(path) + (size_of(page) if page.exists() else 0)
    _remove(path)
    _remove(page)
    _remove(path.with_suffix(LABELS))
    return free


def _remove(path: Path) -> None:
    """Remove a file, or a folder under a temporary name; a missing one is no error.

    Raises
    ------
    CatalogError : it cannot be removed, for example without permission.
    """
    try:
        if not path.is_dir():
            path.unlink(missing_ok=True)
            return
        if path.suffix == ".zarr":
            withdraw_store(path, path.with_suffix(LABELS))
        hidden = temporary_path(path.parent, path.name)
        path.rename(hidden)
        shutil.rmtree(hidden)
    except FileNotFoundError:  # another process was faster
        return
    except OSError as error:
        raise CatalogError(f"cannot remove {path}: {error.strerror}") from error


def _readers(root: Path) -> dict[str, list[str]]:
    """Return {radiance: runs that have read it}; damaged runs are listed under ""."""
    readers: dict[str, list[str]] = {}
    stored = [path.stem for path in (root / "scenes").glob("*.zarr")]
    for path in sorted((root / "runs").glob("*.zarr")):
        try:
            attributes = read_attrs(path)
        except CatalogError:
            if path.exists():  # not removed by another process just now
                readers.setdefault("", []).append(path.stem)
            continue
        named = _named_radiance(attributes)
        by_name = {stem for stem in stored if named and stem.startswith(named)}
        for scene in _radiance_of(attributes) | by_name:
            readers.setdefault(scene, []).append(path.stem)
    return readers


def _datasets(root: Path) -> dict[str, set[str]]:
    """Return {radiance: names of the datasets that hold it}, from the records of their scenes."""
    found: dict[str, set[str]] = {}
    for path in (root / "datasets").glob("*/scenes/*.json"):
        try:
            stores_of_scene = json.loads(path.read_bytes())["stores"]
        except (OSError, ValueError, KeyError, TypeError):
            continue  # a damaged record counts as missing
        for scene in stores_of_scene:
            found.setdefault(str(scene), set()).add(path.parents[1].name)
    return found


def _radiance_of(attributes: dict[str, Any]) -> set[str]:
    """Return the stores of radiance that a run has read, also those of the sub-frames of a shot
    during which the scene moves.
    """
    of_start = attributes.get("scene_ids") or [attributes.get("scene_id")]
    of_sub_frames = (attributes.get("motion") or {}).get("scene_ids") or []
    every = chain(of_start, *of_sub_frames)
    return {str(scene) for scene in every if scene}


def _visible(folder: Path) -> Iterator[Path]:
    """Yield the entries of a folder except temporary names, which belong to writers."""
    if folder.is_dir():
        yield from sorted(p for p in folder.iterdir() if not p.name.startswith("."))


def _sum(paths: list[Path]) -> int:
    return sum(map(size_of, paths))


def _named_radiance(attributes: dict[str, Any]) -> str:
    """Return the beginning of the names of the stores that the scene of a run names itself, as
    `scene.store` or `scene.path`; "" if it names none. Stores of one recipe are read together.
    """
    scene = (attributes.get("config") or {}).get("scene")
    fields = scene if isinstance(scene, dict) else {}
    path = Path(str(fields.get("path") or ""))
    of_path = path.stem if path.suffix == ".zarr" and path.parent.name == "scenes" else ""
    named = Path(str(fields.get("store") or "")).name.removesuffix(".zarr") or of_path
    return named.partition("-")[0]


def _age_s(path: Path) -> float:
    """Return the time since the last change of a store; 0 if another process has removed it."""
    try:
        return time.time() - path.stat().st_mtime
    except FileNotFoundError:
        return 0.0


def _blocks(path: Path) -> int:
    try:
        return 512 * path.lstat().st_blocks
    except FileNotFoundError:  # removed by another process just now
        return 0
