"""A city bus on the lofted shell."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ...lamps import lamp
from ..mesh.piece import Assembly
from ..mesh.primitives import box, tube
from .body import Body
from .headlamp import RoundLamp, round_lamp
from .panels import BACK, FRONT, Region, cut_region, mirrors
from .shell import Shell
from .wheels import Wheel, plate, wheel


def bus(
    name: str = "bus",
    length: float = 11.8,
    paint: str = "paint_yellow",
    lower: str = "paint_red",
    seed: int = 0,
) -> Assembly:
    """Return a city bus with its doors on the right.

    Parameters
    ----------
    name : name of the assembly.
    length : m.
    paint : name of the material of the upper body.
    lower : name of the material of the lower body.
    seed : of no effect: all buses of these measures are alike.
    """
    width = 2.52
    tyre = 0.48
    half = 1.26
    h = 3.05
    shell = Shell(
        length,
        width,
        (
            (0, 1.30),
            (0.04, 1.36),
            (0.24, 2.70),
            (0.50, 2.98),
            (0.8, h),
            (length - 0.6, h),
            (length - 0.12, 2.85),
            (length, 1.25),
        ),
        ((0, 1.18), (length, 1.18)),
        0.32,
        0.03,
        10.0,
        (0.32, 0.14, 0.84),
        (0.22, 0.12, 0.86),
        (0.05, 0.03),
        0.03,
        0.09,
        0.008,
    )
    axles = (2.65, length - 3.3)
    b = Body(shell, axles, tyre)
    cut_region(
        b,
        Region(
            "windscreen",
            "glass",
            [(0, 1.22), (1.10, 1.22), (1.08, 2.45), (0, 2.47)],
            "front",
            trim="gloss_black",
        ),
    )
    sign = cut_region(
        b,
        Region(
            "sign.front", "gloss_black", [(0, 2.56), (0.95, 2.56), (0.93, 2.80), (0, 2.80)], "front"
        ),
    )
    for k, y in enumerate(np.linspace(-0.72, 0.72, 9)):
        u, ay, z, yy = b.at(sign)
        if k % 4 != 1:
            _, sign = b.carve(
                sign,
                "sign",
                "lamp_amber",
                np.max(
                    [
                        np.abs(yy - y) - 0.05,
                        np.abs(z - 2.68) - 0.075,
                        0.030 - np.hypot(yy - y, z - 2.68 - 0.02 * (k % 3 - 1)),
                    ],
                    0,
                ),
                lamp("sign", FRONT),
            )
    doors = ((0.62, 1.72), (length * 0.46, length * 0.46 + 1.25))
    for k, (d0, d1) in enumerate(doors):
        mid = 0.5 * (d0 + d1)
        for a, c in ((d0 + 0.05, mid - 0.04), (mid + 0.04, d1 - 0.05)):
            cut_region(
                b,
                Region(
                    f"door{k}",
                    "glass_tinted",
                    [(a, 0.48), (c, 0.48), (c, 2.42), (a, 2.42)],
                    "right",
                    trim="gloss_black",
                    margin_m=0.045,
                ),
            )
    edges = np.linspace(1.95, length - 0.55, 8)
    for s in (1, -1):
        for a, c in pairwise(edges):
            if s < 0 and any(c > d0 - 0.1 and a < d1 + 0.1 for d0, d1 in doors):
                continue
            cut_region(
                b,
                Region(
                    "side_window",
                    "glass_tinted",
                    [(a + 0.05, 1.30), (c - 0.05, 1.30), (c - 0.05, 2.38), (a + 0.05, 2.38)],
                    ("left" if s > 0 else "right"),
                    trim="gloss_black",
                    margin_m=0.03,
                ),
            )
    cut_region(
        b,
        Region(
            "driver_window",
            "glass",
            [(0.50, 1.30), (1.80, 1.30), (1.80, 2.38), (0.62, 2.38)],
            "left",
            trim="gloss_black",
        ),
    )
    cut_region(
        b,
        Region(
            "rear_window",
            "glass_tinted",
            [(0, 1.62), (0.98, 1.62), (0.95, 2.45), (0, 2.45)],
            trim="gloss_black",
        ),
    )
    cut_region(
        b,
        Region(
            "engine_grille",
            "gap",
            [(0, 0.62), (0.60, 0.62), (0.60, 1.02), (0, 1.02)],
            trim="plastic_black",
        ),
    )
    for s, tag in ((1, "left"), (-1, "right")):
        for kind, y0, z0, r, mat in (
            ("low_beam", 0.93, 0.70, 0.085, "lamp_white"),
            ("position", 0.74, 0.70, 0.06, "lamp_white"),
            ("indicator_front", 1.09, 0.72, 0.045, "lamp_amber"),
        ):
            round_lamp(b, None, RoundLamp(kind, tag, (s * y0, z0), r, 0.02, mat))
        for kind, z0, mat in (
            ("tail", 0.80, "lamp_red"),
            ("brake", 0.98, "lamp_red"),
            ("indicator_rear", 1.16, "lamp_amber"),
            ("reverse", 0.63, "lamp_white"),
        ):
            u, ay, z, y = b.at()
            b.take(
                f"{kind}.{tag}",
                mat,
                np.maximum(np.hypot(y - s * 1.0, z - z0) - 0.075, length - 0.45 - u),
                sunk=-0.015,
                rim="plastic_black",
                lamp=lamp(kind, BACK),
            )
    u, _, z, _ = b.at()
    b.take("lower", lower, z - 0.98)
    lower_part = b.parts[-1]
    u, _, z, _ = b.at(lower_part)
    b.carve(lower_part, "bumper", "plastic_black", z - 0.46 + 9 * ((u > 0.4) & (u < length - 0.4)))
    # wheel houses are opened in the lower skin
    keep = b.paint
    b.paint = next(p for p in b.parts if p.name == "lower")
    b.parts = [p for p in b.parts if p is not b.paint]
    b.arches(0.07, 0.55)
    b.parts.append(b.paint)
    b.paint = keep
    m = Assembly(name).add(b.paint.named("body", paint), *b.parts, b.lining(1.0))
    x0 = length / 2
    rear_wheel = Wheel(tyre, 0.29, 0.58, style="steel")
    for k, a in enumerate(axles):
        for s in (1, -1):
            m.add(*wheel(rear_wheel, x0 - a, s * (half - 0.18), f"wheel{k}"))
    m.add(
        box((0, 0, 0.50), (length - 0.8, 2.3, 0.06), "floor", "underbody"),
        *plate(x0 + 0.04, 0.48, 1),
        *plate(-x0 - 0.035, 0.50, -1, seed=2),
    )
    for u in np.arange(2.6, length - 1.0, 0.85):
        for y in (0.85, 0.40, -0.85):
            if y < 0 and any(d0 - 0.4 < u < d1 + 0.4 for d0, d1 in doors):
                continue
            m.add(
                box((x0 - u, y, 1.15), (0.08, 0.42, 0.75), "seat.back", "seat", 0.03),
                box((x0 - u + 0.2, y, 0.88), (0.42, 0.42, 0.08), "seat", "seat", 0.03),
            )
    m.add(box((x0 - 0.75, 0, 1.08), (0.45, 2.1, 0.2), "dashboard", "interior", 0.05))
    mirrors(m, x0 - 0.05, half - 0.12, 2.1, (0.10, 0.20, 0.36))
    for y in (-0.25, 0.35):
        m.add(
            tube(
                [(x0 - 0.0, y, 1.25), (x0 - 0.03, y - 0.45, 1.62)],
                0.01,
                "wiper",
                "plastic_black",
                6,
            )
        )
    m.add(box((-1.5, 0, h + 0.10), (3.2, 1.7, 0.26), "roof_unit", "paint_white", 0.08))
    return m
