"""The attributes of one store."""

from __future__ import annotations

import json
from typing import Any

from isethdr_core.errors import MOST_LISTED, CatalogError, did_you_mean
from isethdr_core.runs.labels import read_labels
from isethdr_core.storage.encoding import jsonable
from isethdr_core.store import read_attrs

from ..index import stores
from .connection import Homes, homes_of


def show(homes: Homes, name: str) -> dict[str, Any]:
    """Return the root attributes of a store, with its `path`.

    `name` is the beginning of its key, or the name of a run. The name of a run goes first, because
    a short name such as `a` also begins keys. If several homes hold the store, the attributes are
    those in the first home, and `homes` lists all of them.

    Raises
    ------
    CatalogError : no store matches the name, or several do.
    """
    places = homes_of(homes)
    known = [(path, home.name) for home in places for path in stores(home.folder)]
    key = str(name).removesuffix(".zarr")
    found = [entry for entry in known if entry[0].stem == key]
    found = found or [entry for entry in known if name and read_labels(entry[0]).name == name]
    found = found or [entry for entry in known if entry[0].stem.startswith(key)]
    keys = list(dict.fromkeys(path.stem for path, _ in found))
    if len(keys) != 1:
        some = ", ".join(keys[:MOST_LISTED])
        more = f" and {len(keys) - MOST_LISTED} more" if len(keys) > MOST_LISTED else ""
        problem = (
            f"could be any of {some}{more}"
            if keys
            else "names no store" + did_you_mean(name, {path.stem for path, _ in known})
        )
        looked = ", ".join(home.name for home in places)
        raise CatalogError(f"{name!r} {problem}; looked in {looked}")
    path = found[0][0]
    found_in = {"homes": [home for _, home in found]} if len(places) > 1 else {}
    return {"path": str(path), **found_in, **read_attrs(path)}


def shown(homes: Homes, name: str) -> str:
    """Return the result of `show` as indented JSON."""
    return json.dumps(jsonable(show(homes, name)), indent=2)
