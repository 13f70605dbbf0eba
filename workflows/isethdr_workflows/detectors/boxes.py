"""Boxes in pixels: their forms, their overlap, and non-maximum suppression."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

BoxForm = Literal["xyxy", "xywh", "cxcywh"]


@dataclass(frozen=True, eq=False)
class Detections:
    """The detections in one picture, best first.

    Parameters
    ----------
    boxes : (n, 4) left, top, right, bottom in pixels from the top left corner of the picture.
    scores : (n,) confidence of each detection; higher is more certain.
    classes : (n,) index of each class in `CLASSES`.
    """

    boxes: np.ndarray
    scores: np.ndarray
    classes: np.ndarray


def corners(boxes: np.ndarray, form: BoxForm) -> np.ndarray:
    """Return boxes (n, 4) as left, top, right, bottom.

    Parameters
    ----------
    boxes : (n, 4) in any unit.
    form : `xyxy` corners; `xywh` left, top, width, height; `cxcywh` centre, width, height.
    """
    first = boxes[:, :2]
    second = boxes[:, 2:]
    if form == "xyxy":
        return boxes.copy()
    if form == "xywh":
        return np.concatenate([first, first + second], 1)
    return np.concatenate([first - second / 2, first + second / 2], 1)


def areas(boxes: np.ndarray) -> np.ndarray:
    """Return the areas (n,) of boxes (n, 4) given by corners. The area is 0 if right is left of
    left, or bottom above top.
    """
    return np.prod(np.maximum(boxes[:, 2:] - boxes[:, :2], 0), axis=1)


def overlaps(boxes: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the intersection over union (n, m) of boxes (n, 4) with others (m, 4).

    Parameters
    ----------
    boxes, others : boxes given by corners, same unit.
    """
    low = np.maximum(boxes[:, None, :2], others[None, :, :2])
    high = np.minimum(boxes[:, None, 2:], others[None, :, 2:])
    shared = np.prod(np.maximum(high - low, 0), axis=2)
    union = areas(boxes)[:, None] + areas(others)[None] - shared
    return np.divide(shared, union, out=np.zeros_like(shared), where=union > 0)


def suppressed(found: Detections, overlap: float, most: int) -> Detections:
    """Return detections after non-maximum suppression, best first.

    The method is greedy: the best detection is kept, and detections of its class that overlap it by
    more than `overlap` are dropped. Then the same is done with the best one of the rest.

    Parameters
    ----------
    found : detections of one picture.
    overlap : largest intersection over union of two kept detections of a class; 1 keeps all.
    most : largest number of kept detections.
    """
    order = np.argsort(-found.scores, kind="stable")
    boxes = found.boxes[order]
    classes = found.classes[order]
    alive = np.ones(len(order), bool)
    kept = []
    for place in range(len(order)):
        if not alive[place]:
            continue
        kept.append(place)
        if len(kept) == most:
            break
        same = np.flatnonzero(alive & (classes == classes[place]))
        same = same[same > place]
        near = overlaps(boxes[place : place + 1], boxes[same])[0] > overlap
        alive[same[near]] = False
    chosen = order[np.array(kept, int)]
    return Detections(found.boxes[chosen], found.scores[chosen], found.classes[chosen])
