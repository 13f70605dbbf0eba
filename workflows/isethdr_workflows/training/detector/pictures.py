"""Labelled pictures for a detector: runs of cameras over a dataset, with several lightings and
realisations of the noise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image

from isethdr_core.config.composition import compose
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.runs.run import Result, run

from ...dataset.generate import Generated, generated
from ...dataset.record import SceneRecord, read_dataset
from ...dataset.splits import splits
from ...dataset.study.cameras import settings_of
from ...detectors.classes import CLASSES
from ...detectors.objects import TruthObject, truth_objects
from ...detectors.picture_input import View, displayed
from ...detectors.study import chosen_cameras, objects_of
from .settings import OF_RECIPE, Settings

KEPT_METRIC = "contrast"  # the metric that makes a run keep its map of objects
TRAINING = "train"  # names of the two parts of a dataset that are used
HELD_OUT = "validation"
LEAST_HEIGHT_PX = 3.0  # least height, in the shrunk picture, of an object that should be found


@dataclass(frozen=True, eq=False)
class LabelledPicture:
    """A displayed picture and its objects.

    Parameters
    ----------
    rgb : (y, x, 3) picture, uint8.
    boxes : (n, 4) left, top, right, bottom, px.
    classes : (n,) index of each class in `CLASSES`.
    asked : (n,) whether the detector should find the object; other objects do not count.
    road : name of the scene's road.
    """

    rgb: np.ndarray
    boxes: np.ndarray
    classes: np.ndarray
    asked: np.ndarray
    road: str = ""


@dataclass(frozen=True, eq=False)
class Data:
    """Pictures for training, and held-out pictures of other roads."""

    training: Sequence[LabelledPicture]
    held_out: Sequence[LabelledPicture]
    about: str = ""

    @property
    def roads(self) -> list[str]:
        """The roads that are used for training or decide when to stop."""
        return list(dict.fromkeys(p.road for p in (*self.training, *self.held_out)))


def data_of(settings: Settings, overrides: Sequence[str], tell: Callable[[str], None]) -> Data:
    """Return the pictures of the parts `train` and `validation` of a dataset.

    Each picture comes from a run, which is stored and read again by an interrupted training.

    Parameters
    ----------
    settings : settings of the training: dataset, cameras, lightings, realisations of the noise.
    overrides : overrides of all runs.
    tell : called with one line of text for each scene.

    Raises
    ------
    ConfigError : an override is wrong, a part has no scene, no scene of it can be imaged, or the
        training scenes show no object.
    CatalogError : there is no such dataset, or runs cannot be written.
    """
    dataset = generated(read_dataset(settings.dataset))
    cameras, own = chosen_cameras(dataset, overrides, settings.cameras)
    parts = records_of(dataset)
    pictures: dict[str, list[LabelledPicture]] = {}
    for part, records in parts.items():
        pictures[part] = []
        for place, record in enumerate(records, 1):
            tell(f"{part}: scene {record.number + 1}, {place} of {len(records)}")
            for result in runs_of(record, settings, own, tell):
                pictures[part] += [
                    labelled_picture(result, camera, settings.input_px, record.road)
                    for camera in cameras
                ]
        if not pictures[part]:
            raise ConfigError(
                f"no scene of the part {part!r} could be imaged, as printed above; expected"
                f" lightings that fit the scenes, not lightings={settings.lightings}; type for"
                f" example lightings={OF_RECIPE}"
            )
    about = (
        f"dataset {settings.dataset}, seed {dataset.definition.seed}, recipe"
        f" {dataset.definition.recipe_name}; {len(parts[TRAINING])} scenes to learn from,"
        f" {len(parts[HELD_OUT])} held out; cameras {', '.join(cameras)}; lightings"
        f" {settings.lightings}; {settings.realisations} realisations of the noise"
    )
    return Data(pictures[TRAINING], pictures[HELD_OUT], about)


def records_of(dataset: Generated) -> dict[str, list[SceneRecord]]:
    """Return the records of the scenes for training and of the held-out ones, by part.

    Raises
    ------
    ConfigError : one of the parts has no scene yet, or the training scenes show no object.
    """
    definition = dataset.definition
    parts = splits(definition.scenes(), definition.recipe.splits)
    found = {}
    for part in (TRAINING, HELD_OUT):
        if part not in parts:
            raise ConfigError(
                f"the recipe of {definition.name!r} has the parts {', '.join(parts)}; expected"
                f" {TRAINING} and {HELD_OUT}; see splits in docs/how-to/datasets.md"
            )
        found[part] = [record for record in dataset.made if record.number in parts[part]]
        if not found[part]:
            raise ConfigError(
                f"the part {part!r} of the dataset {definition.name!r} has no scene yet; expected"
                " several roads; type for example isethdr dataset generate"
                f" {definition.name} count={2 * definition.count}"
            )
    if not any(objects_of(record) for record in found[TRAINING]):
        raise ConfigError(
            f"the {len(found[TRAINING])} scenes show no {', '.join(CLASSES)}; expected a dataset"
            " with objects; type for example isethdr dataset generate streets recipe=streets"
        )
    return found


def runs_of(
    record: SceneRecord,
    settings: Settings,
    overrides: Sequence[str],
    tell: Callable[[str], None],
) -> list[Result]:
    """Return the runs of a scene, for each lighting and each realisation of the noise.

    A lighting that fails, for example because the scene lacks a light group, is left out.

    Parameters
    ----------
    record : scene of the dataset.
    settings : lightings and number of noise realisations.
    overrides : overrides of the config, as typed.
    tell : called with one line of text for each lighting that is left out.
    """
    results = []
    for lighting in settings.lightings.split(","):
        relit = [] if lighting == OF_RECIPE else [f"lighting={lighting}"]
        for number in range(settings.realisations):
            typed = [*settings_of(record, overrides), *relit, "draws=1", f"seed={number}"]
            config = compose(typed)
            leave_out = [f"~metric.{name}" for name in config.metric if name != KEPT_METRIC]
            try:
                results.append(run(compose([*typed, *leave_out])))
            except CatalogError:
                raise
            except Exception as err:  # any component may fail on one scene; the other scenes go on
                tell(f"  {lighting} is left out: {type(err).__name__}: {err}".splitlines()[0])
                break
    return results


def labelled_picture(result: Result, camera: str, width: int, road: str) -> LabelledPicture:
    """Return the picture of a camera as displayed by `isethdr export --to png`, shrunk to a width.

    Parameters
    ----------
    result : run of the scene.
    camera : name of the camera.
    width : width of the picture, pixels.
    road : name of the scene's road.
    """
    truths = [result.open(f"truth/{name}") for name in result.cameras]
    view = View.of(max(truths, key=lambda truth: truth.sizes["y"] * truth.sizes["x"]))
    rgb = displayed(result.open(f"picture/{camera}").load(), view, "png")
    truth = result.open(f"truth/{camera}").load()
    objects = truth_objects(truth, result.attributes["weights"])
    return shrunk(np.rint(255 * rgb).astype(np.uint8), objects, width, road)


def shrunk(
    rgb: np.ndarray, objects: Sequence[TruthObject], width: int, road: str = ""
) -> LabelledPicture:
    """Return a labelled picture that is shrunk to a width.

    Parameters
    ----------
    rgb : (y, x, 3) picture, uint8.
    objects : objects in the picture.
    width : width of the result, pixels; narrower pictures are not changed.
    road : name of the scene's road.
    """
    scale = min(1.0, width / rgb.shape[1])
    if scale < 1:
        size = (width, max(1, round(scale * rgb.shape[0])))
        rgb = np.asarray(Image.fromarray(rgb).resize(size, Image.Resampling.BILINEAR))
    boxes = scale * np.array([one.box for one in objects], float).reshape(-1, 4)
    asked = np.array([one.counted for one in objects], bool)
    return LabelledPicture(
        rgb,
        boxes,
        np.array([CLASSES.index(one.class_name) for one in objects], int),
        asked & (boxes[:, 3] - boxes[:, 1] >= LEAST_HEIGHT_PX),
        road,
    )
