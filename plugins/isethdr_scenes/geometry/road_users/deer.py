"""Deer: implicit body with legs, neck, head, ears, tail and optional antlers."""

from __future__ import annotations

import numpy as np

from ..mesh.cutting import cut
from ..mesh.implicit import blend, cone, skin_of
from ..mesh.piece import Assembly, pose, unit
from ..mesh.primitives import ball, tube

EYE_M = (0.016, 0.015, 0.016)  # half axes; a third of the ball lies in the head
STRIDE_M = 0.16  # of its walk


def _on_skin(skin: np.ndarray, inside: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return where a ray from a point inside the head leaves it, less a third of an eye: the mean
    of the skin's vertices about that direction.
    """
    way = skin - inside
    distances = np.linalg.norm(way, axis=1)
    towards = unit(np.asarray(direction, float))
    close = (distances < 0.15) & (way @ towards > 0.97 * distances)
    return inside + (distances[close].mean() - EYE_M[0] / 3) * towards


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
    height : at the shoulder, m.
    antlers : whether it has them.
    head_up : 0 grazes, 1 looks up.
    turn : of the head to the left; 0 is straight ahead, 1 is 45 degrees.
    seed : of the coat.
    """
    trunk = [
        cone((0.38, 0, 0.80), (0.10, 0, 0.78), 0.165, 0.175),
        cone((0.10, 0, 0.78), (-0.36, 0, 0.83), 0.175, 0.165),
        cone((0.40, 0, 0.70), (0.30, 0, 0.66), 0.12, 0.13),
        cone((-0.40, 0, 0.84), (-0.48, 0, 0.78), 0.14, 0.11),
    ]
    top = np.array([0.74, 0.0, 1.28]) * head_up + np.array([0.98, 0, 0.52]) * (1 - head_up)
    top = top + [0, turn * 0.22, 0]
    d = np.array([0.22 - 0.04 * abs(turn), turn * 0.18, -0.07]) * head_up + np.array(
        [0.12, 0, -0.22]
    ) * (1 - head_up)
    trunk += [
        cone((0.42, 0, 0.88), 0.45 * np.array([0.42, 0, 0.88]) + 0.55 * top, 0.135, 0.080),
        cone(0.45 * np.array([0.42, 0, 0.88]) + 0.55 * top, top, 0.080, 0.062),
    ]
    head = [
        cone(top + [0, 0, 0.015], top + d * 0.4, 0.072, 0.060),
        cone(top + d * 0.4, top + d, 0.052, 0.033),
        cone(top + d, top + d * 1.12, 0.033, 0.026),
    ]
    legs = []
    hooves = []
    for x, y, s, fore in (
        (0.36, 0.085, 1, 1),
        (0.36, -0.085, -1, 1),
        (-0.42, 0.09, -1, 0),
        (-0.42, -0.09, 1, 0),
    ):
        k = s * STRIDE_M * 0.5
        if fore:
            pts = [
                (x, y, 0.70),
                (x + 0.02 + k * 0.4, y, 0.44),
                (x - 0.01 + k * 0.8, y * 0.9, 0.13),
                (x + 0.03 + k, y * 0.9, 0.035),
            ]
            rad = [0.085, 0.040, 0.026, 0.028]
        else:
            pts = [
                (x, y, 0.78),
                (x + 0.06 + k * 0.3, y, 0.56),
                (x - 0.10 + k * 0.7, y * 0.95, 0.40),
                (x - 0.04 + k, y * 0.9, 0.12),
                (x + k, y * 0.9, 0.035),
            ]
            rad = [0.125, 0.075, 0.036, 0.026, 0.028]
        legs += [cone(a, b, p, q) for a, b, p, q in zip(pts, pts[1:], rad, rad[1:])]
        hooves.append(
            ball(
                np.array(pts[-1]) + [0.018, 0, -0.008], (0.045, 0.028, 0.032), "hoof", "leather", 8
            )
        )
    coat = skin_of(blend(trunk + head + legs, 0.055, 0.004, seed), 0.014, "coat", "fur")
    skin = v = coat.vertices
    belly, coat, _ = cut(
        coat,
        np.max(
            [
                v[:, 2] - 0.655 - 0.02 * np.sin(9 * v[:, 0]),
                np.abs(v[:, 0] - 0.02) - 0.24,
                0.56 - v[:, 2],
            ],
            0,
        ),
    )
    v = coat.vertices
    rump, coat, _ = cut(coat, np.linalg.norm((v - [-0.60, 0, 0.80]) * [1, 1, 0.9], axis=1) - 0.125)
    v = coat.vertices
    nose, coat, _ = cut(coat, np.linalg.norm(v - top - d * 1.12, axis=1) - 0.034)
    v = coat.vertices
    shank, coat, _ = cut(coat, v[:, 2] - 0.30)
    m = Assembly(name).add(
        coat,
        belly.named("belly", "fur_pale"),
        rump.named("rump", "fur_pale"),
        nose.named("nose", "leather"),
        shank.named("shank", "fur_dark"),
        *hooves,
    )
    m.add(
        skin_of(
            blend([cone((-0.53, 0, 0.86), (-0.60, 0, 0.72), 0.035, 0.02)], 0.01),
            0.01,
            "tail",
            "fur_dark",
        )
    )
    ahead = d[:2] / np.linalg.norm(d[:2])
    side = np.array([-ahead[1], ahead[0], 0.0])  # left of the head
    for s in (1, -1):
        e = top + [-0.03, s * 0.05, 0.05]
        tip = e + np.array([-0.05, s * 0.13, 0.07])
        m.add(
            tube([e, 0.5 * (e + tip), tip], [0.022, 0.040, 0.006], "ear", "fur", 8),
            ball(
                _on_skin(skin, top + d * 0.36, side * s + [0, 0, 0.4]), EYE_M, "eye", "eye_deer", 6
            ),
        )
        if antlers:
            b = top + [-0.02, s * 0.035, 0.07]
            beam = [
                b,
                b + [-0.06, s * 0.07, 0.12],
                b + [-0.08, s * 0.17, 0.26],
                b + [0.0, s * 0.23, 0.40],
                b + [0.08, s * 0.20, 0.50],
            ]
            m.add(tube(beam, [0.018, 0.016, 0.014, 0.011, 0.004], "antler", "antler"))
            for i, t in (
                (1, (0.13, 0, 0.08)),
                (2, (0.15, s * 0.02, 0.10)),
                (3, (-0.08, s * 0.06, 0.13)),
            ):
                m.add(
                    tube(
                        [
                            beam[i],
                            np.array(beam[i]) + np.multiply(t, 0.6) + [0, 0, 0.01],
                            np.array(beam[i]) + t,
                        ],
                        [0.012, 0.009, 0.003],
                        "antler",
                        "antler",
                    )
                )
    k = height / 0.97
    return m.moved(pose(scale=(k, k, k)))
