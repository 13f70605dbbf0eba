"""Main config: what `config.yaml` chooses and sets, read without composing it.

The command line shows it in `isethdr run --help`, and completes the names of settings.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import yaml

from ..plugins.ranges import on_command_line

FILE = Path(__file__).parent / "conf" / "config.yaml"
OF_HYDRA = "hydra"  # the last table of the file: how Hydra works, not what a run is


@dataclass(frozen=True)
class Setting:
    """One setting of a run that belongs to no component."""

    name: str  # as typed: `seed`, `accuracy.noise_fraction_allowed`
    default: str
    meaning: str  # the comment above it


@cache
def default_choices() -> dict[str, str]:
    """Return what the main config chooses, by group and key: `sensor@cameras.rgbw` for example."""
    found = {}
    for entry in yaml.safe_load(FILE.read_text())["defaults"]:
        if isinstance(entry, dict):
            [(group, name)] = entry.items()
            if name is not None and not group.startswith("override "):
                found[group] = str(name)
    return found


@cache
def settings() -> list[Setting]:
    """Return the settings of the main config, with the comment above each."""
    text = FILE.read_text()
    values = yaml.safe_load(text)
    found: list[Setting] = []
    table, comment = "", []
    for line in text.partition(f"\n{OF_HYDRA}:")[0].splitlines():
        words = line.strip()
        if words.startswith("#"):
            comment.append(words.lstrip("# "))
            continue
        key, colon, _ = words.partition(":")
        indent = len(line) - len(line.lstrip())
        if colon and not words.startswith("-") and indent in (0, 2):
            table = "" if indent == 0 else table
            value = values[table][key] if table else values.get(key)
            if isinstance(value, dict):
                table = key
            elif key != "defaults":
                name = f"{table}.{key}" if table else key
                found.append(Setting(name, on_command_line(value), " ".join(comment)))
        comment = []
    return found
