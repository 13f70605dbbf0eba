"""Public path of `conformance`, the kit for plugin authors."""

from .conformance import (
    check,
)

__all__ = [
    "check",
]
