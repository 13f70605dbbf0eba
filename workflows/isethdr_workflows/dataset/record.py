"""Record: the folder `datasets/<name>` of a dataset.

`dataset.json` holds the definition and never changes, except that the number of scenes may grow.
`scenes/<number>.json` records the outcome of a scene. Each file is written completely or not at
all. So several processes and machines may write at the same time, and a killed one leaves no
incomplete record. The radiance itself is in `scenes/` of the home folder, where runs find it.
"""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from isethdr_core.errors import CatalogError, ConfigError, did_you_mean
from isethdr_core.runs.provenance import input_digests
from isethdr_core.storage.atomic_write import write_text
from isethdr_core.storage.home_folder import home

from .draw import DrawnScene, drawn_scene
from .recipe import Recipe, parsed

DEFINITION = "dataset.json"
SCENES = "scenes"


@dataclass(frozen=True)
class Definition:
    """All settings that define the scenes of a dataset."""

    name: str
    seed: int
    count: int  # number of scenes
    recipe_name: str
    recipe_text: str  # YAML
    overrides: tuple[str, ...]  # overrides of all scenes, after those of the recipe
    versions: Mapping[str, str]  # versions of isethdr and the libraries when it was begun
    created: str  # time when it was begun, UTC

    @property
    def recipe(self) -> Recipe:
        """The recipe as it was when the dataset was begun."""
        return parsed(self.recipe_text, self.recipe_name)

    @property
    def command(self) -> str:
        """The command that makes the dataset."""
        own = [f"recipe={self.recipe_name}", f"count={self.count}", f"seed={self.seed}"]
        return shlex.join(["isethdr", "dataset", "generate", self.name, *own, *self.overrides])

    @property
    def command_of_another(self) -> str:
        """The command that makes these scenes as a dataset of another name."""
        return replace(self, name=f"{self.name}_2").command

    def scenes(self) -> list[DrawnScene]:
        """Return all scenes as drawn, with the overrides of the dataset after their own."""
        recipe = self.recipe
        drawn = (drawn_scene(recipe, self.seed, number) for number in range(self.count))
        return [
            DrawnScene(s.number, s.family, s.road, (*s.overrides, *self.overrides)) for s in drawn
        ]


@dataclass(frozen=True)
class SceneRecord:
    """The record of one scene: its settings, and its outcome."""

    number: int
    family: str
    road: str
    overrides: tuple[str, ...]
    stores: tuple[str, ...] = ()  # names in `scenes/` of the home folder; empty if it failed
    seconds: float = 0.0  # time of scene and renderer
    cpu_seconds: float = 0.0  # CPU time of scene and renderer; 0 if it was not recorded
    stored_bytes: int = 0
    noise: Mapping[str, float] = field(default_factory=dict)  # relative, by light group
    objects: tuple[Mapping[str, Any], ...] = ()
    error: str = ""  # reason if the scene failed
    at_once: int = 1  # number of scenes that its machine made at the same time
    # digests of the files that the scene uses, by path as typed; empty in records of earlier
    # versions
    inputs: Mapping[str, str] = field(default_factory=dict)
    folder: str = ""  # folder from which relative paths were read; "" if it was not recorded

    @property
    def machine_s(self) -> float:
        """The scene's share of the machine's time, s; scenes made at the same time share it."""
        return self.seconds / self.at_once

    @property
    def files(self) -> dict[str, str]:
        """The digests of the files that the scene was rendered with, by path. A relative path
        remains only if its folder was not recorded.
        """
        return {os.path.join(self.folder, path): digest for path, digest in self.inputs.items()}


def folder_of(name: str) -> Path:
    """Return the folder of a dataset."""
    return home() / "datasets" / name


def begin(wanted: Definition) -> Definition:
    """Write the definition of a dataset and return it. The definition of a dataset that exists
    only changes if the new count is larger.

    Raises
    ------
    ConfigError : a different dataset has this name, or a file that its scenes use has changed since
        they were rendered.
    CatalogError : the definition cannot be written.
    """
    folder = folder_of(wanted.name)
    stored = read_definition(folder) if (folder / DEFINITION).exists() else None
    if stored is not None and _drawn_from(stored) != _drawn_from(wanted):
        raise ConfigError(
            f"the dataset {wanted.name!r} has recipe={stored.recipe_name} seed={stored.seed}"
            f" {' '.join(stored.overrides)}; expected the same recipe, seed and overrides, or"
            f" another name; type for example isethdr dataset generate {wanted.name}_2"
        )
    _check_files(wanted)
    if stored is not None and stored.count >= wanted.count:
        return stored
    definition = wanted if stored is None else _with_count(stored, wanted.count)
    _write(folder / DEFINITION, json.dumps(asdict(definition), indent=1))
    return definition


def _check_files(wanted: Definition) -> None:
    """Raise ConfigError if a file that stored scenes use has changed, because further scenes would
    show its new content.
    """
    records = read_scenes(folder_of(wanted.name))
    # further scenes read a relative path from the folder of this call, not from that of the records
    now = _digests_now(path for record in records.values() for path in record.inputs)
    for number, record in records.items():
        for path, digest in record.inputs.items():
            if now.get(path, digest) == digest:
                continue
            here = os.path.abspath(path)
            before = os.path.join(record.folder, path)
            scene = f"scene {number + 1} of the dataset {wanted.name!r}"
            if record.folder and os.path.realpath(before) != os.path.realpath(here):
                # the file there may be gone or changed, too
                held = _digests_now([before]).get(before) == digest
                there = f"cd {shlex.quote(record.folder)} before the command, or " if held else ""
                raise ConfigError(
                    f"{here} differs from {before}, with which {scene} was rendered; expected a"
                    f" file of the same content; type for example {there}"
                    f"{wanted.command_of_another}"
                )
            raise ConfigError(
                f"{here} has changed since {scene} was rendered; expected the earlier file, or"
                f" another name for the dataset; type for example {wanted.command_of_another}"
            )


def changed_files(records: Iterable[SceneRecord]) -> dict[int, list[str]]:
    """Return {number of a scene: its files whose content has changed since it was rendered}. Scenes
    without such a file are left out.

    Files of `unchecked_files` do not count, because stored radiance does not need them.

    Parameters
    ----------
    records : records of scenes.
    """
    # a store does not tell: it may have been made with other files that describe the same scene
    digests = {record.number: record.files for record in records}
    now = _digests_now(path for of in digests.values() for path in of if os.path.isabs(path))
    changed = {
        number: [path for path, digest in of.items() if now.get(path, digest) != digest]
        for number, of in digests.items()
    }
    return {number: paths for number, paths in changed.items() if paths}


def unchecked_files(records: Iterable[SceneRecord]) -> dict[str, str]:
    """Return {file of a scene that cannot be compared: the reason}: files that are gone, and
    relative paths whose folder was not recorded.

    Parameters
    ----------
    records : records of scenes.
    """
    paths = sorted({path for record in records for path in record.files})
    gone = {path: "which is gone" for path in paths if not os.path.isfile(path)}
    relative = [path for path in paths if not os.path.isabs(path)]
    return gone | dict.fromkeys(relative, "whose folder its record does not name")


def _digests_now(paths: Iterable[str]) -> dict[str, str]:
    return input_digests(_Files(tuple(sorted(set(paths)))))


@dataclass(frozen=True)
class _Files:
    """Files whose digests `input_digests` returns."""

    paths: tuple[str, ...]

    def input_files(self) -> tuple[str, ...]:
        """Return the files."""
        return self.paths


def is_tried(name: str, recipe_text: str, overrides: tuple[str, ...]) -> bool:
    """Return whether a dataset is stored with these values, which means that they were tried.

    Parameters
    ----------
    name : name of the dataset.
    recipe_text : recipe as YAML.
    overrides : overrides of all scenes, after those of the recipe.

    Raises
    ------
    CatalogError : the stored definition is damaged.
    """
    folder = folder_of(name)
    if not (folder / DEFINITION).exists():
        return False
    stored = read_definition(folder)
    return stored.recipe_text == recipe_text and stored.overrides == overrides


def _drawn_from(definition: Definition) -> tuple[int, str, tuple[str, ...]]:
    return definition.seed, definition.recipe_text, definition.overrides


def _with_count(definition: Definition, count: int) -> Definition:
    return Definition(**asdict(definition) | {"count": count, "overrides": definition.overrides})


def read_dataset(name: str) -> Definition:
    """Return the definition of a dataset by its name.

    Raises
    ------
    CatalogError : there is no dataset of this name, or its definition is damaged.
    """
    folder = folder_of(name)
    if not (folder / DEFINITION).exists():
        known = sorted(path.parent.name for path in folder.parent.glob(f"*/{DEFINITION}"))
        raise CatalogError(
            f"there is no dataset {name!r} in {folder.parent}{did_you_mean(name, known)}; type for"
            f" example isethdr dataset generate {name} count=6"
        )
    return read_definition(folder)


def read_definition(folder: Path) -> Definition:
    """Return the definition in a folder.

    Raises
    ------
    CatalogError : the definition is damaged.
    """
    try:
        content = json.loads((folder / DEFINITION).read_text(encoding="utf-8"))
        return Definition(**content | {"overrides": tuple(content["overrides"])})
    except (ValueError, KeyError, TypeError) as err:
        raise CatalogError(
            f"{folder / DEFINITION} is damaged ({err}); expected the file that `isethdr dataset"
            " generate` writes; remove the folder and generate again: stored scenes are reused"
        ) from None


def write_scene(folder: Path, record: SceneRecord) -> None:
    """Write the record of a scene into the folder of its dataset.

    Raises
    ------
    CatalogError : the record cannot be written, for example because the disk is full.
    """
    _write(folder / SCENES / f"{record.number:05d}.json", json.dumps(asdict(record)))


def _write(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, text)
    except OSError as err:
        raise CatalogError(
            f"cannot write {path}: {err.strerror or err}; stored scenes are complete; make room and"
            " type the same command again"
        ) from err


def read_scenes(folder: Path, without: Collection[int] = ()) -> dict[int, SceneRecord]:
    """Return the records in a dataset's folder, by number. A damaged record counts as missing.

    Parameters
    ----------
    folder : folder of the dataset.
    without : numbers of records that are not read.
    """
    records = {}
    for path in sorted((folder / SCENES).glob("[0-9]*.json")):
        try:
            if int(path.stem) in without:
                continue
            content = json.loads(path.read_text(encoding="utf-8"))
            lists = {key: tuple(content[key]) for key in ("overrides", "stores", "objects")}
            record = SceneRecord(**content | lists)
        except (ValueError, KeyError, TypeError):
            continue
        records[record.number] = record
    return records
