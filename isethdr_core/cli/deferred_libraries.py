"""Deferred libraries: large libraries that the command line loads when they are first used.

A config is composed from the fields of the components, so their modules are imported. Most of them
import xarray, which imports pandas. Both imports together take half of the time to compose. An
error in a config, or `isethdr run --cfg job`, needs neither. Programs that import isethdr are not
affected.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from threading import RLock
from types import ModuleType
from typing import Any

LIBRARIES = ("xarray",)  # must be imported as a module everywhere: `import xarray as xr`

_loading = RLock()
_executing: list[ModuleType] = []  # modules whose code runs now, in the thread that holds the lock


class _Deferred(ModuleType):
    """A module that is executed on the first access to one of its names.

    `importlib.util.LazyLoader` executes it at the second `import` statement already, because that
    statement reads the module's specification.
    """

    def __getattr__(self, name: str) -> Any:
        with _loading:  # other threads wait until the module is complete
            if type(self) is _Deferred:
                self._execute(name)
        return getattr(self, name)

    def _execute(self, name: str) -> None:
        """Execute the module and make it an ordinary one.

        Raises
        ------
        AttributeError
            If the module itself uses `name` before it defines it.
        """
        if self in _executing:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r} yet")
        loader = self.__spec__ and self.__spec__.loader
        assert isinstance(loader, _DeferringLoader)
        _executing.append(self)
        try:
            loader.execute(self)
            self.__class__ = ModuleType
        finally:
            _executing.remove(self)


class _DeferringLoader(Loader):
    """Delays the execution of a module."""

    def __init__(self, loader: Loader) -> None:
        self._loader = loader

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        """Return the module that the library's own loader creates; None for the default."""
        return self._loader.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        """Leave the module empty until the first access to one of its names."""
        module.__class__ = _Deferred

    def execute(self, module: ModuleType) -> None:
        """Execute the module, and restore the library's own loader."""
        self._loader.exec_module(module)
        if module.__spec__ is not None:
            module.__spec__.loader = self._loader
        module.__loader__ = self._loader


class _Finder(MetaPathFinder):
    """Finds deferred libraries before Python's own finders do."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the specification of a deferred library; None for others and for loaded ones."""
        if name not in LIBRARIES or name in sys.modules:
            return None
        spec = PathFinder.find_spec(name, path, target)
        if spec is not None and spec.loader is not None:
            spec.loader = _DeferringLoader(spec.loader)
        return spec


def defer() -> None:
    """From now on, load large libraries on first use. Loaded libraries do not change."""
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())
