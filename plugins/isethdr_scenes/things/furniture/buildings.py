"""Buildings: houses, apartment blocks, offices, shops and barns with lit windows.

The front of a building, with the door, faces +x. Walls reach below the ground, so that a building
stands on a slope without a gap.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...geometry.mesh.piece import Assembly
from ...lamps import KINDS
from ..thing import Detail, Thing
from .facades import Front, Openings, door, fronts, windows
from .parts import boxes, families_of, numbers
from .roofs import Roof, roof_pieces

GROUND_M = 0.6  # depth of the walls below the ground
SHOP_HEIGHT_M = 2.2
SHOP_SILL_M = 0.35
DOOR_M = (1.05, 2.1)
CHIMNEY_M = (0.6, 0.6, 0.7)  # depth, width, height above the ridge


def shares() -> dict[str, float]:
    """Return the families with their shares."""
    return families_of("building")


@lru_cache(maxsize=512)
def thing(family: str, variant: int) -> Thing:
    """Return a building; its mesh is not built."""
    n, roof = _plan(family, variant)
    top = roof.top_m + (CHIMNEY_M[2] if n["chimney"] else 0.0)
    size = (roof.depth_m + 2 * roof.reach_m, roof.width_m + 2 * roof.reach_m, top)
    return Thing(family, variant, "building", size, "building")


@lru_cache(maxsize=512)
def _plan(family: str, variant: int) -> tuple[dict, Roof]:
    n, _ = numbers(family, variant)
    n["floors"], n["bays"] = int(n["floors"]), int(n["bays"])
    walls = n["plinth_m"] + n["floors"] * n["floor_m"]
    kinds = n["roofs"].split()
    kind = kinds[variant % len(kinds)]
    return n, Roof(kind, n["depth_m"], n["bays"] * n["bay_m"], walls, n["slope"])


def build(thing: Thing, detail: Detail) -> Assembly:
    """Return the mesh of a building."""
    n, roof = _plan(thing.family, thing.variant)
    rng = np.random.default_rng([thing.variant, 1])
    walls = n["walls"].split()
    covers = n["covers"].split()
    wall = walls[int(rng.integers(len(walls)))]
    cover = covers[int(rng.integers(len(covers)))]
    size = (roof.depth_m, roof.width_m, roof.walls_m + GROUND_M)
    out = Assembly(thing.family).add(
        boxes((0, 0, (roof.walls_m - GROUND_M) / 2), size, "walls", wall),
        *roof_pieces(roof, cover, wall),
    )
    if n["chimney"]:
        deep, wide, above = CHIMNEY_M
        high = roof.top_m + above - roof.walls_m
        place = (0.0, 0.28 * roof.width_m, roof.walls_m + high / 2)
        out.add(boxes(place, (deep, wide, high), "chimney", "wall_brick"))
    for front in fronts(roof.depth_m, roof.width_m):
        main = front.name in ("front", "back")
        bays = n["bays"] if main else max(1, int(roof.depth_m / (1.6 * n["bay_m"])))
        out.add(*_front(front, n, bays, rng, detail))
    return out


def _front(front: Front, n: dict, bays: int, rng: np.random.Generator, detail: Detail) -> list:
    """Return windows and doors of one wall."""
    places = front.width_m * ((np.arange(bays) + 0.5) / bays - 0.5)
    first = n["plinth_m"] + n["floor_m"] * (np.arange(n["floors"]) + 0.52)
    column, row = np.meshgrid(np.arange(bays), np.arange(n["floors"]))
    column = column.ravel()
    row = row.ravel()
    lit = rng.random(len(column)) < (n["lit"] if front.name != "back" else 0.0)
    cd_m2 = float(rng.uniform(6.0, 16.0))
    pieces = []
    keep = np.ones(len(column), bool)
    if front.name == "front":
        entrance = bays // 2 if n["shop"] == 0 else 0
        width, height = (n["gate_m"], 0.8 * n["floor_m"]) if n["gate_m"] else DOOR_M
        if n["gate_m"]:
            keep &= np.abs(places[column]) > n["gate_m"] / 2 + 0.8
            pieces.append(door(front, 0.0, width, height, "wood"))
        else:
            keep &= ~((row == 0) & (column == entrance))
            pieces.append(door(front, float(places[entrance]), width, height, "wood"))
        if n["shop"]:
            shop = np.arange(bays) != entrance
            keep &= row > 0
            middle = np.full(int(shop.sum()), SHOP_SILL_M + SHOP_HEIGHT_M / 2)
            panes = Openings(
                places[shop],
                middle,
                0.88 * front.width_m / bays,
                SHOP_HEIGHT_M,
                np.full(int(shop.sum()), bool(rng.random() < 0.8)),
                "shop_window",
                KINDS["shop_window"].intensity_cd * float(rng.uniform(0.5, 1.5)),
            )
            band = front.size(0.96 * front.width_m, 0.45, 0.24)
            above = front.at(0.0, SHOP_SILL_M + SHOP_HEIGHT_M + 0.32, 0.05)
            boards = ("metal_red", "metal_green", "metal_grey", "wood")
            material = boards[int(rng.integers(len(boards)))]
            pieces += [*windows(front, panes, detail), boxes(above, band, "board", material)]
    openings = Openings(
        places[column][keep],
        first[row][keep],
        min(n["window_m"], 0.8 * front.width_m / bays),
        n["glass_m"],
        lit[keep],
        cd_m2=cd_m2,
    )
    return pieces + windows(front, openings, detail)
