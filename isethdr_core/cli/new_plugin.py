"""`isethdr new-plugin KIND NAME`: a package with a component of any kind, tests and documentation.

The files are Jinja2 templates in `plugin_template/`. Templates at the top of this folder belong to
every package. The folder of each kind holds the component, its preset, its tests and its text.
Jinja2 renders the reports already, so that making a package needs no further library. A tool such
as copier would also update packages made earlier; a plugin needs no update, because the contracts
stay.
"""

from __future__ import annotations

import keyword
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import jinja2

from ..errors import ConfigError, did_you_mean
from ..plugins.component import KINDS
from ..plugins.presets import presets
from ..plugins.registry import components, package_of_component
from ..storage.atomic_write import temporary_path

TEMPLATES = Path(__file__).parent / "plugin_template"
PRESETS = {  # of each kind: what its preset is called, behind the name of the component
    "scene": "harsh",
    "renderer": "quick",
    "lighting": "as_built",
    "lens": "f4",
    "flare": "strong",
    "sensor": "night",
    "isp": "smooth",
    "metric": "median",
}
# template at the top of the folder: the file that it becomes
SHARED = {
    "pyproject.toml": "pyproject.toml",
    "README.md": "README.md",
    "gitignore": ".gitignore",
    "init.py": "{name}/__init__.py",
}
# template of a kind: the file that it becomes
OF_KIND = {
    "{kind}.py": "{name}/{kind}.py",
    "preset.yaml": "{name}/conf/{kind}/{preset}.yaml",
    "test.py": "tests/test_{name}.py",
    "docs.md": "docs/{name}.md",
}


@dataclass(frozen=True)
class NewPlugin:
    """The names in a package: those of its component, its preset, its folder and its class."""

    kind: str
    name: str

    @property
    def project(self) -> str:
        """The name of the package, as pip and the folder spell it."""
        return self.name.replace("_", "-")

    @property
    def preset(self) -> str:
        """The name of the preset."""
        return f"{self.name}_{PRESETS[self.kind]}"

    @property
    def camel(self) -> str:
        """The beginning of the names of classes."""
        return "".join(word.capitalize() for word in self.name.split("_"))

    @property
    def cls(self) -> str:
        """The name of the component's class; the kind keeps it apart from imported names."""
        return self.camel + self.kind.capitalize()

    def files(self) -> Iterator[tuple[str, str]]:
        """Yield (path within the package's folder, text)."""
        loader = jinja2.FileSystemLoader(TEMPLATES)
        templates = jinja2.Environment(
            loader=loader,
            undefined=jinja2.StrictUndefined,
            trim_blocks=True,
            keep_trailing_newline=True,
            autoescape=False,  # Python, YAML and Markdown, of names that were checked
        )
        names = {
            "kind": self.kind,
            "name": self.name,
            "project": self.project,
            "preset": self.preset,
            "camel": self.camel,
            "cls": self.cls,
        }
        places = dict(SHARED)
        places |= {f"{self.kind}/{template}": path for template, path in OF_KIND.items()}
        for template, path in places.items():
            source = f"{template.format(**names)}.jinja"
            yield path.format(**names), templates.get_template(source).render(names)
        yield f"{self.name}/conf/__init__.py", ""


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
    ConfigError : no such kind; a name that is no lower-case identifier, or is taken; a folder that
        exists already, or cannot be written.
    """
    if kind not in KINDS:
        raise ConfigError(f"no kind {kind!r}{did_you_mean(kind, KINDS)}")
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
    print("\nNext:")
    print(f"  pip install -e '{folder}[test]'")
    print(f"  pytest {folder}")
    print(f"  isethdr plugins {kind} {name}")
    print(f"{folder / 'README.md'} says how to run it.")


def _check_name(kind: str, name: str) -> None:
    """Raise ConfigError unless `name` can be that of a package and of a component."""
    example = f"for example isethdr new-plugin {kind} acme_{kind}"
    plain = name.isascii() and name.isidentifier() and name == name.lower()
    if not plain or keyword.iskeyword(name) or not name[0].isalpha() or "__" in f"{name}_":
        raise ConfigError(
            f"the name {name!r} cannot be that of a Python package; expected lower-case letters,"
            f" digits and single underscores, a letter first; type {example}"
        )
    taken = components().get((kind, name))
    if taken is not None:
        raise ConfigError(
            f"{kind} {name!r} is offered by {package_of_component(taken)} already; expected a new"
            f" name; type {example}"
        )
    if name in presets(kind):
        raise ConfigError(f"{name!r} is a preset of a {kind} already; expected a new name")
    if find_spec(name) is not None:
        raise ConfigError(
            f"a Python module {name!r} is installed already; expected a new name; type {example}"
        )
