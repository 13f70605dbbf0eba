"""Vehicles of a trace that touch others, and the area that all of them sweep."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ...placing.boxes import overlapping
from ...roads.profile import Floats

GRID_M = 1.0  # grid of places in a sweep; boxes in one cell count as one place
TURNS = 36  # number of directions that a sweep distinguishes
APART_M = 1e4  # distance that separates different times in the search for pairs


def touching(boxes: np.ndarray, time_s: Floats, owner: np.ndarray) -> set[tuple[int, int]]:
    """Return the pairs of owners whose boxes overlap at the same time.

    Parameters
    ----------
    boxes : (n, FIELDS) boxes of vehicles.
    time_s : (n,) time of each box, s.
    owner : (n,) index of the vehicle of each box.
    """
    if len(boxes) < 2:
        return set()
    reach = np.hypot(boxes[:, 2], boxes[:, 3])
    _, step = np.unique(np.round(time_s, 3), return_inverse=True)
    tree = cKDTree(np.column_stack([boxes[:, :2], step * APART_M]))
    pairs = tree.query_pairs(2 * float(reach.max()), output_type="ndarray")
    away = np.linalg.norm(boxes[pairs[:, 0], :2] - boxes[pairs[:, 1], :2], axis=1)
    near = (away < reach[pairs].sum(1)) & (owner[pairs[:, 0]] != owner[pairs[:, 1]])
    one, two = pairs[near].T
    hits = overlapping(boxes[one].T, boxes[two])
    return {(min(a, b), max(a, b)) for a, b in zip(owner[one[hits]], owner[two[hits]])}


def fewest(pairs: set[tuple[int, int]], kept: int) -> set[int]:
    """Return owners whose removal leaves no pair. The owner with the most pairs is removed first,
    `kept` never. A smaller set may exist.
    """
    left = set(pairs)
    out: set[int] = set()
    while left:
        owners = sorted({owner for pair in left for owner in pair if owner != kept})
        worst = max(owners, key=lambda owner: sum(owner in pair for pair in left))
        out.add(worst)
        left = {pair for pair in left if worst not in pair}
    return out


def swept(boxes: np.ndarray) -> np.ndarray:
    """Return boxes (m, FIELDS) that cover almost all of `boxes` (n, FIELDS).

    Of the boxes at one place and in one direction, the largest is kept.
    """
    if not len(boxes):
        return boxes
    turn = np.round(np.arctan2(boxes[:, 5], boxes[:, 4]) / (2 * np.pi) * TURNS) % TURNS
    cell = np.column_stack([np.round(boxes[:, :2] / GRID_M), turn, boxes[:, 8]])
    order = np.argsort(-boxes[:, 2] * boxes[:, 3], kind="stable")
    _, first = np.unique(cell[order], axis=0, return_index=True)
    return boxes[order[np.sort(first)]]
