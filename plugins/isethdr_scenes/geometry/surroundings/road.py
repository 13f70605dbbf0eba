"""The road, the land next to it, and the places where grass grows."""

from __future__ import annotations

import numpy as np

from ..mesh.piece import Assembly, Piece
from ..mesh.primitives import box, grid
from .ground import EDGE_M, LANE_M, Ground

LINE_WIDTH_M = 0.12
DASH_M = 3.0
DASH_PERIOD_M = 9.0
STUD_M = (0.10, 0.10, 0.018)  # along and across the road, and height
STUD_FACE_M = (0.085, 0.014)  # width and height of the reflector; its area is 12 cm2
CRACKS = 14  # number of sealed cracks on the whole road


def _strip(
    ground: Ground, s: np.ndarray, y: np.ndarray, name: str, material: str, above: float = 0.0
) -> Piece:
    s, y = np.meshgrid(s, y, indexing="ij")
    return grid(ground.on(s, y, above), name, material)


def road(ground: Ground, start_m: float = -30.0, end_m: float = 260.0) -> Assembly:
    """Return carriageway, shoulders, lay-by, sealed cracks, studs and markings.

    The markings are 4 mm above the asphalt.

    Parameters
    ----------
    ground : course and height of the road.
    start_m : start along the road, m.
    end_m : end along the road, m.
    """
    m = Assembly("road")
    s = np.arange(start_m, end_m + 0.1, 1.0)
    half = LINE_WIDTH_M / 2
    m.add(_strip(ground, s, np.linspace(-EDGE_M, EDGE_M, 25), "carriageway", "asphalt"))
    for side in (1, -1):
        shoulder = np.array([0, 0.25, 0.6]) + EDGE_M
        line = np.array([-half, half]) + LANE_M
        m.add(
            _strip(ground, s, np.sort(side * shoulder), "shoulder", "gravel", 0.004),
            _strip(ground, s, np.sort(side * line), "edge_line", "road_paint", 0.004),
        )
    for first in np.arange(start_m, end_m - 4, DASH_PERIOD_M):
        dash = np.arange(first, first + DASH_M + 0.01, 0.5)
        m.add(_strip(ground, dash, np.array([-half, half]), "centre_line", "road_paint", 0.004))
        m.add(*_stud(ground, first + (DASH_M + DASH_PERIOD_M) / 2))  # between two dashes
    if ground.lay_by_m:
        paved = np.arange(ground.lay_by_m[0] + 5, ground.lay_by_m[1] - 4.9, 1.0)
        m.add(_strip(ground, paved, np.linspace(-7.6, -EDGE_M, 9), "lay_by", "asphalt", 0.012))
    rng = np.random.default_rng(ground.seed)
    for _ in range(CRACKS):
        first = rng.uniform(start_m, end_m - 10)
        y = rng.uniform(-3, 3)
        along = np.arange(first, first + rng.uniform(2, 6), 0.25)
        across = y + np.cumsum(rng.normal(size=len(along))) * 0.06
        edges = [ground.on(along, across + w, 0.003) for w in (-0.022, 0.022)]
        m.add(grid(np.stack(edges, 1), "crack", "gap"))
    return m


def _stud(ground: Ground, s_m: float) -> list[Piece]:
    """Return a road stud on the centre line. Its reflector faces back along the road."""
    length, width, height = STUD_M
    body = box((0, 0, height / 2), STUD_M, "stud", "alloy")
    face = box(
        (-length / 2 - 0.001, 0, height / 2), (0.002, *STUD_FACE_M), "stud.face", "stud_reflector"
    )
    at = ground.place(s_m, 0.0)
    return [body.moved(at), face.moved(at)]


def field(ground: Ground, start_m: float = -30.0, end_m: float = 260.0) -> Assembly:
    """Return the land on both sides, up to 400 m from the road. Its mesh is finer near the road.

    Parameters
    ----------
    ground : height of the land.
    start_m : start along the road, m.
    end_m : end along the road, m.
    """
    s = np.arange(start_m, end_m + 0.1, 2.0)
    y = np.concatenate(
        [np.linspace(EDGE_M + 0.6, 14, 34), np.linspace(14.6, 60, 50), np.geomspace(62, 400, 18)]
    )
    return Assembly("field").add(
        *(_strip(ground, s, np.sort(side * y), "field", "meadow") for side in (1, -1))
    )


def tufts(
    ground: Ground,
    along_m: tuple[float, float],
    beside_m: tuple[float, float],
    per_m2: float,
    seed: int,
) -> np.ndarray:
    """Return the roots (n, 3), m, of grass blades that grow in clumps on both verges.

    Parameters
    ----------
    ground : height of the land, and the lay-by without grass.
    along_m : start and end along the road, m.
    beside_m : least and largest distance from the centre line, m.
    per_m2 : mean number of blades per square metre.
    seed : seed of the places.
    """
    start_m, end_m = along_m
    near_m, far_m = beside_m
    rng = np.random.default_rng(seed + 7)
    n = int((end_m - start_m) * (far_m - near_m) * 2 * per_m2)
    clumps = int(n / 14)
    cs = rng.uniform(start_m, end_m, clumps)
    cy = rng.uniform(near_m, far_m, clumps) * rng.choice([-1, 1], clumps)
    k = rng.integers(0, clumps, n)
    s = cs[k] + rng.normal(size=n) * 0.10
    y = cy[k] + rng.normal(size=n) * 0.10
    free = np.abs(y) > EDGE_M + 0.4
    if ground.lay_by_m:
        free &= ~((y < 0) & (y > -8) & (s > ground.lay_by_m[0] + 4) & (s < ground.lay_by_m[1] - 4))
    return ground.on(s, y, -0.01)[free]
