"""A rigid truck: cab on the lofted shell, cargo box of plain parts."""

from __future__ import annotations

import numpy as np

from ..mesh.piece import Assembly, lit, pose
from ..mesh.primitives import box, grid, lathe, tube
from .body import Body
from .headlamp import RoundLamp, round_lamp
from .panels import BACK, Region, cut_region, mirrors
from .shell import Shell
from .wheels import Wheel, plate, wheel


def truck(
    name: str = "truck",
    box_length: float = 6.1,
    box_height: float = 2.45,
    paint: str = "paint_blue",
    box_paint: str = "box_white",
    stripe: str = "paint_orange",
) -> Assembly:
    """Return a rigid truck, 8.5 m long with the default box.

    Parameters
    ----------
    name : name of the assembly.
    box_length : length of the box, m.
    box_height : height of the box, m.
    paint : name of the material of the cab.
    box_paint : name of the material of the box.
    stripe : name of the material of the stripe on the box.
    """
    cab_len = 2.15
    width = 2.48
    tyre = 0.50
    total = cab_len + box_length + 0.25
    shell = Shell(
        cab_len,
        width,
        ((0, 1.62), (0.03, 1.66), (0.36, 2.70), (0.62, 2.84), (1.9, 2.90), (2.15, 2.86)),
        ((0, 1.50), (2.15, 1.52)),
        0.42,
        0.05,
        9.0,
        (0.30, 0.14, 0.86),
        (0.10, 0.06, 0.95),
        (0.05, 0.0),
        0.03,
        0.05,
        0.01,
    )
    b = Body(shell, (1.38,), tyre)
    half = width / 2
    cut_region(
        b,
        Region(
            "windscreen",
            "glass",
            [(0, 1.70), (1.03, 1.70), (0.97, 2.58), (0, 2.60)],
            "front",
            trim="gloss_black",
        ),
    )
    cut_region(
        b,
        Region(
            "side_window",
            "glass",
            [(0.42, 1.62), (1.52, 1.62), (1.52, 2.45), (0.58, 2.45)],
            "sides",
            sunk_m=0.006,
            trim="gloss_black",
        ),
    )
    cut_region(
        b,
        Region(
            "grille",
            "gap",
            [(0, 0.98), (0.72, 0.98), (0.78, 1.46), (0, 1.46)],
            "front",
            trim="chrome",
            margin_m=0.02,
        ),
    )
    for k in range(5):
        b.parts.append(
            tube(
                [
                    (cab_len / 2 + 0.016 - 0.05 * y * y, y, 1.02 + 0.10 * k)
                    for y in np.linspace(-0.74, 0.74, 9)
                ],
                0.016,
                "grille.bar",
                "plastic_black",
                6,
            )
        )
    bumper = cut_region(
        b,
        Region(
            "bumper", "plastic_black", [(0, 0.40), (1.3, 0.40), (1.3, 0.84), (0, 0.84)], "front"
        ),
    )
    for s, tag in ((1, "left"), (-1, "right")):
        for kind, y0, r, mat, z0 in (
            ("low_beam", 0.86, 0.075, "lamp_white", 0.64),
            ("position", 1.02, 0.055, "lamp_white", 0.64),
            ("indicator_front", 1.12, 0.036, "lamp_amber", 0.74),
        ):
            shape = RoundLamp(kind, tag, (s * y0, z0), r, 0.02, mat)
            bumper = round_lamp(b, bumper, shape)
    side = lambda p: np.max(
        [0.8 * half - b.at(p)[1], p.vertices[:, 2] - 2.55, 0.62 - p.vertices[:, 2]], 0
    )
    for d in (0.40, 1.62):
        b.line(lambda p, d=d: b.at(p)[0] - d, side)
    b.arches(0.07, 0.55)
    x_cab = total / 2 - cab_len / 2
    m = Assembly(name)
    cab = Assembly("cab").add(b.paint.named("cab", paint), *b.parts, b.lining(0.9))
    cab.add(
        box((0.25, 0, 1.50), (0.5, 2.1, 0.2), "dashboard", "interior", 0.06),
        lathe(
            [(0.21, 0.012), (0.23, 0), (0.21, -0.012), (0.19, 0), (0.21, 0.012)],
            "steering_wheel",
            "plastic_black",
            20,
            "x",
        ).moved(pose(0.05, 0.55, 1.68)),
    )
    for y in (0.55, -0.55):
        cab.add(
            box((-0.42, y, 1.65), (0.18, 0.52, 0.85), "seat.back", "seat", 0.07),
            box((-0.14, y, 1.30), (0.5, 0.52, 0.16), "seat.cushion", "seat", 0.06),
        )
    cab.add(*[q.moved(pose(cab_len / 2 + 0.02, 0, 0.0)) for q in plate(0, 0.60, 1)])
    mirrors(cab, 0.80, half, 2.05)
    for s in (1, -1):
        cab.add(
            *[
                box(
                    (cab_len / 2 - 1.0 - 0.0, s * (half - 0.05), 0.52 - 0.16 * k),
                    (0.5, 0.16, 0.03),
                    "step",
                    "steel",
                )
                for k in (0,)
            ]
        )
        cab.add(
            box(
                (-0.52, s * (half + 0.012), 1.45),
                (0.16, 0.02, 0.03),
                "handle",
                "plastic_black",
                0.008,
            )
        )
    m.add(*cab.moved(pose(x_cab)).parts)
    x0 = total / 2 - cab_len - 0.22
    x1 = -total / 2
    z0 = 1.02
    z1 = z0 + box_height
    mid = (total / 2 - cab_len - 0.22 - total / 2) / 2
    length = x0 - x1
    m.add(
        box((mid, 0, (z0 + z1) / 2), (length, 2.5, box_height), "cargo", box_paint, 0.03),
        box((mid, 0, z0 + 0.55), (length * 0.995, 2.512, 0.34), "stripe", stripe, 0.004),
    )
    for s in (1, -1):
        for x in np.linspace(x1 + 0.06, x0 - 0.06, 9):
            m.add(
                box(
                    (x, s * 1.253, (z0 + z1) / 2),
                    (0.035, 0.014, box_height - 0.1),
                    "rib",
                    box_paint,
                    0.005,
                )
            )
        for z in (z0 + 0.04, z1 - 0.03):
            m.add(box((mid, s * 1.245, z), (length + 0.01, 0.05, 0.08), "rail", "alloy", 0.01))
        for x in (x0 - 0.02, x1 + 0.02):
            m.add(
                box((x, s * 1.235, (z0 + z1) / 2), (0.07, 0.07, box_height), "post", "alloy", 0.012)
            )
        for k, x in enumerate(np.linspace(x1 + 0.5, x0 - 0.5, 4)):
            m.add(
                *lit(
                    box(
                        (x, s * 1.262, z0 - 0.02),
                        (0.10, 0.02, 0.05),
                        f"marker.{'left' if s > 0 else 'right'}{k}",
                        "lamp_amber",
                        0.008,
                    ),
                    "marker",
                    (0.0, float(s), 0.0),
                )
            )
        m.add(box((mid + 0.3, s * 0.40, 0.84), (length + 1.2, 0.09, 0.22), "chassis", "underbody"))
        for z in (0.55, 0.82):
            m.add(
                box((mid + 0.35, s * 1.19, z), (1.9, 0.03, 0.11), "side_guard", "galvanised", 0.01)
            )
        m.add(
            box(
                (x1 - 0.012, s * 0.62, z0 + box_height / 2),
                (0.02, 1.20, box_height - 0.12),
                "rear_door",
                box_paint,
                0.008,
            )
        )
        for y in (0.22, 0.95):
            m.add(
                tube(
                    [(x1 - 0.045, s * y, z0 + 0.1), (x1 - 0.045, s * y, z1 - 0.1)],
                    0.017,
                    "door_bar",
                    "steel",
                )
            )
        for k, (kind, mat) in enumerate(
            (
                ("indicator_rear", "lamp_amber"),
                ("brake", "lamp_red"),
                ("tail", "lamp_red"),
                ("reverse", "lamp_white"),
            )
        ):
            m.add(
                *lit(
                    box(
                        (x1 - 0.01, s * (1.12 - 0.13 * k), 0.84),
                        (0.05, 0.12, 0.12),
                        f"{kind}.{'left' if s > 0 else 'right'}",
                        mat,
                        0.012,
                    ),
                    kind,
                    BACK,
                )
            )
        m.add(
            box((x1 + 0.015, s * 0.92, 0.84), (0.05, 0.58, 0.17), "lamp_bar", "plastic_black", 0.01)
        )
        m.add(box((x1 + 1.0, s * 1.0, 0.52), (0.015, 0.48, 0.5), "mudflap", "plastic_black"))
        m.add(
            box(
                (x1 - 0.02, s * 0.75, z0 + 0.10),
                (0.012, 0.9, 0.07),
                "contour",
                "reflector_red",
                0.003,
            )
        )
    m.add(
        tube([(mid + 0.9, 1.0, 0.74), (mid + 1.75, 1.0, 0.74)], 0.27, "tank", "alloy", 24),
        box((x1 + 0.06, 0, 0.58), (0.10, 2.3, 0.14), "underrun", "galvanised", 0.02),
    )
    m.add(
        box((x1 - 0.02, 0, z0 + 0.02), (0.06, 2.44, 0.10), "rear_sill", "steel", 0.01),
        *plate(x1 - 0.02, 0.74, -1, seed=5),
    )
    front_wheel = Wheel(tyre, 0.30, 0.58, style="steel")
    rear_wheel = Wheel(tyre, 0.29, 0.58, style="steel")
    ax_f = total / 2 - 1.38
    ax_r = x1 + 1.75
    for s, tag in ((1, "left"), (-1, "right")):
        m.add(
            *wheel(front_wheel, ax_f, s * 1.08, f"wheel.front_{tag}"),
            *wheel(rear_wheel, ax_r, s * 1.06, f"wheel.rear_{tag}"),
            *wheel(rear_wheel, ax_r, s * 0.74, f"wheel.inner_{tag}"),
        )
        a = np.linspace(0.2, np.pi - 0.2, 14)
        guard = np.stack([ax_r + 0.60 * np.cos(a), 0 * a, tyre + 0.60 * np.sin(a)], 1)
        m.add(
            grid(
                np.stack([guard + [0, s * 0.65, 0], guard + [0, s * 1.24, 0]], 1),
                "mudguard",
                "plastic_black",
            )
        )
    return m
