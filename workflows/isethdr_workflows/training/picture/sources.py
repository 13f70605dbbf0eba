"""Sources of noise-free pictures for a training, and of held-out pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from isethdr_core.cli.terminal import number_of
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.chain.side_by_side import threads_for
from isethdr_core.store import open_scene

from .bank import bank
from .camera import TrainingCamera
from .leaves import WAVELENGTH_NM, LeavesRecipe, leaves
from .roads import (
    TEST,
    TRAIN,
    VALIDATION,
    VARIANTS,
    Road,
    lit,
    planes_of,
    render_noise,
    roads_of,
    threads_of,
)
from .settings import LEAST_PATCH, PATCH_STEP, Settings
from .sheets import Source

HELD_OUT_PICTURES = 24  # number of held-out pictures of dead leaves
HELD_OUT_SEED = 1000  # added to the seed of the training's dead leaves
VERSION = 3  # version of the pictures of roads
NOISE_OF = 3  # number of roads for which the noise of rendering is measured
NO_ROADS = "rendered roads: no dataset was named"
NO_DIRT = "dirt on the lens: it comes with rendered roads"


class Data(NamedTuple):
    """Pictures of a training, and held-out pictures, which no step uses."""

    training: tuple[Source, ...]
    held_out: tuple[Source, ...]
    stated: dict[str, Any]  # description of the data, for the card
    missing: list[str]  # list of data that are missing, for the card
    roads: list[str]  # names of the stores of all roads


def data_of(settings: Settings, camera: TrainingCamera, overrides: Sequence[str]) -> Data:
    """Return the pictures of a training. Missing pictures are made.

    Parameters
    ----------
    settings : settings of the training.
    camera : camera of the training.
    overrides : overrides of the config, as typed.

    Raises
    ------
    ConfigError : the dataset has too few roads to train on, no held-out road, or pictures that are
        smaller than a patch.
    """
    roads = roads_of(settings.dataset) if settings.dataset else None
    share = settings.roads_share if roads else 0.0
    recipe = LeavesRecipe(settings.pictures, settings.picture_px)
    held = recipe._replace(pictures=HELD_OUT_PICTURES, seed=recipe.seed + HELD_OUT_SEED)
    training = [leaves_source(camera, recipe, 1 - share)]
    held_out = [leaves_source(camera, held, 1.0)]
    stated = {
        "dead_leaves": f"{recipe.pictures} pictures of {recipe.side_px} px, seed {recipe.seed};"
        f" {held.pictures} held out, seed {held.seed}",
    }
    if roads is None:
        return Data(tuple(training), tuple(held_out), stated, [NO_ROADS, NO_DIRT], [])
    training.append(roads_source(roads.of(TRAIN), camera, overrides, share))
    held_out.append(roads_source(roads.of(VALIDATION), camera, overrides, 1.0))
    check_size(training[-1].pictures, settings)
    noisy = roads.of(TRAIN)[:NOISE_OF]
    noise = float(np.median([render_noise(road, overrides) for road in noisy]))
    stated |= {
        "roads": f"dataset {roads.name}: {_counted(roads.of(TRAIN))} to train on,"
        f" {_counted(roads.of(VALIDATION))} held out to stop and to calibrate,"
        f" {_counted(roads.of(TEST))} never used here; {share:.0%} of the sheets",
        "light_of_roads": f"{VARIANTS} variants of each: as drawn through a clean lens, and with"
        " light groups in other proportions through the flares of the config",
        "truth_of_roads": "the light that reaches the sensor. Its noise of rendering is"
        f" {noise:.2g} of the luminance of a tile (median over tiles of {len(noisy)} roads)"
        f"{as_of_sensor(noise)}; unbiased, so that it does not move a squared loss",
    }
    stores = [road.path.stem for part in (TRAIN, VALIDATION) for road in roads.of(part)]
    return Data(tuple(training), tuple(held_out), stated, [], stores)


def as_of_sensor(noise: float) -> str:
    """Return a text about the electrons whose shot noise equals a relative noise; "" if the noise
    is 0, as where more than half of the tiles are black, or not known (NaN).
    """
    return f", that of a sensor at {1 / noise**2:.0f} e" if noise > 0 else ""


def check_size(pictures: Sequence[np.ndarray], settings: Settings) -> None:
    """Check that a patch fits into the pictures of roads.

    Parameters
    ----------
    pictures : pictures (plane, y, x) of one size.
    settings : settings of the training.

    Raises
    ------
    ConfigError : the pictures are smaller than a patch.
    """
    rows, columns = pictures[0].shape[1:]
    side = min(rows, columns)
    if side >= settings.patch_px:
        return
    fits = side // PATCH_STEP * PATCH_STEP
    advice = f"type patch_px={fits}" if fits >= LEAST_PATCH else "render larger scenes"
    raise ConfigError(
        f"the roads of {settings.dataset} have {columns} x {rows} pixels; expected at least"
        f" patch_px={settings.patch_px} along both axes; {advice}"
    )


def roads_source(
    roads: Sequence[Road], camera: TrainingCamera, overrides: Sequence[str], share: float
) -> Source:
    """Return the pictures of roads through the lens of a config and the filters of a camera.

    Parameters
    ----------
    roads : stored scenes.
    camera : camera whose filters the light passes.
    overrides : overrides of the config, as typed.
    share : share of the sheets that show roads.
    """
    wavelength_nm = tuple(map(float, open_scene(roads[0].path).wavelength.values))
    weights = camera.plane_weights(wavelength_nm)
    # the name of a store holds no lighting, and the number of a scene is the seed of its variants
    scenes = [[r.path.stem, list(r.record.overrides), r.record.number] for r in roads]
    recipe = ["roads", VERSION, scenes, sorted(overrides), _rounded(weights), VARIANTS]
    pictures = bank(
        "roads",
        recipe,
        VARIANTS * len(roads),
        lambda number: planes_of(
            lit(roads[number // VARIANTS], camera, overrides, number % VARIANTS), camera
        ),
        threads=threads_of(roads[0], overrides),
    )
    return Source("roads", pictures, wavelength_nm, share)


def _counted(roads: Sequence[Road]) -> str:
    scenes = number_of(len(roads), "scene")
    return f"{scenes} of {number_of(len({road.record.road for road in roads}), 'road')}"


def _rounded(weights: np.ndarray) -> list[list[str]]:
    """Return weights as rounded texts, which do not depend on the last bits of a sum."""
    return [[f"{value:.9e}" for value in row] for row in weights]


def leaves_source(camera: TrainingCamera, recipe: LeavesRecipe, share: float) -> Source:
    """Return the pictures of dead leaves through the filters of a camera.

    Parameters
    ----------
    camera : camera whose filters the light passes.
    recipe : number, size and seed of the pictures.
    share : share of the sheets that show dead leaves.
    """
    weights = camera.plane_weights(WAVELENGTH_NM)
    pictures = bank(
        "leaves",
        [*recipe, WAVELENGTH_NM, _rounded(weights)],
        recipe.pictures,
        lambda number: leaves(camera, recipe, number),
        threads=threads_for(()),
    )
    return Source("dead leaves", pictures, WAVELENGTH_NM, share)
