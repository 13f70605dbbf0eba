"""Tables of a study of detectors: scores of each camera, differences, and the number of roads
needed to detect a difference.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from . import bootstrap
from .bootstrap import SHARE, Estimate, estimate, roads_to_tell
from .classes import CLASSES
from .groups import EVERYTHING, Group, groups
from .matching import Matches, Picture, matches_of
from .precision import Scores, scores_of

ALL = "all"  # the mean over classes
NAMES = {"mAP": "average_precision", "mAP50": "average_precision_50", "AR": "average_recall"}


@dataclass(frozen=True, eq=False)
class Answers:
    """All pictures of one camera with one detector."""

    camera: str
    pictures: Sequence[Picture]

    @cached_property
    def matches(self) -> dict[str, Matches]:
        """The matches of detections and objects, by class."""
        return matches_of(self.pictures)


@dataclass(frozen=True, eq=False)
class Compared:
    """Cameras and detectors that are compared on the same roads.

    Parameters
    ----------
    answers : {camera: one entry for each detector}.
    classes : classes that are scored.
    trained_apart : whether each camera has detectors of its own; then the bootstrap draws them
        separately.
    """

    answers: Mapping[str, Sequence[Answers]]
    classes: Sequence[str]
    trained_apart: bool = False

    @cached_property
    def road_names(self) -> list[str]:
        """The names of the roads, in the order of their first picture."""
        return list(dict.fromkeys(p.road for p in self._first.pictures))

    @property
    def _first(self) -> Answers:
        return next(iter(self.answers.values()))[0]

    @cached_property
    def weights(self) -> np.ndarray:
        """How often each road is drawn, the same for all cameras."""
        return bootstrap.road_weights(len(self.road_names))

    def draws(self, camera: str, group: Group) -> dict[str, dict[str, np.ndarray]]:
        """Return {class: {score: values of all draws}} of a camera, also for the mean over classes.

        Parameters
        ----------
        camera : name of the camera.
        group : group of objects that count.
        """
        place = {road: k for k, road in enumerate(self.road_names)}
        found: dict[str, dict[str, list[np.ndarray]]] = {}
        for one in self.answers[camera]:
            roads = np.array([place[p.road] for p in one.pictures])
            scored = {
                name: scores_of(one.matches[name], one.pictures, self.weights, roads, group.member)
                for name in self.classes
            }
            for name, values in _with_mean(scored).items():
                for score, drawn in values.items():
                    found.setdefault(name, {}).setdefault(score, []).append(drawn)
        picked = self._picked(camera)
        return {
            name: {
                score: bootstrap.over_detectors(np.stack(of_detectors), picked)
                for score, of_detectors in values.items()
            }
            for name, values in found.items()
        }

    def _picked(self, camera: str) -> np.ndarray | None:
        """Return the numbers of the drawn detectors, which are the same for all cameras unless each
        has detectors of its own.
        """
        detectors = len(self.answers[camera])
        if detectors == 1:
            return None
        seed = 1 + (list(self.answers).index(camera) if self.trained_apart else 0)
        return bootstrap.picked_detectors(detectors, len(self.weights) - 1, seed)

    def objects(self, camera: str, name: str, group: Group) -> int:
        """Return the number of counted objects of a class in a group.

        Parameters
        ----------
        camera : name of the camera.
        name : class of the objects; `ALL` for all classes.
        group : group of objects.
        """
        return len(self._roads_of_objects(camera, name, group))

    def roads_with(self, camera: str, name: str, group: Group) -> int:
        """Return the number of roads with a counted object of a class in a group.

        Parameters
        ----------
        camera, name, group : as in `objects`.
        """
        return len(set(self._roads_of_objects(camera, name, group)))

    def _roads_of_objects(self, camera: str, name: str, group: Group) -> list[str]:
        """Return the road of each counted object."""
        return [
            picture.road
            for picture in self.answers[camera][0].pictures
            for one in picture.objects
            if one.counted and group.member(one) and one.class_name in (name, *self._all_of(name))
        ]

    def _all_of(self, name: str) -> Sequence[str]:
        return self.classes if name == ALL else ()


def _with_mean(scored: Mapping[str, Scores]) -> dict[str, dict[str, np.ndarray]]:
    """Return the values of each class and their mean over classes, by score."""
    values = {
        name: {score: getattr(one, field) for score, field in NAMES.items()}
        for name, one in scored.items()
    }
    mean = {
        score: bootstrap.mean_of_known([of_class[score] for of_class in values.values()])
        for score in NAMES
    }
    return {ALL: mean, **values}


def rows_of(compared: Compared, tell: float) -> list[dict[str, Any]]:
    """Return one row for each score: of each camera, and its difference from the first camera.

    Parameters
    ----------
    compared : cameras and detectors.
    tell : difference of two scores for which the number of roads needed is computed.
    """
    rows = []
    for group in groups():
        drawn = {camera: compared.draws(camera, group) for camera in compared.answers}
        for name in (ALL, *(c for c in CLASSES if c in compared.classes)):
            for score in NAMES:
                values = {camera: drawn[camera][name][score] for camera in drawn}
                rows += _of_score(compared, group, name, score, values)
                if group is EVERYTHING:
                    rows += _to_tell(compared, name, score, values, tell)
    return rows


def _of_score(
    compared: Compared, group: Group, name: str, score: str, values: Mapping[str, np.ndarray]
) -> list[dict[str, Any]]:
    first = next(iter(values))
    # roads without an object in the group do not show how its scores vary
    holding = {camera: compared.roads_with(camera, name, group) for camera in values}
    rows = []
    for camera, drawn in values.items():
        objects = compared.objects(camera, name, group)
        if not objects:
            continue
        base = {"table": group.table, "row": group.row, "class": name, "score": score}
        counts = {"objects": objects, "roads": len(compared.road_names)}
        of_camera = estimate(drawn, holding[camera], SHARE)
        rows.append({**base, "camera": camera, **_numbers(of_camera), **counts})
        if camera != first:
            difference = estimate(drawn - values[first], min(holding[first], holding[camera]))
            title = f"{camera} - {first}"
            rows.append({**base, "camera": title, **_numbers(difference), **counts})
    return rows


def _numbers(found: Estimate) -> dict[str, float]:
    return {"value": found.value, "low": found.low, "high": found.high}


def _to_tell(
    compared: Compared,
    name: str,
    score: str,
    values: Mapping[str, np.ndarray],
    tell: float,
) -> list[dict[str, Any]]:
    """Return rows with the number of roads needed to detect a difference, if both cameras are on
    the same roads and if they are on different roads.
    """
    roads = len(compared.road_names)
    first, *others = values
    rows = []
    for camera in others:
        if not compared.objects(camera, name, EVERYTHING):
            continue
        holding = {c: compared.roads_with(c, name, EVERYTHING) for c in (first, camera)}
        paired = estimate(values[camera] - values[first], min(holding.values())).error
        alone = np.hypot(*(estimate(values[c], holding[c]).error for c in (first, camera)))
        for row, error in (("the same roads", paired), ("other roads", float(alone))):
            rows.append(
                {
                    "table": f"roads that tell {tell:g}",
                    "row": row,
                    "class": name,
                    "score": score,
                    "camera": f"{camera} - {first}",
                    "value": roads_to_tell(error, roads, tell),
                    "low": float("nan"),
                    "high": float("nan"),
                    "objects": compared.objects(camera, name, EVERYTHING),
                    "roads": roads,
                }
            )
    return rows
