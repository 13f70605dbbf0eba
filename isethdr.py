"""`import isethdr`: a second spelling of `isethdr_core`, with the same objects, and the catalog.

Every public name and module of `isethdr_core` is reached from here: `isethdr.run`,
`from isethdr import Component, ledger`. `find`, `show` and `compare` query the home folder, and
`PictureDataset` gives stored pictures for training. This is one module, not a package, so that
nothing is imported twice: import from a module as `from isethdr_core.ledger import ...`.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

import isethdr_core

if TYPE_CHECKING:
    from isethdr_catalog.dataset import PictureDataset as PictureDataset
    from isethdr_catalog.python_calls import compare as compare
    from isethdr_catalog.python_calls import find as find
    from isethdr_catalog.python_calls import show as show

    from isethdr_core import *  # noqa: F403

OF_CATALOG = {  # public name: the module of `isethdr_catalog` that defines it
    "PictureDataset": "dataset",
    "compare": "python_calls",
    "find": "python_calls",
    "show": "python_calls",
}
__all__ = [*isethdr_core.__all__, "PictureDataset", "compare", "find", "show"]


def __getattr__(name: str) -> Any:
    """Return the object of this name from `isethdr_core`, or from the catalog."""
    if name in OF_CATALOG:
        return getattr(importlib.import_module(f"isethdr_catalog.{OF_CATALOG[name]}"), name)
    if name in isethdr_core.__all__:  # not __path__: with it this module would be a package
        return getattr(isethdr_core, name)
    raise AttributeError(f"module 'isethdr' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the names of `isethdr_core`, and those of the catalog."""
    return sorted([*dir(isethdr_core), *OF_CATALOG])
