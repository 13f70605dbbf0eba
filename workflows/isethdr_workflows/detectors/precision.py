"""Average precision and average recall, also for draws of roads by a bootstrap.

Average precision is COCO's: the mean of precision, made to fall with recall, at 101 values of
recall (Lin et al. 2014). Weights of the roads give the values for all draws in one computation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .matching import Matches, Picture
from .objects import TruthObject

RECALLS = np.linspace(0.0, 1.0, 101)
EPSILON = np.spacing(1.0)  # pycocotools adds this to the number of detections
LOOSE = 0  # index of the threshold 0.5
Member = Callable[[TruthObject], bool]


@dataclass(frozen=True, eq=False)
class Hits:
    """Hits and false alarms of one class at one threshold, counted by road.

    Parameters
    ----------
    found : (roads, hits) number of objects found with at least the score of each hit, best first.
    alarms : (roads, hits) number of false alarms with at least the score of each hit.
    objects : (roads,) number of objects to be found.
    """

    found: np.ndarray
    alarms: np.ndarray
    objects: np.ndarray


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of one class, with one value for each draw of roads; NaN without an object."""

    average_precision: np.ndarray  # mean over thresholds 0.5 to 0.95
    average_precision_50: np.ndarray
    average_recall: np.ndarray  # mean over thresholds, with all detections


def scores_of(
    matches: Matches,
    pictures: Sequence[Picture],
    weights: np.ndarray,
    roads: np.ndarray,
    member: Member,
) -> Scores:
    """Return the scores of one class for each draw of roads.

    Objects that are not counted, or are not in the group, are neither missed nor found, and their
    detections are not false alarms. Detections without an object are false alarms in every group.

    Parameters
    ----------
    matches : detections of the class.
    pictures : pictures to which the indices of `matches` refer.
    weights : (draws, roads) how often each road is drawn.
    roads : (pictures,) index of the road of each picture.
    member : function(object) that returns whether an object belongs to the group.
    """
    wanted = np.array(
        [
            one.counted and one.class_name == matches.class_name and member(one)
            for picture in pictures
            for one in picture.objects
        ],
        bool,
    )
    counts = np.array([len(picture.objects) for picture in pictures])
    objects = np.bincount(np.repeat(roads, counts)[wanted], minlength=weights.shape[1])
    first = np.cumsum(counts) - counts  # number of the first object of each picture
    precisions = []
    recalls = []
    for matched in matches.matched:
        alarm = matched < 0
        hit = np.zeros(len(matched), bool)
        hit[~alarm] = wanted[(first[matches.pictures] + matched)[~alarm]]
        is_road = np.arange(weights.shape[1])[:, None] == roads[matches.pictures]
        hits = Hits(
            np.cumsum(is_road & hit, 1)[:, hit], np.cumsum(is_road & alarm, 1)[:, hit], objects
        )
        precision, recall = _averages(hits, weights)
        precisions.append(precision)
        recalls.append(recall)
    return Scores(np.mean(precisions, 0), precisions[LOOSE], np.mean(recalls, 0))


def _averages(hits: Hits, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return average precision and largest recall (draws,) at one threshold.

    Precision is needed only at the hits, because it falls between them. The mean over the 101
    recalls is a sum over hits, each times the number of recalls that it is the first to reach.
    """
    objects = weights @ hits.objects
    some = objects > 0
    nothing = np.where(some, 0.0, np.nan)
    if not hits.found.shape[1]:
        return nothing, nothing.copy()
    found = weights @ hits.found
    alarms = weights @ hits.alarms
    recall = found / np.where(some, objects, 1.0)[:, None]
    precision = found / (found + alarms + EPSILON)
    falling = np.maximum.accumulate(precision[:, ::-1], 1)[:, ::-1]
    reached = np.searchsorted(RECALLS, recall, side="right")
    # before the first object is found, a recall of 0 is reached by the first detection
    first = np.diff(reached, axis=1, prepend=0)
    average = (falling * first).sum(1) / len(RECALLS)
    return average + nothing, recall[:, -1] + nothing
