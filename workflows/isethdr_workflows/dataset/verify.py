"""Verify: check each scene of a dataset against its store and its recipe."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from isethdr_core.errors import IsetHdrError
from isethdr_core.storage import store
from isethdr_core.storage.home_folder import home

from .draw import DrawnScene
from .generate import Generated
from .record import SceneRecord, changed_files

LABELS = ("depth", "distance", "instance", "category", "normal")


@dataclass(frozen=True)
class Problem:
    """A problem of one scene."""

    number: int
    what: str


def verify(dataset: Generated) -> list[Problem]:
    """Return the problems of the scenes that were tried. There are none if all scenes are complete
    and have the settings that the recipe draws, and no file that they use has changed since.

    Every file of every store is read and compared with its checksum.
    """
    problems = []
    changed = changed_files(dataset.scenes.values())
    another = dataset.definition.command_of_another
    for scene in dataset.definition.scenes():
        if scene.number in dataset.scenes:
            texts = problems_of(scene, dataset.scenes[scene.number])
            texts += [
                f"{path} has changed since it was rendered; expected the earlier file, or another"
                f" name for the dataset; type for example {another}"
                for path in changed.get(scene.number, ())
            ]
            problems += [Problem(scene.number, what) for what in texts]
    return problems


def problems_of(scene: DrawnScene, record: SceneRecord) -> list[str]:
    """Return the problems of a scene.

    Parameters
    ----------
    scene : scene as the recipe draws it.
    record : record of the scene.
    """
    if record.error:
        return [f"failed: {record.error.splitlines()[0]}"]
    if record.overrides != scene.overrides:
        return ["its record has other overrides than the recipe draws"]
    try:
        return [what for name in record.stores for what in problems_of_store(name)]
    except IsetHdrError as err:
        return [str(err)]


def problems_of_store(name: str) -> list[str]:
    """Read all radiance of a store, and return its problems.

    Parameters
    ----------
    name : name of the store.

    Raises
    ------
    CatalogError : the store is missing or damaged.
    """
    scene = store.open_store(home() / "scenes" / f"{name}.zarr").load()
    problems = [f"{name}: no label {label!r}" for label in LABELS if label not in scene]
    if "radiance" not in scene:
        return [*problems, f"{name}: no radiance"]
    if not np.isfinite(scene.radiance.values).all():
        problems.append(f"{name}: radiance that is not finite")
    if problems:
        return problems
    listed = {entry["instance"] for entry in scene.attrs.get("objects", [])}
    shown = set(np.unique(scene.instance.values).tolist()) - {0}
    if unknown := sorted(shown - listed):
        problems.append(f"{name}: instances {unknown[:10]} are in no table of objects")
    return problems
