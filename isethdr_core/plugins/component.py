"""Component: a class that a plugin offers under `kind/name`. Stage: one component in a run."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from typing import Any

# version of hooks and Protocols; increased when something is added that a plugin may rely on
PLUGIN_API = 4
KINDS = ("scene", "renderer", "lighting", "lens", "flare", "sensor", "isp", "metric")
KEYED = ("flare", "metric")  # kinds with several members in a run, under names that users choose


@dataclass(frozen=True, init=False)
class Component:
    """A frozen dataclass offered under `kind/name`; its fields become the Hydra config group entry.

    Parameters
    ----------
    kind : one of `KINDS`.
    name : the name that users type, as in `lens=wavefront`.
    cls : the class, or its location as `"package.module:Class"`. Such a class is imported on first
        use, so that its module may import heavy libraries.
    """

    kind: str
    name: str
    target: type | str

    def __init__(self, kind: str, name: str, cls: type | str) -> None:
        object.__setattr__(self, "kind", kind)
        object.__setattr__(self, "name", name)
        object.__setattr__(self, "target", cls)

    @cached_property
    def cls(self) -> type:
        """The class; it is imported if only its location was given."""
        if not isinstance(self.target, str):
            return self.target
        module, _, name = self.target.partition(":")
        loaded: type = getattr(import_module(module), name)
        return loaded

    @property
    def class_name(self) -> str:
        """The name of the class."""
        if isinstance(self.target, str):
            return self.target.partition(":")[2]
        return self.target.__name__

    @property
    def package(self) -> str:
        """The import package of the class."""
        where = self.target if isinstance(self.target, str) else self.target.__module__
        return where.partition(":")[0].partition(".")[0]


def class_getter(package: str, components: Iterable[Component]) -> Callable[[str], type]:
    """Return the `__getattr__` of a package from which its components' classes can be imported.

    So `from acme import AcmeLens` works although `acme/__init__.py` imports no module of lenses.
    """
    offered = {component.class_name: component for component in components}

    def getter(name: str) -> type:
        if name not in offered:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return offered[name].cls

    return getter


@dataclass
class Stage:
    """One component while it runs: the argument of the stage hooks."""

    kind: str
    name: str
    component: Any
    result: Any = None
    row: Any = None
    error: BaseException | None = field(default=None)
