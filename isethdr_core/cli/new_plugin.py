"""`isethdr new-plugin KIND NAME`: a package with a component of any kind, tests and documentation.

`plugin_template/` is a template of copier (https://copier.readthedocs.io). Its `copier.yml` holds
the names of kinds, the rule for names, and what is computed from a name. This module renders the
same files with Jinja2, so that making a package needs no copier. `copier copy` writes the same
package, and `copier update` brings later changes of the template into one.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import jinja2
import yaml

from ..errors import ConfigError, did_you_mean
from ..plugins.component import KINDS
from ..plugins.presets import presets
from ..plugins.registry import components, package_of_component, reads_as_value
from ..storage.atomic_write import temporary_path

TEMPLATE = Path(__file__).parent / "plugin_template"
ANSWERS_FILE = ".copier-answers.yml"  # copier's default
SUFFIX = ".jinja"  # copier's default


@dataclass(frozen=True)
class NewPlugin:
    """Kind and name of a new package. All of its files are computed from them."""

    kind: str
    name: str

    @property
    def project(self) -> str:
        """The name of the package, as pip and the folder spell it."""
        return str(self._names()["project"])

    def files(self) -> Iterator[tuple[str, str]]:
        """Yield (path within the package's folder, text)."""
        names = self._names() | {
            "_copier_answers": {"kind": self.kind, "name": self.name},
            "_copier_conf": {"answers_file": ANSWERS_FILE},
        }
        folder = TEMPLATE / _config()["_subdirectory"]
        for source in sorted(folder.rglob(f"*{SUFFIX}")):
            path = source.relative_to(folder).as_posix().removesuffix(SUFFIX)
            template = source.relative_to(TEMPLATE).as_posix()
            yield _render(path, names), _environment().get_template(template).render(names)

    def next_steps(self, folder: Path) -> str:
        """Return what to type after the package was written into `folder`."""
        names = self._names() | {"_copier_conf": {"dst_path": folder}}
        return _render(_config()["_message_after_copy"], names)

    def name_mistake(self) -> str:
        """Return what is wrong with the spelling of the name; empty where nothing is."""
        validator = _config()["name"]["validator"]
        return _render(validator, {"name": self.name}).strip()

    def _names(self) -> dict[str, Any]:
        """Return kind and name, and the names that copier.yml computes from them, in its order."""
        names: dict[str, Any] = {"kind": self.kind, "name": self.name}
        for key, question in _config().items():
            if not key.startswith("_") and key not in names:
                names[key] = _render(question["default"], names)
        return names


@cache
def _config() -> dict[str, Any]:
    """Return the content of copier.yml: settings begin with an underscore, the others are names."""
    config: dict[str, Any] = yaml.safe_load((TEMPLATE / "copier.yml").read_text(encoding="utf-8"))
    return config


@cache
def _environment() -> jinja2.Environment:
    """Return Jinja2 with the options of copier.yml."""
    # no escaping: the files are Python, YAML and Markdown, and the names were checked
    options = _config()["_envops"] | {"undefined": jinja2.StrictUndefined, "autoescape": False}
    return jinja2.Environment(loader=jinja2.FileSystemLoader(TEMPLATE), **options)


def _render(text: str, names: dict[str, Any]) -> str:
    return _environment().from_string(text).render(names)


def make_plugin(kind: str, name: str, into: Path) -> Path:
    """Write a package with one component into a new folder, and return the folder.

    The folder appears as a whole or not at all.

    Parameters
    ----------
    kind : kind of the component, for example `sensor`.
    name : name of the component, a lower-case identifier.
    into : folder that holds the new package's folder.

    Raises
    ------
    ConfigError : no such kind; a name that is no lower-case identifier, is read as a value such as
        `null`, or is taken; a folder that exists already, or cannot be written.
    """
    if kind not in KINDS:
        raise ConfigError(f"unknown kind {kind!r}{did_you_mean(kind, KINDS)}")
    _check_name(kind, name)
    plugin = NewPlugin(kind, name)
    folder = into / plugin.project
    if folder.exists():
        raise ConfigError(
            f"{folder} exists already; expected a new folder; type another name, or --into FOLDER"
        )
    temporary = temporary_path(into, plugin.project)
    try:
        for path, text in plugin.files():
            place = temporary / path
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(text, encoding="utf-8")
        temporary.rename(folder)
    except OSError as err:
        raise ConfigError(
            f"cannot write {folder} ({err.strerror}); expected a folder that you may write; type"
            " --into FOLDER"
        ) from err
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return folder


def print_new_plugin(kind: str, name: str, into: Path) -> None:
    """Make a package, and print what to type next.

    Parameters
    ----------
    kind : kind of the component, for example `sensor`.
    name : name of the component, for example `acme_mono`.
    into : folder that holds the new package's folder.
    """
    folder = make_plugin(kind, name, into)
    print(f"{folder}")
    for path in sorted(file.relative_to(folder) for file in folder.rglob("*") if file.is_file()):
        print(f"  {path}")
    print()
    print(NewPlugin(kind, name).next_steps(folder), end="")


def _check_name(kind: str, name: str) -> None:
    """Raise ConfigError unless `name` can be that of a package and of a component."""
    example = f"for example isethdr new-plugin {kind} acme_{kind}"
    if mistake := NewPlugin(kind, name).name_mistake():
        raise ConfigError(f"the name {name!r} {mistake}; type {example}")
    if reads_as_value(name):
        raise ConfigError(
            f"the name {name!r} cannot be chosen, because {kind}={name} on the command line sets a"
            f" value; expected another name; type {example}"
        )
    taken = components().get((kind, name))
    if taken is not None:
        raise ConfigError(
            f"{kind} {name!r} is offered by {package_of_component(taken)} already; expected a new"
            f" name; type {example}"
        )
    if name in presets(kind):
        raise ConfigError(
            f"{name!r} is already the name of a preset of kind {kind}; expected a new name; type"
            f" {example}"
        )
    if find_spec(name) is not None:
        raise ConfigError(
            f"a Python module {name!r} is installed already; expected a new name; type {example}"
        )
