"""Change internal settings, which are not part of the public interface, during a measurement."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def changed(module: Any, **values: Any) -> Iterator[Any]:
    """Set attributes of a module to other values within the block.

    Parameters
    ----------
    module : module that is changed.
    values : new values, by the name of the attribute.
    """
    original = {name: getattr(module, name) for name in values}
    try:
        for name, value in values.items():
            setattr(module, name, value)
        yield
    finally:
        for name, value in original.items():
            setattr(module, name, value)
