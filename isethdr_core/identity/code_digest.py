"""Code digest: identifies the code that makes a component's results, independent of module paths.

The digest of a component covers

- the normal form (`code_facts`) of its module, and of every module that it reaches by static
  imports, including imports inside functions. An imported name is replaced by the content that it
  refers to, so neither module paths nor re-exports count;
- the bytes of every data file of the package that these modules name, and of compiled modules;
- of the core, only the part in `core_modules.FOLLOWED`: laws and data that components compute with.
  The rest of the core, the frame (`frame_code`), runs the chain, and is part of a run's name;
- the module of a component that is built by its kind and name;
- the whole package, if the text of a module does not show what it imports.

Installed libraries are identified by version (`Code.libraries`), not by content. No module is
imported to compute a digest. A package that is not installed, but lies on the path, counts as the
component's own code.
"""

from __future__ import annotations

import hashlib
import uuid
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from .core_modules import Rules, within
from .library_versions import version_of
from .module_contents import Module, ModuleReader
from .package_sources import Sources

ROUNDS = 3  # depth of imports down to which the content of a target is part of a digest


@dataclass(frozen=True)
class Code:
    """The code behind a result."""

    digest: str
    libraries: dict[str, str] = field(default_factory=dict)  # distribution: version
    modules: tuple[str, ...] = ()  # the modules that were reached, for people
    data: tuple[str, ...] = ()  # data files and compiled modules, below their package
    has_source: bool = True  # False: the digest is valid in this process only


class CodeReader:
    """Digests the code that roots (modules of components, or the frame) reach by their imports.

    Parameters
    ----------
    sources : where modules and data files lie; None: the search path of Python.
    rules : which modules of the core are followed.
    """

    def __init__(self, sources: Sources | None = None, rules: Rules | None = None) -> None:
        self.sources = sources or Sources()
        self.rules = rules or Rules()
        self._modules = ModuleReader(self.sources, self.rules)

    def code(self, module: str, name: str) -> Code:
        """Return the code of the class or function `name` of a module.

        Raises
        ------
        LookupError : the module has no text here.
        """
        return self._digest([module], [name])

    def frame(self) -> Code:
        """Return the code of the frame: the core without `core_modules.FOLLOWED`, and the part of
        `FOLLOWED` that the frame reaches.
        """
        rules = self.rules
        left_out = (*rules.followed, *rules.without_result)
        modules = self.sources.all_modules(rules.core)
        roots = [m for m in modules if m != rules.core and not within(m, left_out)]
        everything = Rules(rules.core, (rules.core,), rules.without_result)
        return CodeReader(self.sources, everything)._digest(sorted(roots), [])

    def _digest(self, roots: list[str], names: list[str]) -> Code:
        """Return the code that roots reach, kept while no file of it changes.

        Parameters
        ----------
        roots : dotted names of modules.
        names : names in the first root; empty if all of the roots count.
        """
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

    def _reached(self, roots: list[str]) -> dict[str, Module]:
        """Return {name: contents} of the modules that roots reach by their imports."""
        reached: dict[str, Module] = {}
        waiting = list(roots)
        while waiting:
            name = waiting.pop()
            if name in reached:
                continue
            module = reached[name] = self._modules.module(name)
            waiting += sorted(module.next - reached.keys())
        return reached


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
