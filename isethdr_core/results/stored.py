"""Stored runs: opened by the first digits of a key, by a name, or by a path."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from ..errors import CatalogError, did_you_mean
from ..runs.labels import read_labels
from ..runs.run import Result
from ..storage import store
from ..storage.home_folder import existing_homes
from ..storage.object_home.address import is_address


def open_run(
    name: str | os.PathLike[str], home: str | os.PathLike[str] | Iterable[object] = ()
) -> Result:
    """Return a stored run.

    Parameters
    ----------
    name : the key or its first digits, the name that the run was given (`name=first`), or the path
        of its store.
    home : a home or several, in the order of search; without any, that of the variable ISETHDR_HOME
        (./runs if it is not set) and those of ISETHDR_OTHER_HOMES.

    Raises
    ------
    CatalogError : no run or several runs have this name, the store is damaged, or a home does not
        exist.
    """
    path = _path_of(name, home)
    attributes = store.read_attrs(path)
    if attributes.get("kind") != "run":
        raise CatalogError(
            f"{path} holds a {attributes.get('kind', 'store of another kind')}; expected a run;"
            " type hdr.open_scene for radiance"
        )
    return Result(path, attributes, computed=False)


def _path_of(name: str | os.PathLike[str], home: str | os.PathLike[str] | Iterable[object]) -> Path:
    if is_address(str(name)):
        raise CatalogError(
            f"{name} is an address; expected a key, a name or a path; type for example"
            " open_run('1f3a', home='s3://bucket/prefix')"
        )
    if Path(name).suffix == ".zarr":
        return Path(name)
    homes = existing_homes(home)
    text = str(name)
    stored = [
        path
        for place in homes
        for path in sorted((place.folder / "runs").glob("*.zarr"))
        if not path.name.startswith(".")
    ]
    candidates = [p for p in stored if p.stem == text]
    # a name goes before first digits, because a short name such as `a` also begins keys
    candidates = candidates or [p for p in stored if text and read_labels(p).name == text]
    candidates = candidates or [p for p in stored if text and p.stem.startswith(text)]
    keys = {path.stem for path in candidates}
    if len(keys) == 1:
        return candidates[0]  # a run that several homes hold is the same in each
    problem = (
        f"could be any of {len(keys)} runs, for example {candidates[0].stem}"
        if candidates
        else f"names no run{did_you_mean(text, {p.stem for p in stored})}"
    )
    raise CatalogError(f"{text!r} {problem}; looked in {', '.join(h.name for h in homes)}")
