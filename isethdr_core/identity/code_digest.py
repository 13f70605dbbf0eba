"""Code digest: identifies the code that makes a component's results, independent of module paths.

The digest of a component covers

- the normal form (`code_facts`) of its module, and of every module that it reaches by static
  imports, including imports inside functions. An imported name is replaced by the content that it
  refers to, so neither module paths nor re-exports count;
- the bytes of every data file of the package that these modules name, and of compiled modules;
- of the core, only the part in `FOLLOWED`: laws and data that components compute with. The rest of
  the core, the frame (`frame_code`), runs the chain, and is part of the name of a run;
- the module of a component that is built by its kind and name;
- the whole package, if the text of a module does not show what it imports.

Installed libraries are identified by version (`Code.libraries`), not by content. No module is
imported to compute a digest. A package that is not installed, but lies on the path, counts as the
component's own code.
"""

from __future__ import annotations

import hashlib
import importlib.machinery
import os
import sys
import sysconfig
import uuid
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from importlib import metadata, util
from pathlib import Path
from typing import Any, NamedTuple

from ..plugins import registry
from .code_cache import CodeCache, cache_folder
from .code_facts import Facts, Reference, Spec

CORE = "isethdr_core"
SECOND_SPELLING = "isethdr"  # the same names
# modules that components compute with; every other part of the core belongs to the frame
FOLLOWED = (
    "isethdr_core.physics",
    "isethdr_core.lighting",
    "isethdr_core.data",
    "isethdr_core.display",
    "isethdr_core.onnx_session",
)
# parts of the core that change no result: what is shown, written, waited for, refused or estimated
WITHOUT_RESULT = (
    "isethdr_core.cli",
    "isethdr_core.config",
    "isethdr_core.conformance",
    "isethdr_core.errors",
    "isethdr_core.identity",
    "isethdr_core.pipeline.memory_estimate",
    "isethdr_core.pipeline.runtime_estimate",
    "isethdr_core.plugins.hookspecs",
    "isethdr_core.results",
    "isethdr_core.runs.claims",
    "isethdr_core.runs.labels",
    "isethdr_core.runs.names",
    "isethdr_core.runs.parent_watch",
    "isethdr_core.runs.processor",
    "isethdr_core.runs.provenance",
    "isethdr_core.storage.arrays",
    "isethdr_core.storage.atomic_write",
    "isethdr_core.storage.bounded_cache",
    "isethdr_core.storage.exact_encoding",
    "isethdr_core.storage.join",
    "isethdr_core.storage.manifest",
    "isethdr_core.storage.reader",
    "isethdr_core.storage.store",
    "isethdr_core.sweeps",
)
ROUNDS = 3  # depth of imports down to which the targets of references are compared
PRESETS = "conf"  # folders with presets; the config holds the chosen values
COMPILED = tuple(importlib.machinery.EXTENSION_SUFFIXES)
NO_DATA = (".py", ".pyc", ".pyi", ".typed", *COMPILED)
# libraries whose import name is not the name they are installed by
INSTALLED_AS = {
    "OpenEXR": "OpenEXR",
    "colour": "colour-science",
    "colour_demosaicing": "colour-demosaicing",
    "array_api_compat": "array-api-compat",
    "drjit": "drjit",
    "hydra": "hydra-core",
    "omegaconf": "omegaconf",
    "skimage": "scikit-image",
    "PIL": "pillow",
    "yaml": "PyYAML",
    "google_crc32c": "google-crc32c",
}
ABSENT = "not installed"


@dataclass(frozen=True)
class Rules:
    """The modules of the core that belong to components, and those that change no result."""

    core: str = CORE
    followed: tuple[str, ...] = FOLLOWED
    without_result: tuple[str, ...] = WITHOUT_RESULT


@dataclass(frozen=True)
class Code:
    """The code behind a result."""

    digest: str
    libraries: dict[str, str] = field(default_factory=dict)  # distribution: version
    modules: tuple[str, ...] = ()  # the modules that were reached, for people
    data: tuple[str, ...] = ()  # data files and compiled modules, below their package
    has_source: bool = True  # False: its digest holds in this process alone


class Target(NamedTuple):
    """The target of a reference."""

    kind: str  # module: followed; library; outside: neither; unknown: any module of the package
    module: str  # dotted name of a followed module
    name: str  # the rest, or the dotted name outside
    through: tuple[str, ...] = ()  # modules that run on the way


class Located(NamedTuple):
    """Where a module lies."""

    path: str
    is_package: bool


class Sources:
    """The Python packages that can be imported here, read as text.

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
        self._data: dict[str, _Data] = {}
        self._below: dict[str, list[str]] = {}

    def top(self, name: str) -> str:
        """Return `builtin`, `library`, `absent` or `own`: whose a package of this name is."""
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
        """Return where a module of an own package lies; None where there is none of that name."""
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
        except (ValueError, ImportError):  # made in this process, without a spec
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

    def data_of(self, module: str) -> _Data:
        """Return the data files of the package that a module belongs to."""
        folder = self.package_folder(module)
        if folder not in self._data:
            self._data[folder] = _Data.below(folder)
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
class _Data:
    """Data files of one package, found by the last part of their path."""

    folder: str = ""
    by_name: dict[str, list[str]] = field(default_factory=dict)
    by_folder: dict[str, list[str]] = field(default_factory=dict)
    by_suffix: dict[str, list[str]] = field(default_factory=dict)

    @classmethod
    def below(cls, folder: str) -> _Data:
        data = cls(folder)
        packages = set()
        for inner, folders, files in os.walk(folder) if folder else ():
            folders[:] = sorted(f for f in folders if f not in (PRESETS, "__pycache__"))
            if any(name.endswith(".py") for name in files):
                packages.add(inner)
            above = [p for p in _folders_between(folder, inner) if p not in packages]
            for name in sorted(files):
                if name.endswith(NO_DATA):
                    continue
                path = os.path.join(inner, name)
                data.by_name.setdefault(name, []).append(path)
                data.by_suffix.setdefault(os.path.splitext(name)[1], []).append(path)
                for part in above:
                    data.by_folder.setdefault(os.path.basename(part), []).append(path)
        return data

    def named(self, text: str) -> list[str]:
        """Return the files that a string names: a file, or all of a folder without modules."""
        last = text.rpartition("/")[2]
        return self.by_name.get(last) or self.by_folder.get(last) or []


def _folders_between(top: str, folder: str) -> list[str]:
    """Return the folders from below `top` down to `folder`."""
    names = Path(folder).relative_to(top).parts
    return [os.path.join(top, *names[: n + 1]) for n in range(len(names))]


def _loaded(module: str) -> Located | None:
    """Return where a module lies that is loaded in this process and found nowhere on the path."""
    origin = getattr(sys.modules.get(module), "__file__", None)
    return Located(origin, os.path.basename(origin) == "__init__.py") if origin else None


def _in_folder(folder: str, name: str) -> Located | None:
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
    return tuple({sysconfig.get_path(p) + os.sep for p in ("purelib", "platlib")})


def _installed(path: str) -> bool:
    names = Path(path).parts
    return (
        path.startswith(_installation_folders())
        or "site-packages" in names
        or "dist-packages" in names
    )


class CodeReader:
    """Resolve imports over the text of packages, and digest what they reach."""

    def __init__(self, sources: Sources | None = None, rules: Rules | None = None) -> None:
        self.sources = sources or Sources()
        self.rules = rules or Rules()
        self._modules: dict[str, _Module] = {}

    def code(self, module: str, name: str) -> Code:
        """Return the code of the class or function `name` of a module.

        Raises
        ------
        LookupError : the module has no text here.
        """
        return self._digest([module], [name])

    def frame(self) -> Code:
        """Return the code of the frame: the core without `FOLLOWED`, and the part of it that the
        frame reaches.
        """
        rules = self.rules
        left_out = (*rules.followed, *rules.without_result)
        modules = self.sources.all_modules(rules.core)
        roots = [m for m in modules if m != rules.core and not _within(m, left_out)]
        everything = Rules(rules.core, (rules.core,), rules.without_result)
        return CodeReader(self.sources, everything)._digest(sorted(roots), [])

    def _digest(self, roots: list[str], names: list[str]) -> Code:
        locations = [self.sources.locate(root) for root in roots]
        key = repr((self.rules, [location and location.path for location in locations], names))
        key = hashlib.sha256(key.encode()).hexdigest()[:32]
        record = self.sources.cache.digest(key, lambda: self._made(roots, names))
        return Code(
            record["digest"],
            dict(version_of(name) for name in record["libraries"]),
            tuple(record["modules"]),
            tuple(record["data"]),
        )

    def _made(self, roots: list[str], names: list[str]) -> tuple[dict[str, Any], list[str]]:
        """Return the record of the modules that `roots` reach, and the files and folders that it
        depends on.
        """
        reached = self._reached(roots)
        hashes = {name: module.own for name, module in reached.items()}
        for _ in range(ROUNDS):
            hashes = {name: module.with_references(hashes) for name, module in reached.items()}
        root_hashes = [hashes[root] for root in roots] if names else []
        other_hashes = sorted({h for name, h in hashes.items() if not reached[name].only_imports})
        digest = hashlib.sha256(
            "\n".join([*names, *root_hashes, "", *other_hashes]).encode()
        ).hexdigest()[:16]
        record = {
            "digest": digest,
            "libraries": sorted({library for m in reached.values() for library in m.libraries}),
            "modules": sorted(reached),
            "data": sorted({path for m in reached.values() for path in m.data}),
        }
        files = {path for module in reached.values() for path in module.files}
        return record, [*files, *self.sources.folders_of(reached)]

    def _reached(self, roots: list[str]) -> dict[str, _Module]:
        reached: dict[str, _Module] = {}
        waiting = list(roots)
        while waiting:
            name = waiting.pop()
            if name in reached:
                continue
            module = reached[name] = self._module(name)
            waiting += sorted(module.next - reached.keys())
        return reached

    def _module(self, name: str) -> _Module:
        """Return the facts about a module and the targets of its references."""
        if name not in self._modules:
            self._modules[name] = self._read(name)
        return self._modules[name]

    def _read(self, name: str) -> _Module:
        located = self.sources.locate(name)
        if located is None:
            raise LookupError(f"no source of the module {name}")
        if not os.path.isfile(located.path):  # a package without a file of its own
            return _Module(name, digest_empty(), only_imports=True)
        if not located.path.endswith(".py"):
            content = self.sources.cache.content(located.path)
            return _Module(name, content, files={located.path}, data={located.path})
        facts = self.sources.cache.facts(located.path)
        module = _Module(name, facts.tree, only_imports=facts.only_imports)
        module.files.add(located.path)
        for spec in facts.imports:
            if spec.name != "*":
                self._follow(module, self.resolve(name, spec, ()))
            else:
                self._follow(module, self.resolve(name, Spec(spec.level, spec.module, ""), ()))
        for built in facts.builds:
            self._follow(module, self._registered(built))
        for reference in facts.references:
            target = self._reference(name, reference)
            self._follow(module, target)
            module.targets.append(target)
        self._data_of(module, facts)
        if facts.dynamic and not self._is_core(name):
            self._whole_package(module)
        module.next.discard(name)
        return module

    def _reference(self, module: str, reference: Reference) -> Target:
        attributes = tuple(filter(None, reference.attributes.split(".")))
        return self.resolve(module, reference.spec, attributes)

    def _registered(self, built: str) -> Target:
        """Return the location of the class of the component `kind/name`; None if there is none."""
        kind, _, name = built.partition("/")
        offered = registry.components().get((kind, name))
        if offered is None:
            return Target("outside", "", built)
        if isinstance(offered.target, str):
            module, _, name = offered.target.partition(":")
        else:
            module = offered.target.__module__
            name = offered.class_name
        return self.resolve(module, Spec(0, module, name), ())

    def _data_of(self, module: _Module, facts: Facts) -> None:
        data = self.sources.data_of(module.name)
        digest = self.sources.cache.content
        for text in facts.strings:
            files = data.named(text) if data.by_name else []
            module.strings.append(
                ",".join(f"{_below(path, text)}={digest(path)}" for path in files) or text
            )
            module.add_data(files, data.folder)
        for suffix in facts.suffixes:
            files = data.by_suffix.get(suffix, [])
            module.strings += sorted(f"{os.path.basename(path)}={digest(path)}" for path in files)
            module.add_data(files, data.folder)

    def _whole_package(self, module: _Module) -> None:
        module.next |= set(self.sources.all_modules(module.name))
        data = self.sources.data_of(module.name)
        files = [path for group in data.by_name.values() for path in group]
        module.strings += sorted(
            f"{os.path.basename(p)}={self.sources.cache.content(p)}" for p in files
        )
        module.add_data(files, data.folder)

    def _follow(self, module: _Module, target: Target) -> None:
        module.next |= set(target.through)
        if target.kind == "module":
            module.next.add(target.module)
        elif target.kind == "library":
            module.libraries.add(target.name.partition(".")[0])
        elif target.kind == "unknown" and not self._is_core(module.name):
            self._whole_package(module)

    # imports

    def _is_core(self, module: str) -> bool:
        return module.partition(".")[0] == self.rules.core

    def _is_followed(self, module: str) -> bool:
        if not self._is_core(module):
            return True
        return _within(module, self.rules.followed) and not _within(
            module, self.rules.without_result
        )

    def resolve(self, module: str, spec: Spec, attributes: tuple[str, ...]) -> Target:
        """Return the target of an import.

        Parameters
        ----------
        module : dotted name of the module with the import.
        spec : the import: its module, its name, and its level if it is relative.
        attributes : attributes that are read from the imported name, in order.
        """
        path = [*filter(None, spec.module.split("."))]
        if spec.level:
            importer = module.split(".")
            located = self.sources.locate(module)
            drop = spec.level - (1 if located and located.is_package else 0)
            path = [*importer[: len(importer) - drop], *path]
        attributes_left = [*filter(None, [spec.name if spec.name != "*" else ""]), *attributes]
        if not path:
            return Target("outside", "", ".".join(attributes_left))
        if path[0] == SECOND_SPELLING:
            path[0] = self.rules.core
        owner = self.sources.top(path[0])
        if owner == "builtin":
            return Target("outside", "", ".".join([*path, *attributes_left]))
        if owner in ("library", "absent"):
            return Target("library", "", ".".join([*path, *attributes_left]))
        at = path[0]
        through = self._on_the_way(path[0])
        for part in path[1:]:
            at = f"{at}.{part}"
            if self.sources.locate(at) is None:
                return Target("outside", "", at)  # of another platform or version: cannot run
            through += self._on_the_way(at)
        if path[1:] and through and through[-1] == at:
            through = through[:-1]
        return self._descend(at, attributes_left, tuple(through), 0)

    def _descend(self, at: str, names: list[str], through: tuple[str, ...], depth: int) -> Target:
        """Follow names from a module to their definitions, through modules that re-export them."""
        located = self.sources.locate(at)
        facts = self._facts(located)
        if not names or located is None or facts is None:
            return self._at(at, names, through)
        name = names[0]
        more = names[1:]
        passed = facts.imported.get(name)
        if passed is None and name not in facts.defined and name in facts.lazy:
            passed = _lazy_spec(facts.lazy[name], name)
        if passed is not None and depth < 20:
            target = self.resolve(at, passed, tuple(more))
            if target.kind != "outside" or target.name:
                executed = () if facts.only_imports or located.is_package else self._run(at)
                return target._replace(through=(*through, *executed, *target.through))
        if name in facts.defined:
            return self._at(at, names, through)
        if located.is_package and self.sources.locate(f"{at}.{name}") is not None:
            below = f"{at}.{name}"
            return self._descend(below, more, (*through, *self._on_the_way(below)), depth + 1)
        for star in facts.stars:
            target = self.resolve(at, Spec(star.level, star.module, name), tuple(more))
            if target.kind == "module" and target.name:
                return target._replace(through=(*through, *target.through))
        if facts.has_getattr and self._is_followed(at):
            return Target("unknown", at, name, through)
        return self._at(at, names, through)

    def _at(self, module: str, names: list[str], through: tuple[str, ...]) -> Target:
        through = tuple(m for m in through if m != module)
        if self._is_followed(module):
            return Target("module", module, ".".join(names), through)
        return Target("outside", "", ".".join(["core", *names]), through)

    def _run(self, module: str) -> tuple[str, ...]:
        return (module,) if self._is_followed(module) else ()

    def _on_the_way(self, package: str) -> tuple[str, ...]:
        """Return a package whose `__init__.py` runs code when a module below it is imported."""
        located = self.sources.locate(package)
        if located is None or not located.is_package:
            return ()
        facts = self._facts(located)
        return self._run(package) if facts is not None and facts.has_effects else ()

    def _facts(self, located: Located | None) -> Facts | None:
        if located is None or not located.path.endswith(".py"):
            return None
        if not os.path.isfile(located.path):
            return Facts(digest_empty(), only_imports=True)
        return self.sources.cache.facts(located.path)


@dataclass
class _Module:
    """One followed module, its imports resolved."""

    name: str
    own: str  # digest of its normal form
    only_imports: bool = False
    targets: list[Target] = field(default_factory=list)  # of its references, as they are numbered
    strings: list[str] = field(default_factory=list)  # as they are numbered; data by content
    next: set[str] = field(default_factory=set)
    libraries: set[str] = field(default_factory=set)
    data: set[str] = field(default_factory=set)
    files: set[str] = field(default_factory=set)

    def add_data(self, files: list[str], folder: str) -> None:
        """Note data files of the package in `folder`."""
        self.data |= {os.path.relpath(path, os.path.dirname(folder)) for path in files}
        self.files |= set(files)

    def with_references(self, hashes: dict[str, str]) -> str:
        """Return the digest of the module, with each reference replaced by the content of its
        target.
        """
        lines = [self.own]
        lines += [f"{target.name}@{hashes.get(target.module, '')}" for target in self.targets]
        lines += self.strings
        return hashlib.blake2b("\n".join(lines).encode(), digest_size=16).hexdigest()


def _below(path: str, text: str) -> str:
    """Return a data file's name: empty where `text` names the file, else its path in the folder."""
    last = text.rpartition("/")[2]
    names = Path(path).parts
    if names[-1] == last:
        return ""
    return "/".join(names[len(names) - names[::-1].index(last) :])


def _within(module: str, prefixes: tuple[str, ...]) -> bool:
    return module in prefixes or module.startswith(tuple(f"{p}." for p in prefixes))


def _lazy_spec(entry: str, name: str) -> Spec:
    """Return the import of an entry of a lazy table: `module`, `.module` or `module:name`."""
    module, _, attribute = entry.partition(":")
    stripped = module.lstrip(".")
    return Spec(len(module) - len(stripped) or 1, stripped, attribute or name)


def digest_empty() -> str:
    """Return the digest of an empty module."""
    return "empty"


@cache
def version_of(library: str) -> tuple[str, str]:
    """Return the distribution and the version of a library by its import name."""
    for name in (INSTALLED_AS.get(library, library), library.replace("_", "-")):
        with suppress(metadata.PackageNotFoundError):
            return name, metadata.version(name)
    for name in metadata.packages_distributions().get(library, ()):
        return name, metadata.version(name)
    return library, ABSENT


@cache
def reader() -> CodeReader:
    """Return the reader of the packages of this process."""
    return CodeReader()


@cache
def code_of_class(cls: type) -> Code:
    """Return the code of a component's class, as it was on first use in this process.

    A class without source text, for example one typed at a prompt, has a digest that is valid in
    this process only: its results are never taken for those of another class.
    """
    try:
        return reader().code(cls.__module__, cls.__qualname__)
    except (LookupError, OSError):
        return Code(f"process {uuid.uuid4().hex[:8]}", has_source=False)


def code_of(component: object) -> Code:
    """Return the code of a component."""
    cls: type = type(component)
    return code_of_class(cls)


@cache
def frame_code() -> Code:
    """Return the code of the core that runs a chain."""
    return reader().frame()


def keep() -> None:
    """Store the facts of this process for later processes."""
    reader().sources.cache.save()
