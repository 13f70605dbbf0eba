"""Stored runs: opened by the first digits of a key, by a name, or by a path."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import CatalogError, did_you_mean
from ..runs.labels import read_labels
from ..runs.run import Result
from ..storage import store
from ..storage.object_home.calls import follow_home


def open_run(name: str | os.PathLike[str]) -> Result:
    """Return a stored run.

    Parameters
    ----------
    name : the key or its first digits, the name that the run was given (`name=first`), or the path
        of its store.

    Raises
    ------
    CatalogError : no run is called so, several are, or the store is damaged.
    """
    path = _path_of(name)
    attributes = store.read_attrs(path)
    if attributes.get("kind") != "run":
        raise CatalogError(
            f"{path} holds a {attributes.get('kind', 'store of another kind')}; expected a run;"
            " type hdr.open_scene for radiance"
        )
    return Result(path, attributes, computed=False)


def _path_of(name: str | os.PathLike[str]) -> Path:
    if Path(name).suffix == ".zarr":
        return Path(name)
    follow_home(store.home())
    folder = store.home() / "runs"
    text = str(name)
    stored = sorted(p for p in folder.glob("*.zarr") if not p.name.startswith("."))
    candidates = [p for p in stored if p.stem == text]
    candidates = candidates or [p for p in stored if text and p.stem.startswith(text)]
    candidates = candidates or [p for p in stored if text and read_labels(p).name == text]
    if len(candidates) == 1:
        return candidates[0]
    problem = (
        f"could be any of {len(candidates)} runs, for example {candidates[0].stem}"
        if candidates
        else f"names no run{did_you_mean(text, [p.stem for p in stored])}"
    )
    raise CatalogError(f"{text!r} {problem}; looked in {folder}")
