"""The rear of a passenger car: tail lamps, diffuser, exhausts and plate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..mesh.cutting import cut, polygon
from ..mesh.piece import lit
from ..mesh.primitives import box, tube
from .body import Body
from .car_shapes import Car
from .wheels import blank_plate, plate

if TYPE_CHECKING:
    from ..mesh.piece import Piece


def rear(b: Body, c: Car) -> None:
    """Cut tail lamps (tail, brake, indicator, reverse from outside to inside) and diffuser; add the
    attached parts.
    """
    half = c.width / 2
    back = (-1.0, 0.0, 0.0)
    u, ay, z, _ = b.at()
    shape = polygon(c.tail_lamp, 0.012)
    lens = b.take(
        "tail_lamp",
        "lamp_red",
        np.maximum(shape(ay, z), c.length - 0.30 - u),
        sunk=-0.006,
        rim="gloss_black",
    )
    (y0, y1), (z0, z1) = (
        (min(p[k] for p in c.tail_lamp), max(p[k] for p in c.tail_lamp)) for k in (0, 1)
    )
    tall = z1 - z0 > y1 - y0
    for s, tag in ((1, "left"), (-1, "right")):
        for kind, material, f0, f1 in (
            ("tail", "lamp_red", 0.06, 0.52),
            ("brake", "lamp_red", 0.56, 0.72),
            ("indicator_rear", "lamp_amber", 0.76, 0.88),
            ("reverse", "lamp_white", 0.91, 1.0),
        ):

            def band(part: Piece, f0: float = f0, f1: float = f1, s: int = s) -> list[np.ndarray]:
                """Return the values that are all below 0 within the lamp."""
                _, ay, z, y = b.at(part)
                t = (z1 - z) / (z1 - z0) if tall else (y1 - ay) / (y1 - y0)
                return [f0 - t, t - f1, shape(ay, z) + 0.014, -s * y]

            name = f"{kind}.{tag}"
            glow, rest, _ = cut(lens, np.max(band(lens), 0))
            # the wrapped side stays dark
            lamp = lit(glow.named(name, material), kind, back)
            if not len(lamp[0].faces):
                lens = b.refine(lens, band)
                glow, rest, _ = cut(lens, np.max(band(lens), 0))
                lamp = lit(glow.named(name, material), kind, back)
            b.parts = [p for p in b.parts if p is not lens] + [rest, *lamp]
            lens = rest
    u, ay, z, _ = b.at()
    low = c.clearance + 0.06
    diffuser = polygon(
        [(0, low), (half * 0.72, low), (half * 0.66, low + 0.13), (0, low + 0.13)], 0.02
    )
    b.take("diffuser", "plastic_black", np.maximum(diffuser(ay, z), c.length - 0.5 - u), sunk=0.01)
    for s in (1, -1):
        b.parts.append(
            box(
                (-c.length / 2 - 0.004, s * half * 0.74, low + 0.20),
                (0.02, 0.16, 0.035),
                "reflector",
                "reflector_red",
                0.008,
            )
        )
        if b.shell.coarse:
            continue
        b.parts.append(
            tube(
                [
                    (-c.length / 2 + 0.12, s * 0.52, low - 0.01),
                    (-c.length / 2 - 0.015, s * 0.52, low - 0.01),
                ],
                0.032,
                "exhaust",
                "steel",
                14,
            )
        )
    zp = max(0.60 * c.tail_lamp[0][1] + 0.13, 0.52)
    if b.shell.coarse:
        b.parts.append(blank_plate(-c.length / 2 - 0.034, zp))
    else:
        b.parts += plate(-c.length / 2 - 0.034, zp, -1, seed=3)
    edge = b.shell.upper[6 if c.open_roof else 5]
    zb = edge[1] - (0.0 if c.open_roof else 0.045)
    b.parts += lit(
        box(
            (c.length / 2 - edge[0] - 0.10, 0, zb + 0.012),
            (0.03, 0.26, 0.018),
            "brake.high",
            "lamp_red",
            0.006,
        ),
        "brake_high",
        back,
    )
