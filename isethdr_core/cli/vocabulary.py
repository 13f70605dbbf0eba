"""Vocabulary: the words of tab completion, collected from commands, components and presets."""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperGroup
from typer.main import get_command

from ..config.main_config import default_choices, settings
from ..plugins import registry
from ..plugins.component import KINDS
from ..plugins.descriptions import Description, descriptions
from ..plugins.presets import EXPERIMENT, component_of, presets
from .commands import add_commands
from .completion import Vocabulary


def collected(app: typer.Typer) -> tuple[Vocabulary, list[str]]:
    """Return all words that can be offered, and the packages that they come from.

    Parameters
    ----------
    app : the command line, to which the commands of plugins are added.
    """
    add_commands(registry.plugin_manager(), app)
    words = Vocabulary(
        experiments=sorted(presets(EXPERIMENT)), settings=[s.name for s in settings()]
    )
    _add_commands(words, app)
    shown, _ = descriptions(registry.components().values())
    for kind in KINDS:
        about = {c.name: _choices(d) for c, d in shown.items() if c.kind == kind}
        based = {p.name: about.get(component_of(p), {}) for p in presets(kind).values()}
        words.names[kind] = about | based
    for group, name in default_choices().items():
        kind, _, place = group.partition("@")
        if kind in KINDS:
            words.chosen[place or kind] = name
            words.kind_of[place or kind] = kind
    plugins = [p.__name__ for p in registry.plugin_manager().get_plugins()]
    offered = {comp.package for comp in registry.components().values()}
    packages = {"isethdr_core", *offered, *(name.partition(".")[0] for name in plugins)}
    return words, sorted(packages)


def _choices(about: Description) -> dict[str, list[str]]:
    return {row.name: list(row.choices) for row in about.fields}


def _add_commands(words: Vocabulary, app: typer.Typer) -> None:
    """Add the commands, with their subcommands and options."""
    group: Any = get_command(app)
    for name, command in group.commands.items():
        below = command.commands if isinstance(command, TyperGroup) else {}
        words.commands[name] = sorted(below)
        words.options[name] = _options(command)
        for other, sub in below.items():
            words.options[f"{name} {other}"] = _options(sub)


def _options(command: Any) -> list[str]:
    return [o for p in command.params for o in (*p.opts, *p.secondary_opts) if o.startswith("--")]
