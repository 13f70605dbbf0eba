"""A bicycle and its rider."""

from __future__ import annotations

import numpy as np

from ...lamps import lamp
from ..mesh.piece import Assembly, shift, unit
from ..mesh.primitives import ball, box, lathe, tube
from .person import Person, figure
from .poses import two_bone


def bicycle(
    colour: str = "paint_blue", crank: float = 35.0
) -> tuple[Assembly, list[np.ndarray], list[np.ndarray], np.ndarray]:
    """Return (bicycle, pedals, grips, saddle) with the wheels on y = 0; `crank` in degrees; the
    last three are points (3,).
    """
    m = Assembly("bicycle")
    r = 0.335
    rear = np.array([-0.45, 0, 0.335])
    front = np.array([0.58, 0, 0.335])
    bb = np.array([-0.02, 0, 0.285])
    seat = np.array([-0.185, 0, 0.78])
    head = np.array([0.385, 0, 0.86])
    low = np.array([0.425, 0, 0.72])
    for c in (rear, front):
        a = np.linspace(0, 2 * np.pi, 49)
        ring = lambda q, h, c=c, a=a: c + np.stack([q * np.cos(a), h + 0 * a, q * np.sin(a)], 1)
        m.add(
            tube(ring(r - 0.018, 0), 0.019, "tyre", "tyre", 8, False),
            tube(ring(r - 0.042, 0), 0.011, "rim", "alloy", 6, False),
            tube([c - [0, 0.05, 0], c + [0, 0.05, 0]], 0.022, "hub", "steel", 10),
        )
        for k in range(28):
            t = 2 * np.pi * k / 28
            o = 0.022 * np.array(
                [np.cos(t + (1.3 if k % 2 else -1.3)), 0, np.sin(t + (1.3 if k % 2 else -1.3))]
            )
            m.add(
                tube(
                    [
                        c + o + [0, 0.03 * (-1) ** (k // 2), 0],
                        c + (r - 0.045) * np.array([np.cos(t), 0, np.sin(t)]),
                    ],
                    0.0014,
                    "spoke",
                    "steel",
                    4,
                    False,
                )
            )
        b = np.linspace(0.35, 2.6, 24) if c is rear else np.linspace(0.55, 2.2, 20)
        m.add(
            tube(
                c + np.stack([(r + 0.018) * np.cos(b), 0 * b, (r + 0.018) * np.sin(b)], 1),
                0.016,
                "mudguard",
                "plastic_black",
                6,
            )
        )
    tubes = [
        (bb, seat, 0.017),
        (bb, low, 0.021),
        (seat - [0.0, 0, 0.03], head - [0, 0, 0.03], 0.017),
        (head + [-0.01, 0, 0.05], low + [0.01, 0, -0.03], 0.022),
        (seat, seat + [-0.045, 0, 0.13], 0.013),
    ]
    tubes += [
        (rear + [0, s * 0.055, 0], e, 0.009)
        for s in (1, -1)
        for e in (bb + [0, s * 0.03, 0], seat + [0, s * 0.018, -0.05])
    ]
    for a, b, q in tubes:
        m.add(tube([a, b], q, "frame", colour if q != 0.013 else "steel", 10))
    for s in (1, -1):
        m.add(
            tube(
                [
                    low + [0.01, s * 0.045, -0.04],
                    low + [0.05, s * 0.05, -0.12],
                    front + [0, s * 0.055, 0],
                ],
                0.012,
                "fork",
                colour,
            )
        )
    m.add(
        tube(
            [low + [0.005, -0.045, -0.04], low + [0.005, 0.045, -0.04]], 0.015, "fork.crown", colour
        )
    )
    m.add(tube([head, head + [-0.03, 0, 0.13]], 0.013, "stem", "plastic_black"))
    grips = [np.array([0.29, s * 0.29, 1.02]) for s in (1, -1)]
    m.add(
        tube(
            [grips[0], [0.37, 0.17, 1.02], head + [-0.01, 0, 0.135], [0.37, -0.17, 1.02], grips[1]],
            0.012,
            "handlebar",
            "alloy",
        )
    )
    m.add(
        *[
            tube([g, g + [0.07, -s * 0.09, 0.0]], 0.017, "grip", "plastic_black")
            for g, s in zip(grips, (1, -1))
        ]
    )
    saddle = seat + [-0.045, 0, 0.15]
    m.add(
        ball(saddle + [-0.07, 0, 0], (0.10, 0.085, 0.032), "saddle", "leather", 8),
        ball(saddle + [0.06, 0, 0.0], (0.13, 0.032, 0.025), "saddle", "leather", 8),
    )
    m.add(
        lathe(
            [(0.09, 0.045), (0.095, 0.048), (0.095, 0.052), (0.06, 0.052)], "chainring", "steel", 28
        ).moved(shift(*bb))
    )
    pedals = []
    for s, k in ((1, 0), (-1, np.pi)):
        t = np.radians(crank) + k
        e = bb + [0.17 * np.cos(t), s * 0.075, 0.17 * np.sin(t)]
        pedals.append(e + [0, s * 0.06, 0])
        m.add(
            tube([bb + [0, s * 0.06, 0], e], 0.011, "crank", "alloy"),
            box(e + [0, s * 0.055, 0], (0.09, 0.085, 0.022), "pedal", "plastic_black", 0.006),
        )
    for z in (0.05, -0.05):
        m.add(
            tube([bb + [0, -0.05, z * 1.8], rear + [0, -0.05, z * 0.7]], 0.005, "chain", "steel", 5)
        )
    m.add(
        tube(
            [head + [0.05, 0, 0.03], head + [0.11, 0, 0.03]],
            0.032,
            "lamp.body",
            "plastic_black",
            12,
        ),
        lathe([(0.028, 0), (0.001, 0.003)], "bike_front", "lamp_white", 14, "x")
        .moved(shift(*head + [0.113, 0, 0.03]))
        .named("bike_front", lamp=lamp("bike_front", (1.0, 0.0, 0.0))),
        lathe([(0.001, -0.003), (0.026, 0)], "bike_tail", "lamp_red", 14, "x")
        .moved(shift(*seat + [-0.075, 0, 0.02]))
        .named("bike_tail", lamp=lamp("bike_tail", (-1.0, 0.0, 0.0))),
    )
    return m, pedals, grips, saddle


RIDER = Person(top="cloth_vest", legs="cloth_dark", helmet="paint_white", bands=True)


def rider(look: Person = RIDER, crank: float = 35.0, seed: int = 0) -> Assembly:
    """Return the rider of `bicycle(crank=crank)`, in the bicycle's coordinates.

    Parameters
    ----------
    look : build, skin and clothes.
    crank : angle of the pedals, degrees.
    seed : of folds in the clothes.
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
