"""Patches of a coat, as fields on its surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..shapes import Patch, Values


@dataclass(frozen=True)
class Landmarks:
    """Points and measures of the body that set the places of patches, m."""

    shoulder_m: float
    chest: np.ndarray
    hip: np.ndarray
    chest_depth_m: float
    poll: np.ndarray  # point where head and neck meet
    nose: np.ndarray
    seed: int


def patches(coat: Mapping[str, Any], marks: Landmarks) -> tuple[Patch, ...]:
    """Return the patches that a coat names. Where patches overlap, the earlier one is shown."""
    k = marks.shoulder_m
    face = marks.nose - marks.poll
    length = float(np.linalg.norm(face))
    ahead = face / length
    made: dict[str, Values] = {
        "nose": lambda v: np.linalg.norm(v - marks.nose, axis=1) - 0.16 * length,
        "face": lambda v: -((v - marks.poll) @ ahead) - 0.10 * length,
        "muzzle": lambda v: np.linalg.norm(v - marks.nose, axis=1) - 0.52 * length,
        "cheeks": lambda v: _cheeks(v, marks, ahead, length),
        "socks": lambda v: v[:, 2] - coat["sock_height"] * k,
        "rump": lambda v: np.linalg.norm(v - (marks.hip - [0.20 * k, 0, 0]), axis=1) - 0.135 * k,
        "throat": lambda v: _throat(v, marks),
        "belly": lambda v: _belly(v, marks),
        "mane": lambda v: _mane(v, marks),
        "saddle": lambda v: _saddle(v, marks),
        "spots": lambda v: _spots(v, marks),
        "blotches": lambda v: _blotches(v, marks, coat["blotch_share"]),
    }
    return tuple(
        Patch(name, coat[name], inside) for name, inside in made.items() if name in coat
    ) + (() if "nose" in coat else (Patch("nose", "leather", made["nose"]),))


def tail_patches(coat: Mapping[str, Any], end: np.ndarray, reach_m: float) -> tuple[Patch, ...]:
    """Return the patch of the tip of a tail, if the coat names a colour for it.

    Parameters
    ----------
    coat : colours of the coat; `tip` names the material of the tail's tip.
    end : (3,) place of the tail's end, m.
    reach_m : distance from the end up to which the tip reaches, m.
    """
    if "tip" not in coat:
        return ()
    return (Patch("tip", coat["tip"], lambda v: np.linalg.norm(v - end, axis=1) - reach_m),)


def _cheeks(v: np.ndarray, marks: Landmarks, ahead: np.ndarray, length: float) -> np.ndarray:
    """Return the field of the lower half of the face, negative inside."""
    along = (v - marks.poll) @ ahead
    below = (v - marks.poll) @ np.array([ahead[2], 0.0, -ahead[0]])
    far_below = below - 0.5 * length
    ends = np.maximum(0.25 * length - along, along - 0.97 * length)
    return np.max([0.02 * length - below, far_below, ends], 0)


def _belly(v: np.ndarray, marks: Landmarks) -> np.ndarray:
    """Return the field of the underside of the trunk, which narrows towards both ends."""
    k = marks.shoulder_m
    depth = marks.chest_depth_m
    middle = (marks.chest[0] + marks.hip[0]) / 2
    half = (marks.chest[0] - marks.hip[0]) / 2
    along = (v[:, 0] - middle) / half
    sink = 0.20 * depth * along**2 + 0.02 * k * np.sin(9 * v[:, 0] / k)
    line = marks.chest[2] - 0.30 * depth - sink
    low = marks.chest[2] - 0.75 * depth
    return np.max([v[:, 2] - line, (np.abs(along) - 0.92) * half, low - v[:, 2]], 0)


def _throat(v: np.ndarray, marks: Landmarks) -> np.ndarray:
    """Return the field of the underside of the neck and the front of the chest."""
    k = marks.shoulder_m
    front = marks.chest + np.array([0.06 * k, 0.0, 0.0])
    way = marks.poll - front
    along = np.clip((v - front) @ way / (way @ way), 0, 1)
    line = front + along[:, None] * way
    beside = np.abs(v[:, 1]) - (0.085 - 0.02 * along) * k
    behind = (line[:, 0] + 0.05 * k) - v[:, 0]
    return np.max([beside, behind, marks.chest[2] - 0.4 * marks.chest_depth_m - v[:, 2]], 0)


def _mane(v: np.ndarray, marks: Landmarks) -> np.ndarray:
    """Return the field of the crest of the neck and the shoulder."""
    k = marks.shoulder_m
    start = marks.chest + np.array([-0.08 * k, 0.0, 0.42 * marks.chest_depth_m])
    way = marks.poll + np.array([0.0, 0.0, 0.03 * k]) - start
    along = (v - start) @ way / (way @ way)
    above = (v - start) - along[:, None] * way
    up = above @ np.array([-way[2], 0.0, way[0]]) / np.linalg.norm(way)
    return np.max([0.02 * k - up, np.abs(v[:, 1]) - 0.055 * k, -0.05 - along, along - 1.05], 0)


def _saddle(v: np.ndarray, marks: Landmarks) -> np.ndarray:
    k = marks.shoulder_m
    line = marks.chest[2] + (0.02 + 0.03 * np.sin(11 * v[:, 0] / k)) * k
    return np.max([line - v[:, 2], v[:, 0] - marks.chest[0] - 0.06 * k], 0)


def _spots(v: np.ndarray, marks: Landmarks) -> np.ndarray:
    """Return the field of round spots in rows on back and flanks."""
    k = marks.shoulder_m
    cell = 0.085 * k
    row = np.floor(v[:, 2] / cell)
    x = np.mod(v[:, 0] + 0.5 * cell * np.mod(row, 2), cell) - cell / 2
    z = np.mod(v[:, 2], cell) - cell / 2
    off_trunk = np.max([marks.hip[0] - 0.1 * k - v[:, 0], v[:, 0] - marks.chest[0]], 0)
    low = marks.chest[2] - 0.05 * k - v[:, 2]
    return np.max([np.hypot(x, z) - 0.022 * k, off_trunk, low], 0)


def _blotches(v: np.ndarray, marks: Landmarks, share: float) -> np.ndarray:
    """Return the field of large irregular spots over about `share` of the body."""
    rng = np.random.default_rng(marks.seed)
    waves = rng.normal(size=(7, 3)) * 4.2 / marks.shoulder_m
    phases = rng.uniform(0, 2 * np.pi, 7)
    level = np.sin(v @ waves.T + phases).mean(1)
    # the mean of 7 sines is close to normal, with a standard deviation of 1 / sqrt(14)
    return (0.27 * 2.0 * (0.5 - share) - level) * 0.3 * marks.shoulder_m
