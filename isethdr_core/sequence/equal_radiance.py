"""Equal radiance: stored radiance of another scene that shows the same light.

Every frame of a sequence has a name of its own, because its time is part of it. Where nothing has
changed since an earlier frame, the renderer would repeat the same work. The radiance of a frame is
therefore looked for among the newest stores by the content of its description. Either everything
is equal, or some light groups are: their lamps and all surfaces. The stores that serve are noted
beside the stores, so that the scene need not be built to find them again.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import xarray as xr

from ..data.scene_description import SceneDescription
from ..errors import CatalogError
from ..runs.provenance import described, fingerprint, input_digests, libraries
from ..storage import store
from ..storage.atomic_write import write_text
from ..uncertainty import ledger
from .equal_content import content_of

NEWEST = 64  # stores that are looked at: each takes a millisecond
EQUAL = "equal_groups"  # key of attributes: light groups that serve another scene; [] means all


def content_record(
    description: SceneDescription, renderer: Any, effort: tuple[str, ...]
) -> dict[str, Any] | None:
    """Return what the radiance of a description follows from, as plain data; None if it cannot be
    told.

    Parameters
    ----------
    renderer : the component. `effort` : its fields that buy accuracy only.
    """
    content = content_of(description)
    if content is None:
        return None
    made_by = {
        "fields": described(renderer, without=effort),
        "code": fingerprint(renderer),
        "versions": libraries(renderer),
        "inputs": input_digests(renderer),
    }
    return {"renderer": store.content_hash(made_by), **content._asdict()}


def find_equal(folder: Path, content: Mapping[str, Any], by_group: bool) -> dict[str, list[str]]:
    """Return the stores that hold equal radiance, with the light groups that are equal: [] where
    everything is.

    Parameters
    ----------
    folder : of scene stores.
    content : of `content_record`.
    by_group : whether single light groups may serve where not everything is equal.
    """
    found: dict[str, list[str]] = {}
    for path in sorted(folder.glob("*.zarr"), key=_age)[:NEWEST]:
        with suppress(CatalogError):
            other = store.read_attrs(path).get("content")
            if not other or other["renderer"] != content["renderer"]:
                continue
            if other["whole"] == content["whole"]:
                found[path.stem] = []
            elif by_group and list(other["groups"]) == list(content["groups"]):
                mine = content["groups"].items()
                if same := [g for g, digest in mine if other["groups"][g] == digest]:
                    found[path.stem] = same
    return found


def note(folder: Path, recipe: str, found: Mapping[str, list[str]]) -> None:
    """Note the stores whose radiance is that of a recipe, beside those noted before."""
    known = _noted(folder, recipe)
    write_text(_file(folder, recipe), json.dumps(known | dict(found)))


def equal_stores(folder: Path, recipe: str) -> list[dict[str, Any]]:
    """Return the root attributes of the stores that were noted for a recipe and still exist. They
    state the groups that are equal, and no others.
    """
    attributes = []
    # labels and objects come from the first store
    for name, groups in sorted(_noted(folder, recipe).items(), key=lambda noted: bool(noted[1])):
        with suppress(CatalogError):
            read = {**store.read_attrs(folder / f"{name}.zarr"), "id": name, EQUAL: groups}
            if groups:
                for key in ("groups", "absent_groups"):
                    read[key] = [group for group in read[key] if group in groups]
            if read["groups"] or read["absent_groups"]:
                attributes.append(read)
    return attributes


def is_partial(attributes: Mapping[str, Any]) -> bool:
    """Return whether a store serves with some light groups alone, without labels."""
    return bool(attributes.get(EQUAL))


def equal_part(scene: xr.Dataset, attributes: Mapping[str, Any]) -> xr.Dataset:
    """Return the part of a store's radiance that serves, and state that it was not rendered again.

    Parameters
    ----------
    scene : the Dataset of the store.
    attributes : of the store, as of `equal_stores`; those of a scene's own store change nothing.
    """
    if EQUAL not in attributes:
        return scene
    groups = [str(group) for group in scene.light_group.values]
    if is_partial(attributes):
        groups = [group for group in groups if group in attributes["groups"]]
        of_all = [name for name, v in scene.data_vars.items() if "light_group" not in v.dims]
        held = [str(group) in groups for group in scene.light_group.values]
        scene = scene.drop_vars(of_all).isel(light_group=[k for k, on in enumerate(held) if on])
    ledger.left_out(
        f"rendering of {', '.join(groups)}",
        f"nothing that it depends on differs from the stored scene {attributes['id']}",
        0.0,
        "relative",
        key="equal content",
        needless=True,
    )
    return scene


def _noted(folder: Path, recipe: str) -> dict[str, list[str]]:
    try:
        return dict(json.loads(_file(folder, recipe).read_text()))
    except (OSError, ValueError, TypeError):
        return {}


def _file(folder: Path, recipe: str) -> Path:
    return folder / f".{recipe}.equal.json"


def _age(path: Path) -> float:
    try:
        return -os.stat(path).st_mtime
    except OSError:  # another process has just taken it away
        return float("inf")
