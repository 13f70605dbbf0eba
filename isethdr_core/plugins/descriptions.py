"""Descriptions: what `isethdr plugins` prints of each component.

To describe a component its class has to be imported, and with it NumPy, xarray and SciPy. So
descriptions are kept in a file of the user's cache folder; they serve until a Python file of the
core or of the component's package changes.
"""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
import json
import os
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cache
from importlib import util
from pathlib import Path

from ..errors import PluginError
from ..storage.atomic_write import write_text
from .component import Component
from .ranges import field_types, range_text
from .registry import BrokenPlugin, class_of

CORE = "isethdr_core"


@dataclass(frozen=True)
class Description:
    """What is printed of one component."""

    summary: str  # first paragraph of the docstring of its class
    fields: list[str]  # `name=default`, with the declared range in brackets


def described(comp: Component) -> Description:
    """Return the description of a component, read from its class.

    Raises
    ------
    PluginError : the class cannot be imported or breaks its contract.
    """
    cls = class_of(comp)
    return Description(summary_of(cls), field_texts(cls))


def summary_of(cls: type) -> str:
    """Return the first paragraph of a class's docstring as one line."""
    return " ".join((inspect.getdoc(cls) or "no description").split("\n\n")[0].split())


def descriptions(
    members: Iterable[Component],
) -> tuple[dict[Component, Description], list[BrokenPlugin]]:
    """Return the description of each component, kept ones where they serve, and what did not
    load.
    """
    found: dict[Component, Description] = {}
    broken: list[BrokenPlugin] = []
    path = cache_file()
    kept = _read(path)
    is_new = False
    for comp in members:
        # a class that is here already needs no import
        key = f"{comp.kind}/{comp.name} {comp.target} {_state(comp.package)}{_state(CORE)}"
        if isinstance(comp.target, str) and key in kept:
            found[comp] = kept[key]
            continue
        try:
            found[comp] = described(comp)
        except PluginError as err:
            broken.append(BrokenPlugin(f"{comp.kind}/{comp.name}", comp.package, str(err)))
            continue
        if isinstance(comp.target, str):
            kept[key] = found[comp]
            is_new = True
    if is_new:
        _write(path, kept)
    return found, broken


def cache_file() -> Path:
    """Return where descriptions are kept.

    This is `components.json` in the folder ISETHDR_CACHE, or in `isethdr` of the user's cache
    folder, XDG_CACHE_HOME or ~/.cache.
    """
    if own := os.environ.get("ISETHDR_CACHE"):
        return Path(own) / "components.json"
    folder = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(folder) / "isethdr" / "components.json"


def field_texts(cls: type) -> list[str]:
    """Return each field of a component as `name=default`, with its declared range in brackets."""
    types = field_types(cls)
    texts = []
    for f in dataclasses.fields(cls):
        if f.init:
            limits = range_text(types[f.name])
            texts.append(f"{f.name}={default_text(f)}" + (f" ({limits})" if limits else ""))
    return texts


def default_text(f: dataclasses.Field[object]) -> str:
    """Return a field's default as the command line would write it."""
    if f.default is not dataclasses.MISSING:
        return repr(f.default)
    if f.default_factory is not dataclasses.MISSING:
        return repr(f.default_factory())
    return "<value>"


@cache
def _state(package: str) -> str:
    """Return a name of the Python files of a package, by their paths, sizes and times of change."""
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
    """Return what is kept; nothing where the file is missing or damaged."""
    with suppress(OSError, ValueError, TypeError, AttributeError):
        return {k: Description(**v) for k, v in json.loads(path.read_text("utf-8")).items()}
    return {}


def _write(path: Path, kept: dict[str, Description]) -> None:
    """Keep the descriptions of the files as they are now; where nothing can be written, go
    without.
    """
    now = {k: asdict(v) for k, v in kept.items() if k.endswith(_state(CORE))}
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, json.dumps(now))
