"""The study `isethdr study detection`: which objects of a dataset can be detected at all."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeVar

import numpy as np

from isethdr_core.cli.terminal import number_of, print_path
from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.storage.object_home.calls import kept_here

from ..dataset.generate import Generated, generated
from ..dataset.recipe import node_of
from ..dataset.record import SceneRecord, read_dataset
from .exposing import even
from .frame import CLASSES, SceneObjects, Thing, kind_of, noisier
from .imaging import (
    CameraName,
    Prepared,
    View,
    camera_names,
    overrides_of,
    prepared,
    view,
)
from .lit_scene import built_for, check_same_radiance
from .observer.clutter import Search, searches
from .observer.observing import (
    Answer,
    Beside,
    Check,
    Examined,
    Observer,
    examined,
    observed,
    places_of,
    row,
    rows_read,
)
from .questions import Question, question_of
from .results.curves import with_curves
from .results.files import write_files
from .results.shares import Found, Needed, roads_needed
from .results.study_results import Results
from .results.summary import print_limitations, summary
from .threads import at_once, threads_of

OneScene = TypeVar("OneScene", bound=SceneObjects)
RENDERED = ", rendered without"  # these two texts follow the name of a camera
NOISIER = ", twice the render noise"
# keys of the config that choose noise realisations; the study needs none
OF_REALISATIONS = ("seed", "draws", "device")
# overrides of scenes that are tunnels, which daylight does not reach
TUNNELS = {"scene=tunnel", "scene.road=tunnel"}
# lowest level over the lowest factor on the light; objects differ in their own illuminance
MOST_FACTOR = 10.0


def detection(
    *overrides: str,
    dataset: str = "",
    cameras: str = "",
    question: str = "",
    false_alarms: float = 0.1,
    order: int = 3,
    windows: int = 48,
) -> list[dict]:
    """Compare the shares of objects that a model observer finds in the captures of each camera.

    Parameters
    ----------
    overrides : overrides of all scenes: lens, lighting, fields of cameras.
    dataset : name of a generated dataset.
    cameras : names separated by commas, of cameras of the config or presets of sensors;
        `name:LPLG+SPLG` uses some of a camera's captures. Each is compared with the first one.
    question : captures, filters, dark, noise or removal: presets of cameras, overrides and light
        levels.
    false_alarms : false alarms in a picture.
    order : largest total order of the Hermite-Gauss channels.
    windows : number of windows without objects, of each scene and size of object.

    Raises
    ------
    ConfigError : no dataset is named, it has no objects, a camera or the question is unknown, a
        number is out of its range, or an override asks for other radiance or a noise realisation.
    CatalogError : there is no such dataset.
    """
    asked = question_of(question)
    how = checked(false_alarms, order, windows)
    if not dataset:
        raise ConfigError(
            "dataset is empty; expected the name of a generated dataset; type for example"
            " isethdr study detection dataset=streets"
        )
    check_same_radiance(overrides)
    check_read(overrides)
    made = generated(read_dataset(dataset))
    names = camera_names(cameras or asked.cameras)
    settings = (
        *overrides_of([n for n in names if not _added(n, asked)]),
        *asked.overrides,
        *overrides,
    )
    records = chosen(made, asked)
    results = replace(
        studied(records, names, settings, asked, how), dataset=dataset, question=question
    )
    for title, path in write_files(results):
        print_path(kept_here(title, path), path)
    print_limitations(results)
    return summary(results)


def check_read(overrides: Sequence[str]) -> None:
    """Check that the study reads each key that is overridden.

    Parameters
    ----------
    overrides : overrides of all scenes, as typed.

    Raises
    ------
    ConfigError : an override sets a key of single noise realisations.
    """
    for text in overrides:
        if node_of(text) in OF_REALISATIONS:
            raise ConfigError(
                f"{text} has no effect: the observer uses the statistics of the noise, not a"
                " realisation; expected overrides of the lighting, lens, cameras or isp; type for"
                " example lens.f_number=4"
            )


def _added(name: CameraName, asked: Question) -> bool:
    """Return whether the question's own overrides add a camera."""
    return any(text.startswith(f"+sensor@cameras.{name.sensor}=") for text in asked.overrides)


def checked(false_alarms: float, order: int, windows: int) -> Observer:
    """Return the settings of the observer.

    Parameters
    ----------
    false_alarms : false alarms in a picture, above 0, at most 100.
    order : highest order of the channels, 0 to 8.
    windows : windows without objects of each scene and size, 2 to 10000.

    Raises
    ------
    ConfigError : a number is out of its range.
    """
    if not (0 < false_alarms <= 100 and 0 <= order <= 8 and 2 <= windows <= 10_000):
        raise ConfigError(
            f"false_alarms is {false_alarms:g}, order {order} and windows {windows}; expected false"
            " alarms a picture above 0, at most 100, an order from 0 to 8 and 2 to 10000 windows;"
            " type for example false_alarms=0.1 order=3 windows=48"
        )
    return Observer(false_alarms, order, windows)


def chosen(made: Generated, asked: Question) -> list[SceneRecord]:
    """Return the scenes that a question is about.

    Parameters
    ----------
    made : the dataset.
    asked : question of the study.

    Raises
    ------
    ConfigError : the dataset has no scene yet, or no object of the classes.
    """
    name = made.definition.name
    if not made.made:
        raise ConfigError(
            f"the dataset {name!r} has no scene yet; expected at least one; type for example"
            f" isethdr dataset generate {name}"
        )
    records = [
        record
        for record in made.made
        if not (asked.dipped and "scene.headlamp_beam=driving" in record.overrides)
        and not (asked.open_sky and TUNNELS & set(record.overrides))
    ]
    kinds = asked.kinds or tuple(CLASSES)
    if not any(kind_of(entry) in kinds for record in records for entry in record.objects):
        raise ConfigError(
            f"the dataset {name!r} has no {', '.join(kinds)} in {len(records)} scenes; expected at"
            " least one object; type for example isethdr dataset generate streets recipe=streets"
        )
    return records


def studied(
    records: Sequence[SceneRecord],
    names: Sequence[CameraName],
    settings: Sequence[str],
    asked: Question,
    how: Observer,
) -> Results:
    """Return the results of the observer for the scenes of a dataset.

    Parameters
    ----------
    records : records of the scenes; their radiance is stored.
    names : cameras, as typed.
    settings : overrides of all scenes.
    asked : question of the study.
    how : settings of the observer.
    """
    transfer = list(dict.fromkeys(name.sensor for name in names)) if asked.transfer else []
    ready, failed = all_prepared(records, settings, transfer)
    threads = threads_of(ready[0].built) if ready else 1
    bare: list[Prepared] = []
    if asked.bare:
        bare, not_bare = all_prepared(records, settings, [], bare=True)
        failed += [(number, f"rendered without people: {why}") for number, why in not_bare]
    rows: list[Found] = []
    checks: dict[str, Check] = {}
    places: dict[str, float] = {}
    for name in names:
        # a function of its own, so that the pictures of one camera are freed before the next one
        scenes = Scenes(ready, bare, threads)
        found, of_camera, places = _through(name, scenes, asked, how, places)
        rows += found
        for text, check in of_camera.items():
            checks[text] = checks.get(text, Check()) + check
        known = sum(math.isfinite(row.d) for row in found if row.camera == name.text)
        print(f"{name.text}: {number_of(known, 'row')}")
    results = Results(
        dataset="",
        question="",
        asked=asked,
        how=how,
        cameras=tuple(checks),
        overrides=tuple(settings),
        rows=tuple(rows),
        checks=checks,
        failed=tuple(failed),
    )
    if asked.levels:
        return with_curves(results)
    return replace(results, needed=tuple(_needed(rows)))


class Scenes(NamedTuple):
    """The scenes of a study, imaged by the lens."""

    ready: Sequence[Prepared]
    bare: Sequence[Prepared]  # the same views rendered without objects; empty if not asked for
    threads: int  # number of threads that may call sensors


def _through(
    name: CameraName,
    scenes: Scenes,
    asked: Question,
    how: Observer,
    places: dict[str, float],
) -> tuple[list[Found], dict[str, Check], dict[str, float]]:
    """Return the rows of all scenes through one camera, its checks, and the number of places of
    each class in a picture. It is that of the first camera that shows the class, so that cameras
    have the same thresholds.
    """
    views = at_once(
        lambda one: view(one, name, even(one.light) if asked.grey_field else None),
        scenes.ready,
        scenes.threads,
    )
    light = {one.record.number: one.light for one in scenes.ready}
    bare = {one.record.number: view(one, name, light.get(one.record.number)) for one in scenes.bare}
    outlines = [limited(one.scene_objects(), asked) for one in views]
    places = places_of(outlines) | places
    read = searches(outlines, how.order, how.windows)
    suffixes = ["", *([RENDERED] if bare else []), *([NOISIER] if asked.noisier else [])]
    rows: list[Found] = []
    checks: dict[str, Check] = {}
    for level in levels_of(asked):
        # each frame is freed once its windows are read
        forms = at_once(
            lambda one, level=level: _forms(one, bare, asked, level, read), views, scenes.threads
        )
        for suffix in suffixes:
            text = name.text + suffix
            row_of = RowOf(text, level, transfer_of(views, name))
            known = [one[suffix] for one in forms if suffix in one]
            found, check = observed(known, how, row_of, places)
            rows += found
            checks[text] = checks.get(text, Check()) + check
    return rows, checks, places


def _forms(
    one: View,
    bare: Mapping[int, View],
    asked: Question,
    level: float,
    read: Mapping[str, Search],
) -> dict[str, Examined]:
    """Return the windows of a scene in the forms that a question compares, by the text that follows
    the name of the camera.

    Parameters
    ----------
    one : scene through a camera.
    bare : {scene: the same view rendered without objects}; empty if not asked for.
    asked : question of the study.
    level : level of light.
    read : {kind of light: windows that are read}.
    """
    factor = factor_of(one, asked, level)
    search = read[one.prepared.condition]
    rows = rows_read(limited(one.scene_objects(), asked), search)
    frame = limited(one.frame(factor, rows), asked)
    forms = {"": examined(frame, search)}
    if frame.number in bare:  # else the view without objects failed
        without = bare[frame.number].frame(factor, rows)
        forms[RENDERED] = examined(frame, search, without)
    if asked.noisier:
        forms[NOISIER] = examined(noisier(frame), search)
    return forms


def all_prepared(
    records: Sequence[SceneRecord],
    settings: Sequence[str],
    transfer: Sequence[str],
    bare: bool = False,
) -> tuple[list[Prepared], list[tuple[int, str]]]:
    """Return the scenes imaged by the lens, and [(number, reason)] of the scenes that failed.

    Parameters
    ----------
    records : scenes of the dataset.
    settings : overrides of all scenes.
    transfer : names of the cameras for which contrast transfer accuracy is computed too.
    bare : whether the views are rendered without people, riders and animals.
    """
    done = itertools.count(1)

    def one(record: SceneRecord) -> Prepared | tuple[int, str]:
        made: Prepared | tuple[int, str]
        try:
            made = prepared(record, settings, transfer, bare)
        except (CatalogError, ConfigError):
            raise
        except Exception as err:  # any component may fail on one scene; the other scenes go on
            made = record.number, f"{type(err).__name__}: {err}".splitlines()[0]
        print(f"scene {record.number + 1}, {next(done)} of {len(records)}", flush=True)
        return made

    threads = threads_of(built_for(records[0], settings)[1], rendering=bare) if records else 1
    every = at_once(one, records, threads)
    ready = [made for made in every if isinstance(made, Prepared)]
    return ready, [made for made in every if not isinstance(made, Prepared)]


@dataclass(frozen=True)
class RowOf:
    """A function that makes the rows of one camera at one level of light."""

    camera: str
    level: float
    transfer: Mapping[int, Mapping[str, float]]  # {scene: {object: score}}

    def __call__(self, scene: SceneObjects, thing: Thing, answer: Answer) -> Found:
        """Return the row of an object.

        Parameters
        ----------
        scene : scene through a camera.
        thing : object in the scene.
        answer : detectability and decision of the observer.
        """
        transfer = self.transfer.get(scene.number, {}).get(thing.name, math.nan)
        beside = Beside(self.camera, self.level, transfer)
        return row(scene, thing, answer, beside)


def transfer_of(views: Sequence[View], name: CameraName) -> dict[int, Mapping[str, float]]:
    """Return the contrast transfer accuracy of the objects of each scene. It is empty for a camera
    with only some of its captures.

    Parameters
    ----------
    views : scenes through the camera.
    name : the camera, as typed.
    """
    if name.captures:
        return {}
    return {one.prepared.record.number: one.prepared.transfer.get(name.sensor, {}) for one in views}


def levels_of(asked: Question) -> tuple[float, ...]:
    """Return the levels at which frames are made: factors on the light, or lux on the sensor."""
    if asked.unit == "object_lux":
        least = asked.levels[0] / MOST_FACTOR
        return tuple(np.geomspace(least, asked.levels[-1], len(asked.levels) + 1).tolist())
    return asked.levels or (1.0,)


def factor_of(one: View, asked: Question, level: float) -> float:
    """Return the factor on the light of a scene.

    Parameters
    ----------
    one : scene through a camera.
    asked : question of the study, with the unit of its levels.
    level : level of light: lux on the sensor, or a factor.
    """
    return level / one.prepared.mean_lux if asked.unit == "sensor_lux" else level


def limited(scene: OneScene, asked: Question) -> OneScene:
    """Return a scene with the objects that a question is about."""
    low, high = asked.distances_m
    things = tuple(
        thing
        for thing in scene.things
        if low <= thing.distance_m <= high and (not asked.kinds or thing.kind in asked.kinds)
    )
    return replace(scene, things=things)


def _needed(rows: Sequence[Found]) -> list[Needed]:
    persons = [one for one in rows if one.kind == "person"]
    return roads_needed(persons) if persons else []
