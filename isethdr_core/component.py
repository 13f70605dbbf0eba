"""Public path of `plugins.component`."""

from .plugins.component import (
    KEYED,
    KINDS,
    PLUGIN_API,
    Component,
    Stage,
    class_getter,
)

__all__ = ["Component", "KEYED", "KINDS", "PLUGIN_API", "Stage", "class_getter"]
