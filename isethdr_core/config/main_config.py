"""Main config: choices and settings of `config.yaml`, read without composing it.

`isethdr run --help` prints them, and the command line completes names from them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import yaml

from ..plugins.ranges import on_command_line

FILE = Path(__file__).parent / "conf" / "config.yaml"
OF_HYDRA = "hydra"  # the last table of the file: settings of Hydra, not of a run


@dataclass(frozen=True)
class Setting:
    """One setting of a run that belongs to no component."""

    name: str  # as typed: `seed`, `accuracy.noise_fraction_allowed`
    default: str
    meaning: str  # the comment above it


@cache
def default_choices() -> dict[str, str]:
    """Return the choices of the main config by group and key, for example `sensor@cameras.rgbw`."""
    choices = {}
    for entry in yaml.safe_load(FILE.read_text())["defaults"]:
        if isinstance(entry, dict):
            [(group, name)] = entry.items()
            if name is not None and not group.startswith("override "):
                choices[group] = str(name)
    return choices


@cache
def settings() -> list[Setting]:
    """Return the settings of the main config, with the comment above each."""
    text = FILE.read_text()
    values = yaml.safe_load(text)
    rows: list[Setting] = []
    table = ""
    comment = []
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
                rows.append(Setting(name, on_command_line(value), " ".join(comment)))
        comment = []
    return rows
