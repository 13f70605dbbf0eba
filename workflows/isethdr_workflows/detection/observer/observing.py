"""The observer at work: every object of the frames of one camera at one level of light."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from ..frame import Frame, Thing
from ..results.shares import Found
from ..threads import at_once
from .channels import count
from .clutter import Clutter, Moments, covariance, size_of
from .counting import Counted, Task, counted, expected_share
from .difference import Seen, seen
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


def places_of(frames: Sequence[Frame]) -> dict[str, float]:
    """Return the number of places in a picture where the observer looks for each class.

    It looks for an object of the median size at 7 distances from 8 to 90 m, in steps of half of
    its width, and in three rows.
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
    how : settings of the observer.
    row_of : function(frame, thing, answer) that returns the row of an object.
    places : number of places of each class in a picture.
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
    """Return the observer's knowledge about an object, its window, and the number of windows behind
    the covariance. Return None if there are too few windows, or if the object's ring has too few
    cells to fill it from.
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


def row(frame: Frame, thing: Thing, answer: Answer, beside: Beside) -> Found:
    """Return the row of an object.

    Parameters
    ----------
    frame : scene through a camera.
    thing : object in the frame.
    answer : detectability and decision of the observer.
    beside : further values: camera, level of light and contrast transfer accuracy.
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
