"""The same view rendered without people, riders and animals. It shows what they hide and shade."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from isethdr_core.config.composition import compose
from isethdr_core.data.scene_description import SceneDescription
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.chain import chain, plan, stage
from isethdr_core.runs.sample_accumulation import rendered_anew
from isethdr_core.storage import store
from isethdr_core.uncertainty.ledger import Ledger

from ..dataset.record import SceneRecord
from .frame import CLASSES
from .threads import COMPOSING

PEOPLE = ("person", *CLASSES["animal"], "bicycle")
FOLDER = "without_people"  # name of the folder of these scenes in the home folder


def without_people(record: SceneRecord) -> Path:
    """Return the path of the stored radiance of a scene without people, riders and animals. It is
    rendered if it is not stored.

    Everything else is the same: the description of the scene is built as for the dataset, and these
    objects are removed from it. The renderer has the settings and the noise limit of the dataset.

    Parameters
    ----------
    record : record of the scene.

    Raises
    ------
    ConfigError : the scene has no description.
    """
    folder = store.home() / FOLDER
    name = store.content_hash([FOLDER, list(record.stores), list(record.overrides)])
    if path := store.find_complete(folder, name):
        return path
    with COMPOSING:
        config = compose(record.overrides)
        whole = replace(chain(config), leave_out=False)
    description = whole.scene()
    if whole.renderer is None or not isinstance(description, SceneDescription):
        raise ConfigError(
            f"scene {record.number + 1} has no description to take objects from; expected a scene"
            " with geometry; type for example isethdr dataset generate streets recipe=streets"
        )
    kept = tuple(one for one in description.objects if one.category not in PEOPLE)
    bare = replace(description, objects=kept, next_frame=None)
    rows = Ledger()
    demand = plan(whole, rows)
    radiance = stage(
        rows,
        "renderer",
        config.renderer.name,
        whole.renderer,
        lambda: rendered_anew(whole.renderer, bare, demand),
    )
    attributes = {"kind": "scene", "without": list(PEOPLE), "of": list(record.stores)}
    return store.write_store(folder, name, {"": radiance}, attributes)
