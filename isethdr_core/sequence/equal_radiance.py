"""Equal radiance: stored radiance of another scene that shows the same light.

Every frame of a sequence has its own name, because its time is part of the name. If nothing has
changed since an earlier frame, the renderer would repeat the same work. The newest stores are
therefore searched for radiance with the same content of the scene description. The recipe that is
found is noted in a file next to the stores, so that the scene need not be built to find it again.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import CatalogError
from ..runs.provenance import described, fingerprint, input_digests, libraries
from ..storage import store
from ..storage.atomic_write import write_text
from .equal_content import Contents

NEWEST = 64  # number of stores that are searched; each takes a millisecond
NOTE = ".equal.json"  # end of the name of a note
CONTENT = "content"  # keys of the attributes of a store
GROUP_CONTENTS = "group_contents"


class ContentNames(NamedTuple):
    """Names of everything that determines radiance: equal names mean equal light."""

    whole: str
    groups: dict[str, str]  # by light group


def content_names(contents: Contents, renderer: Any, effort: Sequence[str]) -> ContentNames:
    """Return the names of the radiance that a renderer makes of a description.

    Parameters
    ----------
    contents : digests of the scene's description.
    renderer : renderer with the seed of the frame.
    effort : fields of the renderer that change only the accuracy.
    """
    made_by = {
        "fields": described(renderer, without=effort),
        "code": fingerprint(renderer),
        "versions": libraries(renderer),
        "inputs": input_digests(renderer),
    }

    def name(content: str) -> str:
        return store.content_hash({"content": content, "renderer": made_by})

    groups = {group: name(content) for group, content in contents.groups.items()}
    return ContentNames(name(contents.whole), groups)


def newest(folder: Path) -> Iterator[dict[str, Any]]:
    """Yield the attributes of the newest stores, with their name as `id`."""
    for path in sorted(folder.glob("*.zarr"), key=_age)[:NEWEST]:
        attributes: dict[str, Any] = {}
        with suppress(CatalogError):
            attributes = store.read_attrs(path)
        if attributes:
            yield {**attributes, "id": path.stem}


def find_equal(folder: Path, content: str) -> list[str]:
    """Return the recipes whose stored radiance has a content, the newest first.

    Parameters
    ----------
    folder : folder of scene stores.
    content : name of the content, as in `ContentNames`.
    """
    equal = (s for s in newest(folder) if s.get(CONTENT) == content)
    return list(dict.fromkeys(str(attributes["recipe"]) for attributes in equal))


def note(folder: Path, recipe: str, equal: Sequence[str]) -> None:
    """Note the recipes of equal radiance; if there is none, remove the note.

    Parameters
    ----------
    folder : folder of scene stores.
    recipe : name of the radiance.
    equal : names of other radiance with the same light.
    """
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


def remove_stale_notes(folder: Path) -> int:
    """Remove the notes that name no recipe with a store any more, and return their number.

    Parameters
    ----------
    folder : folder of scene stores.
    """
    removed = 0
    for path in folder.glob(f".*{NOTE}"):
        recipe = path.name.removeprefix(".").removesuffix(NOTE)
        if not any(any(folder.glob(f"{name}-*.zarr")) for name in noted(folder, recipe)):
            path.unlink(missing_ok=True)
            removed += 1
    return removed


def _file(folder: Path, recipe: str) -> Path:
    return folder / f".{recipe}{NOTE}"


def _age(path: Path) -> float:
    try:
        return -os.stat(path).st_mtime
    except OSError:  # another process has just taken it away
        return float("inf")
