"""Image every scene of a dataset through the cameras of the main job, and collect the scores."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from isethdr_core.cli.terminal import duration
from isethdr_core.config.composition import compose
from isethdr_core.errors import CatalogError
from isethdr_core.pipeline.chain import chain
from isethdr_core.runs.run import Result, run
from isethdr_core.storage.home_folder import home

from ..generate import Generated, generated
from ..recipe import node_of
from ..record import SceneRecord, read_dataset
from ..workers import HERE, Workers, share

# Defaults that later overrides may change. A page for each run takes longer than the run's scores.
# One noise realisation per scene is enough: scenes differ by more than their noise, and intervals
# over scenes include both.
OWN = ("report=false", "draws=1")


@dataclass(frozen=True)
class Shot:
    """The scores of all cameras for one scene."""

    number: int  # number of the scene
    road: str
    run: str  # key of the run
    scores: tuple[Mapping[str, Any], ...]  # camera, metric, object, value, unit
    objects: tuple[Mapping[str, Any], ...]  # rows of the scene's table of objects
    weights: Mapping[str, float]  # weights of the light groups


@dataclass(frozen=True)
class Imaged:
    """All scenes of a dataset that could be imaged."""

    shots: tuple[Shot, ...]
    failed: tuple[tuple[int, str], ...]  # number of the scene, reason


def imaged(
    dataset: Generated,
    overrides: Sequence[str],
    tell: Callable[[str], None],
    workers: Workers | None = None,
) -> Imaged:
    """Return the scores of every scene that is made.

    The run of each scene is stored and read by the next call, so an interrupted study continues
    where it stopped. A scene that fails is named, and the other scenes are still imaged. If workers
    share the scenes, a failed scene is tried once more.

    Parameters
    ----------
    dataset : definition and records of the dataset.
    overrides : overrides of all runs, after those of the scene: other cameras, lenses, lightings.
    tell : called with one line of text for each scene that is done.
    workers : who images the scenes; None: this process.

    Raises
    ------
    ConfigError : an override has a mistake, which is found before the first scene is imaged.
    CatalogError : the runs cannot be written; or processes ended before their scenes were imaged.
    """
    made = dataset.made
    for family in {record.family: record for record in made}.values():
        chain(compose(settings_of(family, overrides)))
    if workers is None or workers.engine == HERE:
        return imaged_in_turn(made, overrides, tell)
    make = partial(image_scenes, tuple(overrides))
    share(make, [record.number for record in made], workers, dataset.definition.name, tell)
    return imaged_in_turn(made, overrides, lambda line: None)


def image_scenes(
    overrides: Sequence[str], name: str, numbers: Sequence[int], tell: Callable[[str], None]
) -> None:
    """Image some scenes of a dataset one after the other, as the work of one process.

    Parameters
    ----------
    overrides : overrides of all runs, after those of the scene.
    name : name of the dataset.
    numbers : numbers of scenes that are made.
    tell : called with one line of text for each scene that is done.
    """
    wanted = set(numbers)
    made = generated(read_dataset(name)).made
    imaged_in_turn([record for record in made if record.number in wanted], overrides, tell)


def imaged_in_turn(
    made: Sequence[SceneRecord], overrides: Sequence[str], tell: Callable[[str], None]
) -> Imaged:
    """Return the scores of some scenes, imaged one after the other unless their runs are stored.

    Parameters
    ----------
    made : records of scenes with radiance.
    overrides : overrides of all runs, after those of the scene.
    tell : called with one line of text for each scene that is done.
    """
    shots = []
    failed = []
    started = time.monotonic()
    computed = 0
    for place, record in enumerate(made, 1):
        begun = time.monotonic()
        line = f"scene {record.number + 1}: "
        try:
            result = run(compose(settings_of(record, overrides)))
        except CatalogError:
            raise
        except Exception as err:  # any component may fail on one scene; the other scenes go on
            failed.append((record.number, f"{type(err).__name__}: {err}".splitlines()[0]))
            tell(line + f"failed: {failed[-1][1]}")
            continue
        shots.append(shot_of(record, result))
        computed += result.computed
        line += f"{time.monotonic() - begun:.0f} s" if result.computed else "stored before"
        left = len(made) - place
        if left and computed:
            line += f", about {duration((time.monotonic() - started) / computed * left)} left"
        tell(line)
    return Imaged(tuple(shots), tuple(failed))


def settings_of(record: SceneRecord, overrides: Sequence[str]) -> list[str]:
    """Return the overrides of the run of a scene.

    The run reads the radiance that the scene's record names, which is the same with every version
    of the code. The run has the scene's own settings instead, and renders what is not stored, if
    this radiance is gone, if an override may choose another scene or renderer, or if motion during
    the shot needs radiance of further moments.

    Parameters
    ----------
    record : record of the scene.
    overrides : overrides of all runs, after those of the scene.
    """
    changed = {node_of(text) for text in overrides} & {"scene", "renderer", "experiment"}
    own = {text: node_of(text) for text in record.overrides}
    moving = "motion" in {*own.values(), *map(node_of, overrides)}
    if changed or moving or "experiment" in own.values() or not is_stored(record):
        return [*record.overrides, *OWN, *overrides]
    others = [text for text, node in own.items() if node not in ("scene", "renderer")]
    stored = ("scene=stored", f"scene.store={record.stores[0]}", "~renderer")
    return [*others, *stored, *OWN, *overrides]


def is_stored(record: SceneRecord) -> bool:
    """Return whether the radiance that a record names is in the home folder."""
    folder = home() / "scenes"
    return bool(record.stores) and all((folder / f"{n}.zarr").exists() for n in record.stores)


def shot_of(record: SceneRecord, result: Result) -> Shot:
    """Return the scores of the run of a scene.

    Parameters
    ----------
    record : record of the scene.
    result : result of its run.
    """
    return Shot(
        number=record.number,
        road=record.road,
        run=result.key,
        scores=tuple(result.scores),
        objects=tuple(result.attributes["objects"]),
        weights=result.attributes["weights"],
    )
