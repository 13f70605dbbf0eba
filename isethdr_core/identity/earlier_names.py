"""Earlier names: names of runs and radiance from the time when whole packages named their code.

Before code was identified by component (`code_digest`), a name contained the digests of all bytes
of the packages in use, and the module path of each class. Such results are still used as long as
their code is the same. For each commit whose results may be stored, `earlier_names.json` states the
old parts of the names, and the digest of each component in that commit. A component with the same
digest now is unchanged. A component with another digest is unchanged only if the table `unchanged`
lists exactly these two digests, with the reason, and for tested values of its fields. Otherwise
there is no earlier name.

`scripts/earlier_names.py` writes the file.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, Field, asdict, dataclass, fields
from functools import cache, lru_cache
from importlib import util
from pathlib import Path
from typing import Any

from ..plugins import registry
from ..runs import provenance
from ..storage.encoding import jsonable
from ..storage.store import content_hash
from .code_digest import code_of_class, frame_code

TABLE = Path(__file__).with_name("earlier_names.json")
RADIANCE_CORE = (  # parts of the core whose code entered the names of radiance
    "isethdr_core.scene",
    "isethdr_core.quantities",
    "isethdr_core.categories",
    "isethdr_core.physics.photometry",
    "isethdr_core.physics.radiometry",
)
CORE_PACKAGE = "isethdr_core"
# {key of a config that holds one component: its kind}
COMPONENTS = {kind: kind for kind in ("scene", "renderer", "lighting", "lens", "sensor", "isp")}
# settings that select the noise, or the number of its realisations
FREE = ("device", "seed", "draws")
# {key of a config that holds several components: their kind}
TABLES = {"versions": "lighting", "flare": "flare", "cameras": "sensor", "metric": "metric"}


@dataclass(frozen=True)
class Edition:
    """The code of one commit, as the names of that time state it."""

    commit: str
    version: str  # version of the distribution
    packages: dict[str, str]  # digest of the bytes of a package, or of a module of the core
    components: dict[str, dict[str, Any]]  # {identity of a component: its class, fields and code}
    frame: str  # digest of the part of the core that runs a chain
    settings: dict[str, Any]  # default settings of a config, without its components


class Different(Exception):
    """A part of the chain differs from the edition, so there is no earlier name."""


def radiance_names(scene: object, renderer: object, effort: Sequence[str]) -> Iterator[str]:
    """Yield the names under which the radiance of a scene and a renderer may be stored.

    Parameters
    ----------
    scene : scene component.
    renderer : renderer component.
    effort : fields of the renderer that change only the accuracy; they are no part of the name.
    """
    for edition in editions():
        try:
            yield content_hash(
                {
                    "scene": _described(edition, scene),
                    "renderer": _described(edition, renderer, effort),
                    "code": _packages(edition, (scene, renderer), RADIANCE_CORE),
                    "versions": _versions(edition),
                }
            )
        except Different:
            continue


def run_names(
    config: dict[str, Any], components: Sequence[object], inputs: dict[str, Any]
) -> Iterator[str]:
    """Yield the names under which a run may be stored.

    Parameters
    ----------
    config : composed config as plain data.
    inputs : digests of input files, by path.
    components : all components of the run.
    """
    for edition in editions():
        try:
            for component in components:
                _described(edition, component)
            _same(edition, provenance.CORE, edition.frame, flat_settings(config))
            yield content_hash(
                {
                    "config": _settings(edition, config),
                    "code": _packages(edition, components, (CORE_PACKAGE,)),
                    "versions": _versions(edition),
                    "inputs": inputs,
                }
            )
        except Different:
            continue


def same_class(stored: dict[str, Any], component: object) -> bool:
    """Return whether a component's record in a store, old or new, is of this component's class."""
    name = provenance.identity(component)
    if "component" in stored:
        return bool(stored["component"] == name)
    return any(
        edition.components.get(name, {}).get("class") == stored.get("class")
        for edition in editions()
    )


@cache
def editions() -> tuple[Edition, ...]:
    """Return the editions of the table."""
    return tuple(Edition(**edition) for edition in _table()["editions"])


@cache
def _table() -> dict[str, Any]:
    table: dict[str, Any] = json.loads(TABLE.read_text())
    return table


def _described(edition: Edition, component: Any, without: Sequence[str] = ()) -> dict[str, Any]:
    """Return a component as it was described in an edition."""
    values = {k: v for k, v in asdict(component).items() if k not in without}
    component_edition = edition.components.get(provenance.identity(component))
    if component_edition is None:  # a component of another package is described as it is now
        cls = type(component)
        return {"class": f"{cls.__module__}.{cls.__qualname__}", **values}
    _same(edition, provenance.identity(component), component_edition["code"], values)
    for added in fields(component):
        if added.name in values and added.name not in component_edition["fields"]:
            if values.pop(added.name) != _default(added):
                raise Different(added.name)
    return {"class": component_edition["class"], **values}


def _default(added: Field[Any]) -> Any:
    return added.default_factory() if added.default_factory is not MISSING else added.default


def _same(edition: Edition, name: str, digest_of_edition: str, values: Mapping[str, Any]) -> None:
    """Raise Different unless the code behind `name` makes the same result as in the edition.

    Parameters
    ----------
    edition : the edition.
    name : registered name of the component, or of the frame.
    digest_of_edition : digest of its code in the edition.
    values : fields of the component, or settings of the run.
    """
    digest_now = _digest_now(name)
    if digest_now == digest_of_edition:
        return
    for entry in _table()["unchanged"]:
        if (entry["of"], entry["from"], entry["to"]) == (name, digest_of_edition, digest_now):
            tested = entry["tested"]
            if all(value_class(v) in tested.get(key, ()) for key, v in values.items()):
                return
    raise Different(name)


def _digest_now(name: str) -> str:
    if name == provenance.CORE:
        return frame_code().digest
    kind, _, registered = name.partition("/")
    return code_of_class(registry.components()[kind, registered].cls).digest


def value_class(value: Any) -> str:
    """Return the class of a field's value. Values of one class count as tested together; all finite
    numbers except zero are one class.
    """
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        if value == 0:
            return "zero"
        return "number" if math.isfinite(value) else "not finite"
    return json.dumps(jsonable(value), sort_keys=True)


def _packages(
    edition: Edition, components: Sequence[object], core: tuple[str, ...]
) -> dict[str, str]:
    """Return the digest of every package that took part, as it was in the edition."""
    names = set(core)
    for component in components:
        component_edition = edition.components.get(provenance.identity(component))
        path = component_edition["class"] if component_edition else type(component).__module__
        names.add(path.partition(".")[0])
    return {name: edition.packages.get(name) or bytes_digest(name) for name in sorted(names)}


def _versions(edition: Edition) -> dict[str, str]:
    return provenance.versions() | {"isethdr": edition.version}


def _settings(edition: Edition, config: dict[str, Any]) -> dict[str, Any]:
    """Return a config as plain data in the form of the edition.

    Fields that components got later are left out: `_described` has found them at their defaults.
    Other new keys are left out if their value changes nothing.
    """
    settings = {}
    for key, value in config.items():
        if key in COMPONENTS:
            settings[key] = _component_node(edition, COMPONENTS[key], value)
        elif key in TABLES:
            nodes = (value or {}).items()
            settings[key] = value and {
                name: _component_node(edition, TABLES[key], node) for name, node in nodes
            }
        elif key in edition.settings:
            settings[key] = _known_keys(edition.settings[key], key, value)
        elif not _changes_nothing(key, value):
            raise Different(key)
    return settings


def _component_node(edition: Edition, kind: str, node: Any) -> Any:
    component_edition = edition.components.get(f"{kind}/{node['name']}") if node else None
    if component_edition is None:
        return node
    return {k: v for k, v in node.items() if k == "name" or k in component_edition["fields"]}


def _known_keys(known: Any, path: str, value: Any) -> Any:
    if not (isinstance(known, dict) and isinstance(value, dict)):
        return value
    earlier = {}
    for key, inner in value.items():
        if key in known:
            earlier[key] = _known_keys(known[key], f"{path}.{key}", inner)
        elif not _changes_nothing(f"{path}.{key}", inner):
            raise Different(f"{path}.{key}")
    return earlier


def _changes_nothing(path: str, value: Any) -> bool:
    new = _table()["new_settings"]
    return path in new and new[path] == value


def flat_settings(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of a run that select its computation, without components and names."""
    flat: dict[str, Any] = {}
    for key, value in config.items():
        if key in COMPONENTS or key in TABLES or key in FREE:
            continue
        if isinstance(value, dict):
            flat |= {f"{key}.{inner}": v for inner, v in value.items()}
        else:
            flat[key] = value
    return flat


def bytes_digest(package: str) -> str:
    """Return the digest of all Python, YAML and CSV files of a package or module."""
    spec = util.find_spec(package)
    if spec is None:
        raise Different(package)
    if spec.submodule_search_locations is None:
        known = spec.origin if spec.has_location else None
        return file_digest(Path(known)) if known else folder_digest([])
    return folder_digest([Path(folder) for folder in sorted(spec.submodule_search_locations)])


def file_digest(path: Path) -> str:
    """Return the digest of a module that is one file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def folder_digest(folders: Sequence[Path]) -> str:
    """Return the digest of the files of a package; presets below `conf` do not enter."""
    return _files_digest(tuple(file for folder in folders for file in _files(str(folder))))


def _files(folder: str) -> list[tuple[str, str, int, int]]:
    """Return the place in the folder, path, time and size of each file that the digest reads."""
    found = []
    for path, folders, names in os.walk(folder):
        folders[:] = [f for f in folders if f != "conf"]
        for name in names:
            if os.path.splitext(name)[1] in (".py", ".yaml", ".csv"):
                full = os.path.join(path, name)
                state = os.stat(full)
                inside = full[len(folder) + 1 :].replace(os.sep, "/")
                found.append((inside, full, state.st_mtime_ns, state.st_size))
    return sorted(found, key=lambda file: file[0].split("/"))


@lru_cache(maxsize=32)
def _files_digest(files: tuple[tuple[str, str, int, int], ...]) -> str:
    """Return the digest of files; they are read again only once one of them has changed."""
    digest = hashlib.sha256()
    for inside, full, _, _ in files:
        digest.update(inside.encode())
        digest.update(Path(full).read_bytes())
    return digest.hexdigest()[:16]
