"""Bushes and hedges of `data/bushes.yaml`: leaves over an outline, and stems."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ...geometry.mesh.piece import Assembly, Piece, join, unit
from ...geometry.mesh.primitives import ball, box, tube
from ..ranges import drawn, generator, read
from ..thing import Detail, Thing
from .foliage import Leaves, fitted

FILE = "bushes.yaml"
GROUP = "bush"
# largest number of triangles of any bush or hedge
TRIANGLES: dict[Detail, int] = {"near": 40_000, "middle": 12_000, "far": 3_000}
MOST_LEAVES = 17_000
LOW = 1.7  # exponent that moves leaves towards the ground
UP = np.array([0.0, 0.0, 1.0])


def shares() -> dict[str, float]:
    """Return the bushes and hedges, each with its share."""
    return {family: ranges["share"] for family, ranges in read(FILE).items()}


def thing(family: str, variant: int) -> Thing:
    """Return a bush of a family. The same variant gives the same bush."""
    told = _told(family, variant)
    # the length of a hedge lies along x
    length = told["length_m"]
    width = told["width_m"]
    size = (round(length, 3), round(width, 3), round(told["height_m"], 3))
    return Thing(family, variant, "vegetation", size, GROUP)


def build(thing: Thing, detail: Detail) -> Assembly:
    """Return the mesh, centred in x and y on z = 0."""
    told = _told(thing.family, thing.variant)
    return fitted(_bush(told, thing.size_m, detail, thing.family), thing.size_m)


@lru_cache(maxsize=256)
def _told(family: str, variant: int) -> dict[str, Any]:
    rng = generator(family, variant)
    told: dict[str, Any] = drawn(read(FILE)[family], rng)
    told["seed"] = int(rng.integers(2**31))
    return told


def _bush(
    told: dict[str, Any], size_m: tuple[float, float, float], detail: Detail, name: str
) -> Assembly:
    rng = np.random.default_rng(told["seed"])
    half = np.array([size_m[0] / 2, size_m[1] / 2, size_m[2] / 2])
    colour = told["colours"][told["seed"] % len(told["colours"])]
    flowers = told.get("flowers", ())
    area = 8 * (half[0] * half[1] + half[1] * half[2] + half[0] * half[2]) * 0.7
    count = min(MOST_LEAVES, int(told["leaves"] * area))
    leaves = _leaves(told, half, count, rng)
    out = Assembly(name)
    flowering = round(told.get("flower_share", 0.0) * count)
    for material, part in (
        (colour, slice(flowering, None)),
        (flowers[told["seed"] % len(flowers)] if flowers else colour, slice(0, flowering)),
    ):
        if part == slice(0, 0):
            continue
        some = Leaves(
            leaves.centres[part],
            leaves.normals[part],
            leaves.along[part],
            told["leaf_m"],
            told["slim"],
        )
        out.add(some.piece("leaves" if material == colour else "flowers", material, detail))
    out.add(_shade(half, detail, bool(told.get("hedge"))))
    if told.get("stems"):
        out.add(_stems(told["stems"], half, detail, rng))
    return out


def _radius(d: np.ndarray, corner: float, lumps: float, waves: np.ndarray) -> np.ndarray:
    """Return the radii (n,) of the outline in directions `d` (n, 3), in units of the half axes."""
    smooth = (np.abs(d) ** corner).sum(1) ** (-1 / corner)
    return smooth * (1 - lumps * (0.5 + 0.5 * np.sin(d @ waves.T).mean(1)))


def _leaves(told: dict[str, Any], half: np.ndarray, count: int, rng: np.random.Generator) -> Leaves:
    # directions are uniform on each face of the box, and their number is proportional to its area
    faces = np.array([half[1] * half[2], half[0] * half[2], half[0] * half[1]])
    axis = rng.choice(3, count, p=faces / faces.sum())
    d = rng.uniform(-1, 1, (count, 3))
    d[np.arange(count), axis] = rng.choice([-1.0, 1.0], count)
    if told["corner"] < 4:
        d = unit(rng.normal(size=(count, 3)))
    # the same number of leaves in the lower half as in the upper
    d[:, 2] = 2 * np.abs(d[:, 2]) - 1
    waves = rng.normal(size=(6, 3)) * 4
    depth = 1 - 0.30 * rng.uniform(0, 1, count) ** 2 * (0.35 if told.get("hedge") else 1.0)
    r = _radius(d, told["corner"], told["lumps"], waves) * depth
    centres = d * r[:, None] * half + [0, 0, half[2]]
    if not told.get("hedge"):
        # a bush is widest at about a third of its height
        centres[:, 2] = 2 * half[2] * np.clip(centres[:, 2] / (2 * half[2]), 0, 1) ** LOW
    outward = unit(d * r[:, None] / half)
    normals = unit(outward + 0.6 * rng.normal(size=(count, 3)))
    along = 0.8 * rng.normal(size=(count, 3)) + 2.5 * told["upright"] * UP
    return Leaves(centres, normals, along, told["leaf_m"], told["slim"])


def _shade(half: np.ndarray, detail: Detail, hedge: bool) -> Piece:
    """Return the dark inside, which blocks the view through the bush."""
    if hedge:
        return box((0, 0, half[2]), 1.66 * half, "inside", "leaf_dark")
    rings = {"near": 12, "middle": 8, "far": 5}[detail]
    return ball((0, 0, 0.72 * half[2]), 0.60 * half, "inside", "leaf_dark", rings)


def _stems(count: int, half: np.ndarray, detail: Detail, rng: np.random.Generator) -> Piece:
    made = []
    for _ in range(count if detail == "near" else max(count // 3, 1)):
        a = rng.uniform(0, 2 * np.pi)
        out = np.array([np.cos(a), np.sin(a), 0.0]) * half
        middle = 0.25 * out + [0, 0, 0.6 * half[2]]
        end = rng.uniform(0.5, 0.8) * out + [0, 0, rng.uniform(1.1, 1.6) * half[2]]
        path = [0.08 * out, middle, end]
        made.append(tube(path, [0.022, 0.015, 0.006], "stem", "bark", 4, False))
    return join(made, "stem")
