"""Shapes of passenger cars as data: four sets of the same parameters. All lengths are in metres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Front:
    """Shapes of the front of a passenger car."""

    grille: Literal["bars", "mesh", "kidney", "shield", "closed"] = "bars"
    headlamp: Literal["swept", "slim", "tall", "round"] = "swept"
    # place of the daytime running lamps: none, at the upper edge of the headlamp (brow), at its
    # inner end (hook), or in the bumper
    daytime: Literal["none", "brow", "hook", "bumper"] = "none"


@dataclass(frozen=True)
class Car:
    """A passenger car. u is the distance from the front end; profiles are ((u, z), ...).

    `roof` has eight points: nose, hood front, cowl, windscreen top, roof top, roof rear, rear
    window base, tail.
    """

    length: float
    width: float
    wheelbase: float
    overhang: float  # front end to front axle
    tyre: float  # radius
    clearance: float
    roof: tuple
    belt: tuple  # the shoulder line under the side windows
    doors: tuple  # u of front edge, middle post, rear edge
    glass_end: float  # u of the rear end of the side windows
    tail_lamp: tuple  # outline in (|y|, z)
    crown: float = 3.3  # exponent of the cabin's section; higher values are boxier
    lean: float = 0.36  # inward lean of the cabin, per metre of height
    cladding: float = 0.0  # height of dark sills and arches
    rails: bool = False  # roof rails
    panel: bool = False  # no windows behind the doors
    aerial: bool = True  # whether it has a roof aerial; a panel van has none
    two_doors: bool = False
    open_roof: bool = False  # no roof and no side windows behind the windscreen
    bed: float = 0.0  # depth of a bed, which reaches from the rear window base to the tail
    rows: int = 2  # number of rows of seats; a panel van has one
    grille: tuple = (0.43, 0.13)  # half width and height
    front: Front = Front()
    paint: str = "silver"
    spokes: int = 5
    step: float = 0.055  # spacing of the sections of the body; larger for cars that are far away


CARS = {
    "sedan": Car(
        length=4.66,
        width=1.82,
        wheelbase=2.75,
        overhang=0.90,
        tyre=0.325,
        clearance=0.17,
        roof=(
            (0, 0.66),
            (0.22, 0.73),
            (1.30, 0.945),
            (2.06, 1.37),
            (2.55, 1.44),
            (3.25, 1.385),
            (4.05, 1.085),
            (4.66, 1.02),
        ),
        belt=((0, 0.60), (0.3, 0.66), (1.25, 0.85), (2.6, 0.905), (4.0, 0.945), (4.66, 0.93)),
        doors=(1.34, 2.42, 3.46),
        glass_end=3.75,
        tail_lamp=((0.50, 0.80), (0.95, 0.82), (0.95, 0.95), (0.50, 0.93)),
    ),
    "hatchback": Car(
        length=4.08,
        width=1.77,
        wheelbase=2.55,
        overhang=0.82,
        tyre=0.315,
        clearance=0.17,
        roof=(
            (0, 0.68),
            (0.20, 0.76),
            (1.14, 0.97),
            (1.88, 1.41),
            (2.35, 1.485),
            (3.45, 1.43),
            (3.93, 1.04),
            (4.08, 0.98),
        ),
        belt=((0, 0.61), (0.3, 0.68), (1.1, 0.88), (2.4, 0.935), (3.5, 0.99), (4.08, 0.96)),
        doors=(1.18, 2.24, 3.16),
        glass_end=3.42,
        tail_lamp=((0.62, 0.80), (0.90, 0.80), (0.90, 1.0), (0.66, 1.0)),
        crown=3.4,
        paint="red",
        spokes=6,
    ),
    "suv": Car(
        length=4.55,
        width=1.87,
        wheelbase=2.68,
        overhang=0.90,
        tyre=0.36,
        clearance=0.22,
        roof=(
            (0, 0.83),
            (0.16, 0.93),
            (1.24, 1.10),
            (1.92, 1.58),
            (2.4, 1.665),
            (3.85, 1.60),
            (4.36, 1.13),
            (4.55, 1.06),
        ),
        belt=((0, 0.74), (0.3, 0.84), (1.2, 1.02), (2.6, 1.065), (3.9, 1.12), (4.55, 1.05)),
        doors=(1.28, 2.36, 3.34),
        glass_end=3.9,
        tail_lamp=((0.58, 0.92), (0.95, 0.92), (0.95, 1.09), (0.58, 1.07)),
        crown=3.8,
        lean=0.30,
        cladding=0.42,
        rails=True,
        paint="blue",
        spokes=7,
    ),
    "van": Car(
        length=4.95,
        width=1.92,
        wheelbase=3.08,
        overhang=0.90,
        tyre=0.335,
        clearance=0.19,
        roof=(
            (0, 0.80),
            (0.14, 0.93),
            (0.82, 1.14),
            (1.58, 1.82),
            (2.2, 1.93),
            (4.6, 1.91),
            (4.84, 1.55),
            (4.95, 1.0),
        ),
        belt=((0, 0.70), (0.3, 0.84), (0.9, 1.04), (2.4, 1.10), (4.4, 1.13), (4.95, 0.98)),
        doors=(1.0, 2.12, 3.3),
        glass_end=2.05,
        tail_lamp=((0.80, 0.85), (0.97, 0.85), (0.97, 1.35), (0.80, 1.35)),
        crown=5.5,
        lean=0.16,
        panel=True,
        paint="white",
        spokes=6,
    ),
}
