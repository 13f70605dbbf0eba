"""Deer: implicit body with legs, neck, head, ears, tail and optional antlers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..mesh.cutting import cut
from ..mesh.implicit import Field, blend, cone, skin_of
from ..mesh.piece import Assembly, Piece, pose, unit
from ..mesh.primitives import ball, tube

SHOULDER_M = 0.97  # height at the shoulder before the deer is scaled
NECK_ROOT_M = np.array([0.42, 0, 0.88])  # point where the neck leaves the trunk
NECK_RADII_M = (0.135, 0.080, 0.062)  # radii of the neck at its root, its middle and the nape
EYE_M = (0.016, 0.015, 0.016)  # half axes; the centre lies a third of the first below the skin
STRIDE_M = 0.16  # distance along x between the left and the right hoof of a pair
FORE_LEGS_M = 0.36  # x of the upper ends of the legs
HIND_LEGS_M = -0.42
FORE_RADII_M = (0.085, 0.040, 0.026, 0.028)  # shoulder, elbow, fetlock, hoof
HIND_RADII_M = (0.125, 0.075, 0.036, 0.026, 0.028)  # hip, stifle, hock, fetlock, hoof
MUZZLE = 1.12  # distance from the nape to the tip of the nose / from the nape to the mouth


@dataclass(frozen=True, eq=False)
class _Head:
    """Place and direction of the head."""

    nape: np.ndarray  # (3,) end of the neck, m
    face: np.ndarray  # (3,) vector from the nape to the mouth, m

    def at(self, share: float) -> np.ndarray:
        """Return the point (3,), m, at a share of the way from the nape to the mouth."""
        return self.nape + self.face * share


class _Leg(NamedTuple):
    """The joints of a leg from top to hoof, and the radii there."""

    joints_m: list[tuple[float, float, float]]
    radii_m: tuple[float, ...]


def deer(
    name: str = "deer",
    height: float = 1.0,
    antlers: bool = True,
    head_up: float = 1.0,
    turn: float = 0.0,
    seed: int = 0,
) -> Assembly:
    """Return a deer that walks along +x.

    Parameters
    ----------
    name : name of the assembly.
    height : height at the shoulder, m.
    antlers : whether it has antlers.
    head_up : raise of the head: 0 for a grazing deer, 1 for one that looks up.
    turn : turn of the head to the left; 0 is straight ahead, 1 is 45 degrees.
    seed : seed of the waves of the coat.
    """
    head = _head(head_up, turn)
    legs = _legs()
    limbs = [field for leg in legs for field in _limb(leg)]
    body = blend([*_trunk(), *_neck(head), *_skull(head), *limbs], 0.055, 0.004, seed)
    coat = skin_of(body, 0.014, "coat", "fur")
    model = Assembly(name).add(*_coloured(coat, head), *map(_hoof, legs), _tail())
    for side in (1, -1):
        model.add(_ear(head, side), _eye(head, side, coat.vertices))
        if antlers:
            model.add(*_antler(head, side))
    scale = height / SHOULDER_M
    return model.moved(pose(scale=(scale, scale, scale)))


def _head(head_up: float, turn: float) -> _Head:
    """Return the head, raised (`head_up` 1), grazing (0) or between."""

    def between(up: list[float], grazing: list[float]) -> np.ndarray:
        return np.array(up) * head_up + np.array(grazing) * (1 - head_up)

    return _Head(
        nape=between([0.74, 0.0, 1.28], [0.98, 0, 0.52]) + [0, turn * 0.22, 0],
        face=between([0.22 - 0.04 * abs(turn), turn * 0.18, -0.07], [0.12, 0, -0.22]),
    )


def _trunk() -> list[Field]:
    """Return chest and belly, the breast below them, and the rump."""
    return [
        cone((0.38, 0, 0.80), (0.10, 0, 0.78), 0.165, 0.175),
        cone((0.10, 0, 0.78), (-0.36, 0, 0.83), 0.175, 0.165),
        cone((0.40, 0, 0.70), (0.30, 0, 0.66), 0.12, 0.13),
        cone((-0.40, 0, 0.84), (-0.48, 0, 0.78), 0.14, 0.11),
    ]


def _neck(head: _Head) -> list[Field]:
    root, waist, end = NECK_RADII_M
    on_the_way = 0.45 * NECK_ROOT_M + 0.55 * head.nape
    return [
        cone(NECK_ROOT_M, on_the_way, root, waist),
        cone(on_the_way, head.nape, waist, end),
    ]


def _skull(head: _Head) -> list[Field]:
    """Return the skull, the bridge of the nose, and the nose."""
    return [
        cone(head.nape + [0, 0, 0.015], head.at(0.4), 0.072, 0.060),
        cone(head.at(0.4), head.at(1), 0.052, 0.033),
        cone(head.at(1), head.at(MUZZLE), 0.033, 0.026),
    ]


def _legs() -> list[_Leg]:
    """Return the four legs of a walking deer: one fore leg and the diagonally opposite hind leg are
    forward.
    """
    forwards = STRIDE_M * 0.5
    return [
        _fore_leg(0.085, forwards),
        _fore_leg(-0.085, -forwards),
        _hind_leg(0.09, -forwards),
        _hind_leg(-0.09, forwards),
    ]


def _fore_leg(y: float, swing: float) -> _Leg:
    """Return a fore leg at `y` with its hoof `swing` ahead of the straight leg, m."""
    x = FORE_LEGS_M
    joints = [
        (x, y, 0.70),
        (x + 0.02 + swing * 0.4, y, 0.44),
        (x - 0.01 + swing * 0.8, y * 0.9, 0.13),
        (x + 0.03 + swing, y * 0.9, 0.035),
    ]
    return _Leg(joints, FORE_RADII_M)


def _hind_leg(y: float, swing: float) -> _Leg:
    """Return a hind leg at `y` with its hoof `swing` ahead of the straight leg, m."""
    x = HIND_LEGS_M
    joints = [
        (x, y, 0.78),
        (x + 0.06 + swing * 0.3, y, 0.56),
        (x - 0.10 + swing * 0.7, y * 0.95, 0.40),
        (x - 0.04 + swing, y * 0.9, 0.12),
        (x + swing, y * 0.9, 0.035),
    ]
    return _Leg(joints, HIND_RADII_M)


def _limb(leg: _Leg) -> list[Field]:
    ends = zip(leg.joints_m, leg.joints_m[1:], leg.radii_m, leg.radii_m[1:])
    return [cone(*each) for each in ends]


def _hoof(leg: _Leg) -> Piece:
    centre = np.array(leg.joints_m[-1]) + [0.018, 0, -0.008]
    return ball(centre, (0.045, 0.028, 0.032), "hoof", "leather", 8)


def _coloured(coat: Piece, head: _Head) -> list[Piece]:
    """Return the pieces of the coat by colour: the main coat, belly, rump, nose and shanks."""
    v = coat.vertices
    below = v[:, 2] - 0.655 - 0.02 * np.sin(9 * v[:, 0])  # a wavy edge
    beside = np.abs(v[:, 0] - 0.02) - 0.24
    belly, coat, _ = cut(coat, np.max([below, beside, 0.56 - v[:, 2]], 0))
    to_rump = (coat.vertices - [-0.60, 0, 0.80]) * [1, 1, 0.9]
    rump, coat, _ = cut(coat, np.linalg.norm(to_rump, axis=1) - 0.125)
    to_nose = coat.vertices - head.nape - head.face * MUZZLE
    nose, coat, _ = cut(coat, np.linalg.norm(to_nose, axis=1) - 0.034)
    shanks, coat, _ = cut(coat, coat.vertices[:, 2] - 0.30)
    return [
        coat,
        belly.named("belly", "fur_pale"),
        rump.named("rump", "fur_pale"),
        nose.named("nose", "leather"),
        shanks.named("shank", "fur_dark"),
    ]


def _tail() -> Piece:
    tail = blend([cone((-0.53, 0, 0.86), (-0.60, 0, 0.72), 0.035, 0.02)], 0.01)
    return skin_of(tail, 0.01, "tail", "fur_dark")


def _ear(head: _Head, side: int) -> Piece:
    root = head.nape + [-0.03, side * 0.05, 0.05]
    tip = root + np.array([-0.05, side * 0.13, 0.07])
    return tube([root, 0.5 * (root + tip), tip], [0.022, 0.040, 0.006], "ear", "fur", 8)


def _eye(head: _Head, side: int, skin: np.ndarray) -> Piece:
    """Return an eye on the skin (n, 3), m, that looks sideways and up."""
    ahead = head.face[:2] / np.linalg.norm(head.face[:2])
    left = np.array([-ahead[1], ahead[0], 0.0])
    centre = _on_skin(skin, head.at(0.36), left * side + [0, 0, 0.4])
    return ball(centre, EYE_M, "eye", "eye_deer", 6)


def _on_skin(skin: np.ndarray, inside: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return the centre (3,), m, of an eye on a ray from a point inside the head.

    The skin is at the mean distance of its vertices near the ray. The centre lies a third of the
    eye's first half axis below it.
    """
    way = skin - inside
    distances = np.linalg.norm(way, axis=1)
    towards = unit(np.asarray(direction, float))
    close = (distances < 0.15) & (way @ towards > 0.97 * distances)
    return inside + (distances[close].mean() - EYE_M[0] / 3) * towards


def _antler(head: _Head, side: int) -> list[Piece]:
    """Return the beam of one antler and its three tines."""
    root = head.nape + [-0.02, side * 0.035, 0.07]
    beam = [
        root,
        root + [-0.06, side * 0.07, 0.12],
        root + [-0.08, side * 0.17, 0.26],
        root + [0.0, side * 0.23, 0.40],
        root + [0.08, side * 0.20, 0.50],
    ]
    parts = [tube(beam, [0.018, 0.016, 0.014, 0.011, 0.004], "antler", "antler")]
    for start, way in (
        (beam[1], (0.13, 0, 0.08)),
        (beam[2], (0.15, side * 0.02, 0.10)),
        (beam[3], (-0.08, side * 0.06, 0.13)),
    ):
        bend = start + np.multiply(way, 0.6) + [0, 0, 0.01]
        tine = [start, bend, start + way]
        parts.append(tube(tine, [0.012, 0.009, 0.003], "antler", "antler"))
    return parts
