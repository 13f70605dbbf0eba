"""Public path of `plugins.component`."""

from .plugins.component import (
    KEYED,
    KINDS,
    Component,
    Stage,
)

__all__ = [
    "Component",
    "KEYED",
    "KINDS",
    "Stage",
]
