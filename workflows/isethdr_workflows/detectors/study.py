"""The study `detector_scores`: scores of detectors on the pictures of cameras, with intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from isethdr_core.cli.terminal import number_of, print_path
from isethdr_core.config.composition import compose
from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.results.stored import open_run
from isethdr_core.storage.atomic_write import write_text

from ..dataset.generate import Generated, generated
from ..dataset.record import SceneRecord, folder_of, read_dataset
from ..dataset.splits import splits
from ..dataset.study.cameras import Shot, imaged, settings_of
from ..dataset.study.files import csv_text
from .bootstrap import FEWEST_ROADS
from .classes import CLASSES, class_of
from .detector import Detector, open_detector
from .matching import Picture
from .objects import LEAST_HEIGHT_PX, truth_objects
from .picture_input import View
from .rows import HEAD, object_rows
from .tables import ALL, Answers, Compared, rows_of

CAMERA = "{camera}"  # stands for the camera's name in the path of a detector
OBJECTS = "detector_objects.csv"
TABLE = "detector_scores.csv"
EXAMPLE = "isethdr study detector_scores detector=detector.yaml dataset=streets"


def detector_scores(
    *overrides: str,
    detector: str = "",
    dataset: str = "",
    cameras: str = "",
    part: str = "",
    false_alarms: float = 0.1,
    tell: float = 0.02,
) -> list[dict[str, Any]]:
    """Score detectors on the pictures of several cameras: precision and recall with intervals.

    Parameters
    ----------
    overrides : overrides of all runs: lenses, lightings, other cameras.
    detector : file with the description of a detector (YAML). Several files, separated by commas,
        are the same detector trained again from other seeds. `{camera}` in a path stands for the
        name of each camera, if each has a detector of its own.
    dataset : name of the dataset.
    cameras : names, separated by commas; empty: all of the config. The others are compared with the
        first one.
    part : part of the dataset: train, validation or test; empty: all scenes. Roads that a detector
        was trained on are always left out.
    false_alarms : false alarms of a class in a picture at which an object counts as found.
    tell : difference of two scores for which the number of roads needed is computed.

    Returns
    -------
    rows with table, row, class, score, camera, value, low, high, objects, roads.

    Raises
    ------
    ConfigError : a detector, a camera, a part or an override is wrong, or no object is left.
    CatalogError : there is no such dataset.
    """
    if not detector or not dataset:
        raise ConfigError(f"a detector and a dataset are needed; type for example {EXAMPLE}")
    if not tell > 0 or not 0 <= false_alarms < math.inf:
        raise ConfigError(
            f"tell={tell:g} false_alarms={false_alarms:g}; expected tell above 0 and false_alarms"
            " from 0 up; type for example tell=0.02 false_alarms=0.1"
        )
    whole = generated(read_dataset(dataset))
    names, own = chosen_cameras(whole, overrides, cameras)
    opened = {camera: open_detectors(detector, camera) for camera in names}
    chosen = scored_scenes(whole, part, [d for of in opened.values() for d in of])
    shots = imaged(chosen, own, print)
    if not shots.shots:
        raise ConfigError(f"all scenes failed, the first one because: {shots.failed[0][1]}")
    answers = {
        camera: [Answers(camera, []) for _ in of_camera] for camera, of_camera in opened.items()
    }
    for shot in shots.shots:
        for camera, pictures in detected(shot, opened).items():
            for answer, picture in zip(answers[camera], pictures, strict=True):
                answer.pictures.append(picture)
    return written(dataset, compared_of(answers, opened, detector), false_alarms, tell)


def chosen_cameras(
    dataset: Generated, overrides: Sequence[str], cameras: str
) -> tuple[list[str], list[str]]:
    """Return the names of the chosen cameras, and the overrides, with ones that remove the other
    cameras.

    Parameters
    ----------
    dataset : generated dataset.
    overrides : overrides of the config, as typed.
    cameras : names of cameras, separated by commas; empty: all of the config.

    Raises
    ------
    ConfigError : the dataset has no scene, or a camera is not in the config.
    """
    if not dataset.made:
        raise ConfigError(
            f"the dataset {dataset.definition.name!r} has no scene yet; type for example isethdr"
            f" dataset generate {dataset.definition.name}"
        )
    config = compose(settings_of(dataset.made[0], overrides))
    table = [config.sensor.name] if config.get("sensor") else list(config.cameras)
    names = [name for name in cameras.split(",") if name] or table
    for name in names:
        if name not in table:
            raise ConfigError(f"the config has no camera {name!r}{did_you_mean(name, table)}")
    left_out = [f"~sensor@cameras.{name}" for name in table if name not in names]
    return names, [*overrides, *left_out]


def open_detectors(detector: str, camera: str) -> list[Detector]:
    """Return the detectors of a camera.

    Parameters
    ----------
    detector : files of descriptions, as typed.
    camera : name of the camera, which replaces `{camera}`.
    """
    paths = [path.strip() for path in detector.split(",")]
    return [open_detector(Path(path.replace(CAMERA, camera))) for path in paths]


def scored_scenes(dataset: Generated, part: str, detectors: Sequence[Detector]) -> Generated:
    """Return the dataset with the scenes of a part, without roads that a detector was trained on.

    Parameters
    ----------
    dataset : generated dataset.
    part : name of a part, for example `test`; empty: all scenes.
    detectors : detectors of all cameras.

    Raises
    ------
    ConfigError : there is no such part, or no scene or no object is left.
    """
    definition = dataset.definition
    scenes = dict(dataset.scenes)
    parts = splits(definition.scenes(), definition.recipe.splits)
    if part:
        if part not in parts:
            raise ConfigError(f"the dataset has no part {part!r}{did_you_mean(part, parts)}")
        scenes = {k: record for k, record in scenes.items() if k in parts[part]}
    seen = {road for one in detectors for road in one.form.trained_roads}
    left_out = sum(record.road in seen for record in replace(dataset, scenes=scenes).made)
    scenes = {k: record for k, record in scenes.items() if record.road not in seen}
    if left_out:
        print(f"left out: {number_of(left_out, 'scene')} on roads that a detector was trained on")
    chosen = replace(dataset, scenes=scenes)
    if not chosen.made:
        unseen = [record.number for record in dataset.made if record.road not in seen]
        others = [name for name, numbers in parts.items() if not set(numbers).isdisjoint(unseen)]
        more = f"isethdr dataset generate {definition.name} count={2 * definition.count}"
        advice = f"part={others[0]}" if others else more
        raise ConfigError(
            f"no scene of the dataset {definition.name!r} is left to be scored; expected roads that"
            f" no detector was trained on; type for example {advice}"
        )
    if not any(objects_of(record) for record in chosen.made):
        raise ConfigError(
            f"the {len(chosen.made)} scenes show no {', '.join(CLASSES)}; expected a dataset with"
            " objects; type for example isethdr dataset generate streets recipe=streets"
        )
    return chosen


def objects_of(record: SceneRecord) -> list[Any]:
    """Return the objects of a scene that belong to a class."""
    return [row for row in record.objects if class_of(row)]


def detected(shot: Shot, detectors: dict[str, list[Detector]]) -> dict[str, list[Picture]]:
    """Return, for each camera, the objects and the detections of each detector in a stored run.

    Parameters
    ----------
    shot : the run of a scene.
    detectors : {camera: its detectors}.
    """
    run = open_run(shot.run)
    truths = {camera: run.open(f"truth/{camera}").load() for camera in run.cameras}
    view = View.of(max(truths.values(), key=lambda truth: truth.sizes["y"] * truth.sizes["x"]))
    found = {}
    for camera, of_camera in detectors.items():
        objects = truth_objects(truths[camera], shot.weights)
        picture = run.open(f"picture/{camera}").load()
        found[camera] = [
            Picture(shot.number, shot.road, camera, objects, one(picture, view))
            for one in of_camera
        ]
    return found


def compared_of(
    answers: dict[str, list[Answers]], opened: dict[str, list[Detector]], detector: str
) -> Compared:
    """Return the comparison of the answers, with the classes that every detector knows.

    Parameters
    ----------
    answers : {camera: pictures with the answers of each detector}.
    opened : {camera: its detectors}.
    detector : file of the detectors' description, as typed; with `{camera}` in it, each camera has
        its own.
    """
    lacking = {name for of in opened.values() for one in of for name in one.form.lacks}
    classes = [name for name in CLASSES if name not in lacking]
    return Compared(answers, classes, trained_apart=CAMERA in detector)


def written(
    dataset: str, compared: Compared, false_alarms: float, tell: float
) -> list[dict[str, Any]]:
    """Write the tables into the folder of the dataset, and return the rows of the scores.

    Parameters
    ----------
    dataset : name of the dataset.
    compared : answers of all cameras and detectors.
    false_alarms : false alarms per picture at which objects count as found.
    tell : difference of two scores for which the number of roads needed is computed.

    Raises
    ------
    ConfigError : no object in any picture counts.
    """
    rows = rows_of(compared, tell)
    if not rows:
        raise ConfigError(
            f"no picture has an object that counts, of the classes {', '.join(compared.classes)};"
            f" expected objects of at least {LEAST_HEIGHT_PX:g} pixels in height that are not"
            " hidden; type other cameras, or generate more scenes"
        )
    objects = [
        row
        for of_camera in compared.answers.values()
        for number, answer in enumerate(of_camera)
        for row in object_rows(answer, number, false_alarms)
    ]
    for title, name, head, content in (
        ("scores", TABLE, list(rows[0]), rows),
        ("objects", OBJECTS, HEAD, objects),
    ):
        path = folder_of(dataset) / name
        write_text(path, csv_text(head, (row.values() for row in content)))
        print_path(title, path)
    roads = len(compared.road_names)
    if roads < FEWEST_ROADS:
        print(f"no interval from {number_of(roads, 'road')}; expected at least {FEWEST_ROADS}")
    return rows


def of_everything(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the rows that a terminal shows: those of all objects, without groups."""
    return [
        {k: v for k, v in row.items() if k not in ("table", "row")}
        for row in rows
        if row["table"] == ALL
    ]
