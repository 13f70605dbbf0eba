"""Small things of a street: bollards, marker posts, bins, benches, stands for bicycles, cones."""

from __future__ import annotations

import numpy as np

from ...geometry.mesh.piece import Assembly, Piece, join
from ...geometry.mesh.primitives import box, grid, lathe, tube
from ..thing import Detail, Thing
from .parts import boxes, families_of, family_data, numbers, quads
from .waiting import bus_stop, bus_stop_size

FOOT_M = 0.2  # depth of things below the ground
SIDES: dict[Detail, int] = {"near": 18, "middle": 12, "far": 8}
HOOP_STEP_M = 0.8
HOOP_M = 0.8
HOOP_WIDTH_M = 0.05


def shares() -> dict[str, float]:
    """Return the families with their shares."""
    return families_of("furniture")


def thing(family: str, variant: int) -> Thing:
    """Return a small thing; its mesh is not built."""
    n, _ = numbers(family, variant)
    size = {
        "bollard": lambda: (0.16, 0.16, n["height_m"]),
        "marker_post": lambda: (0.118, 0.124, 1.0),
        "litter_bin": lambda: (0.42, 0.42, n["height_m"]),
        "wheeled_bin": lambda: (0.74, 0.60, n["height_m"]),
        "bench": lambda: (0.62, n["length_m"], 0.86),
        "bicycle_stand": lambda: (
            HOOP_M,
            HOOP_STEP_M * (int(n["hoops"]) - 1) + HOOP_WIDTH_M,
            0.80,
        ),
        "traffic_cone": lambda: (0.38, 0.38, n["height_m"]),
        "warning_board": lambda: (0.36, 0.42, n["height_m"]),
        "bus_stop": lambda: bus_stop_size(n),
    }[family]()
    return Thing(family, variant, family_data(family)["category"], size, "furniture")


def build(thing: Thing, detail: Detail) -> Assembly:
    """Return the mesh of a small thing."""
    n, _ = numbers(thing.family, thing.variant)
    make = {
        "bollard": _bollard,
        "marker_post": _marker_post,
        "litter_bin": _litter_bin,
        "wheeled_bin": _wheeled_bin,
        "bench": _bench,
        "bicycle_stand": _bicycle_stand,
        "traffic_cone": _cone,
        "warning_board": _board,
        "bus_stop": bus_stop,
    }[thing.family]
    return Assembly(thing.family).add(*make(n, detail))


def _bollard(n: dict, detail: Detail) -> list[Piece]:
    top = n["height_m"]
    sides = SIDES[detail]
    body = [(0.0, -FOOT_M), (0.075, -FOOT_M), (0.075, top - 0.06), (0.08, top - 0.05)]
    ring = [(0.078, top - 0.24), (0.078, top - 0.14)]
    return [
        lathe([*body, (0.06, top - 0.01), (0.0, top)], "bollard", "metal_grey", sides, "z"),
        lathe(ring, "ring", "sheeting_white", sides, "z"),
    ]


def _marker_post(n: dict, detail: Detail) -> list[Piece]:
    """Return a post with reflectors that face +x and -x."""
    return [
        box((0, 0, 0.4), (0.10, 0.12, 1.2), "post", "lamp_white", 0.03, 2),
        box((0, 0, 0.80), (0.104, 0.124, 0.20), "band", "plastic_black", 0.03, 2),
        boxes(
            [(0.054, 0, 0.80), (-0.054, 0, 0.80)], (0.01, 0.05, 0.15), "reflector", "post_reflector"
        ),
    ]


def _litter_bin(n: dict, detail: Detail) -> list[Piece]:
    top = n["height_m"]
    sides = SIDES[detail]
    return [
        lathe(
            [(0.0, -0.02), (0.18, -0.02), (0.20, 0.75 * top), (0.0, 0.75 * top)],
            "bin",
            "metal_green",
            sides,
            "z",
        ),
        tube([(0, 0, 0.7 * top), (0, 0, 0.95 * top)], 0.05, "stem", "metal_grey", 6),
        lathe(
            [(0.0, 0.9 * top), (0.21, 0.9 * top), (0.21, 0.94 * top), (0.0, top)],
            "lid",
            "metal_grey",
            sides,
            "z",
        ),
    ]


def _wheeled_bin(n: dict, detail: Detail) -> list[Piece]:
    top = n["height_m"]
    x = np.array([-0.27, 0.27, 0.27, -0.27])
    y = np.array([-0.25, -0.25, 0.25, 0.25])
    rings = [np.stack([k * x, k * y, 0 * x + z], 1) for k, z in ((0.82, 0.06), (1.0, top - 0.12))]
    return [
        grid(np.stack(rings, 1), "body", "bin_green", close_u=True, smooth=False),
        boxes((0.0, 0, top - 0.06), (0.66, 0.60, 0.12), "lid", "bin_green"),
        boxes((-0.34, 0, top - 0.16), (0.06, 0.44, 0.04), "grip", "plastic_black"),
        boxes((0.35, 0, top - 0.12), (0.04, 0.40, 0.03), "rim", "bin_green"),
        join(
            [
                tube([(-0.22, s * 0.24, 0.1), (-0.22, s * 0.28, 0.1)], 0.1, "wheel", "tyre", 12)
                for s in (1, -1)
            ],
            "wheel",
        ),
        boxes((0.1, 0, 0.04), (0.3, 0.4, 0.08), "foot", "bin_green"),
    ]


def _bench(n: dict, detail: Detail) -> list[Piece]:
    """Return a bench that faces +x."""
    length = n["length_m"]
    seat = [(0.06 + 0.11 * k, 0, 0.45) for k in range(-1, 3)]
    back = [(-0.19 - 0.03 * k, 0, 0.60 + 0.12 * k) for k in range(3)]
    return [
        boxes(seat, (0.09, length, 0.04), "seat", "wood"),
        boxes(back, (0.035, length, 0.09), "back", "wood"),
        boxes(
            [(0.10, s * (length / 2 - 0.2), 0.20) for s in (1, -1)],
            (0.42, 0.06, 0.46),
            "leg",
            "metal_grey",
        ),
        boxes(
            [(-0.275, s * (length / 2 - 0.2), 0.61) for s in (1, -1)],
            (0.07, 0.05, 0.5),
            "support",
            "metal_grey",
        ),
    ]


def _bicycle_stand(n: dict, detail: Detail) -> list[Piece]:
    """Return a row of hoops along y. Each hoop lies across the row."""
    count = int(n["hoops"])
    radius = HOOP_WIDTH_M / 2
    half = HOOP_M / 2 - radius
    top = 0.80 - radius
    bend = 0.15
    turn = np.linspace(0, np.pi / 2, {"near": 5, "middle": 3, "far": 2}[detail])
    rise = np.stack([-half + bend * (1 - np.cos(turn)), top - bend + bend * np.sin(turn)], 1)
    side = np.concatenate([[(-half, -FOOT_M)], rise])
    path = np.concatenate([side, side[::-1] * [-1, 1]])
    hoops = []
    for k in range(count):
        y = HOOP_STEP_M * (k - (count - 1) / 2)
        line = np.stack([path[:, 0], 0 * path[:, 0] + y, path[:, 1]], 1)
        hoops.append(tube(line, radius, "hoop", "galvanised", {"near": 10}.get(detail, 6)))
    return [join(hoops, "hoop")]


def _cone(n: dict, detail: Detail) -> list[Piece]:
    top = n["height_m"]
    sides = SIDES[detail]
    slope = lambda z: 0.14 + (0.03 - 0.14) * z / top
    bands = [(0.42, 0.58), (0.70, 0.84)]
    return [
        boxes((0, 0, 0.02), (0.38, 0.38, 0.04), "foot", "plastic_black"),
        lathe([(slope(0.0), 0.03), (0.03, top), (0.0, top)], "cone", "paint_orange", sides, "z"),
        *(
            lathe(
                [(slope(a * top) + 0.003, a * top), (slope(b * top) + 0.003, b * top)],
                "band",
                "sheeting_white",
                sides,
                "z",
            )
            for a, b in bands
        ),
    ]


def _board(n: dict, detail: Detail) -> list[Piece]:
    """Return a board of road works with slanted stripes of red and white. It faces +x."""
    top = n["height_m"]
    bottom = 0.35
    half = 0.125
    stripe = (top - bottom) / 6
    corners = []
    for k in range(6):
        low = bottom + k * stripe
        high = low + stripe
        cut = lambda z: min(max(z, bottom), top)
        corners.append(
            [
                (0.014, -half, cut(low - stripe / 2)),
                (0.014, half, cut(low + stripe / 2)),
                (0.014, half, cut(high + stripe / 2)),
                (0.014, -half, cut(high - stripe / 2)),
            ]
        )
    return [
        boxes((0, 0, 0.05), (0.36, 0.42, 0.10), "foot", "plastic_black"),
        boxes((0, 0, 0.25), (0.05, 0.05, 0.3), "post", "galvanised"),
        boxes((0, 0, (top + bottom) / 2), (0.024, 2 * half, top - bottom), "board", "lamp_white"),
        quads(corners[::2], "red", "sheeting_red"),
        quads(corners[1::2], "white", "sheeting_white"),
    ]
