"""Wheels, forks, mirrors, plates and lamps of motorcycles and scooters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...lamps import lamp_of_family
from ..mesh.piece import Piece, lit, shift
from ..mesh.primitives import ball, box, lathe, tube
from ..vehicles.wheels import plate

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

AHEAD = (1.0, 0.0, 0.0)
BEHIND = (-1.0, 0.0, 0.0)


def wheel(x: float, radius: float, width: float, spokes: int, wired: bool = False) -> list[Piece]:
    """Return a wheel that stands on z = 0: tyre, rim, spokes and two brake discs.

    Parameters
    ----------
    x : place of the axle ahead of the origin, m.
    radius : radius of the tyre, m.
    width : width of the tyre, m.
    spokes : number of cast spokes.
    wired : whether the wheel has 36 thin wire spokes in place of cast ones.
    """
    inner = radius - 0.62 * width
    angle = np.linspace(-0.35 * np.pi, 1.35 * np.pi, 15)
    mid = (radius + inner) / 2
    half = (radius - inner) / 2
    tyre = np.stack([mid + half * np.sin(angle), -width / 2 * np.cos(angle)], 1)
    tyre[:, 0] = np.minimum(tyre[:, 0], radius)
    rim = [(inner, -0.36 * width), (inner - 0.02, 0.0), (inner, 0.36 * width)]
    back = [(inner, 0.36 * width), (inner + 0.01, 0.0), (inner, -0.36 * width)]
    out = [
        lathe(tyre, "tyre", "tyre", 40),
        lathe(rim[::-1], "rim", "alloy", 40),
        lathe(back[::-1], "rim", "alloy", 40),
        tube([(0, -0.06, 0), (0, 0.06, 0)], 0.035, "hub", "steel", 12),
    ]
    for k in range(36 if wired else spokes):
        turn = 2 * np.pi * k / (36 if wired else spokes)
        to = inner * np.array([np.cos(turn), 0, np.sin(turn)])
        side = (0.03 if k % 2 else -0.03) if wired else 0.0
        out.append(tube([(0, side, 0), to], 0.0025 if wired else 0.016, "spoke", "alloy", 4, False))
    for side in (1, -1):
        disc = [(0.55 * inner, 0.004), (0.36 * inner, 0.004)]
        disc = disc + disc[::-1] + disc[:1]
        y = side * 0.06
        ring = [(0.62 * inner, 0.002), (0.34 * inner, 0.002), (0.34 * inner, -0.002)]
        ring = [*ring, (0.62 * inner, -0.002), (0.62 * inner, 0.002)]
        out.append(lathe(ring[::-1], "brake_disc", "steel", 28).moved(shift(0, y, 0)))
    return [piece.moved(shift(x, 0, radius)) for piece in out]


def fork(axle: np.ndarray, head: np.ndarray, spread: float, material: str) -> list[Piece]:
    """Return both legs of a fork, from the axle to the steering head, and the bridges between them.

    Parameters
    ----------
    axle : (3,) middle of the axle, m.
    head : (3,) lower end of the steering head, m.
    spread : distance of both legs, m.
    material : name of the material of the upper tubes.
    """
    axle = np.asarray(axle, float)
    head = np.asarray(head, float)
    out = []
    for side in (spread / 2, -spread / 2):
        low = axle + [0, side, 0]
        high = head + [0, side, 0]
        out.append(tube([low, (low + high) / 2], 0.028, "fork.slider", "steel", 10))
        out.append(tube([(low + high) / 2, high], 0.022, "fork", material, 10))
    bridge = head - 0.25 * (head - axle)
    for at in (head, bridge):
        out.append(box(at, (0.05, spread + 0.06, 0.035), "fork.bridge", "plastic_black", 0.01))
    return out


def guard(
    x: float, z: float, radius: float, width: float, turn: tuple[float, float], material: str
) -> Piece:
    """Return a mudguard about an axle.

    Parameters
    ----------
    x : place of the axle ahead of the origin, m.
    z : height of the axle, m.
    radius : radius of the guard, m.
    width : width of the guard, m.
    turn : first and last angle of the guard from straight ahead, upwards, radians.
    material : name of the material.
    """
    half = width / 2
    profile = [(radius - 0.02, -half), (radius + 0.004, -0.7 * half), (radius + 0.012, 0.0)]
    profile += [(radius + 0.004, 0.7 * half), (radius - 0.02, half)]
    profile += [(r - 0.008, h) for r, h in reversed(profile)]
    profile.append(profile[0])
    # the lathe turns from up (z) to ahead (x)
    return lathe(
        profile, "mudguard", material, 20, turn=(np.pi / 2 - turn[1], np.pi / 2 - turn[0])
    ).moved(shift(x, 0, z))


def mirrors(x: float, half: float, z: float) -> list[Piece]:
    """Return both mirrors on stalks that are 0.16 m high.

    Parameters
    ----------
    x : distance of the mirrors' middles ahead of the origin, m.
    half : distance of the middles from the plane of symmetry, m.
    z : height of the middles, m.
    """
    out = []
    for side in (1, -1):
        at = np.array([x, side * half, z])
        out.append(
            tube([at + [0.06, -side * 0.05, -0.16], at], 0.006, "mirror.arm", "plastic_black", 6)
        )
        out.append(ball(at, (0.022, 0.07, 0.045), "mirror", "plastic_black", 8))
        out.append(
            lathe([(0.001, -0.003), (0.04, 0)], "mirror.glass", "chrome", 14, "x").moved(
                shift(*(at + [-0.020, 0, 0]))
            )
        )
    return out


def head_lamp(at: np.ndarray, radius: float, housing: str) -> list[Piece]:
    """Return a round headlamp with a position lamp below its middle.

    Parameters
    ----------
    at : (3,) middle of the lens, m.
    radius : radius of the lens, m.
    housing : name of the material of the housing.
    """
    at = np.asarray(at, float)
    bowl = [(0.3 * radius, -0.9 * radius), (radius, -0.25 * radius), (1.08 * radius, 0.0)]
    lens = [(radius, 0.0), (0.001, 0.006)]
    low = lathe(lens, "low_beam", "lamp_white", 24, "x").moved(shift(*at))
    small = lathe([(0.22 * radius, 0.0), (0.001, 0.002)], "position", "lamp_white", 12, "x")
    small = small.moved(shift(*(at + [0.012, 0, -0.8 * radius])))
    return [
        lathe(bowl, "headlamp.housing", housing, 24, "x").moved(shift(*at)),
        low.named("low_beam", lamp=lamp_of_family("low_beam", AHEAD, "dipped_r112_b")),
        small.named("position", lamp=lamp_of_family("position", AHEAD, "front_position")),
    ]


def rear_lamps(at: ArrayLike, width: float = 0.16) -> list[Piece]:
    """Return a tail lamp above a brake lamp in one housing; `at` (3,), m, is the middle of its
    back.
    """
    at = np.asarray(at, float)
    out = [box(at + [0.03, 0, 0], (0.06, width, 0.07), "tail.housing", "gloss_black", 0.02)]
    lenses = (
        ("tail", "motorcycle_rear_position", 0.0, 0.018),
        ("brake", "motorcycle_stop", 0.0, -0.014),
    )
    for kind, family, y, z in lenses:
        lens = box(at + [-0.002, y, z], (0.012, 0.8 * width, 0.024), kind, "lamp_red", 0.005)
        front, back = lit(lens, kind, BEHIND)
        out += [front.named(kind, lamp=lamp_of_family(kind, BEHIND, family)), back]
    return out


def indicators(front: tuple[float, float, float], rear: tuple[float, float, float]) -> list[Piece]:
    """Return four indicators on stalks; `front` and `rear` are the places (x, y, z), m, of the left
    ones.
    """
    out = []
    for at, kind, axis, family in (
        (front, "indicator_front", AHEAD, "indicator_front"),
        (rear, "indicator_rear", BEHIND, "motorcycle_indicator_rear"),
    ):
        for side, tag in ((1, "left"), (-1, "right")):
            place = np.array(at) * [1, side, 1]
            root = place * [1, 0.35, 1]
            out.append(tube([root, place], 0.008, "indicator.arm", "plastic_black", 6))
            lens = ball(place, (0.026, 0.03, 0.022), f"{kind}.{tag}", "lamp_amber", 8)
            bright, back = lit(lens, kind, axis)
            out += [
                bright.named(bright.name, lamp=lamp_of_family(kind, axis, family)),
                back.named(back.name, "plastic_black"),
            ]
    return out


def rear_plate(x: float, z: float, seed: int) -> list[Piece]:
    """Return the licence plate.

    Parameters
    ----------
    x : distance of its middle ahead of the origin, m.
    z : height of its middle, m.
    seed : seed of the glyphs.
    """
    return plate(x, z, -1, (0.20, 0.16), 4, seed)
