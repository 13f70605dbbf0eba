"""Sources of noise-free pictures for a training, and those that are held out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from .bank import bank
from .camera import TrainingCamera
from .leaves import WAVELENGTH_NM, LeavesRecipe, leaves
from .settings import Settings
from .sheets import Source

HELD_OUT_PICTURES = 24  # dead leaves
HELD_OUT_SEED = 1000  # beyond those of a training


class Data(NamedTuple):
    """Pictures of a training, and pictures that no step sees."""

    training: tuple[Source, ...]
    held_out: tuple[Source, ...]
    stated: dict[str, Any]  # for the card
    missing: list[str]  # what was not done, for the card


def data_of(settings: Settings, camera: TrainingCamera, overrides: Sequence[str]) -> Data:
    """Return the pictures of a training; they are made where they are missing."""
    recipe = LeavesRecipe(settings.pictures, settings.picture_px)
    training = [leaves_source(camera, recipe, 1.0)]
    held = recipe._replace(pictures=HELD_OUT_PICTURES, seed=recipe.seed + HELD_OUT_SEED)
    held_out = [leaves_source(camera, held, 1.0)]
    stated = {
        "dead_leaves": f"{recipe.pictures} pictures of {recipe.side_px} px, seed {recipe.seed};"
        f" {held.pictures} held out, seed {held.seed}",
    }
    missing = ["rendered roads: no dataset was named", "dirt on the lens: no veil and no scatter"]
    return Data(tuple(training), tuple(held_out), stated, missing)


def leaves_source(camera: TrainingCamera, recipe: LeavesRecipe, share: float) -> Source:
    """Return dead leaves through a camera's filters."""
    weights = camera.plane_weights(WAVELENGTH_NM)
    pictures = bank(
        "leaves",
        [*recipe, WAVELENGTH_NM, [[f"{v:.9e}" for v in row] for row in weights]],
        recipe.pictures,
        lambda number: leaves(camera, recipe, number),
    )
    return Source("dead leaves", pictures, WAVELENGTH_NM, share)
