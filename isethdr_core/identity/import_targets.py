"""Import targets: where an imported name is defined.

The search passes through the packages that re-export the name, and collects those of them that run
code when they are imported.
"""

from __future__ import annotations

import os
from typing import NamedTuple

from .code_facts import Facts
from .core_modules import SECOND_SPELLING, Rules
from .name_bindings import Spec
from .package_sources import Located, Sources

EMPTY = "empty"  # digest of a package without a file of its own
MOST_STEPS = 20  # largest number of steps from a package down to a module; more is a cycle


class Target(NamedTuple):
    """What an imported name refers to."""

    # module: a followed module; library: a library; outside: neither of them; unknown: possibly any
    # module of the package
    kind: str
    module: str  # dotted name of a followed module
    name: str  # name within that module; outside: the whole dotted name
    through: tuple[str, ...] = ()  # modules that are executed before the target is reached


class ImportResolver:
    """Finds the targets of imports in the text of packages.

    Parameters
    ----------
    sources : where modules lie.
    rules : which modules of the core are followed.
    """

    def __init__(self, sources: Sources, rules: Rules) -> None:
        self._sources = sources
        self._rules = rules

    def resolve(self, module: str, spec: Spec, attributes: tuple[str, ...]) -> Target:
        """Return the target of an import.

        Parameters
        ----------
        module : dotted name of the module with the import.
        spec : the import: its module, its name, and its level if it is relative.
        attributes : attributes that are read from the imported name, in order.
        """
        path = self._absolute(module, spec)
        attributes_left = [*filter(None, [spec.name if spec.name != "*" else ""]), *attributes]
        if not path:
            return Target("outside", "", ".".join(attributes_left))
        if path[0] == SECOND_SPELLING:
            path[0] = self._rules.core
        owner = self._sources.top(path[0])
        if owner == "builtin":
            return Target("outside", "", ".".join([*path, *attributes_left]))
        if owner in ("library", "absent"):
            return Target("library", "", ".".join([*path, *attributes_left]))
        at = path[0]
        through = self._on_the_way(path[0])
        for part in path[1:]:
            at = f"{at}.{part}"
            if self._sources.locate(at) is None:
                return Target("outside", "", at)  # for another platform or version: never runs here
            through += self._on_the_way(at)
        if path[1:] and through and through[-1] == at:
            through = through[:-1]
        return self._descend(at, attributes_left, tuple(through), 0)

    def _absolute(self, module: str, spec: Spec) -> list[str]:
        """Return the parts of the dotted name of the module that an import in `module` names."""
        path = [*filter(None, spec.module.split("."))]
        if not spec.level:
            return path
        importer = module.split(".")
        located = self._sources.locate(module)
        drop = spec.level - (1 if located and located.is_package else 0)
        return [*importer[: len(importer) - drop], *path]

    def _descend(self, at: str, names: list[str], through: tuple[str, ...], depth: int) -> Target:
        """Follow names from a module to their definitions, through modules that re-export them.

        Parameters
        ----------
        at : module where the search stands.
        names : the name that is looked for in it, and the attributes that are read from it.
        through : modules that ran on the way.
        depth : steps down so far.
        """
        located = self._sources.locate(at)
        facts = self._facts(located)
        if not names or located is None or facts is None:
            return self._at(at, names, through)
        name = names[0]
        more = names[1:]
        passed = facts.imported.get(name)
        if passed is None and name not in facts.defined and name in facts.lazy:
            passed = _lazy_spec(facts.lazy[name], name)
        if passed is not None and depth < MOST_STEPS and not self._is_own(at, passed, name):
            target = self.resolve(at, passed, tuple(more))
            if target.kind != "outside" or target.name:
                executed = () if facts.only_imports or located.is_package else self._run(at)
                return target._replace(through=(*through, *executed, *target.through))
        if name in facts.defined:
            return self._at(at, names, through)
        if located.is_package and self._sources.locate(f"{at}.{name}") is not None:
            below = f"{at}.{name}"
            return self._descend(below, more, (*through, *self._on_the_way(below)), depth + 1)
        for star in facts.stars:
            target = self.resolve(at, Spec(star.level, star.module, name), tuple(more))
            if target.kind == "module" and target.name:
                return target._replace(through=(*through, *target.through))
        if facts.has_getattr and self._rules.follows(at):
            return Target("unknown", at, name, through)
        return self._at(at, names, through)

    def _is_own(self, package: str, spec: Spec, name: str) -> bool:
        """Return whether a package imports its own module `name`, as by `from . import name`."""
        return spec.name == name and self._absolute(package, spec) == package.split(".")

    def _at(self, module: str, names: list[str], through: tuple[str, ...]) -> Target:
        """Return the target in the module that defines it; outside if that is not followed."""
        through = tuple(m for m in through if m != module)
        if self._rules.follows(module):
            return Target("module", module, ".".join(names), through)
        return Target("outside", "", ".".join(["core", *names]), through)

    def _run(self, module: str) -> tuple[str, ...]:
        """Return a module that runs on the way; nothing if it is not followed."""
        return (module,) if self._rules.follows(module) else ()

    def _on_the_way(self, package: str) -> tuple[str, ...]:
        """Return a package whose `__init__.py` runs code when a module below it is imported."""
        located = self._sources.locate(package)
        if located is None or not located.is_package:
            return ()
        facts = self._facts(located)
        return self._run(package) if facts is not None and facts.has_effects else ()

    def _facts(self, located: Located | None) -> Facts | None:
        """Return the facts of a Python file; None for a compiled module, or without a module."""
        if located is None or not located.path.endswith(".py"):
            return None
        if not os.path.isfile(located.path):
            return Facts(EMPTY, only_imports=True)
        return self._sources.cache.facts(located.path)


def _lazy_spec(entry: str, name: str) -> Spec:
    """Return the import of an entry of a lazy table: `module`, `.module` or `module:name`."""
    module, _, attribute = entry.partition(":")
    stripped = module.lstrip(".")
    return Spec(len(module) - len(stripped) or 1, stripped, attribute or name)
