"""Public path of `plugins.component`."""

from .plugins.component import (
    KEYED,
    KINDS,
    Component,
    Stage,
    class_getter,
)

__all__ = [
    "Component",
    "KEYED",
    "KINDS",
    "Stage",
    "class_getter",
]
