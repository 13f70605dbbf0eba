"""Rows of objects: which ones a detector found in the pictures of which camera."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from .classes import CLASSES
from .matching import THRESHOLDS, Matches
from .precision import LOOSE
from .tables import Answers

DIGITS = 9  # decimal digits of a number of false alarms that are not rounding
HEAD = (
    *("scene", "road", "instance", "camera", "detector", "class", "category", "name"),
    *("distance_m", "height_px", "illuminance_lx", "lamp_near", "visible_fraction"),
    *("counted", "found", "score"),
)


def object_rows(answers: Answers, detector: int, false_alarms: float) -> list[dict[str, Any]]:
    """Return one row for each object of each picture, with the columns of `HEAD`.

    `score` is the score of the object's detection with an intersection over union of at least 0.5;
    0 without one. `found` is 1 if this score is above the scores of all false alarms of the class,
    except for the allowed number of them.

    Parameters
    ----------
    answers : answers of one camera with one detector.
    detector : number of the detector.
    false_alarms : allowed false alarms of a class in a picture, on average.
    """
    scores: dict[tuple[int, int], float] = {}
    least = {}
    for name, matches in answers.matches.items():
        least[name] = threshold(matches, len(answers.pictures), false_alarms)
        matched = matches.matched[LOOSE]
        for place in np.flatnonzero(matched >= 0):
            key = (int(matches.pictures[place]), int(matched[place]))
            scores[key] = float(matches.scores[place])
    rows = []
    for number, picture in enumerate(answers.pictures):
        for place, one in enumerate(picture.objects):
            score = scores.get((number, place), -math.inf)
            values = (
                *(picture.scene, picture.road, one.instance, picture.camera, detector),
                *(one.class_name, one.category, one.name, one.distance_m, one.height_px),
                *(one.illuminance_lx, int(one.lamp_near), one.visible_fraction, int(one.counted)),
                *(int(score > least[one.class_name]), max(score, 0.0)),
            )
            rows.append(dict(zip(HEAD, values, strict=True)))
    return rows


def threshold(matches: Matches, pictures: int, false_alarms: float) -> float:
    """Return the score above which there is at most the allowed number of false alarms.

    Parameters
    ----------
    matches : detections of one class.
    pictures : number of pictures.
    false_alarms : allowed false alarms in a picture, on average.
    """
    alarms = matches.scores[matches.matched[LOOSE] < 0]
    # the product of a decimal share may lie one rounding below a whole number: 0.29 * 100
    allowed = math.floor(round(false_alarms * pictures, DIGITS))
    return float(alarms[allowed]) if len(alarms) > allowed else -math.inf


def recall_at(rows: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Return the share of the counted objects that were found, by class; NaN without objects."""
    found = {}
    for name in CLASSES:
        own = [row["found"] for row in rows if row["class"] == name and row["counted"]]
        found[name] = sum(own) / len(own) if own else math.nan
    return found


assert THRESHOLDS[LOOSE] == 0.5, "`found` is about an intersection over union of 0.5"
