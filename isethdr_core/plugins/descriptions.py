"""Descriptions: what `isethdr plugins` prints of each component.

To describe a component, its class has to be imported, and with it NumPy, xarray and SciPy. So
descriptions are kept in a file of the user's cache folder. They are used until a Python file of the
core or of the component's package changes.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cache
from importlib import util
from pathlib import Path
from typing import Any

from ..errors import PluginError
from ..storage.atomic_write import write_text
from .component import Component
from .field_docs import FieldRow, description, field_rows
from .registry import BrokenPlugin, class_of

CORE = "isethdr_core"


@dataclass(frozen=True)
class Description:
    """The description of one component that `isethdr plugins` prints."""

    summary: str  # first paragraph of the docstring of its class
    fields: list[FieldRow]
    paragraphs: list[str]  # the rest of that docstring, up to its first section


def described(comp: Component) -> Description:
    """Return the description of a component, read from its class.

    Raises
    ------
    PluginError : the class cannot be imported or breaks its contract.
    """
    cls = class_of(comp)
    summary, *details = description(cls) or ["no description"]
    return Description(summary, field_rows(cls), details)


def descriptions(
    members: Iterable[Component],
) -> tuple[dict[Component, Description], list[BrokenPlugin]]:
    """Return the description of each component, from the cache if it is current, and the components
    that did not load.
    """
    by_component: dict[Component, Description] = {}
    broken: list[BrokenPlugin] = []
    path = cache_file()
    stored = _read(path)
    is_new = False
    for comp in members:
        # only classes given by location are cached: any other is imported already
        key = f"{comp.kind}/{comp.name} {comp.target} {_state(comp.package)}{_state(CORE)}"
        if isinstance(comp.target, str) and key in stored:
            by_component[comp] = stored[key]
            continue
        try:
            by_component[comp] = described(comp)
        except PluginError as err:
            broken.append(BrokenPlugin(f"{comp.kind}/{comp.name}", comp.package, str(err)))
            continue
        if isinstance(comp.target, str):
            stored[key] = by_component[comp]
            is_new = True
    if is_new:
        _write(path, stored)
    return by_component, broken


def cache_file() -> Path:
    """Return the path of the file with the descriptions.

    This is `components.json` in the folder ISETHDR_CACHE, or in `isethdr` of the user's cache
    folder, XDG_CACHE_HOME or ~/.cache.
    """
    if own := os.environ.get("ISETHDR_CACHE"):
        return Path(own) / "components.json"
    folder = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(folder) / "isethdr" / "components.json"


@cache
def _state(package: str) -> str:
    """Return a digest of the paths, sizes and times of change of a package's Python files."""
    digest = hashlib.sha256()
    spec = util.find_spec(package)
    places = [] if spec is None else list(spec.submodule_search_locations or [spec.origin or ""])
    for place in places:
        for file in sorted(Path(place).rglob("*.py")) or [Path(place)]:
            with suppress(OSError):
                status = os.stat(file)
                digest.update(f"{file} {status.st_size} {status.st_mtime_ns}\n".encode())
    return digest.hexdigest()[:16]


def _read(path: Path) -> dict[str, Description]:
    """Return the cached descriptions; empty if the file is missing or damaged."""
    with suppress(OSError, ValueError, TypeError, AttributeError):
        stored = json.loads(path.read_text("utf-8"))
        return {k: _description(**v) for k, v in stored.items()}
    return {}


def _description(summary: str, fields: list[dict[str, Any]], paragraphs: list[str]) -> Description:
    rows = [FieldRow(**row | {"choices": tuple(row["choices"])}) for row in fields]
    return Description(summary, rows, paragraphs)


def _write(path: Path, described_components: dict[str, Description]) -> None:
    """Cache the descriptions that belong to the current files. A folder without write permission is
    ignored.
    """
    now = {k: asdict(v) for k, v in described_components.items() if k.endswith(_state(CORE))}
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, json.dumps(now))
