"""Selection: the stored pictures that a run, a query or a sweep names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from isethdr_core.errors import CatalogError
from isethdr_core.results.stored import open_run
from isethdr_core.runs.run import Result
from isethdr_core.storage.home_folder import existing_homes
from isethdr_core.sweeps.record import read_jobs, read_sweep

from . import query

EVERY = 2**31 - 1  # limit of rows that no query reaches


@dataclass(frozen=True, order=True)
class StoredShot:
    """One camera of a stored run."""

    path: Path  # path of the run's store
    camera: str


@dataclass(frozen=True)
class Selection:
    """Stored runs by camera, and stored scenes."""

    shots: tuple[StoredShot, ...]
    scenes: tuple[Path, ...] = ()  # stores of radiance, found by a query with kind=scene


def select(what: Sequence[str]) -> Selection:
    """Return the stored pictures that names or a query select in all homes, sorted by key and
    camera. A run that several homes hold counts once.

    Parameters
    ----------
    what : keys, first digits or names of runs, and names of sweeps; or conditions `name=value` of a
        query, as `isethdr catalog find` takes them. A query without `kind` finds runs.

    Raises
    ------
    CatalogError : nothing is named or found, a name is unknown, or names and conditions are mixed.
    """
    conditions = [text for text in what if "=" in text]
    if not what or 0 < len(conditions) < len(what):
        raise CatalogError(
            f"{' '.join(what) or 'nothing'!r} names no runs; expected names of runs or sweeps, or"
            " conditions alone; type for example sensor=bayer lighting=night_rural"
        )
    if conditions:
        return found(query.typed_conditions(conditions))
    existing_homes()
    shots: set[StoredShot] = set()
    for name in what:
        shots |= _named(name)
    return Selection(tuple(sorted(shots)))


def found(conditions: Mapping[str, Any]) -> Selection:
    """Return the runs by camera, and with `kind=scene` the scenes, that meet all conditions.

    Raises
    ------
    CatalogError : nothing meets the conditions, or no record has a property.
    """
    homes = existing_homes()
    rows = query.find(homes, **{"limit": EVERY, "kind": "run", **conditions})
    shots: dict[tuple[str, str], StoredShot] = {}
    scenes: dict[str, Path] = {}
    for row in rows:
        path = query.path_of(row, homes)
        if row["kind"] == "run":
            shots.setdefault((path.stem, row["camera"]), StoredShot(path, row["camera"]))
        elif row["kind"] == "scene":
            scenes.setdefault(path.stem, path)
    if not shots and not scenes:
        asked = " ".join(f"{name}={value}" for name, value in conditions.items())
        raise CatalogError(
            f"nothing in {', '.join(home.name for home in homes)} meets {asked}; expected"
            " conditions that a stored run meets; type isethdr catalog find"
            f" kind={conditions.get('kind', 'run')} to list what is stored"
        )
    return Selection(tuple(sorted(shots.values())), tuple(sorted(scenes.values())))


def _named(name: str) -> set[StoredShot]:
    """Return the cameras of a run, or of all stored runs of a sweep."""
    results = [open_run(name)] if (found := _of_sweep(name)) is None else found
    return {StoredShot(r.path, camera) for r in results for camera in r.cameras}


def _of_sweep(name: str) -> list[Result] | None:
    """Return the stored runs of a sweep in the first home that has it; None if no home has it."""
    if name in ("", ".", ".."):
        return None
    for home in existing_homes():
        folder = home.folder / "sweeps" / name
        if read_sweep(folder) is None:
            continue
        keys = dict.fromkeys(job.key for job in read_jobs(folder) if job.key)
        if not keys:
            raise CatalogError(f"no job of the sweep {name!r} has a stored run; run it again")
        return [open_run(home.folder / "runs" / f"{key}.zarr") for key in keys]
    return None
