"""Patches of grass, and rocks, of `data/ground_cover.yaml`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ...geometry.mesh.cutting import cut
from ...geometry.mesh.piece import Assembly, unit, vertex_normals
from ...geometry.mesh.primitives import ball
from ...geometry.surroundings.plants import grass
from ..ranges import drawn, generator, read
from ..thing import Detail, Thing
from .foliage import SHOWN, Leaves, fitted

FILE = "ground_cover.yaml"
# largest number of triangles of any patch or rock
TRIANGLES: dict[Detail, int] = {"near": 7_000, "middle": 2_200, "far": 800}
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Grasses:
    """Patches of grass and reed, about 1 m across."""

    group: str = "grass"

    def shares(self) -> dict[str, float]:
        """Return the kinds of grass, each with its share."""
        return {family: ranges["share"] for family, ranges in read(FILE)["grass"].items()}

    def thing(self, family: str, variant: int) -> Thing:
        """Return a patch. The same variant gives the same patch."""
        told = _told("grass", family, variant)
        side = round(told["length_m"], 3)
        return Thing(family, variant, "vegetation", (side, side, told["height_m"]), self.group)

    def build(self, thing: Thing, detail: Detail) -> Assembly:
        """Return the mesh, centred in x and y on z = 0."""
        told = _told("grass", thing.family, thing.variant)
        return fitted(_patch(told, detail, thing.family), thing.size_m)


@dataclass(frozen=True)
class Rocks:
    """Rocks that lie on the ground."""

    group: str = "rock"

    def shares(self) -> dict[str, float]:
        """Return the kinds of rock, each with its share."""
        return {family: ranges["share"] for family, ranges in read(FILE)["rock"].items()}

    def thing(self, family: str, variant: int) -> Thing:
        """Return a rock. The same variant gives the same rock."""
        told = _told("rock", family, variant)
        length = told["length_m"]
        size = tuple(round(length * f, 3) for f in (1.0, told["narrow"], told["flat"]))
        return Thing(family, variant, "rock", (size[0], size[1], size[2]), self.group)

    def build(self, thing: Thing, detail: Detail) -> Assembly:
        """Return the mesh, centred in x and y on z = 0."""
        told = _told("rock", thing.family, thing.variant)
        return fitted(_rock(told, detail, thing.family), thing.size_m)


@lru_cache(maxsize=256)
def _told(kind: str, family: str, variant: int) -> dict[str, Any]:
    rng = generator(family, variant)
    told: dict[str, Any] = drawn(read(FILE)[kind][family], rng)
    told["seed"] = int(rng.integers(2**31))
    return told


def _patch(told: dict[str, Any], detail: Detail, name: str) -> Assembly:
    rng = np.random.default_rng(told["seed"])
    count = told["blades"]
    side = told["length_m"]
    height = told["height_m"]
    away = side / 2 * np.sqrt(rng.uniform(0, 1, count))
    azimuth = rng.uniform(0, 2 * np.pi, count)
    roots = np.column_stack([away * np.cos(azimuth), away * np.sin(azimuth), np.zeros(count)])
    shown = max(40, round(SHOWN[detail] * count))
    made = grass(roots[:shown], name, height, told["seed"], told["dry"])
    out = Assembly(name)
    for part in made.parts:
        material = told["material"] if part.material == "grass" else part.material
        # fewer blades are wider, so that the patch covers about the same area
        vertices = part.vertices.reshape(-1, 5, 3)
        wider = min(4.0, count / shown) ** 0.75
        sideways = (vertices[:, [0, 3]] - vertices[:, [1, 2]]) * (wider - 1) / 2
        vertices[:, [0, 3]] += sideways
        vertices[:, [1, 2]] -= sideways
        out.add(part.named(material, material))
    if "flowers" in told:
        flowers = told["flowers"][told["seed"] % len(told["flowers"])]
        out.add(_heads(roots, told["flower_share"], height, rng).piece("flowers", flowers, detail))
    if "plume" in told:
        plumes = _heads(roots, 0.25, 0.95 * height, rng, 0.22, 0.18)
        out.add(plumes.piece("plume", told["plume"], detail))
    return out


def _heads(
    roots: np.ndarray,
    share: float,
    height: float,
    rng: np.random.Generator,
    length_m: float = 0.035,
    slim: float = 0.9,
) -> Leaves:
    """Return flowers or plumes over some of the blades."""
    count = max(3, round(share * len(roots)))
    centres = roots[:count] + UP * height * rng.uniform(0.7, 1.0, (count, 1))
    upright = slim < 0.5
    along = (UP if upright else 0) + 0.3 * rng.normal(size=(count, 3))
    normals = (0.0 if upright else 1.0) * UP + rng.normal(size=(count, 3)) * 0.5
    return Leaves(centres, unit(normals), along, length_m, slim)


def _rock(told: dict[str, Any], detail: Detail, name: str) -> Assembly:
    """Return a rock: a ball cut by planes, with rounded edges and some noise."""
    rng = np.random.default_rng(told["seed"])
    normals = unit(rng.normal(size=(told["faces"], 3)))
    sides = np.concatenate([np.eye(3), -np.eye(3)])  # the last faces down and lies on the ground
    normals = np.concatenate([normals, sides])
    distances = np.append(rng.uniform(0.68, 0.95, told["faces"]), [0.9, 0.9, 0.8, 0.9, 0.9, 0.45])
    waves = rng.normal(size=(10, 3)) * 9
    phases = rng.uniform(0, 2 * np.pi, 10)
    rings = {"near": 36, "middle": 18, "far": 9}[detail]
    sphere = ball((0, 0, 0), (1, 1, 1), name, "rock", rings)
    d = unit(sphere.vertices)
    # a smooth minimum over the planes rounds the edges
    along = np.maximum(d @ normals.T, 1e-3) / distances
    radius = 1 / (along**9).sum(1) ** (1 / 9)
    radius *= 1 + told["rough"] * np.sin(d @ waves.T + phases).sum(1) / 2
    vertices = d * radius[:, None]
    material = told["materials"][told["seed"] % len(told["materials"])]
    stone = type(sphere)(
        name, vertices, sphere.faces, material, vertex_normals(vertices, sphere.faces)
    )
    out = Assembly(name)
    if told.get("moss"):
        level = stone.normals[:, 2] + 0.35 * np.sin(vertices @ waves[:4].T * 0.6).mean(1)
        moss, stone, _ = cut(stone, 0.45 - level)
        out.add(moss.named("moss", "moss"))
    return out.add(stone.named("stone", material))
