"""Wheels and licence plates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from ..mesh.piece import Piece, mirrored, shift
from ..mesh.primitives import box, flat_grids, lathe, sharp_boxes

HOLES = 8  # number of holes in a steel rim


@dataclass(frozen=True)
class Wheel:
    """Tyre and rim."""

    radius_m: float  # radius of the tyre
    width_m: float  # width of the tyre
    rim: float = 0.66  # radius of the rim / radius of the tyre
    spokes: int = 5  # number of forked spokes of an alloy rim
    style: Literal["alloy", "steel"] = "alloy"


def wheel(shape: Wheel, x: float, y: float, name: str = "wheel") -> list[Piece]:
    """Return the parts of a wheel that stands on z = 0, its face towards +y (-y if y < 0).

    Parameters
    ----------
    shape : tyre and rim.
    x, y : position of its middle, m.
    name : first part of the names of the parts.
    """
    pose = np.eye(4)
    pose[:3, 3] = x, y, shape.radius_m
    return [part.moved(pose).named(f"{name}.{part.name}") for part in _parts(shape, y < 0)]


@lru_cache(maxsize=4)  # the wheels of one vehicle are equal
def _parts(shape: Wheel, right: bool) -> tuple[Piece, ...]:
    """Return the parts of a wheel about the origin, its face towards +y, or -y if `right`."""
    if right:
        return tuple(mirrored(part) for part in _parts(shape, False))
    half_width = shape.width_m / 2
    rim_radius = shape.radius_m * shape.rim
    if shape.style == "steel":
        face = _steel_face(rim_radius, half_width)
    else:
        face = _alloy_face(rim_radius, half_width, shape.spokes)
    return (_tyre(shape.radius_m, rim_radius, half_width), _barrel(rim_radius, half_width), *face)


def _tyre(radius: float, rim_radius: float, half_width: float) -> Piece:
    """Return the tyre.

    Parameters
    ----------
    radius : radius of its tread, m.
    rim_radius : radius of the rim that carries it, m.
    half_width : half its width, m.
    """
    wall_radius = rim_radius + 0.25 * (radius - rim_radius)
    outer = [  # profile of one half from the rim to the tread: radius, distance from the middle
        (rim_radius, half_width * 0.82),
        (wall_radius, half_width),
        (radius - 0.035, half_width * 0.96),
        (radius - 0.008, half_width * 0.78),
        (radius, half_width * 0.5),
    ]
    inner = [(r, -y) for r, y in outer]
    return lathe([*inner, *reversed(outer)], "tyre", "tyre", 40)


def _barrel(rim_radius: float, half_width: float) -> Piece:
    """Return the cylinder of the rim; lengths as in `_tyre`."""
    profile = [
        (rim_radius, half_width * 0.82),
        (rim_radius * 1.0, half_width * 0.92),
        (rim_radius * 0.93, half_width * 0.88),
        (rim_radius * 0.9, half_width * 0.2),
        (rim_radius * 0.88, -half_width * 0.8),
    ]
    return lathe(profile, "barrel", "alloy", 40)


def _steel_face(rim_radius: float, half_width: float) -> list[Piece]:
    """Return the pressed disc of a steel rim, and its holes; lengths as in `_tyre`."""
    profile = [
        (rim_radius * 0.92, half_width * 0.3),
        (rim_radius * 0.8, half_width * 0.5),
        (rim_radius * 0.55, half_width * 0.05),
        (rim_radius * 0.5, half_width * 0.35),
        (rim_radius * 0.3, half_width * 0.4),
        (0.001, half_width * 0.4),
    ]
    hole = lathe([(0.13 * rim_radius, 0), (0.001, 0.004)], "hole", "gap", 12)
    angles = 2 * np.pi * np.arange(HOLES) / HOLES
    places = [
        (np.sin(a) * 0.7 * rim_radius, half_width * 0.3, np.cos(a) * 0.7 * rim_radius)
        for a in angles
    ]
    return [lathe(profile, "disc", "steel", 32), *(hole.moved(shift(*p)) for p in places)]


def _alloy_face(rim_radius: float, half_width: float, spokes: int) -> list[Piece]:
    """Return brake, spokes and hub of an alloy rim.

    Parameters
    ----------
    rim_radius : radius of the rim, m.
    half_width : half the width of the tyre, m.
    spokes : number of forked spokes.
    """
    brake = [(rim_radius * 0.90, -half_width * 0.1), (0.001, -half_width * 0.1)]
    disc = [(rim_radius * 0.62, half_width * 0.15), (0.2 * rim_radius, half_width * 0.15)]
    hub = [
        (rim_radius * 0.24, half_width * 0.5),
        (rim_radius * 0.22, half_width * 0.72),
        (rim_radius * 0.16, half_width * 0.78),
        (0.001, half_width * 0.8),
    ]
    return [
        lathe(brake, "brake", "lamp_dark", 32),
        lathe(disc, "brake_disc", "steel", 32),
        _spokes(spokes, rim_radius, half_width),
        lathe(hub, "hub", "alloy", 20),
    ]


def _spokes(count: int, rim_radius: float, half_width: float) -> Piece:
    """Return the spokes of a rim. Each forked spoke has two branches.

    Parameters
    ----------
    count : number of forked spokes.
    rim_radius : outer radius of the rim, m.
    half_width : half the width of the tyre, m.
    """
    along = np.linspace(0.12, 0.95, 6)
    low = np.array([0, -0.28 * half_width, 0])
    rings = []
    for number in range(count):
        for fork in (-0.11, 0.11):
            angles = 2 * np.pi * number / count + fork * along * 1.3
            sine = np.sin(angles)
            cosine = np.cos(angles)
            centres = np.stack(
                [
                    sine * along * rim_radius,
                    half_width * (0.62 + 0.22 * along),
                    cosine * along * rim_radius,
                ],
                -1,
            )
            across = np.stack([cosine, 0 * angles, -sine], -1)
            half = across * (0.055 + 0.02 * along)[:, None] * rim_radius
            sides = [
                centres - half + low,
                centres - half * 0.75,
                centres + half * 0.75,
                centres + half + low,
            ]
            rings.append(np.stack(sides, 1))
    return flat_grids(np.array(rings), "spoke", "alloy", close_v=True)


def plate(
    x: float,
    z: float,
    facing: int,
    size_m: tuple[float, float] = (0.52, 0.112),
    ink: int = 7,
    seed: int = 0,
) -> list[Piece]:
    """Return a licence plate with random dark glyphs.

    Parameters
    ----------
    x, z : position of its middle, m.
    facing : +1 (front) or -1 (rear).
    size_m : width and height, m.
    ink : number of glyphs.
    seed : seed of the glyphs.
    """
    width = size_m[0]
    rng = np.random.default_rng(seed)
    centres = []
    sizes = []
    face_x = x + facing * 0.007
    for y in (np.arange(ink) - (ink - 1) / 2) * width / (ink + 1.5):
        for dy, dz, stroke_width, stroke_height in (
            (-0.018, 0, 0.011, 0.07),
            (0.018, 0, 0.011, 0.07),
            (0, 0.03, 0.036, 0.011),
            (0, 0, 0.036, 0.011),
            (0, -0.03, 0.036, 0.011),
        ):
            if rng.random() < 0.7:
                centres.append((face_x, y + dy, z + dz))
                sizes.append((0.003, stroke_width, stroke_height))
    glyphs = sharp_boxes(np.array(centres), np.array(sizes), "plate.ink", "plate_ink")
    return [blank_plate(x, z, size_m), glyphs]


def blank_plate(x: float, z: float, size_m: tuple[float, float] = (0.52, 0.112)) -> Piece:
    """Return a licence plate without glyphs.

    Parameters
    ----------
    x, z : position of its middle, m.
    size_m : width and height, m.
    """
    return box((x, 0, z), (0.012, *size_m), "plate", "plate_white", 0.004)
