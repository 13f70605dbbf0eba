"""Public path of `plugins.hookspecs`."""

from .plugins.hookspecs import (
    PROJECT,
    hookimpl,
    hookspec,
    isethdr_after_stage,
    isethdr_before_stage,
    isethdr_commands,
    isethdr_components,
    isethdr_config_paths,
    isethdr_on_stage_error,
)

__all__ = [
    "PROJECT",
    "hookimpl",
    "hookspec",
    "isethdr_after_stage",
    "isethdr_before_stage",
    "isethdr_commands",
    "isethdr_components",
    "isethdr_config_paths",
    "isethdr_on_stage_error",
]
