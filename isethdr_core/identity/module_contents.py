"""Module contents: what one module holds and reaches, its imports resolved.

The contents are the module's normal form, the targets of its references, the data files that it
names, and the libraries that it imports.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass, field
from pathlib import Path

from ..plugins import registry
from .code_facts import Facts
from .core_modules import Rules
from .import_targets import EMPTY, ImportResolver, Target
from .name_bindings import Spec
from .normal_form import Reference
from .package_sources import Sources


@dataclass
class Module:
    """One followed module, its imports resolved."""

    name: str
    own: str  # digest of its normal form
    only_imports: bool = False  # only re-exports names
    targets: list[Target] = field(default_factory=list)  # targets of its numbered references
    # numbered strings; the name of a data file is replaced by the content of the file
    strings: list[str] = field(default_factory=list)
    next: set[str] = field(default_factory=set)  # modules that it reaches directly
    libraries: set[str] = field(default_factory=set)  # libraries that it imports, by import name
    data: set[str] = field(default_factory=set)  # data files that it names, below their package
    files: set[str] = field(default_factory=set)  # files on which these contents depend

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


class ModuleReader:
    """Reads modules of packages as text; no module is imported.

    Parameters
    ----------
    sources : where modules and data files lie.
    rules : which modules of the core are followed.
    """

    def __init__(self, sources: Sources, rules: Rules) -> None:
        self._sources = sources
        self._rules = rules
        self._resolver = ImportResolver(sources, rules)
        self._modules: dict[str, Module] = {}

    def module(self, name: str) -> Module:
        """Return the contents of a module.

        Raises
        ------
        LookupError : the module has no text here.
        """
        if name not in self._modules:
            self._modules[name] = self._read(name)
        return self._modules[name]

    def _read(self, name: str) -> Module:
        located = self._sources.locate(name)
        if located is None:
            raise LookupError(f"no source of the module {name}")
        if not os.path.isfile(located.path):  # a package without a file of its own
            return Module(name, EMPTY, only_imports=True)
        if not located.path.endswith(".py"):
            content = self._sources.cache.content(located.path)
            return Module(name, content, files={located.path}, data={located.path})
        facts = self._sources.cache.facts(located.path)
        module = Module(name, facts.tree, only_imports=facts.only_imports)
        module.files.add(located.path)
        for spec in facts.imports:
            followed = spec._replace(name="") if spec.name == "*" else spec
            self._follow(module, self._resolver.resolve(name, followed, ()))
        for built in facts.builds:
            self._follow(module, self._registered(built))
        for reference in facts.references:
            target = self._reference(name, reference)
            self._follow(module, target)
            module.targets.append(target)
        self._data_of(module, facts)
        if facts.dynamic and not self._rules.is_core(name):
            self._whole_package(module)
        module.next.discard(name)
        return module

    def _reference(self, module: str, reference: Reference) -> Target:
        """Return what an imported name refers to where a module uses it."""
        attributes = tuple(filter(None, reference.attributes.split(".")))
        return self._resolver.resolve(module, reference.spec, attributes)

    def _registered(self, built: str) -> Target:
        """Return the target of the class of the component `kind/name`."""
        kind, _, name = built.partition("/")
        offered = registry.components().get((kind, name))
        if offered is None:
            return Target("outside", "", built)
        if isinstance(offered.target, str):
            module, _, name = offered.target.partition(":")
        else:
            module = offered.target.__module__
            name = offered.class_name
        return self._resolver.resolve(module, Spec(0, module, name), ())

    def _data_of(self, module: Module, facts: Facts) -> None:
        """Add the strings of a module. A string that names data files stands for their content."""
        data = self._sources.data_of(module.name)
        digest = self._sources.cache.content
        for text in facts.strings:
            files = data.named(text) if data.by_name else []
            module.strings.append(
                ",".join(f"{_below(path, text, data.folder)}={digest(path)}" for path in files)
                or text
            )
            module.add_data(files, data.folder)
        for text in facts.rare_strings if data.by_name else []:
            files = data.named(text)
            module.strings += [
                f"{_below(path, text, data.folder)}={digest(path)}" for path in files
            ]
            module.add_data(files, data.folder)
        for suffix in facts.suffixes:
            files = data.by_suffix.get(suffix, [])
            module.strings += sorted(f"{os.path.basename(path)}={digest(path)}" for path in files)
            module.add_data(files, data.folder)

    def _whole_package(self, module: Module) -> None:
        """Let a module reach all modules and data of its package, because its text does not show
        which of them it uses.
        """
        module.next |= set(self._sources.all_modules(module.name))
        data = self._sources.data_of(module.name)
        files = [path for group in data.by_name.values() for path in group]
        module.strings += sorted(
            f"{os.path.basename(p)}={self._sources.cache.content(p)}" for p in files
        )
        module.add_data(files, data.folder)

    def _follow(self, module: Module, target: Target) -> None:
        """Let a module reach a target, and the modules that run on the way to it."""
        module.next |= set(target.through)
        if target.kind == "module":
            module.next.add(target.module)
        elif target.kind == "library":
            module.libraries.add(target.name.partition(".")[0])
        elif target.kind == "unknown" and not self._rules.is_core(module.name):
            self._whole_package(module)


def _below(path: str, text: str, package: str) -> str:
    """Return a data file's name: empty where `text` names the file, else its path in the folder
    that `text` names, or its file name where `text` is a suffix.

    Parameters
    ----------
    path : path of the data file.
    text : string that names it.
    package : folder of the package. Folders above it do not count, as a package may lie anywhere.
    """
    last = text.rpartition("/")[2]
    names = Path(path).relative_to(package).parts
    if names[-1] == last:
        return ""
    for folder in (last, last.rpartition(".")[2]):
        if folder in names[:-1]:
            return "/".join(names[len(names) - names[::-1].index(folder) :])
    return names[-1]
