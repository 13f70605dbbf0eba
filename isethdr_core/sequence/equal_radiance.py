"""Equal radiance: stored radiance of another scene that shows the same light.

Every frame of a sequence has a name of its own, because its time is part of it. Where nothing has
changed since an earlier frame, the renderer would repeat the same work. The radiance of a frame is
therefore looked for among the newest stores by the content of its description. The recipe of the
store is noted beside the stores, so that the scene need not be built to find it again.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..data.scene_description import SceneDescription
from ..errors import CatalogError
from ..runs.provenance import described, fingerprint, input_digests, libraries
from ..storage import store
from ..storage.atomic_write import write_text
from .equal_content import content_of

NEWEST = 64  # stores that are looked at: each takes a millisecond


def content_name(description: SceneDescription, renderer: Any, effort: Sequence[str]) -> str | None:
    """Return the name of everything that the radiance of a description follows from; None if it
    cannot be told.

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
    return store.content_hash({"content": content, "renderer": made_by})


def find_equal(folder: Path, content: str) -> list[str]:
    """Return the recipes whose stored radiance has a content, the newest first.

    Parameters
    ----------
    folder : of scene stores. `content` : of `content_name`.
    """
    found: dict[str, None] = {}
    for path in sorted(folder.glob("*.zarr"), key=_age)[:NEWEST]:
        with suppress(CatalogError):
            attributes: Mapping[str, Any] = store.read_attrs(path)
            if attributes.get("content") == content:
                found[str(attributes["recipe"])] = None
    return list(found)


def note(folder: Path, recipe: str, equal: Sequence[str]) -> None:
    """Note the recipes whose radiance is that of `recipe`; without any, there is no note."""
    if not equal:
        _file(folder, recipe).unlink(missing_ok=True)
        return
    write_text(_file(folder, recipe), json.dumps([*equal]))


def noted(folder: Path, recipe: str) -> list[str]:
    """Return the recipes that were noted; their stores may be gone."""
    try:
        return [str(name) for name in json.loads(_file(folder, recipe).read_text())]
    except (OSError, ValueError, TypeError):
        return []


def _file(folder: Path, recipe: str) -> Path:
    return folder / f".{recipe}.equal.json"


def _age(path: Path) -> float:
    try:
        return -os.stat(path).st_mtime
    except OSError:  # another process has just taken it away
        return float("inf")
