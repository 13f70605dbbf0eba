"""Presets: the YAML files of plugins, as the command line lists them, without composing any.

A preset's description is the comment in its file; the component that it is based on is found by
its `defaults`, from preset to preset.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import yaml

from .config_paths import PACKAGE, config_paths, folders_of
from .ranges import on_command_line
from .yaml_text import read_yaml

EXPERIMENT = "experiment"  # the group of presets of whole runs


@dataclass(frozen=True)
class Preset:
    """One preset: the component that it is based on, its description, and the fields that
    it sets.
    """

    group: str  # a kind, or `experiment`
    name: str
    summary: str
    based_on: str  # the component or preset that its `defaults` name first, "" for none
    fields: tuple[tuple[str, str], ...]  # (field, value as typed); none for an experiment
    path: Path


@cache
def presets(group: str) -> dict[str, Preset]:
    """Return the presets of a kind, or the experiments, by name."""
    by_name: dict[str, Preset] = {}
    for folder in preset_folders():
        # an editor may leave a link to nothing
        for path in filter(Path.is_file, sorted((folder / group).glob("*.yaml"))):
            by_name.setdefault(path.stem, _read(group, path))
    return by_name


def component_of(preset: Preset) -> str:
    """Return the name of the component that a preset is based on, directly or by other presets."""
    return [preset, *_bases(preset)][-1].based_on


def values_of(preset: Preset) -> dict[str, tuple[str, str]]:
    """Return all fields that a preset sets, with those of the presets that it is based on.

    Returns
    -------
    {field: (value as typed, name of the preset that sets it)}.
    """
    return {
        field: (value, each.name)
        for each in reversed([preset, *_bases(preset)])
        for field, value in each.fields
    }


def _bases(preset: Preset) -> list[Preset]:
    """Return the presets that a preset is based on, the nearest first."""
    all_presets = presets(preset.group)
    found: list[Preset] = []
    base = all_presets.get(preset.based_on)
    while base is not None and base != preset and base not in found:
        found.append(base)
        base = all_presets.get(base.based_on)
    return found


def described_file(text: str) -> tuple[str, list[str]]:
    """Return the description in a YAML file, which its opening comment holds, and its lines."""
    described: list[str] = []
    body: list[str] = []
    for line in text.splitlines():
        opening = not any(not done.startswith("defaults: [") for done in body)
        (described if opening and line.startswith("# ") else body).append(line)
    words = " ".join(line.lstrip("# ") for line in described)
    return words.removeprefix("@package _global_").strip(), body


def preset_folders() -> Iterator[Path]:
    """Yield the folders with presets of plugins, of the core, and of the working folder."""
    for _, place in config_paths():
        if place.startswith(PACKAGE):
            yield from map(Path, folders_of(place.removeprefix(PACKAGE)))
        elif place.startswith("file://"):
            yield Path(place.removeprefix("file://"))
    yield Path(__file__).parents[1] / "config" / "conf"  # presets of the core: lightings
    yield Path.cwd() / "conf"


def _read(group: str, path: Path) -> Preset:
    # one file in another encoding must not hide the others
    text = path.read_text(encoding="utf-8", errors="replace")
    try:
        content = read_yaml(text)
    except yaml.YAMLError:  # Hydra reports the mistake when the preset is chosen
        content = None
    values = content if isinstance(content, Mapping) else {}
    defaults = values.get("defaults")
    listed = defaults if isinstance(defaults, list) else []  # Hydra refuses anything else
    based_on = next((d for d in listed if isinstance(d, str)), "")
    fields: tuple[tuple[str, str], ...] = ()
    if group != EXPERIMENT:
        own = ((k, v) for k, v in values.items() if k not in ("defaults", "name"))
        fields = tuple((str(k), on_command_line(v)) for k, v in own)
    summary = described_file(text)[0]
    return Preset(group, path.stem, summary, "" if based_on == "_self_" else based_on, fields, path)
