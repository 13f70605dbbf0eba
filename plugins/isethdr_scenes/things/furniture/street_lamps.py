"""Street lamps: mast arms, post tops and high masts, with luminaires that are tables of candela.

A mast arm reaches towards +x, over the road. Its pole stands at the rear end of its extent.
"""

from __future__ import annotations

import numpy as np

from ...geometry.mesh.piece import Assembly, Piece, pose, shift
from ...geometry.mesh.primitives import box, lathe, tube
from ...lamps import KINDS
from ..thing import Detail, Thing
from .parts import families_of, numbers, quads, shining, upright

POLE_RADIUS_M = 0.10
HEAD_LENGTH_M = 0.70
HEAD_HALF_HEIGHT_M = 0.07
LENS_M = (0.48, 0.20, 0.012)  # size of a lens along the arm and across it, and its height
FOOT_M = 0.3  # depth of a pole below the ground, for slopes
TILT_DEG = 5.0  # tilt of the axis of a luminaire towards the road
CAP_M = 0.26  # radius of a post top
CROWN_M = 0.75  # distance from the middle of a high mast to the outer end of its luminaires


def shares() -> dict[str, float]:
    """Return the families with their shares."""
    return families_of("street lamp")


def thing(family: str, variant: int) -> Thing:
    """Return a street lamp; its mesh is not built."""
    n, _ = numbers(family, variant)
    tall = n["height_m"]
    if family == "mast_arm":
        size = (POLE_RADIUS_M + n["reach_m"] + HEAD_LENGTH_M, 0.30, tall + HEAD_HALF_HEIGHT_M)
    elif family == "post_top":
        size = (2 * CAP_M, 2 * CAP_M, tall + 0.10)
    else:
        size = (2 * CROWN_M, 2 * CROWN_M, tall + 0.3)
    return Thing(family, variant, "street lamp", size, "street lamp")


def build(thing: Thing, detail: Detail) -> Assembly:
    """Return the mesh of a street lamp."""
    n, _ = numbers(thing.family, thing.variant)
    sides = {"near": 12, "middle": 8, "far": 5}[detail]
    make = {"mast_arm": _mast_arm, "post_top": _post_top, "high_mast": _high_mast}
    return make[thing.family](n, sides)


def pole_x_m(thing: Thing) -> float:
    """Return x of the pole in the coordinates of the thing, m."""
    if thing.family == "mast_arm":
        return POLE_RADIUS_M - thing.size_m[0] / 2
    return 0.0


def _pole(tall: float, foot: float, top: float, sides: int) -> list[Piece]:
    return [
        tube([(0, 0, -FOOT_M), (0, 0, 1.0)], foot, "base", "galvanised", sides),
        tube([(0, 0, 1.0), (0, 0, tall)], [0.8 * foot, top], "pole", "galvanised", sides),
    ]


def _mast_arm(n: dict, sides: int) -> Assembly:
    tall = n["height_m"]
    reach = n["reach_m"]
    t = np.linspace(0, np.pi / 2, max(4, sides // 2))
    rise = min(0.9, reach)
    arm = np.stack([reach * (1 - np.cos(t)), 0 * t, tall - rise + rise * np.sin(t)], 1)
    out = Assembly("mast_arm").add(
        *_pole(tall - rise, 0.095, 0.05, sides),
        box((-0.09, 0, 0.65), (0.02, 0.10, 0.32), "hatch", "steel"),
        tube(arm, 0.038, "arm", "galvanised", sides),
        box(
            (reach + HEAD_LENGTH_M / 2 - 0.05, 0, tall),
            (HEAD_LENGTH_M + 0.1, 0.30, 2 * HEAD_HALF_HEIGHT_M),
            "head",
            "metal_grey",
            0.05,
            2,
        ),
        _lens((reach + 0.36, 0, tall - HEAD_HALF_HEIGHT_M - 0.004), "street_road", 0.0, "lens"),
    )
    return upright(out, -(reach + HEAD_LENGTH_M - POLE_RADIUS_M) / 2)


def _post_top(n: dict, sides: int) -> Assembly:
    tall = n["height_m"]
    ring = lathe(
        [(0.20, 0.0), (0.07, 0.0)], "lens", "lamp_white", max(8, 2 * sides), "z", (2 * np.pi, 0)
    )
    tilt = np.radians(TILT_DEG)
    return Assembly("post_top").add(
        *_pole(tall, 0.07, 0.045, sides),
        lathe(
            [(0.0, tall - 0.02), (CAP_M, tall - 0.02), (CAP_M, tall + 0.04), (0.0, tall + 0.10)],
            "cap",
            "metal_grey",
            2 * sides,
            "z",
        ),
        shining(
            ring.moved(shift(0, 0, tall - 0.025)),
            "street_post_top",
            (np.sin(tilt), 0, -np.cos(tilt)),
            _candela("street_post_top"),
        ),
    )


def _high_mast(n: dict, sides: int) -> Assembly:
    tall = n["height_m"]
    out = Assembly("high_mast").add(
        *_pole(tall, 0.20, 0.09, sides),
        tube([(0, 0, tall), (0, 0, tall + 0.3)], 0.09, "tip", "galvanised", sides),
    )
    for k in range(4):
        turn = pose(yaw=90.0 * k)
        head = box((0.45, 0, tall), (0.6, 0.34, 0.14), f"head{k}", "metal_grey", 0.04, 2)
        lens = _lens((0.47, 0, tall - 0.074), "street_high_mast", 15.0, f"lens{k}")
        out.add(head.moved(turn), lens.moved(turn))
    return out


def _candela(kind: str) -> float:
    return KINDS[kind].intensity_cd


def _lens(centre: tuple[float, int, float], kind: str, outwards_deg: float, name: str) -> Piece:
    """Return a lens that faces down, with its beam tilted towards +x.

    Parameters
    ----------
    centre : middle of the lens, m.
    kind : kind of lamp.
    outwards_deg : tilt of the beam, degrees; it is at least `TILT_DEG`.
    name : name of the piece.
    """
    x, y, z = centre
    half_x = LENS_M[0] / 2
    half_y = LENS_M[1] / 2
    corners = [
        (x - half_x, y - half_y, z),
        (x - half_x, y + half_y, z),
        (x + half_x, y + half_y, z),
        (x + half_x, y - half_y, z),
    ]
    angle = np.radians(max(outwards_deg, TILT_DEG))
    axis = (np.sin(angle), 0.0, -np.cos(angle))
    return shining(quads([corners], name, "lamp_white"), kind, axis, _candela(kind))
