"""Labelled pictures for a detector: the cameras over a dataset, with several lightings and
realisations of the noise.

Captures and pictures in full size are not stored: writing and reading them would take a third of
the time. The labelled pictures are kept in the cache of intermediate results, where an interrupted
training finds them again.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from PIL import Image

from isethdr_core import generator
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.pipeline.runtime_estimate import pixel_bytes
from isethdr_core.pipeline.shot import developed
from isethdr_core.runs.result_names import named, record
from isethdr_core.truth import labels_on, truth

from ...accuracy.point import free_memory
from ...dataset.generate import Generated, generated
from ...dataset.record import SceneRecord, read_dataset
from ...dataset.splits import splits
from ...detection.lit_scene import LitScene, built_for, check_same_radiance, lit
from ...detection.threads import at_once, threads_of
from ...detectors.classes import CLASSES
from ...detectors.objects import TruthObject, truth_objects
from ...detectors.picture_input import View, displayed
from ...detectors.study import chosen_cameras, objects_of
from .settings import OF_RECIPE, Settings

FORM = 1  # part of the names of kept pictures; it rises when the same inputs give other pictures
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

    def arrays(self) -> list[np.ndarray]:
        """Return everything except the road."""
        return [self.rgb, self.boxes, self.classes, self.asked]


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

    A scene is imaged by the lens once for each lighting. Several scenes are imaged at once, as many
    as plugins and the free memory allow.

    Parameters
    ----------
    settings : settings of the training: dataset, cameras, lightings, realisations of the noise.
    overrides : overrides of all runs.
    tell : called with one line of text for each scene.

    Raises
    ------
    ConfigError : an override is wrong or asks for other radiance, a part has no scene, no scene of
        it can be imaged, or the training scenes show no object.
    CatalogError : there is no such dataset, or its radiance cannot be read.
    """
    check_same_radiance(overrides)
    dataset = generated(read_dataset(settings.dataset))
    cameras, own = chosen_cameras(dataset, overrides, settings.cameras)
    parts = records_of(dataset)
    done = itertools.count(1)
    many = sum(map(len, parts.values()))
    threads = scenes_at_once(parts[TRAINING][0], own)

    def pictures_of(scene: SceneRecord) -> list[LabelledPicture]:
        found = scene_pictures(scene, settings, cameras, own, tell)
        tell(f"scene {scene.number + 1}, {next(done)} of {many}")
        return found

    pictures: dict[str, list[LabelledPicture]] = {}
    for part, records in parts.items():
        of_scenes = at_once(pictures_of, records, threads)
        pictures[part] = list(itertools.chain.from_iterable(of_scenes))
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
    if overrides:
        about += f"; overrides {' '.join(overrides)}"
    return Data(pictures[TRAINING], pictures[HELD_OUT], about)


def scenes_at_once(scene: SceneRecord, overrides: Sequence[str]) -> int:
    """Return how many scenes are imaged at the same time, at least one. The pictures of all cameras
    of each scene must fit into the free memory together.

    Parameters
    ----------
    scene : record of one scene.
    overrides : overrides of the config, as typed.
    """
    built = built_for(scene, overrides)[1]
    each_bytes = max(sum(pixel_bytes(built).values()), 1.0)
    return max(1, min(threads_of(built), int(free_memory() // each_bytes)))


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


def scene_pictures(
    scene: SceneRecord,
    settings: Settings,
    cameras: Sequence[str],
    overrides: Sequence[str],
    tell: Callable[[str], None],
) -> list[LabelledPicture]:
    """Return the pictures of a scene, for each lighting, realisation of the noise, and camera.

    A lighting that fails, for example because the scene lacks a light group, is left out.

    Parameters
    ----------
    scene : record of the scene.
    settings : lightings, number of noise realisations, and width of the pictures.
    cameras : names of the cameras.
    overrides : overrides of the config, as typed.
    tell : called with one line of text for each lighting that is left out.
    """
    pictures = []
    for lighting in settings.lightings.split(","):
        relit = [] if lighting == OF_RECIPE else [f"lighting={lighting}"]
        try:
            seen = lit(scene, [*overrides, *relit])
            for number in range(settings.realisations):
                pictures += camera_pictures(seen, cameras, number, settings.input_px, scene.road)
        except (CatalogError, MemoryError):  # the next try may succeed
            raise
        except Exception as err:  # any component may fail on one scene; the other scenes go on
            tell(f"  {lighting} is left out: {type(err).__name__}: {err}".splitlines()[0])
    return pictures


def camera_pictures(
    seen: LitScene, cameras: Sequence[str], number: int, width: int, road: str
) -> list[LabelledPicture]:
    """Return the picture of each camera as displayed by `isethdr export --to png`, shrunk to a
    width.

    Parameters
    ----------
    seen : the scene under one lighting.
    cameras : names of the cameras.
    number : number of the noise realisation, which is the seed of the shot.
    width : width of the pictures, pixels.
    road : name of the scene's road.
    """
    key = generator(number, seen.config.device, road)
    components = [*(seen.built.cameras[name] for name in cameras), seen.built.isp]
    made_of = [record(component) for component in components]
    noise = [key.seed, key.device, key.scene]
    name = named("labelled pictures", FORM, seen.names.light, made_of, noise, width)

    def drawn() -> list[list[np.ndarray]]:
        shot = seen.shot(key)
        labels = seen.scene[["instance"]]
        pictures = {}
        references = {}
        for camera in cameras:
            captures = seen.built.cameras[camera](shot.light, key)
            picture = pictures[camera] = developed(seen.built.isp, captures)
            on_pixels = labels_on(labels, picture)
            reference = truth(seen.mixed, picture)
            references[camera] = reference.assign(on_pixels.data_vars).assign_attrs(on_pixels.attrs)
        largest = max(references.values(), key=lambda one: one.sizes["y"] * one.sizes["x"])
        view = View.of(largest)
        weights = seen.mixed.attrs["weights"]
        return [
            labelled_picture(pictures[camera], references[camera], view, weights, width).arrays()
            for camera in cameras
        ]

    return [LabelledPicture(*arrays, road) for arrays in seen.reuse.value(name, drawn)]


def labelled_picture(
    picture: xr.Dataset,
    reference: xr.Dataset,
    view: View,
    weights: Mapping[str, float],
    width: int,
) -> LabelledPicture:
    """Return a picture as displayed, shrunk to a width, with its objects.

    Parameters
    ----------
    picture : picture of a camera.
    reference : its reference picture, with the label `instance` and the attribute `objects`.
    view : white and tone curve.
    weights : {light group: weight} of the lighting.
    width : width of the result, pixels.
    """
    rgb = displayed(picture, view, "png")
    return shrunk(np.rint(255 * rgb).astype(np.uint8), truth_objects(reference, weights), width)


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
