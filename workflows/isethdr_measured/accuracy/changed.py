"""Settings that users need not know, changed for the time of a measurement."""

from __future__ import annotations

from contextlib import contextmanager


@contextmanager
def changed(module, **values):
    """Within, the names of a module have these values."""
    original = {name: getattr(module, name) for name in values}
    try:
        for name, value in values.items():
            setattr(module, name, value)
        yield
    finally:
        for name, value in original.items():
            setattr(module, name, value)
