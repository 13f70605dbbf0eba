"""The recall of detectors and of the observer, for the same objects of the same scenes.

`isethdr study detector_scores` writes one row for each object, camera and detector into the folder
of the dataset. Objects below that study's limits of size count neither as misses nor as hits there,
so they are left out here.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import spearmanr

from ...dataset.study.intervals import Mean, mean_over_roads
from ..frame import CLASSES
from .shares import Found, few_roads

FILE = "detector_objects.csv"


class Recall(NamedTuple):
    """Objects of one class that a detector and the observer find.

    Parameters
    ----------
    rank : Spearman's rank correlation of the observer's d' and the detector's score; NaN if either
        is the same for all objects.
    """

    detector: str
    camera: str
    kind: str
    objects: int
    detector_found: Mean
    observer_found: Mean
    rank: float


class SoughtObject(NamedTuple):
    """An object that both a detector and the observer looked for.

    Parameters
    ----------
    detector, camera : names.
    own : row of the observer.
    found : 1 if the detector finds the object at the allowed false alarms, else 0.
    score : score that the detector gives to the object; 0 without a box.
    """

    detector: str
    camera: str
    own: Found
    found: float
    score: float


def recalls(path: Path, rows: Sequence[Found]) -> list[Recall]:
    """Return the recall of each detector and of the observer, by camera and class.

    Parameters
    ----------
    path : file with the rows of the detectors; without it there are no recalls.
    rows : rows of the observer.
    """
    groups: dict[tuple[str, str, str], list[SoughtObject]] = {}
    for one in sought_objects(path, rows):
        for kind in (one.own.kind, "all"):
            groups.setdefault((one.detector, one.camera, kind), []).append(one)
    order = ["all", *CLASSES]
    return [
        _recall(key, members)
        for key, members in sorted(groups.items(), key=lambda item: _order(item[0], order))
    ]


def sought_objects(path: Path, rows: Sequence[Found]) -> list[SoughtObject]:
    """Return the objects that detectors and the observer have in common.

    Parameters
    ----------
    path : file with the rows of the detectors; without it there are none.
    rows : rows of the observer.
    """
    if not path.is_file():
        return []
    known = {(one.scene, one.instance, one.camera): one for one in rows if math.isfinite(one.d)}
    common = []
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            own = known.get((int(row["scene"]), int(row["instance"]), row["camera"]))
            if own is None or not float(row["counted"] or 0):
                continue
            found = float(row["found"] or 0)
            score = float(row["score"] or 0)
            common.append(SoughtObject(row["detector"], row["camera"], own, found, score))
    return common


def _order(key: tuple[str, str, str], order: Sequence[str]) -> tuple[str, str, int]:
    return key[0], key[1], order.index(key[2])


def _recall(key: tuple[str, str, str], members: Sequence[SoughtObject]) -> Recall:
    roads = [one.own.road for one in members]
    scores = [one.score for one in members]
    d = [one.own.d for one in members]
    varied = len(set(scores)) > 1 and len(set(d)) > 1
    return Recall(
        *key,
        len(members),
        few_roads(mean_over_roads([one.found for one in members], roads, (0.0, 1.0))),
        few_roads(mean_over_roads([one.own.found for one in members], roads, (0.0, 1.0))),
        float(spearmanr(d, scores).statistic) if varied else float(np.nan),
    )
