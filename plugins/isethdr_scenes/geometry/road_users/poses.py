"""Joints of a pedestrian, and the elbow or knee of a limb with given ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..mesh.piece import unit

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def walk(phase: float = 0.12, stride: float = 26.0, arms: float = 24.0) -> dict[str, np.ndarray]:
    """Return the joints (3,), m, of a walker 1.76 m tall, by name.

    The left and the right side are half a cycle apart; arms swing against the legs.

    Parameters
    ----------
    phase : phase of the gait; 0 to 1 is one full cycle.
    stride : largest angle of the thighs from the vertical, degrees.
    arms : largest angle of the arms from the vertical, degrees.
    """
    # the angles th, shin, ar and fore are measured from straight down, positive forwards
    a = 2 * np.pi * phase
    j = {
        "pelvis": np.array([0, 0, 0.93]),
        "chest": np.array([0.025, 0, 1.32]),
        "neck": np.array([0.03, 0, 1.48]),
        "head": np.array([0.055, 0, 1.635]),
    }
    for s, tag, k in ((1, "l", 0), (-1, "r", np.pi)):
        hip = np.array([0, s * 0.092, 0.90])
        th = np.radians(stride * np.cos(a + k) + 4)
        flex = np.radians(8 + 34 * max(0, -np.sin(a + k)) ** 1.5 + 10 * max(0, -np.cos(a + k)))
        knee = hip + 0.425 * np.array([np.sin(th), 0, -np.cos(th)])
        shin = th - flex
        ankle = knee + 0.415 * np.array([np.sin(shin), 0.0, -np.cos(shin)])
        toe = unit(
            np.array(
                [
                    np.cos(shin * 0.55),
                    s * 0.12,
                    np.sin(shin * 0.55) * 0.9 if shin < 0 else 0.18 * np.sin(shin),
                ]
            )
        )
        if shin < 0:
            toe[2] = -abs(toe[2])
        j |= {
            f"hip_{tag}": hip,
            f"knee_{tag}": knee,
            f"ankle_{tag}": ankle,
            f"toe_{tag}": ankle + 0.17 * unit(toe) - [0, 0, 0.045],
        }
        sh = np.array([0.02, s * 0.178, 1.405])
        ar = np.radians(arms * np.cos(a + k + np.pi))
        elbow = sh + 0.30 * np.array([np.sin(ar), s * 0.16, -np.cos(ar)])
        fore = ar + np.radians(22)
        j |= {
            f"shoulder_{tag}": sh,
            f"elbow_{tag}": elbow,
            f"wrist_{tag}": elbow + 0.25 * np.array([np.sin(fore), s * 0.02, -np.cos(fore)]),
        }
    return j


def two_bone(a: np.ndarray, b: np.ndarray, l1: float, l2: float, bend: ArrayLike) -> np.ndarray:
    """Return the middle joint (3,), m, of a limb of two bones from `a` to `b`, bent towards `bend`.

    If `b` is out of reach, the limb is almost straight.

    Parameters
    ----------
    a : (3,) first joint, m.
    b : (3,) last joint, m.
    l1 : length of the bone from `a`, m.
    l2 : length of the bone to `b`, m.
    bend : (3,) direction towards which the middle joint lies.
    """
    a = np.asarray(a, float)
    b = np.asarray(b, float)
    d = min(np.linalg.norm(b - a), 0.999 * (l1 + l2))
    t = unit(b - a)
    x = (l1 * l1 - l2 * l2 + d * d) / (2 * d)
    side = unit(np.asarray(bend, float) - t * (t @ bend))
    return a + t * x + side * np.sqrt(max(l1 * l1 - x * x, 0))
