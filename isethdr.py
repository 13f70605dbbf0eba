"""`import isethdr`: a second spelling of `isethdr_core`, with the same objects.

Every public name and module of `isethdr_core` is reached from here: `isethdr.run`,
`from isethdr import Component, ledger`. This is one module, not a package, so that nothing is
imported twice: import from a module as `from isethdr_core.ledger import ...`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import isethdr_core

if TYPE_CHECKING:
    from isethdr_core import *  # noqa: F403

__all__ = isethdr_core.__all__


def __getattr__(name: str) -> Any:
    """Return the object of this name from `isethdr_core`."""
    if name in isethdr_core.__all__:  # not __path__: with it this module would be a package
        return getattr(isethdr_core, name)
    raise AttributeError(f"module 'isethdr' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the names of `isethdr_core`."""
    return dir(isethdr_core)
