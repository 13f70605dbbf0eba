"""Fittings of a passenger car: mirrors, handles, rails and wipers; seats and dashboard."""

from __future__ import annotations

import numpy as np

from ..mesh.piece import Assembly, shift
from ..mesh.primitives import box, lathe, tube
from .body import Body
from .car_shapes import Car

ROWS_M = (0.36, 1.22, 2.08)  # seats behind the top of the windscreen


def fittings(model: Assembly, b: Body, c: Car) -> None:
    """Add mirrors, door handles, roof rails, wipers and aerial.

    Parameters
    ----------
    model : assembly that gets the parts.
    b : body of the car.
    c : measures, styles and paint.
    """
    coarse = b.shell.coarse
    x0 = c.length / 2
    half = c.width / 2
    cowl = c.roof[2]
    top = c.roof[3]
    um = cowl[0] + 0.36
    zm = float(b.belt(um)) + 0.10
    for s in (1, -1):
        yb = s * half
        model.add(
            box(
                (x0 - um, yb + s * 0.06, zm),
                (0.14, 0.21, 0.14),
                "mirror",
                f"paint_{c.paint}",
                0.062,
                5,
            ),
            tube(
                [(x0 - um + 0.01, yb - s * 0.10, zm - 0.085), (x0 - um, yb + s * 0.02, zm - 0.045)],
                0.022,
                "mirror.arm",
                "plastic_black",
            ),
        )
        if not coarse:
            glass = (x0 - um - 0.069, yb + s * 0.06, zm)
            model.add(box(glass, (0.006, 0.15, 0.09), "mirror.glass", "chrome", 0.002))
        handles = 1 if c.panel or c.two_doors else 2
        for d in (c.doors[1] - 0.16, c.doors[2] - 0.14)[: 0 if coarse else handles]:
            model.add(
                tube(
                    [
                        (x0 - d + 0.10, s * (half - 0.018), float(b.belt(d)) - 0.085),
                        (x0 - d + 0.07, s * (half + 0.012), float(b.belt(d)) - 0.085),
                        (x0 - d - 0.07, s * (half + 0.012), float(b.belt(d)) - 0.085),
                        (x0 - d - 0.10, s * (half - 0.018), float(b.belt(d)) - 0.085),
                    ],
                    0.014,
                    "handle",
                    "chrome",
                )
            )
        if c.rails:
            u = np.linspace(top[0] + 0.15, c.roof[5][0] - 0.05, 12)
            roof = b.tops_at(u, s * half * 0.66)
            model.add(
                tube(
                    [
                        (
                            x0 - k,
                            s * half * 0.66,
                            roof[i] + (0.028 if 0 < i < 11 else -0.02),
                        )
                        for i, k in enumerate(u)
                    ],
                    0.016,
                    "rail",
                    "alloy",
                )
            )
        if coarse:
            continue
        y = s * 0.38
        wz = lambda u: float(b.upper(u)) + 0.022
        model.add(
            tube(
                [
                    (x0 - cowl[0] - 0.07, y, wz(cowl[0] + 0.07) - 0.01),
                    (x0 - cowl[0] - 0.13, y - 0.50, wz(cowl[0] + 0.13) - 0.005),
                ],
                0.008,
                "wiper",
                "plastic_black",
                6,
            )
        )
    if c.aerial and not c.panel and not coarse:
        model.add(
            tube(
                [
                    (x0 - c.roof[5][0] + 0.02, 0, c.roof[5][1] - 0.02),
                    (x0 - c.roof[5][0] - 0.10, 0, c.roof[5][1] + 0.10),
                ],
                [0.018, 0.004],
                "aerial",
                "plastic_black",
            )
        )


def interior(model: Assembly, b: Body, c: Car) -> None:
    """Add dashboard, steering wheel, seats and floor.

    Parameters
    ----------
    model : assembly that gets the parts.
    b : body of the car.
    c : measures, styles and paint.
    """
    x0 = c.length / 2
    cowl = c.roof[2]
    top = c.roof[3]
    belt = float(b.belt(top[0]))
    n = 1 if b.shell.coarse else 3  # steps of rounded edges
    rows = [top[0] + 0.42] if c.panel else [top[0] + k for k in ROWS_M[: c.rows]]
    model.add(
        box(
            (x0 - cowl[0] - 0.22, 0, belt - 0.05),
            (0.5, c.width * 0.82, 0.16),
            "dashboard",
            "interior",
            0.06,
        ),
        lathe(
            [(0.175, 0.012), (0.19, 0), (0.175, -0.012), (0.16, 0), (0.175, 0.012)],
            "steering_wheel",
            "plastic_black",
            24,
            "x",
        ).moved(shift(x0 - top[0] + 0.12, 0.37, belt + 0.04)),
    )
    for u in rows:
        for y in (0.37, -0.37):
            if x0 - u - 0.1 < -c.length / 2 + 0.35:
                continue
            model.add(
                box(
                    (x0 - u - 0.14, y, belt - 0.12),
                    (0.16, 0.48, 0.62),
                    "seat.back",
                    "seat",
                    0.07,
                    n,
                ),
                box(
                    (x0 - u + 0.12, y, belt - 0.42),
                    (0.52, 0.50, 0.16),
                    "seat.cushion",
                    "seat",
                    0.06,
                    n,
                ),
                box(
                    (x0 - u - 0.17, y, belt + 0.27),
                    (0.10, 0.25, 0.17),
                    "seat.head",
                    "seat",
                    0.045,
                    n,
                ),
            )
    model.add(
        box(
            (x0 - c.length * 0.52, 0, c.clearance + 0.10),
            (c.length * 0.72, c.width * 0.8, 0.05),
            "floor",
            "underbody",
        )
    )
