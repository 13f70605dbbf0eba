"""Panels of guard rails, fences, walls and noise barriers.

Panels stand end to end along y, and face the road along +x.
"""

from __future__ import annotations

import numpy as np

from ...geometry.mesh.piece import Assembly, Piece
from ...geometry.mesh.primitives import grid
from ...geometry.surroundings.roadside import W_BEAM
from ..thing import Detail, Thing
from .parts import boxes, families_of, family_data, numbers

FOOT_M = 0.4  # depth of the posts below the ground
POST_M = 0.06
BEAM_DEPTH_M = 0.08
# depth (x) of a panel, m
DEPTH_M = {
    "guard_rail": BEAM_DEPTH_M + POST_M,
    "concrete_barrier": 0.60,
    "picket_fence": 0.10,
    "mesh_fence": 0.06,
    "garden_wall": 0.34,
    "noise_barrier": 0.24,
}
# New Jersey profile: half the width, and height, m
CONCRETE = ((0.30, -0.3), (0.30, 0.08), (0.12, 0.33), (0.08, 0.81))


def shares() -> dict[str, float]:
    """Return the families with their shares."""
    return families_of("barrier")


def thing(family: str, variant: int) -> Thing:
    """Return a panel; its mesh is not built. All panels of a variant have the same height."""
    n, _ = numbers(family, variant)
    size = (DEPTH_M[family], n["length_m"], n["height_m"])
    return Thing(family, variant, family_data(family)["category"], size, "barrier")


def build(thing: Thing, detail: Detail) -> Assembly:
    """Return the mesh of a panel."""
    _, length, height = thing.size_m
    make = {
        "guard_rail": _guard_rail,
        "concrete_barrier": _concrete,
        "picket_fence": _pickets,
        "mesh_fence": _mesh,
        "garden_wall": _wall,
        "noise_barrier": _noise,
    }[thing.family]
    return Assembly(thing.family).add(*make(length, height, detail))


def _posts(
    length: float, height: float, step: float, x: float, side: float, material: str
) -> Piece:
    """Return posts from below the ground to `height`, m, at even spacing along a panel."""
    count = max(1, round(length / step))
    y = length * ((np.arange(count) + 0.5) / count - 0.5)
    middle = np.stack([0 * y + x, y, 0 * y + (height - FOOT_M) / 2], 1)
    return boxes(middle, (side, side, height + FOOT_M), "post", material)


def _guard_rail(length: float, height: float, detail: Detail) -> list[Piece]:
    out, up = np.array(W_BEAM).T
    if detail == "far":
        out = out[[0, 2, 4, 5, 7, 9]]
        up = up[[0, 2, 4, 5, 7, 9]]
    back = -DEPTH_M["guard_rail"] / 2
    y = np.array([-length / 2, length / 2])
    along, outward = np.meshgrid(y, out, indexing="ij")
    points = np.stack([back + POST_M + outward, along, 0 * along + height - 0.155 + up], -1)
    beam = grid(points, "beam", "galvanised")
    pieces = [beam, _posts(length, height - 0.05, 2.0, back + POST_M / 2, POST_M, "galvanised")]
    if detail == "near":
        place = (back + POST_M + 0.03, 0.0, height - 0.155)
        pieces.append(boxes(place, (0.02, 0.06, 0.09), "reflector", "reflector_amber"))
    return pieces


def _concrete(length: float, height: float, detail: Detail) -> list[Piece]:
    half, up = np.array(CONCRETE).T
    up = np.where(up > 0.5, height, up)
    ring_x = np.r_[half, -half[::-1]]
    ring_z = np.r_[up, up[::-1]]
    y = np.array([-length / 2, length / 2])
    along, x = np.meshgrid(y, ring_x, indexing="ij")
    _, z = np.meshgrid(y, ring_z, indexing="ij")
    side = grid(np.stack([x, along, z], -1)[::-1], "barrier", "concrete", smooth=False)
    ends = boxes(
        [(0, s * (length / 2 - 0.01), height / 2 - 0.15) for s in (1, -1)],
        (0.15, 0.02, height + 0.3),
        "end",
        "concrete",
    )
    return [side, ends]


def _pickets(length: float, height: float, detail: Detail) -> list[Piece]:
    count = int(length / 0.14)
    y = length * ((np.arange(count) + 0.5) / count - 0.5)
    wide = 0.075 if detail != "far" else 0.10
    slats = boxes(
        np.stack([0 * y + 0.035, y, 0 * y + height / 2 + 0.03], 1),
        (0.03, wide, height - 0.06),
        "slat",
        "wood",
    )
    rails = boxes(
        [(0.0, 0, 0.25 * height), (0.0, 0, 0.8 * height)], (0.04, length, 0.07), "rail", "wood"
    )
    post = _posts(length, 0.95 * height, 2.4, -0.03, 0.04, "wood")
    return [slats, rails, post]


def _mesh(length: float, height: float, detail: Detail) -> list[Piece]:
    step = {"near": 0.05, "middle": 0.1, "far": 0.25}[detail]
    wire = {"near": 0.005, "middle": 0.008, "far": 0.012}[detail]
    count = int(length / step)
    y = length * ((np.arange(count) + 0.5) / count - 0.5)
    wires = np.stack([0 * y, y, 0 * y + height / 2], 1)
    z = np.linspace(0.05, height - 0.02, 7)
    return [
        boxes(wires, (wire, wire, height - 0.04), "wire", "metal_green"),
        boxes(np.stack([0 * z, 0 * z, z], 1), (0.012, length, 0.02), "rail", "metal_green"),
        _posts(length, height, 2.5, 0.0, 0.06, "metal_green"),
    ]


def _wall(length: float, height: float, detail: Detail) -> list[Piece]:
    low = -FOOT_M
    body = boxes(
        (0, 0, (height - 0.06 + low) / 2), (0.24, length, height - 0.06 - low), "wall", "wall_brick"
    )
    cap = boxes((0, 0, height - 0.03), (0.34, length, 0.06), "cap", "concrete")
    return [body, cap]


def _noise(length: float, height: float, detail: Detail) -> list[Piece]:
    count = max(3, int(height / 0.5))
    z = height * (np.arange(count) + 0.5) / count
    panels = boxes(
        np.stack([0 * z + 0.02, 0 * z, z], 1),
        (0.14, length - 0.2, 0.94 * height / count),
        "panel",
        "wood" if count % 2 else "metal_green",
    )
    core = boxes((0, 0, height / 2 - 0.2), (0.08, length - 0.1, height + 0.35), "core", "concrete")
    y = np.array([-length / 2 + 0.08, length / 2 - 0.08])
    post = np.stack([0 * y, y, 0 * y + (height - FOOT_M) / 2], 1)
    return [panels, core, boxes(post, (0.24, 0.16, height + FOOT_M), "post", "galvanised")]
