"""Tab completion: what may follow on the command line, answered without composing a config.

A shell calls `isethdr complete -- WORD ...` at each press of Tab. The words it may offer (commands,
components, presets, fields, settings) are kept in a file of the user's cache folder, until a Python
file or a preset of the core or of a plugin changes.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from importlib import metadata, util
from pathlib import Path
from typing import Any

import typer

from ..storage.home_folder import home

SCRIPTS = Path(__file__).parent / "completion_scripts"
SHELLS = {"bash": "isethdr.bash", "zsh": "isethdr.zsh", "fish": "isethdr.fish"}
COMPOSING = ("run", "plan")  # commands that take overrides
# subcommands of `catalog` that take a store's key
OF_RUNS = ("show", "compare", "report", "score", "rm")
REPRODUCE = "reproduce"  # takes the key of a run
KINDS_ONLY = "plugins"
NEW_PLUGIN = "new-plugin"


@dataclass
class Vocabulary:
    """All words that can be offered."""

    commands: dict[str, list[str]] = field(default_factory=dict)  # {command: its subcommands}
    options: dict[str, list[str]] = field(default_factory=dict)  # {full command: its options}
    # {kind: {component or preset: {field: its choices}}}
    names: dict[str, dict[str, dict[str, list[str]]]] = field(default_factory=dict)
    experiments: list[str] = field(default_factory=list)
    settings: list[str] = field(default_factory=list)
    # {place in the config: choice of the main config}; a place is, for example, `flare.dirt`
    chosen: dict[str, str] = field(default_factory=dict)
    kind_of: dict[str, str] = field(default_factory=dict)  # {place: kind}; `cameras.rgbw`: sensor


def complete(app: typer.Typer, words: list[str]) -> list[str]:
    """Return the completions of the last word.

    Parameters
    ----------
    app : the command line.
    words : words typed after `isethdr`, up to the cursor; the last one may be empty.
    """
    known_words = vocabulary(app)
    *before, current = words or [""]
    if not before:
        return _beginning(current, [*known_words.commands, "--help", "--version"])
    command = before[0]
    if current.startswith("-"):
        subcommand = " ".join(w for w in before[:2] if not w.startswith("-"))
        named = known_words.options.get(subcommand, known_words.options.get(command, []))
        own = ["-m", "--multirun", "--cfg"] if command == "run" else []
        own += ["--home", "--help"]
        return _beginning(current, [*named, *(o for o in own if o not in named)])
    if command in COMPOSING:
        return list(dict.fromkeys(_overrides(known_words, before[1:], current)))
    if command == KINDS_ONLY:
        places = [
            list(known_words.names),
            *([known_words.names.get(before[1], {})] if before[1:] else []),
        ]
        return _beginning(current, places[len(before) - 1] if len(before) <= len(places) else [])
    if command == NEW_PLUGIN:
        return _beginning(current, known_words.names) if len(before) == 1 else []
    if before == [REPRODUCE] or before[1:2] and before[1] in OF_RUNS:
        return _beginning(current, _stored())
    return _beginning(current, known_words.commands.get(command, [])) if len(before) == 1 else []


def script(shell: str) -> str:
    """Return the completion script that a shell reads when it starts."""
    return (SCRIPTS / SHELLS[shell]).read_text(encoding="utf-8")


def _beginning(current: str, words: Any) -> list[str]:
    return sorted(word for word in words if word.startswith(current))


def _stored() -> list[str]:
    with suppress(OSError):
        return [
            entry.name.removesuffix(".zarr")
            for part in ("runs", "scenes")
            if (home() / part).is_dir()
            for entry in os.scandir(home() / part)
            if entry.name.endswith(".zarr") and not entry.name.startswith(".")
        ]
    return []


def _overrides(words: Vocabulary, before: list[str], current: str) -> Iterator[str]:
    """Yield overrides of a config that begin with `current`."""
    chosen = dict(words.chosen)
    kind_of = dict(words.kind_of)
    for word in before:  # choices typed earlier on this command line
        key, _, name = word.lstrip("+").partition("=")
        group, _, place = key.partition("@")
        if group in words.names:
            chosen[place or group] = name.partition(",")[0]
            kind_of[place or group] = group
    key, equals, value = current.partition("=")
    if equals:
        done, comma, last = value.rpartition(",")
        for choice in _values(words, key, chosen, kind_of):
            if choice.startswith(last):
                yield f"{key}={done}{comma}{choice}"
        return
    if current.startswith("~"):
        yield from _beginning(current, [f"~{place}" for place in chosen])
        return
    first = [f"{group}=" for group in (*words.names, "experiment")]
    first += [f"{setting}=" for setting in words.settings]
    yield from _beginning(current, first)
    for place, name in chosen.items():
        if current.startswith(f"{place}."):
            fields = words.names.get(kind_of[place], {}).get(name, {})
            yield from _beginning(current, [f"{place}.{one}=" for one in fields])
        elif current and f"{place}.".startswith(current):
            yield f"{place}."


def _values(
    words: Vocabulary, key: str, chosen: dict[str, str], kind_of: dict[str, str]
) -> list[str]:
    """Return the values that are known for the key of an override."""
    group = key.lstrip("+").partition("@")[0]
    if group in words.names:
        return sorted(words.names[group])
    if group == "experiment":
        return words.experiments
    place, _, name = group.rpartition(".")
    return words.names.get(kind_of.get(place, ""), {}).get(chosen.get(place, ""), {}).get(name, [])


# --- the vocabulary, kept in a file ---------------------------------------------------------------


def vocabulary(app: typer.Typer) -> Vocabulary:
    """Return all words that can be offered; the stored words if no package has changed."""
    path = cache_file()
    with suppress(OSError, ValueError, TypeError, KeyError):
        stored = json.loads(path.read_text(encoding="utf-8"))
        if stored["state"] == _state(stored["packages"]):
            return Vocabulary(**stored["words"])
    from .vocabulary import collected  # imports every plugin

    words, packages = collected(app)
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        stored = {"state": _state(packages), "packages": packages, "words": asdict(words)}
        temporary = path.with_suffix(f".{os.getpid()}")
        temporary.write_text(json.dumps(stored), encoding="utf-8")
        temporary.replace(path)
    return words


def cache_file() -> Path:
    """Return the path of the stored words, in the folder of the component descriptions."""
    own = os.environ.get("ISETHDR_CACHE")
    folder = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return (Path(own) if own else Path(folder) / "isethdr") / "completion.json"


def _state(packages: list[str]) -> str:
    """Return a digest of the installed plugins and of the files of their packages."""
    digest = hashlib.sha256(os.environ.get("ISETHDR_PLUGINS", "all").encode())
    for entry in sorted(f"{e.name}={e.value}" for e in metadata.entry_points(group="isethdr")):
        digest.update(entry.encode())
    for package in packages:
        spec = util.find_spec(package)
        places = [] if spec is None else list(spec.submodule_search_locations or [])
        if spec is not None and not places and spec.origin:
            status = os.stat(spec.origin)
            digest.update(f"{spec.origin} {status.st_mtime_ns}\n".encode())
        for place in places:
            for folder, _, files in os.walk(place):
                for name in files:
                    if name.endswith((".py", ".yaml")):
                        status = os.stat(os.path.join(folder, name))
                        digest.update(f"{name} {status.st_size} {status.st_mtime_ns}\n".encode())
    return digest.hexdigest()[:16]
