"""Broadleaf trees and conifers of `data/trees.yaml`, through the seasons."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from ...geometry.mesh.piece import Assembly, Piece, join, unit
from ...geometry.mesh.primitives import Stem, ball, tubes
from ..ranges import drawn, generator, read
from ..thing import Detail, Thing
from .foliage import Leaves, fitted

FILE = "trees.yaml"
Season = Literal["spring", "summer", "autumn", "winter"]
# largest number of triangles of any tree; they are stored once per model
TRIANGLES: dict[Detail, int] = {"near": 42_000, "middle": 12_000, "far": 3_200}
TWIGS = 6  # number of twigs of a bough
CONIFER_TWIGS = 4  # the same of a conifer, which has more boughs
BARE = 9  # number of small twigs of each twig, on a tree without leaves
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Trees:
    """The trees of one season."""

    season: Season
    group: str

    def shares(self) -> dict[str, float]:
        """Return the species, each with its share."""
        return {species: ranges["share"] for species, ranges in read(FILE).items()}

    def thing(self, family: str, variant: int) -> Thing:
        """Return a tree of a species. The same variant gives the same tree."""
        told = _told(family, variant)
        height = told["height_m"]
        width = told["width"] * height
        size = (round(width, 3), round(width * told["oval"], 3), round(height, 3))
        return Thing(family, variant, "tree", size, self.group)

    def build(self, thing: Thing, detail: Detail) -> Assembly:
        """Return the mesh, centred in x and y on z = 0."""
        told = _told(thing.family, thing.variant)
        materials = told["colours"][self.season]
        material = materials[told["seed"] % len(materials)]
        fruit = told.get("fruit", {}).get(self.season, 0)
        return fitted(_tree(told, material, fruit, detail, thing.family), thing.size_m)


SUMMER = Trees("summer", "tree")
SPRING = Trees("spring", "spring tree")
AUTUMN = Trees("autumn", "autumn tree")
WINTER = Trees("winter", "winter tree")


@lru_cache(maxsize=256)
def _told(species: str, variant: int) -> dict[str, Any]:
    """Return the numbers of a tree."""
    rng = generator(species, variant)
    told: dict[str, Any] = drawn(read(FILE)[species], rng)
    told["oval"] = float(rng.uniform(0.9, 1.1))
    told["seed"] = int(rng.integers(2**31))
    return told


@dataclass(frozen=True)
class _Bough:
    path: np.ndarray  # (k, 3)
    radius: float


@dataclass(frozen=True)
class _Frame:
    """The wood of a tree."""

    trunk: _Bough
    boughs: list[_Bough]
    twigs: list[_Bough]


def _tree(told: dict[str, Any], material: str, fruit: int, detail: Detail, name: str) -> Assembly:
    rng = np.random.default_rng(told["seed"])
    trunk = _trunk(told, rng)
    boughs = _boughs(told, trunk, rng)
    frame = _Frame(trunk, boughs, _twigs(told, boughs, rng))
    bare = material == "none"
    bark = told["bark"][told["seed"] % len(told["bark"])]
    out = Assembly(name).add(tubes(_wood(told, frame, bare, detail, rng), "wood", bark))
    if not bare:
        leaves = _leaves(told, boughs, frame.twigs, rng)
        out.add(leaves.piece("leaves", material, detail))
        if fruit and detail != "far":
            out.add(_fruit(leaves.centres[:fruit]))
    return out


def _trunk(told: dict[str, Any], rng: np.random.Generator) -> _Bough:
    height = told["height_m"]
    t = np.linspace(0, 1, 8)
    bend = np.cumsum(rng.normal(size=(8, 2)) * (0.004 if told.get("conifer") else 0.010), 0)
    path = np.column_stack([bend * height, t * _leader(told) * height])
    path[0, :2] = 0
    return _Bough(path, told["trunk"] * height)


def _leader(told: dict[str, Any]) -> float:
    """Return the height of the trunk's end / height of the tree. Boughs form the top above it."""
    if told.get("conifer") or told["width"] < 0.25:
        return 0.97
    return 0.80


def _on(bough: _Bough, t: float) -> np.ndarray:
    at = t * (len(bough.path) - 1)
    i = min(int(at), len(bough.path) - 2)
    return bough.path[i] + (at - i) * (bough.path[i + 1] - bough.path[i])


def _boughs(told: dict[str, Any], trunk: _Bough, rng: np.random.Generator) -> list[_Bough]:
    """Return boughs from the trunk to the outline of the crown."""
    height = told["height_m"]
    count = told["boughs"]
    profile = np.asarray(told["profile"], float)
    reach = told["width"] * height / 2
    base = told["base"] * height
    out = []
    for k in range(count):
        u = (k + rng.uniform(0, 1)) / count
        radius = reach * np.interp(u, profile[:, 0], profile[:, 1]) * rng.uniform(0.82, 1.0)
        tip_z = base + u * (height - base) * 0.985
        start_z = max(tip_z - told["rise"] * radius, 0.55 * base)
        start_z = min(start_z, 0.985 * _leader(told) * height)
        azimuth = 2.39996 * k + rng.uniform(-0.4, 0.4)
        start = _on(trunk, start_z / (_leader(told) * height))
        away = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        tip = away * radius + UP * tip_z
        middle = 0.5 * (start + tip) - UP * told["sag"] * radius
        swerve = rng.normal(size=3) * 0.05 * radius
        path = _curve(start, middle + swerve, tip, 6)
        thick = told["trunk"] * height * (0.12 + 0.30 * radius / max(reach, 1e-6))
        out.append(_Bough(path, thick * (0.35 if told.get("conifer") else 1.0)))
    return out


def _curve(a: np.ndarray, b: np.ndarray, c: np.ndarray, points: int) -> np.ndarray:
    """Return points of a parabola from `a` to `c` that passes through `b` halfway."""
    t = np.linspace(0, 1, points)[:, None]
    return a * (1 - t) * (1 - 2 * t) + b * 4 * t * (1 - t) + c * t * (2 * t - 1)


def _twigs(told: dict[str, Any], boughs: list[_Bough], rng: np.random.Generator) -> list[_Bough]:
    conifer = bool(told.get("conifer"))
    twigs = CONIFER_TWIGS if conifer else TWIGS
    # one row per twig; this order keeps the random numbers of a tree the same
    drawn = [
        (
            rng.uniform(0, 1),
            rng.uniform(0.5, 1.1),
            rng.normal(),
            rng.uniform(0.7, 1.15),
            rng.uniform(0.3, 1.2),
        )
        for _ in range(len(boughs) * twigs)
    ]
    place, turn, lift, long, low = np.array(drawn).T[..., None]
    k = np.tile(np.arange(twigs), len(boughs))[:, None]
    paths = np.repeat([bough.path for bough in boughs], twigs, 0)
    ways = [bough.path[-1] - bough.path[0] for bough in boughs]
    length = np.repeat([np.linalg.norm(way) for way in ways], twigs)[:, None]
    way = np.repeat(unit(np.array(ways)), twigs, 0)
    side = unit(np.cross(way, UP) + 1e-9)
    t = 0.30 + 0.68 * (k + place) / twigs
    at = t * (paths.shape[1] - 1)
    first = np.minimum(at.astype(int), paths.shape[1] - 2)[:, 0]
    row = np.arange(len(paths))
    before = paths[row, first]
    start = before + (at - first[:, None]) * (paths[row, first + 1] - before)
    turn = np.where(k % 2, 1, -1) * turn
    lift = lift * (0.10 if conifer else 0.45)
    heading = unit(np.cos(turn) * way + np.sin(turn) * side + lift * UP)
    share = 0.42 - 0.26 * t if conifer else 0.55 - 0.30 * t
    reach = length * share * long
    hang = told["weep"] * (0.45 * reach + 0.10 * told["height_m"] * low)
    if conifer:
        hang = told["weep"] * reach
    middle = start + 0.5 * reach * heading - 0.25 * hang * UP
    tip = start + reach * heading * (1 - 0.5 * told["weep"]) - hang * UP
    tip[:, 2] = np.maximum(tip[:, 2], 0.5 * told["base"] * told["height_m"])
    curves = _curve(start[:, None], middle[:, None], tip[:, None], 4)
    radii = np.repeat([0.30 * bough.radius for bough in boughs], twigs)
    return [_Bough(path, radius) for path, radius in zip(curves, radii.tolist(), strict=True)]


def _wood(
    told: dict[str, Any], frame: _Frame, bare: bool, detail: Detail, rng: np.random.Generator
) -> list[Stem]:
    """Return trunk, boughs and twigs. A bare tree has more twigs, and a coarse one has fewer."""
    sides = {"near": (12, 5), "middle": (8, 4), "far": (5, 3)}[detail]
    least = 0.008 if bare else 0.003
    if told.get("conifer"):
        sides = (sides[0], 3)
    height = told["height_m"]
    radii = frame.trunk.radius * np.linspace(1, 0.12, len(frame.trunk.path))
    radii[0] *= 1.35
    wood = [Stem(frame.trunk.path, radii, sides[0])]
    steps = {"near": 1, "middle": 1, "far": 2}[detail]
    for bough in frame.boughs:
        path = bough.path[:: 2 * steps - 1] if detail == "near" else bough.path[[0, 3, 5]]
        taper = np.maximum(bough.radius * np.linspace(1, 0.25, len(path)), least)
        wood.append(Stem(path, taper, sides[1]))
    hidden = detail == "far" or (detail == "middle" and told.get("conifer"))
    if hidden and not bare:
        return wood
    for twig in frame.twigs if detail != "far" else frame.twigs[::2]:
        path = twig.path if detail == "near" else twig.path[[0, 3]]
        taper = np.maximum(twig.radius * np.linspace(1, 0.3, len(path)), least)
        wood.append(Stem(path, taper, 3))
        if bare and detail != "far":
            wood += _small_twigs(twig, height, BARE if detail == "near" else 3, least, rng)
    return wood


def _small_twigs(
    twig: _Bough, height: float, count: int, radius: float, rng: np.random.Generator
) -> list[Stem]:
    way = twig.path[-1] - twig.path[0]
    length = float(np.linalg.norm(way))
    made = []
    for _ in range(count):
        start = _on(twig, float(rng.uniform(0.25, 1.0)))
        heading = unit(unit(way) + 0.8 * rng.normal(size=3) + 0.2 * UP)
        end = start + heading * min(0.5 * length, 0.06 * height) * rng.uniform(0.6, 1.2)
        made.append(Stem([start, end], [radius, 0.6 * radius], 3))
    return made


def _leaves(
    told: dict[str, Any], boughs: list[_Bough], twigs: list[_Bough], rng: np.random.Generator
) -> Leaves:
    """Return the leaves around twigs and the outer parts of boughs, in random order."""
    count = told["leaves"]
    height = told["height_m"]
    bearers = [*twigs, *boughs]
    lengths = np.array([np.linalg.norm(b.path[-1] - b.path[0]) for b in bearers])
    lengths[len(twigs) :] *= 0.5
    pick = rng.choice(len(bearers), count, p=lengths / lengths.sum())
    t = np.sqrt(rng.uniform(0.04, 1.0, count))
    t[pick >= len(twigs)] = rng.uniform(0.45, 1.0, int((pick >= len(twigs)).sum()))
    ends = np.array([[b.path[0], b.path[len(b.path) // 2], b.path[-1]] for b in bearers])[pick]
    first = t[:, None] < 0.5
    w = np.where(first, 2 * t[:, None], 2 * t[:, None] - 1)
    at = np.where(
        first, (1 - w) * ends[:, 0] + w * ends[:, 1], (1 - w) * ends[:, 1] + w * ends[:, 2]
    )
    spread = np.clip(rng.normal(size=(count, 3)), -1.8, 1.8)  # keeps leaves close to the crown
    centres = at + spread * told["clump"] * height
    way = unit(ends[:, 2] - ends[:, 0])
    if told.get("conifer"):
        side = unit(np.cross(way, UP) + 1e-9) * rng.choice([-1.0, 1.0], count)[:, None]
        along = way + 0.9 * side + 0.25 * rng.normal(size=(count, 3))
        normals = 0.7 * UP + 0.6 * rng.normal(size=(count, 3))
    else:
        along = rng.normal(size=(count, 3)) - (0.4 + 2.2 * told["weep"]) * UP
        outward = unit(centres - UP * 0.5 * height * (1 + told["base"]))
        normals = 0.8 * rng.normal(size=(count, 3)) + 0.7 * UP + 0.6 * outward
    order = rng.permutation(count)
    return Leaves(centres[order], unit(normals)[order], along[order], told["leaf_m"], told["slim"])


def _fruit(centres: np.ndarray) -> Piece:
    return join([ball(c, (0.04, 0.04, 0.038), "fruit", "fruit_red", 4) for c in centres], "fruit")
