"""Traffic lights: signals with a lamp for red, amber and green.

A signal faces +x, towards waiting traffic. Its three lamps are separate parts. The scene sets which
of them are on.
"""

from __future__ import annotations

import numpy as np

from ...geometry.mesh.piece import Assembly, Piece, shift
from ...geometry.mesh.primitives import box, lathe, tube
from ...lamps import KINDS
from ..thing import Detail, Thing
from .parts import families_of, numbers, shining

STATES = {
    "red": ("signal_red",),
    "red_amber": ("signal_red", "signal_amber"),
    "green": ("signal_green",),
    "amber": ("signal_amber",),
}
HEAD_M = (0.20, 0.32, 0.96)  # depth, width, height of the housing
LENS_M = 0.10  # radius of a lens
STEP_M = 0.31  # distance between the middles of two lenses
HOOD_M = 0.18  # length of a hood
POLE_M = 0.06  # radius of a pole
MAST_M = 0.12  # radius of a mast at its foot
COLOURS = (
    ("signal_red", "lamp_red"),
    ("signal_amber", "lamp_amber"),
    ("signal_green", "lamp_dark"),
)
FOOT_M = 0.3


def shares() -> dict[str, float]:
    """Return the families with their shares."""
    return families_of("traffic light")


def thing(family: str, variant: int) -> Thing:
    """Return a traffic light; its mesh is not built."""
    n, _ = numbers(family, variant)
    top = n["height_m"] + HEAD_M[2] / 2
    depth = HEAD_M[0] + HOOD_M
    if family == "signal_post":
        width = max(HEAD_M[1], 2 * POLE_M)
        return Thing(family, variant, "traffic light", (depth + 2 * POLE_M, width, top), _GROUP)
    width = n["reach_m"] + MAST_M + HEAD_M[1] / 2
    return Thing(family, variant, "traffic light", (depth + MAST_M, width, top), _GROUP)


_GROUP = "traffic light"


def pole_y_m(thing: Thing) -> float:
    """Return y of the pole in the coordinates of the thing, m. The arm of a mast reaches to the
    left.
    """
    return 0.0 if thing.family == "signal_post" else MAST_M - thing.size_m[1] / 2


def build(thing: Thing, detail: Detail) -> Assembly:
    """Return the mesh of a traffic light."""
    n, _ = numbers(thing.family, thing.variant)
    sides = {"near": 20, "middle": 12, "far": 8}[detail]
    height = n["height_m"]
    length = thing.size_m[0]
    out = Assembly(thing.family)
    if thing.family == "signal_post":
        pole_x = POLE_M - length / 2
        top = height + HEAD_M[2] / 2
        out.add(
            tube([(pole_x, 0, -FOOT_M), (pole_x, 0, top - 0.02)], POLE_M, "pole", "galvanised", 10)
        )
        return out.add(*_head((pole_x + POLE_M + HEAD_M[0] / 2, 0.0, height), sides))
    pole_x = MAST_M - length / 2
    pole_y = pole_y_m(thing)
    end_y = pole_y + n["reach_m"]
    path = [(pole_x, pole_y, height), (pole_x, end_y, height)]
    radii = [0.07, 0.05]
    out.add(
        tube(
            [(pole_x, pole_y, -FOOT_M), (pole_x, pole_y, height + 0.1)],
            [MAST_M, 0.09],
            "mast",
            "galvanised",
            12,
        ),
        tube(path, radii, "arm", "galvanised", 10),
    )
    return out.add(*_head((length / 2 - HOOD_M - HEAD_M[0] / 2, end_y, height), sides))


def _head(middle: tuple[float, float, float], sides: int) -> list[Piece]:
    """Return a housing with three lenses that face +x, and a hood over each."""
    x, y, z = middle
    front = x + HEAD_M[0] / 2
    pieces = [box(middle, HEAD_M, "housing", "plastic_black", 0.03, 2)]
    for k, (kind, material) in enumerate(COLOURS):
        at = shift(front + 0.004, y, z + STEP_M * (1 - k))
        lens = lathe([(LENS_M, 0.0), (1e-4, 0.0)], kind, material, sides, "x")
        hood = lathe(
            [(LENS_M + 0.012, 0.0), (LENS_M + 0.012, HOOD_M - 0.004)],
            "hood",
            "plastic_black",
            sides,
            "x",
            (-0.15 * np.pi, 1.15 * np.pi),
        )
        pieces += [
            shining(lens.moved(at), kind, (1.0, 0.0, 0.0), KINDS[kind].intensity_cd),
            hood.moved(at),
        ]
    return pieces
