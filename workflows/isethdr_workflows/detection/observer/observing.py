"""The observer at work: every object of the frames of one camera at one level of light."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from ..frame import Frame, Thing
from ..tables import Found
from ..threads import at_once
from .channels import count
from .clutter import Clutter, Moments, covariance, size_of
from .counting import Counted, Task, counted, expected_share
from .difference import Seen, seen
from .hotelling import Detectability, detectability, found, threshold

NEAREST_M = 8.0  # distances that an observer looks for objects at
FARTHEST_M = 90.0
DISTANCES = 7
ROWS = 3  # places above each other at one distance
CHECKED = 0.05  # false alarms in a place, where decisions are counted
DRAWS = 20  # of the noise, for each object that is counted
NOTHING = Detectability(math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class Observer:
    """How the observer looks.

    Parameters
    ----------
    false_alarms : false alarms in a picture.
    order : highest order of the channels.
    windows : without objects, of each scene and size.
    """

    false_alarms: float = 0.1
    order: int = 3
    windows: int = 48


@dataclass(frozen=True)
class Check:
    """Decisions that were counted, beside what the observer states."""

    hits: int = 0
    trials: int = 0
    expected: float = 0.0  # hits
    objects: int = 0
    false_alarms: int = 0
    places: int = 0

    def __add__(self, other: Check) -> Check:
        """Return both together."""
        return Check(
            self.hits + other.hits,
            self.trials + other.trials,
            self.expected + other.expected,
            self.objects + other.objects,
            self.false_alarms + other.false_alarms,
            self.places + other.places,
        )


def places_of(frames: Sequence[Frame]) -> dict[str, float]:
    """Return the number of places in a picture where an object of each class may be.

    An object of the median size is looked for at 7 distances from 8 to 90 m, at every half of its
    width, in three rows.
    """
    sizes: dict[str, list[float]] = {}
    for frame in frames:
        columns = frame.colours.shape[2]
        for thing in frame.things:
            sizes.setdefault(thing.kind, []).append(thing.box[3] * thing.distance_m / columns)
    distances = np.geomspace(NEAREST_M, FARTHEST_M, DISTANCES)
    return {
        kind: float(np.sum(ROWS * 2 * distances / np.median(widths)))
        for kind, widths in sizes.items()
    }


def observed(
    frames: Sequence[Frame],
    how: Observer,
    row_of: Callable[[Frame, Thing, Answer], Found],
    places: Mapping[str, float],
    bare: Mapping[int, Frame] | None = None,
) -> tuple[list[Found], Check]:
    """Return one row for each object of the frames, and the decisions that were counted.

    Parameters
    ----------
    frames : frames of one camera at one level of light, all roads.
    how : the observer looks.
    row_of : function(frame, thing, answer) -> its row.
    places : places of each class in a picture.
    bare : {scene: the same view rendered without objects}; None: objects are filled from the ring.
    """
    rows = []
    check = Check()

    def answered(clutter: Clutter, frame: Frame) -> tuple[list[Found], Check]:
        mine = []
        counted_here = Check()
        view = None if bare is None else bare.get(frame.number)
        for thing in frame.things:
            limit = threshold(how.false_alarms, places[thing.kind])
            at = _looked_at(clutter, frame, thing, view)
            if at is None:
                mine.append(row_of(frame, thing, Answer(NOTHING, limit, math.nan)))
                continue
            task, window, samples = at
            d = detectability(task.difference, task.clutter, task.noise, samples, window.render)
            decisions = _decided(clutter, frame, thing, task, window)
            mine.append(row_of(frame, thing, Answer(d, limit, decisions.told_apart)))
            counted_here += _check_of(decisions, d)
        return mine, counted_here

    for condition in dict.fromkeys(frame.condition for frame in frames):
        alike = [frame for frame in frames if frame.condition == condition]
        clutter = Clutter(alike, how.order, how.windows)
        clutter.prepare(size_of(thing.box) for frame in alike for thing in frame.things)
        for mine, counted_here in at_once(partial(answered, clutter), alike):
            rows += mine
            check += counted_here
    return rows, check


def _looked_at(
    clutter: Clutter, frame: Frame, thing: Thing, bare: Frame | None
) -> tuple[Task, Seen, int] | None:
    """Return the observer's knowledge of an object, its window, and the number of windows behind
    the covariance; None where these are too few, or nothing is left to fill the object from.
    """
    size = size_of(thing.box)
    shape = clutter.shape(size)
    if shape.channels.shape[1] > frame.joined(size.level).shape[2]:
        return None
    moments = clutter.others(size, frame.road)
    colours = len(frame.colours)
    if moments.count < 2 * colours * count(clutter.order):
        return None
    window = seen(frame, thing, size, shape, bare)
    if window is None:
        return None
    task = Task(
        difference=window.difference,
        clutter=covariance(moments),
        mean=_mean(moments),
        noise=shape.channels.noise(colours),
    )
    return task, window, moments.count


def _mean(moments: Moments) -> np.ndarray:
    return moments.total / moments.count


def _decided(clutter: Clutter, frame: Frame, thing: Thing, task: Task, window: Seen) -> Counted:
    """Return counted decisions about one object on its own road."""
    empty = clutter.outputs(frame, size_of(thing.box))
    shown = np.repeat(window.outputs[None], DRAWS, 0)
    random = np.random.default_rng([frame.number, thing.instance])
    return counted(task, shown, empty, CHECKED, random)


def _check_of(decisions: Counted, d: Detectability) -> Check:
    """Return decisions about one object beside what its detectability states."""
    return Check(
        decisions.hits,
        decisions.trials,
        float(expected_share(np.array(d.d), CHECKED)) * decisions.trials,
        1,
        decisions.false_alarms,
        decisions.places,
    )


class Answer(NamedTuple):
    """What the observer says of one object: its detectability, the threshold of the decision, and
    the share of pairs of windows that it tells apart.
    """

    d: Detectability
    limit: float
    told_apart: float


class Beside(NamedTuple):
    """What a row says beside the observer: camera, level of light, contrast transfer accuracy."""

    camera: str
    level: float
    transfer: float


def row(frame: Frame, thing: Thing, answer: Answer, beside: Beside) -> Found:
    """Return the row of an object.

    Parameters
    ----------
    frame : scene through a camera.
    thing : object in the frame.
    answer : detectability and decision of the observer.
    beside : camera, level of light and contrast transfer accuracy.
    """
    d = answer.d
    return Found(
        scene=frame.number,
        road=frame.road,
        camera=beside.camera,
        condition=frame.condition,
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
