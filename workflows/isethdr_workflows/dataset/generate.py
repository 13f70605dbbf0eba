"""Generate: render the missing scenes of a dataset, and record the outcome of each."""

from __future__ import annotations

import math
import os
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from isethdr_core.cli.terminal import duration
from isethdr_core.config.composition import compose
from isethdr_core.errors import CatalogError, ConfigError, IsetHdrError
from isethdr_core.pipeline.chain import chain
from isethdr_core.runs.labels import checked
from isethdr_core.runs.provenance import input_digests, libraries, versions
from isethdr_core.runs.rendering import Rendered, render
from isethdr_core.runs.run import check_writable
from isethdr_core.storage import store

from .draw import SEED, DrawnScene, overrides_to_try
from .recipe import Recipe, read_recipe
from .record import (
    Definition,
    SceneRecord,
    begin,
    folder_of,
    is_tried,
    read_dataset,
    read_scenes,
    write_scene,
)
from .workers import Order, Workers, share

FAILED = "failed"  # folder of tracebacks, in the folder of the dataset
TIMED = ("scene", "renderer")  # stages that count towards the seconds of a scene

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Request:
    """The request for a dataset."""

    name: str
    count: int = 60  # number of scenes
    seed: int = 0
    recipe: str = "roads"  # name of a bundled recipe, or path of a YAML file
    overrides: tuple[str, ...] = ()  # overrides of all scenes, after those of the recipe
    sample: int | None = None  # number of first scenes to make; None: all
    workers: Workers = field(default_factory=Workers)

    def __post_init__(self) -> None:
        if self.count < 1 or self.seed < 0:
            raise ConfigError(
                f"count is {self.count} and seed is {self.seed}; expected a count of 1 or more and"
                " a seed of 0 or more; type for example count=60 seed=0"
            )
        if self.sample is not None and self.sample < 1:
            raise ConfigError(
                f"sample is {self.sample}; expected 1 or more of the first scenes; type for example"
                " sample=6"
            )


@dataclass(frozen=True)
class Generated:
    """A dataset after `generate`."""

    definition: Definition
    scenes: dict[int, SceneRecord]  # records of the scenes that were tried, by number

    @property
    def made(self) -> list[SceneRecord]:
        """The records of the scenes with radiance, sorted by number."""
        return [record for record in self.scenes.values() if record.stores]

    @property
    def failed(self) -> list[SceneRecord]:
        """The records of the scenes that failed, sorted by number."""
        return [record for record in self.scenes.values() if record.error]


def generate(request: Request, tell: Tell = print) -> Generated:
    """Render the missing scenes of a dataset, and return the dataset.

    A scene that fails is recorded with its reason, and the other scenes are still made. The next
    call tries it again. A stored scene is not rendered again.

    Parameters
    ----------
    request : the requested dataset.
    tell : called with one line of text for each scene that is done.

    Raises
    ------
    ConfigError : a mistake in the recipe or an override, found before the first scene is rendered;
        another dataset has this name; or a file that stored scenes use has changed.
    CatalogError : the stores cannot be written, for example because the disk is full.
    """
    definition = begun(request)
    wanted = numbers_of(request)
    done = read_scenes(folder_of(definition.name))
    missing = [number for number in wanted if not _is_stored(done.get(number))]
    if missing:
        make = partial(make_scenes, at_once=request.workers.at_once)
        order = longest_first(definition)
        share(make, missing, request.workers, definition.name, tell, order)
    return generated(definition)


def longest_first(definition: Definition) -> Order:
    """Return a function that chooses the next scene: one of a family of which no scene was begun,
    else one of the family whose scenes took longest. So the last scenes are short, and no process
    waits long for another one.

    Parameters
    ----------
    definition : definition of the dataset.
    """
    families = {scene.number: scene.family for scene in definition.scenes()}
    records: dict[int, SceneRecord] = {}
    begun_families: set[str] = set()

    def chosen(left: Sequence[int]) -> int:
        records.update(read_scenes(folder_of(definition.name), without=records))
        seconds: dict[str, list[float]] = {}
        for record in records.values():
            if record.stores:
                seconds.setdefault(record.family, []).append(record.seconds)
        means = {family: sum(values) / len(values) for family, values in seconds.items()}
        means |= dict.fromkeys(set(families.values()) - means.keys() - begun_families, math.inf)
        number = max(left, key=lambda one: means.get(families[one], 0.0))
        begun_families.add(families[number])
        return number

    return chosen


def begun(request: Request) -> Definition:
    """Try every value of a requested dataset, write its definition, and return it.

    Raises
    ------
    ConfigError, CatalogError : as `generate`.
    """
    name = checked("name", request.name)
    recipe = read_recipe(request.recipe)
    check_seeds(recipe, request.overrides)
    # trying a case lays out a street, which takes half a second; a dataset that is stored with the
    # same recipe and overrides was tried before
    cases = [] if is_tried(name, recipe.text, request.overrides) else overrides_to_try(recipe)
    for family, overrides in cases:
        tried(family, overrides + request.overrides)
    first = chain(compose([*recipe.families[0].overrides, *request.overrides]))
    check_writable(store.home() / "scenes")
    return begin(
        Definition(
            name=name,
            seed=request.seed,
            count=request.count,
            recipe_name=request.recipe,
            recipe_text=recipe.text,
            overrides=request.overrides,
            versions=versions() | libraries(first.scene, first.renderer),
            created=datetime.now(UTC).isoformat(timespec="seconds"),
        )
    )


def check_seeds(recipe: Recipe, overrides: Sequence[str]) -> None:
    """Check that nothing sets the seed of all scenes, because the name of a road is that of its
    seed, and roads decide the parts of a dataset.

    Parameters
    ----------
    recipe : recipe of the dataset.
    overrides : overrides of all scenes, after those of the recipe.

    Raises
    ------
    ConfigError : an override or the recipe sets `scene.seed`.
    """
    of_families = (text for family in recipe.families for text in (*family.overrides, *family.draw))
    for text in (*overrides, *of_families):
        if text.lstrip("+~").partition("=")[0] == SEED:
            raise ConfigError(
                f"{text} sets the seed of every scene; expected {SEED} to be drawn for each scene,"
                " from the seed of the dataset; type for example seed=5"
            )


def tried(family: str, overrides: Sequence[str]) -> None:
    """Compose and build a scene without rendering it.

    Parameters
    ----------
    family : family of the scene, for messages.
    overrides : all overrides of the scene.

    Raises
    ------
    ConfigError : an override has a mistake, or there is nothing to render.
    """
    try:
        built = chain(compose(overrides))
    except IsetHdrError as err:
        raise ConfigError(f"family {family}: {err}") from None
    if built.renderer is None:
        raise ConfigError(
            f"family {family} has no renderer, so there is nothing to render; expected a scene with"
            " geometry; type for example scene=night_drive"
        )


def numbers_of(request: Request) -> range:
    """Return the numbers of the scenes to make now."""
    return range(request.count if request.sample is None else min(request.sample, request.count))


def generated(definition: Definition) -> Generated:
    """Return a dataset with the scenes that were tried so far."""
    records = read_scenes(folder_of(definition.name))
    within = {number: record for number, record in records.items() if number < definition.count}
    return Generated(definition, within)


def make_scenes(name: str, numbers: Sequence[int], tell: Tell = print, at_once: int = 1) -> None:
    """Render some scenes of a dataset one after the other, as the work of one process.

    Parameters
    ----------
    name : name of the dataset; its definition is stored.
    numbers : numbers of the scenes.
    tell : called with one line of text for each scene that is done.
    at_once : number of scenes that this machine makes at the same time.

    Raises
    ------
    CatalogError : the stores cannot be written, so that all later scenes would fail as well.
    """
    definition = read_dataset(name)
    scenes = definition.scenes()
    started = time.monotonic()
    computed = 0
    for place, number in enumerate(numbers):
        record, was_computed = made(scenes[number], folder_of(name))
        if was_computed:
            record = replace(record, at_once=at_once)
        write_scene(folder_of(name), record)
        computed += was_computed
        left = len(numbers) - place - 1
        rate_s = (time.monotonic() - started) / computed if computed else None
        tell(told(record, definition.count, left, rate_s))


def made(scene: DrawnScene, folder: Path) -> tuple[SceneRecord, bool]:
    """Render a scene if it is not stored; return its record, and whether it was rendered.

    Parameters
    ----------
    scene : the scene.
    folder : folder of the dataset, for the traceback of a failure.

    Raises
    ------
    CatalogError : a store cannot be written or is damaged.
    """
    record = SceneRecord(scene.number, scene.family, scene.road, scene.overrides)
    try:
        config = compose(scene.overrides)
        built = chain(config)
        inputs = input_digests(built.scene, built.renderer)
        rendered = render(config, by_noise=True)
    except CatalogError:
        raise
    except Exception as err:  # any component may fail on one scene; the other scenes go on
        write_traceback(folder, scene.number)
        return _with(record, error=f"{type(err).__name__}: {err}"), False
    record = _with(record, inputs=inputs, folder=os.getcwd(), **measured(rendered))
    return record, rendered.computed


def measured(rendered: Rendered) -> dict[str, Any]:
    """Return the properties of stored radiance that a record holds."""
    attributes = rendered.attributes
    rows = [row for a in attributes for row in a["ledger"] if row["stage"].split(" ")[0] in TIMED]
    return {
        "stores": tuple(path.stem for path in rendered.stores),
        "seconds": sum(row["seconds"] for row in rows),
        "cpu_seconds": sum(row.get("cpu_s") or 0.0 for row in rows),
        "stored_bytes": sum(
            file.stat().st_size
            for path in rendered.stores
            for file in path.rglob("*")
            if file.is_file()
        ),
        # the stores of a scene hold different light groups
        "noise": {str(k): float(v) for a in attributes for k, v in a["noise"].items()},
        "objects": tuple(attributes[-1]["objects"]),
    }


def write_traceback(folder: Path, number: int) -> None:
    """Write the traceback of the exception that is being handled."""
    path = folder / FAILED / f"{number:05d}.txt"
    with suppress(OSError):  # a full disk must not hide the error that it caused
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(traceback.format_exc(), encoding="utf-8")


def told(record: SceneRecord, count: int, left: int, rate_s: float | None) -> str:
    """Return one line about a scene that is done.

    Parameters
    ----------
    record : record of the scene.
    count : number of scenes of the dataset.
    left : number of scenes that this process still has to make.
    rate_s : seconds per rendered scene; None before the first one.
    """
    start = f"scene {record.number + 1} of {count}, {record.family}: "
    if record.error:
        return start + f"failed: {record.error.splitlines()[0]}"
    line = start + f"{record.seconds:.0f} s, {record.stored_bytes / 1e6:.1f} MB"
    if left and rate_s is not None:
        line += f", about {duration(left * rate_s)} left"
    return line


def _with(record: SceneRecord, **fields: Any) -> SceneRecord:
    return SceneRecord(record.number, record.family, record.road, record.overrides, **fields)


def _is_stored(record: SceneRecord | None) -> bool:
    """Return whether a scene is recorded and all of its stores are there."""
    return (
        record is not None
        and bool(record.stores)
        and all((store.home() / "scenes" / f"{name}.zarr").is_dir() for name in record.stores)
    )
