"""The front of a passenger car: grille, headlamps, intake and plate."""

from __future__ import annotations

import numpy as np

from ...lamps import lamp
from ..mesh.cutting import polygon
from ..mesh.piece import shift
from ..mesh.primitives import lathe, tube
from .body import Body
from .car_shapes import Car
from .headlamp import RoundLamp, round_lamp
from .wheels import plate

NARROW_M = 0.88  # half the width


def front(b: Body, c: Car):
    """Cut grille, headlamps (see `headlamp`), position lamps, intake and fog lamps; add badge and
    plate.
    """
    half = c.width / 2
    nose = c.roof[0][1]
    ahead = lambda u, lim=0.5: u - lim
    wide, high = c.grille
    z1 = nose - 0.035
    z0 = nose - (0.035 + high)
    u, ay, z, _ = b.at()
    grille = polygon(
        [(0, z0 - 0.02), (wide - 0.07, z0 - 0.02), (wide, z1 - 0.02), (0, z1 - 0.02)], 0.012
    )
    v = np.maximum(grille(ay, z), ahead(u))
    ring = b.take("grille.frame", "chrome", v - 0.014)
    u, ay, z, _ = b.at(ring)
    b.carve(ring, "grille", "gap", grille(ay, z))
    for k in range(4):
        zk = z0 + 0.005 + k * 0.034 * high / 0.13
        b.parts.append(
            tube(
                [
                    (c.length / 2 + 0.012 - 0.10 * y * y, y, zk)
                    for y in np.linspace(-(wide - 0.03), wide - 0.03, 9)
                ],
                0.006,
                "grille.bar",
                "chrome",
                6,
            )
        )
    closer = max(0.0, NARROW_M - half)  # the lamps of a narrow car lie nearer to its middle
    outline = polygon(
        [
            (0.50 - closer, z0 + 0.015),
            (0.72 - closer, z0 + 0.0),
            (half + 0.05, z0 + 0.06),
            (half + 0.05, z1 + 0.045),
            (0.74 - closer, z1 + 0.02),
            (0.50 - closer, z1 - 0.01),
        ],
        0.01,
    )
    u, ay, z, y = b.at()
    house = b.take(
        "headlamp.housing",
        "lamp_dark",
        np.maximum(outline(ay, z), ahead(u, 0.46)),
        sunk=0.008,
        rim="gloss_black",
    )
    mid = 0.5 * (z0 + z1) + 0.005
    for s, tag in ((1, "left"), (-1, "right")):
        for kind, material, yc, zc, r in (
            ("low_beam", "lamp_white", 0.70 - closer, mid + 0.012, 0.047),
            ("reflector", "chrome", 0.585 - closer, mid + 0.012, 0.043),
            ("indicator_front", "lamp_amber", half - 0.085, mid + 0.035, 0.034),
        ):
            shape = RoundLamp(kind, tag, (s * yc, zc), r, material=material)
            house = round_lamp(b, house, shape)
        u, ay, z, y = b.at(house)
        _, house = b.carve(
            house,
            f"position.{tag}",
            "lamp_white",
            np.max(
                [
                    np.abs(z - z0 - 0.028 - 0.20 * np.maximum(ay - 0.72 + closer, 0)) - 0.008,
                    0.52 - closer - ay,
                    ay - half + 0.07,
                    -s * y,
                ],
                0,
            ),
            lamp("position", (1.0, 0.0, 0.0)),
        )
    u, ay, z, _ = b.at()
    low = c.clearance + 0.05
    intake = polygon([(0, low), (0.52, low), (0.60, low + 0.10), (0, low + 0.12)], 0.015)
    b.take("intake", "gap", np.maximum(intake(ay, z), ahead(u)), sunk=0.02, rim="plastic_black")
    u, ay, z, _ = b.at()
    fog = polygon(
        [(0.66, low + 0.03), (0.80, low + 0.05), (0.80, low + 0.14), (0.68, low + 0.11)], 0.015
    )
    b.take("fog_bezel", "plastic_black", np.maximum(fog(ay, z), ahead(u)), sunk=0.012)
    zp = z0 - 0.125
    b.parts += plate(c.length / 2 + 0.034, zp, 1)
    b.parts.append(
        lathe([(0.001, 0.008), (0.040, 0.008), (0.046, 0)], "badge", "chrome", 20, "x").moved(
            shift(c.length / 2 + 0.028, 0, z1 - 0.06)
        )
    )
