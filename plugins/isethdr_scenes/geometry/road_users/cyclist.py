"""A bicycle and its rider."""

from __future__ import annotations

import numpy as np

from ...lamps import lamp
from ..mesh.piece import Assembly, Piece, shift, unit
from ..mesh.primitives import ball, box, lathe, tube
from .person import Person, figure
from .poses import two_bone

WHEEL_M = 0.335  # radius, tyre included
HUB_M = 0.022  # radius of a hub
SPOKES = 28  # number of spokes of each wheel
# joints of the frame, (3,) m; the wheels stand on y = 0
REAR_M = np.array([-0.45, 0, WHEEL_M])  # axles
FRONT_M = np.array([0.58, 0, WHEEL_M])
BRACKET_M = np.array([-0.02, 0, 0.285])  # bearing of the cranks
SEAT_M = np.array([-0.185, 0, 0.78])  # top of the seat tube
HEAD_M = np.array([0.385, 0, 0.86])  # top of the head tube
LOW_M = np.array([0.425, 0, 0.72])  # bottom of the head tube
CRANK_M = 0.17  # length of a crank
TUBE_M = 0.017  # radius of the tubes of the frame


def bicycle(
    colour: str = "paint_blue", crank: float = 35.0
) -> tuple[Assembly, list[np.ndarray], list[np.ndarray], np.ndarray]:
    """Return a bicycle with its wheels on y = 0, and the points where its rider touches it.

    Parameters
    ----------
    colour : name of the material of the frame.
    crank : angle of the left crank from straight ahead, upwards, degrees.

    Returns
    -------
    The bicycle; the pedals and the grips, left and right, and the saddle, each a point (3,), m.
    """
    model = Assembly("bicycle")
    model.add(*_wheel(REAR_M), _mudguard(REAR_M, np.linspace(0.35, 2.6, 24)))
    model.add(*_wheel(FRONT_M), _mudguard(FRONT_M, np.linspace(0.55, 2.2, 20)))
    model.add(*_frame(colour), *_fork(colour))
    grips = [np.array([0.29, side * 0.29, 1.02]) for side in (1, -1)]
    model.add(*_handlebar(*grips))
    saddle = SEAT_M + [-0.045, 0, 0.15]
    model.add(*_saddle(saddle), _chainring())
    pedals = []
    for side, turn in ((1, 0), (-1, np.pi)):
        angle = np.radians(crank) + turn
        end = BRACKET_M + [CRANK_M * np.cos(angle), side * 0.075, CRANK_M * np.sin(angle)]
        pedals.append(end + [0, side * 0.06, 0])
        model.add(*_crank_and_pedal(end, side))
    model.add(*_chain(), *_lamps())
    return model, pedals, grips, saddle


def _wheel(axle: np.ndarray) -> list[Piece]:
    """Return tyre, rim, hub and spokes."""
    turn = np.linspace(0, 2 * np.pi, 49)
    circle = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], 1)
    tyre = axle + (WHEEL_M - 0.018) * circle
    rim = axle + (WHEEL_M - 0.042) * circle
    return [
        tube(tyre, 0.019, "tyre", "tyre", 8, False),
        tube(rim, 0.011, "rim", "alloy", 6, False),
        tube([axle - [0, 0.05, 0], axle + [0, 0.05, 0]], HUB_M, "hub", "steel", 10),
        *(_spoke(axle, k) for k in range(SPOKES)),
    ]


def _spoke(axle: np.ndarray, k: int) -> Piece:
    """Return the k-th spoke. Even and odd spokes leave the hub at opposite slants."""
    angle = 2 * np.pi * k / SPOKES
    lean = angle + (1.3 if k % 2 else -1.3)
    root = HUB_M * np.array([np.cos(lean), 0, np.sin(lean)])
    flange = [0, 0.03 * (-1) ** (k // 2), 0]
    end = (WHEEL_M - 0.045) * np.array([np.cos(angle), 0, np.sin(angle)])
    return tube([axle + root + flange, axle + end], 0.0014, "spoke", "steel", 4, False)


def _mudguard(axle: np.ndarray, turn: np.ndarray) -> Piece:
    """Return a mudguard over a wheel; `turn` (n,) are its angles about the axle, radians."""
    arc = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], 1)
    return tube(axle + (WHEEL_M + 0.018) * arc, 0.016, "mudguard", "plastic_black", 6)


def _frame(colour: str) -> list[Piece]:
    """Return seat tube, down tube, top tube, head tube, seat post, and the stays of both sides."""
    below = [0, 0, 0.03]
    rows = [
        (BRACKET_M, SEAT_M, TUBE_M, colour),
        (BRACKET_M, LOW_M, 0.021, colour),
        (SEAT_M - below, HEAD_M - below, TUBE_M, colour),
        (HEAD_M + [-0.01, 0, 0.05], LOW_M + [0.01, 0, -0.03], 0.022, colour),
        (SEAT_M, SEAT_M + [-0.045, 0, 0.13], 0.013, "steel"),
    ]
    for side in (1, -1):
        drop_out = REAR_M + [0, side * 0.055, 0]
        rows += [
            (drop_out, BRACKET_M + [0, side * 0.03, 0], 0.009, colour),
            (drop_out, SEAT_M + [0, side * 0.018, -0.05], 0.009, colour),
        ]
    return [
        tube([start, end], radius, "frame", material, 10) for start, end, radius, material in rows
    ]


def _fork(colour: str) -> list[Piece]:
    """Return both blades of the fork, its crown, and the stem above it."""
    parts = []
    for side in (1, -1):
        blade = [
            LOW_M + [0.01, side * 0.045, -0.04],
            LOW_M + [0.05, side * 0.05, -0.12],
            FRONT_M + [0, side * 0.055, 0],
        ]
        parts.append(tube(blade, 0.012, "fork", colour))
    crown = [LOW_M + [0.005, -0.045, -0.04], LOW_M + [0.005, 0.045, -0.04]]
    stem = [HEAD_M, HEAD_M + [-0.03, 0, 0.13]]
    return [
        *parts,
        tube(crown, 0.015, "fork.crown", colour),
        tube(stem, 0.013, "stem", "plastic_black"),
    ]


def _handlebar(left: np.ndarray, right: np.ndarray) -> list[Piece]:
    """Return the handlebar and the grips at its ends `left` and `right` (3,), m."""
    bend = [0.37, 0.17, 1.02]
    clamp = HEAD_M + [-0.01, 0, 0.135]
    path = [left, bend, clamp, np.multiply(bend, [1, -1, 1]), right]
    return [
        tube(path, 0.012, "handlebar", "alloy"),
        tube([left, left + [0.07, -0.09, 0.0]], 0.017, "grip", "plastic_black"),
        tube([right, right + [0.07, 0.09, 0.0]], 0.017, "grip", "plastic_black"),
    ]


def _saddle(at: np.ndarray) -> list[Piece]:
    """Return the seat and the nose of the saddle."""
    return [
        ball(at + [-0.07, 0, 0], (0.10, 0.085, 0.032), "saddle", "leather", 8),
        ball(at + [0.06, 0, 0.0], (0.13, 0.032, 0.025), "saddle", "leather", 8),
    ]


def _chainring() -> Piece:
    profile = [(0.09, 0.045), (0.095, 0.048), (0.095, 0.052), (0.06, 0.052)]
    return lathe(profile, "chainring", "steel", 28).moved(shift(*BRACKET_M))


def _crank_and_pedal(end: np.ndarray, side: int) -> list[Piece]:
    """Return a crank to its outer end (3,), m, and the pedal there."""
    return [
        tube([BRACKET_M + [0, side * 0.06, 0], end], 0.011, "crank", "alloy"),
        box(end + [0, side * 0.055, 0], (0.09, 0.085, 0.022), "pedal", "plastic_black", 0.006),
    ]


def _chain() -> list[Piece]:
    """Return the upper and the lower run of the chain."""
    runs = []
    for z in (0.05, -0.05):
        path = [BRACKET_M + [0, -0.05, z * 1.8], REAR_M + [0, -0.05, z * 0.7]]
        runs.append(tube(path, 0.005, "chain", "steel", 5))
    return runs


def _lamps() -> list[Piece]:
    """Return the housing of the front lamp, its lens, and the rear lamp below the saddle."""
    housing = [HEAD_M + [0.05, 0, 0.03], HEAD_M + [0.11, 0, 0.03]]
    front = lathe([(0.028, 0), (0.001, 0.003)], "bike_front", "lamp_white", 14, "x")
    rear = lathe([(0.001, -0.003), (0.026, 0)], "bike_tail", "lamp_red", 14, "x")
    return [
        tube(housing, 0.032, "lamp.body", "plastic_black", 12),
        front.moved(shift(*HEAD_M + [0.113, 0, 0.03])).named(
            "bike_front", lamp=lamp("bike_front", (1.0, 0.0, 0.0))
        ),
        rear.moved(shift(*SEAT_M + [-0.075, 0, 0.02])).named(
            "bike_tail", lamp=lamp("bike_tail", (-1.0, 0.0, 0.0))
        ),
    ]


RIDER = Person(top="cloth_vest", legs="cloth_dark", helmet="paint_white", bands=True)


def rider(look: Person = RIDER, crank: float = 35.0, seed: int = 0) -> Assembly:
    """Return the rider of `bicycle(crank=crank)`, in the bicycle's coordinates.

    Parameters
    ----------
    look : build, skin and clothes.
    crank : angle of the left crank from straight ahead, upwards, degrees.
    seed : seed of the folds in the clothes.
    """
    _, pedals, grips, saddle = bicycle(crank=crank)
    pelvis = saddle + [0.0, 0, 0.085]
    up = unit(np.array([0.62, 0, 1]))
    j = {
        "pelvis": pelvis,
        "chest": pelvis + up * 0.40,
        "neck": pelvis + up * 0.56 + [0.0, 0, 0.0],
        "head": pelvis + up * 0.60 + [0.075, 0, 0.125],
    }
    for q, s in ((0, "l"), (1, "r")):
        w = 1 - 2 * q
        hip = pelvis + [0.01, w * 0.09, -0.02]
        ankle = pedals[q] + [-0.075, -w * 0.02, 0.105]
        knee = two_bone(hip, ankle, 0.43, 0.42, [1, w * 0.12, 0.2])
        sh = pelvis + up * 0.48 + [0, w * 0.178, 0]
        d = unit(grips[q] - sh)
        wrist = grips[q] - d * 0.02 + [-0.03, 0, 0.045]
        j |= {
            f"hip_{s}": hip,
            f"knee_{s}": knee,
            f"ankle_{s}": ankle,
            f"toe_{s}": ankle + [0.16, w * 0.01, -0.075],
            f"shoulder_{s}": sh,
            f"elbow_{s}": two_bone(sh, wrist, 0.30, 0.26, [-0.2, w * 0.6, -1]),
            f"wrist_{s}": wrist,
        }
    return figure(j, look, "rider", seed)
