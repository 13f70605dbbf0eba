"""The observer at work: every object of the frames of one camera at one level of light."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from ..frame import Frame, SceneObjects, Thing
from ..results.shares import Found
from ..threads import at_once
from .channels import count
from .clutter import (
    Clutter,
    Moments,
    Search,
    Size,
    covariance,
    moments_of,
    outputs,
    size_of,
    window_rows,
)
from .counting import Counted, Task, counted, expected_share
from .difference import Seen, outline_of, seen
from .hotelling import Detectability, detectability, found, threshold

NEAREST_M = 8.0  # nearest and farthest distance at which the observer looks for objects
FARTHEST_M = 90.0
DISTANCES = 7  # number of distances at which it looks
ROWS = 3  # number of places above each other at one distance
CHECKED = 0.05  # false alarms per place at which simulated decisions are counted
DRAWS = 20  # number of noise realisations for each object in simulated decisions
NOTHING = Detectability(math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class Observer:
    """Settings of the observer.

    Parameters
    ----------
    false_alarms : false alarms in a picture.
    order : highest order of the channels.
    windows : number of windows without objects, of each scene and size.
    """

    false_alarms: float = 0.1
    order: int = 3
    windows: int = 48


@dataclass(frozen=True)
class Check:
    """Simulated decisions that were counted, and the hits that the observer states."""

    hits: int = 0
    trials: int = 0
    expected: float = 0.0  # number of hits that the observer states
    objects: int = 0
    false_alarms: int = 0
    places: int = 0

    def __add__(self, other: Check) -> Check:
        """Return the sum of both."""
        return Check(
            self.hits + other.hits,
            self.trials + other.trials,
            self.expected + other.expected,
            self.objects + other.objects,
            self.false_alarms + other.false_alarms,
            self.places + other.places,
        )


def places_of(scenes: Sequence[SceneObjects]) -> dict[str, float]:
    """Return the number of places in a picture where the observer looks for each class.

    It looks for an object of the median size at 7 distances from 8 to 90 m, in steps of half of
    its width, and in three rows.
    """
    sizes: dict[str, list[float]] = {}
    for scene in scenes:
        columns = scene.layout.size(0)[1]
        for thing in scene.things:
            sizes.setdefault(thing.kind, []).append(thing.box[3] * thing.distance_m / columns)
    distances = np.geomspace(NEAREST_M, FARTHEST_M, DISTANCES)
    return {
        kind: float(np.sum(ROWS * 2 * distances / np.median(widths)))
        for kind, widths in sizes.items()
    }


@dataclass(eq=False, kw_only=True)
class Examined(SceneObjects):
    """The windows that the observer read in a frame. The frame itself is not needed any more.

    Parameters
    ----------
    search : windows that were read.
    colours : number of colours.
    moments : sums over the windows without objects of each size.
    empty : channel outputs (window, channel) of these windows, for the sizes of the own objects.
    windows : the window of each object; None if it could not be read.
    """

    search: Search
    colours: int
    moments: dict[Size, Moments]
    empty: dict[Size, np.ndarray]
    windows: tuple[Seen | None, ...]


def examined(frame: Frame, search: Search, bare: Frame | None = None) -> Examined:
    """Return the windows that the observer reads in a frame.

    Parameters
    ----------
    frame : scene through a camera at one level of light.
    search : windows that are read in all scenes of this kind of light.
    bare : the same view rendered without objects; None: objects are filled from the ring.
    """
    own = {size_of(thing.box) for thing in frame.things}
    moments = {}
    empty = {}
    for level in sorted({size.level for size in search.sizes}):
        picture = frame.joined(level).astype(np.float64, copy=False)
        for size in search.sizes:
            if size.level == level:
                read = outputs(frame, size, search, picture)
                moments[size] = moments_of(read)
                if size in own:
                    empty[size] = read
    return Examined(
        number=frame.number,
        road=frame.road,
        condition=frame.condition,
        layout=frame.layout,
        things=frame.things,
        search=search,
        colours=len(frame.colours),
        moments=moments,
        empty=empty,
        windows=tuple(_window(frame, thing, search, bare) for thing in frame.things),
    )


def _window(frame: Frame, thing: Thing, search: Search, bare: Frame | None) -> Seen | None:
    size = size_of(thing.box)
    shape = search.shape(size)
    if shape.channels.shape[1] > frame.layout.size(size.level)[1]:
        return None
    return seen(frame, thing, size, shape, bare)


def rows_read(scene: SceneObjects, search: Search) -> slice:
    """Return the rows of cells that `examined` reads. Other rows have no influence on the result.

    Both ends are the border, or multiples of the largest joined cells that are read.

    Parameters
    ----------
    scene : scene through a camera.
    search : windows that are read.
    """
    cuts = [(size.level, window_rows(scene, size, search)) for size in search.sizes]
    for thing in scene.things:
        level = size_of(thing.box).level
        cuts.append((level, outline_of(scene.layout, thing, level).part[0]))
    if not cuts:
        return slice(0, 0)
    step = 2 ** max(level for level, _ in cuts)
    start = min(cut.start << level for level, cut in cuts) // step * step
    stop = -(-max(cut.stop << level for level, cut in cuts) // step) * step
    return slice(start, min(stop, scene.layout.size(0)[0]))


def observed(
    scenes: Sequence[Examined],
    how: Observer,
    row_of: Callable[[SceneObjects, Thing, Answer], Found],
    places: Mapping[str, float],
) -> tuple[list[Found], Check]:
    """Return one row for each object of the scenes, and the decisions that were counted.

    Parameters
    ----------
    scenes : windows of one camera at one level of light, all roads.
    how : settings of the observer.
    row_of : function(scene, thing, answer) that returns the row of an object.
    places : number of places of each class in a picture.
    """
    rows = []
    check = Check()

    def answered(clutter: Clutter, scene: Examined) -> tuple[list[Found], Check]:
        mine = []
        counted_here = Check()
        for thing, window in zip(scene.things, scene.windows, strict=True):
            limit = threshold(how.false_alarms, places[thing.kind])
            at = _task(clutter, scene, thing, window)
            if window is None or at is None:
                mine.append(row_of(scene, thing, Answer(NOTHING, limit, math.nan)))
                continue
            task, samples = at
            d = detectability(task.difference, task.clutter, task.noise, samples, window.render)
            decisions = _decided(scene, thing, task, window)
            mine.append(row_of(scene, thing, Answer(d, limit, decisions.told_apart)))
            counted_here += _check_of(decisions, d)
        return mine, counted_here

    for condition in dict.fromkeys(scene.condition for scene in scenes):
        alike = [scene for scene in scenes if scene.condition == condition]
        clutter = Clutter([(scene.road, scene.moments) for scene in alike])
        for mine, counted_here in at_once(partial(answered, clutter), alike):
            rows += mine
            check += counted_here
    return rows, check


def _task(
    clutter: Clutter, scene: Examined, thing: Thing, window: Seen | None
) -> tuple[Task, int] | None:
    """Return the observer's knowledge about an object, and the number of windows behind the
    covariance. Return None if there are too few windows, or if the object's window could not be
    read.
    """
    if window is None:
        return None
    size = size_of(thing.box)
    moments = clutter.others(size, scene.road)
    if moments.count < 2 * scene.colours * count(scene.search.order):
        return None
    task = Task(
        difference=window.difference,
        clutter=covariance(moments),
        mean=_mean(moments),
        noise=scene.search.shape(size).channels.noise(scene.colours),
    )
    return task, moments.count


def _mean(moments: Moments) -> np.ndarray:
    return moments.total / moments.count


def _decided(scene: Examined, thing: Thing, task: Task, window: Seen) -> Counted:
    """Return counted decisions about one object on its own road."""
    empty = scene.empty[size_of(thing.box)]
    shown = np.repeat(window.outputs[None], DRAWS, 0)
    random = np.random.default_rng([scene.number, thing.instance])
    return counted(task, shown, empty, CHECKED, random)


def _check_of(decisions: Counted, d: Detectability) -> Check:
    """Return the decisions about one object, with the hits that its detectability states."""
    return Check(
        decisions.hits,
        decisions.trials,
        float(expected_share(np.array(d.d), CHECKED)) * decisions.trials,
        1,
        decisions.false_alarms,
        decisions.places,
    )


class Answer(NamedTuple):
    """The observer's answer about one object: its detectability, the threshold of the decision, and
    the share of pairs of windows that are told apart.
    """

    d: Detectability
    limit: float
    told_apart: float


class Beside(NamedTuple):
    """Further values of a row: camera, level of light, contrast transfer accuracy."""

    camera: str
    level: float
    transfer: float


def row(scene: SceneObjects, thing: Thing, answer: Answer, beside: Beside) -> Found:
    """Return the row of an object.

    Parameters
    ----------
    scene : scene through a camera.
    thing : object in the scene.
    answer : detectability and decision of the observer.
    beside : further values: camera, level of light and contrast transfer accuracy.
    """
    d = answer.d
    return Found(
        scene=scene.number,
        road=scene.road,
        camera=beside.camera,
        condition=scene.condition,
        level=beside.level,
        instance=thing.instance,
        name=thing.name,
        kind=thing.kind,
        distance_m=thing.distance_m,
        height_px=thing.height_px,
        illuminance_lx=thing.illuminance_lx,
        near_lamp=thing.near_lamp,
        d=d.d,
        noise_only=d.noise_only,
        found=float(found(d.d, answer.limit)),
        found_noise_only=float(found(d.noise_only, answer.limit)),
        transfer=beside.transfer,
        told_apart=answer.told_apart,
    )
