"""Matches of detections and objects, by hotcoco with the rules of COCO's evaluation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from isethdr_core.extras import needed

from .boxes import Detections
from .classes import CLASSES
from .objects import TruthObject

THRESHOLDS = np.linspace(0.5, 0.95, 10)  # thresholds of intersection over union, as in COCO
MOST = 100  # largest number of detections of a class in a picture


@dataclass(frozen=True, eq=False)
class Picture:
    """Objects and detections of one picture."""

    scene: int
    road: str
    camera: str
    objects: Sequence[TruthObject]
    found: Detections


@dataclass(frozen=True, eq=False)
class Matches:
    """The detections of one class over all pictures, best first.

    Parameters
    ----------
    class_name : class of all detections.
    scores : (n,) scores of the detections.
    pictures : (n,) index of the picture of each detection.
    matched : (thresholds, n) index of the matched object in its picture, -1 for none.
    """

    class_name: str
    scores: np.ndarray
    pictures: np.ndarray
    matched: np.ndarray


def matches_of(pictures: Sequence[Picture]) -> dict[str, Matches]:
    """Return the matches of each class.

    Every object takes part, including those that are not counted later, so that their detections
    are not false alarms. An object is matched once, by the best detection that reaches the
    threshold.

    Parameters
    ----------
    pictures : pictures of one camera and one detector.

    Raises
    ------
    ConfigError : hotcoco is not installed.
    """
    rows, places = _annotations(pictures)
    answers = [
        {
            "image_id": number,
            "category_id": int(kind) + 1,
            "bbox": [float(v) for v in (x0, y0, x1 - x0, y1 - y0)],
            "score": float(score),
        }
        for number, picture in enumerate(pictures, 1)
        for (x0, y0, x1, y1), score, kind in zip(
            picture.found.boxes, picture.found.scores, picture.found.classes, strict=True
        )
    ]
    evaluated = _evaluated(pictures, rows, answers) if rows and answers else []
    found = {(row["category_id"], row["image_id"]): row for row in evaluated}
    return {name: _of_class(kind, pictures, found, places) for kind, name in enumerate(CLASSES, 1)}


def _annotations(
    pictures: Sequence[Picture],
) -> tuple[list[dict[str, Any]], dict[int, int]]:
    """Return the objects as COCO annotations, and {number of the annotation: index of the object in
    its picture}.
    """
    rows: list[dict[str, Any]] = []
    places = {}
    for number, picture in enumerate(pictures, 1):
        for place, one in enumerate(picture.objects):
            x0, y0, x1, y1 = one.box
            places[len(rows) + 1] = place
            rows.append(
                {
                    "id": len(rows) + 1,
                    "image_id": number,
                    "category_id": CLASSES.index(one.class_name) + 1,
                    "bbox": [x0, y0, x1 - x0, y1 - y0],
                    "area": (x1 - x0) * (y1 - y0),
                    "iscrowd": 0,
                }
            )
    return rows, places


def _evaluated(
    pictures: Sequence[Picture], rows: list[dict[str, Any]], answers: list[dict[str, Any]]
) -> list[dict[str, Any]]:
    """Return hotcoco's matches, one entry for each picture and class."""
    with needed("a score of detections", extra="detect"):
        coco = import_module("hotcoco")
    truth = coco.COCO(
        {
            "images": [{"id": k + 1, "width": 1, "height": 1} for k in range(len(pictures))],
            "categories": [{"id": k, "name": name} for k, name in enumerate(CLASSES, 1)],
            "annotations": rows,
        }
    )
    evaluation = coco.COCOeval(truth, truth.loadRes(answers), "bbox")
    evaluation.evaluate()
    everywhere = evaluation.params.areaRng[0]
    return [row for row in evaluation.evalImgs if row is not None and row["aRng"] == everywhere]


def _of_class(
    kind: int,
    pictures: Sequence[Picture],
    found: dict[tuple[int, int], dict[str, Any]],
    places: dict[int, int],
) -> Matches:
    scores = []
    of_picture = []
    matched = []
    for number in range(1, len(pictures) + 1):
        row = found.get((kind, number))
        if row is None:
            own = pictures[number - 1].found
            alone = np.sort(own.scores[own.classes == kind - 1])[::-1][:MOST]
            scores += alone.tolist()
            of_picture += [number - 1] * len(alone)
            matched.append(np.full((len(THRESHOLDS), len(alone)), -1))
            continue
        scores += row["dtScores"]
        of_picture += [number - 1] * len(row["dtScores"])
        matched.append(
            np.array(
                [
                    [places[i] if hit else -1 for i, hit in zip(ids, hits, strict=True)]
                    for ids, hits in zip(row["dtMatches"], row["dtMatched"], strict=True)
                ],
                int,
            ).reshape(len(THRESHOLDS), -1)
        )
    order = np.argsort(-np.array(scores), kind="stable")
    return Matches(
        CLASSES[kind - 1],
        np.array(scores)[order],
        np.array(of_picture, int)[order],
        np.concatenate(matched, 1)[:, order],
    )
