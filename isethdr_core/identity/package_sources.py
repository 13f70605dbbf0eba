"""Package sources: where the modules and data files of packages lie. Nothing is imported."""

from __future__ import annotations

import importlib.machinery
import os
import sys
import sysconfig
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import util
from pathlib import Path
from typing import NamedTuple

from .code_cache import CodeCache, cache_folder

PRESETS = "conf"  # folders with presets; the config holds the chosen values
COMPILED = tuple(importlib.machinery.EXTENSION_SUFFIXES)
NO_DATA = (".py", ".pyc", ".pyi", ".typed", *COMPILED)


class Located(NamedTuple):
    """Where a module lies."""

    path: str
    is_package: bool


class Sources:
    """Finds the modules and data files of the packages that can be imported here.

    Parameters
    ----------
    folders : folders of the packages; None: the search path of Python.
    cache : cache of the facts about each file.
    """

    def __init__(
        self, folders: Iterable[Path] | None = None, cache: CodeCache | None = None
    ) -> None:
        self._folders = None if folders is None else [str(folder) for folder in folders]
        self.cache = cache or CodeCache(cache_folder())
        self._tops: dict[str, str] = {}
        self._located: dict[str, Located | None] = {}
        self._data: dict[str, DataFiles] = {}
        self._below: dict[str, list[str]] = {}

    def top(self, name: str) -> str:
        """Return the owner of a package of this name: `builtin`, `library`, `absent` or `own`."""
        if name not in self._tops:
            self._tops[name] = self._whose(name)
        return self._tops[name]

    def _whose(self, name: str) -> str:
        if name in sys.stdlib_module_names or name in sys.builtin_module_names:
            return "builtin"
        if name.startswith("isethdr_"):
            return "own"
        located = self.locate(name)
        if located is None:
            return "own" if name in sys.modules and self._folders is None else "absent"
        return "library" if _installed(located.path) else "own"

    def locate(self, module: str) -> Located | None:
        """Return where a module lies; None if there is no module of that name."""
        if module not in self._located:
            parent, _, last = module.rpartition(".")
            if not parent:
                located = self._top_level(module)
            else:
                above = self.locate(parent)
                folder = os.path.dirname(above.path) if above and above.is_package else None
                located = _in_folder(folder, last) if folder else None
            if located is None and self._folders is None:
                located = _loaded(module)
            self._located[module] = located
        return self._located[module]

    def _top_level(self, name: str) -> Located | None:
        if self._folders is not None:
            for folder in self._folders:
                if located := _in_folder(folder, name):
                    return located
            if name.startswith("isethdr_"):
                return None
        try:
            spec = util.find_spec(name)
        except (ValueError, ImportError):  # a module made in this process, without a spec
            return None
        if spec is None:
            return None
        if spec.origin and spec.has_location:
            return Located(spec.origin, spec.submodule_search_locations is not None)
        for folder in spec.submodule_search_locations or ():
            return Located(os.path.join(folder, "__init__.py"), True)
        return None

    def package_folder(self, module: str) -> str:
        """Return the folder of the package at the top of a module's name."""
        top = self.locate(module.partition(".")[0])
        return os.path.dirname(top.path) if top and top.is_package else ""

    def data_of(self, module: str) -> DataFiles:
        """Return the data files of the package that a module belongs to."""
        folder = self.package_folder(module)
        if folder not in self._data:
            self._data[folder] = DataFiles.below(folder)
        return self._data[folder]

    def folders_of(self, modules: Iterable[str]) -> list[str]:
        """Return the folders of the packages of `modules`; each new file changes their state."""
        packages = {self.package_folder(module) for module in modules} - {""}
        return sorted(
            {folder_below for folder in packages for folder_below in self._folders_below(folder)}
        )

    def _folders_below(self, folder: str) -> list[str]:
        if folder not in self._below:
            self._below[folder] = [
                path for path, _, _ in os.walk(folder) if os.path.basename(path) != "__pycache__"
            ]
        return self._below[folder]

    def all_modules(self, module: str) -> list[str]:
        """Return every module of the package that a module belongs to, presets left out."""
        top = module.partition(".")[0]
        folder = self.package_folder(module)
        if not folder:
            return [top]
        modules = []
        for path in sorted(Path(folder).rglob("*.py")):
            names = [top, *path.relative_to(folder).with_suffix("").parts]
            if PRESETS not in names:
                modules.append(".".join(names[:-1] if names[-1] == "__init__" else names))
        return modules


@dataclass
class DataFiles:
    """Data files of one package, by file name, by folder name, and by suffix."""

    folder: str = ""  # folder of the package
    by_name: dict[str, list[str]] = field(default_factory=dict)  # {file name: paths}
    by_folder: dict[str, list[str]] = field(default_factory=dict)  # {folder of data: paths}
    by_suffix: dict[str, list[str]] = field(default_factory=dict)  # {suffix with its dot: paths}

    @classmethod
    def below(cls, folder: str) -> DataFiles:
        """Return the data files in a folder and in all folders below it, without presets."""
        data = cls(folder)
        files_in = _files_below(folder)
        packages = _packages(files_in)
        for inner, files in files_in.items():
            above = [p for p in _folders_between(folder, inner) if p not in packages]
            for name in files:
                if name.endswith(NO_DATA):
                    continue
                path = os.path.join(inner, name)
                data.by_name.setdefault(name, []).append(path)
                data.by_suffix.setdefault(os.path.splitext(name)[1], []).append(path)
                for part in above:
                    data.by_folder.setdefault(os.path.basename(part), []).append(path)
        return data

    def named(self, text: str) -> list[str]:
        """Return the files that a string names.

        The string is the path of a file, the path of a folder of data, the dotted name of such a
        folder (`acme.tables`), or a suffix without its dot.
        """
        last = text.rpartition("/")[2]
        return (
            self.by_name.get(last)
            or self.by_folder.get(last)
            or self.by_folder.get(last.rpartition(".")[2])
            or self.by_suffix.get(f".{text}")
            or []
        )


def _files_below(folder: str) -> dict[str, list[str]]:
    """Return {path: names of files} of a folder and the folders below, without presets."""
    files_in = {}
    for inner, folders, files in os.walk(folder) if folder else ():
        folders[:] = sorted(f for f in folders if f not in (PRESETS, "__pycache__"))
        files_in[inner] = sorted(files)
    return files_in


def _packages(files_in: Mapping[str, Sequence[str]]) -> set[str]:
    """Return the folders of modules. A folder of data is not among them, even if an `__init__.py`
    makes it importable, as `importlib.resources` needs it.
    """
    with_modules = {
        inner
        for inner, files in files_in.items()
        if any(name.endswith(".py") and name != "__init__.py" for name in files)
    }
    return {
        inner
        for inner, files in files_in.items()
        if inner in with_modules
        or "__init__.py" in files
        and any(below.startswith(inner + os.sep) for below in with_modules)
    }


def _folders_between(top: str, folder: str) -> list[str]:
    """Return the folders from below `top` down to `folder`."""
    names = Path(folder).relative_to(top).parts
    return [os.path.join(top, *names[: n + 1]) for n in range(len(names))]


def _loaded(module: str) -> Located | None:
    """Return where a module lies that is loaded in this process and found nowhere on the path."""
    origin = getattr(sys.modules.get(module), "__file__", None)
    return Located(origin, os.path.basename(origin) == "__init__.py") if origin else None


def _in_folder(folder: str, name: str) -> Located | None:
    """Return where a module or package of this name lies directly in a folder."""
    package = os.path.join(folder, name, "__init__.py")
    if os.path.isfile(package):
        return Located(package, True)
    for suffix in (".py", *COMPILED):
        if os.path.isfile(path := os.path.join(folder, name + suffix)):
            return Located(path, False)
    if os.path.isdir(os.path.join(folder, name)):
        return Located(package, True)  # a package without a file of its own
    return None


@cache
def _installation_folders() -> tuple[str, ...]:
    """Return the folders into which libraries are installed."""
    return tuple({sysconfig.get_path(p) + os.sep for p in ("purelib", "platlib")})


def _installed(path: str) -> bool:
    """Return whether a file belongs to an installed library."""
    names = Path(path).parts
    return (
        path.startswith(_installation_folders())
        or "site-packages" in names
        or "dist-packages" in names
    )
