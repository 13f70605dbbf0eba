"""A gable house with windows, some of them lit."""

from __future__ import annotations

import numpy as np

from ..mesh.piece import Assembly, Piece, flat, lit
from ..mesh.primitives import box, grid

ROOF_RISE_M = 2.6  # height of the ridge above the walls
GABLE_RISE_M = 2.35  # height of the tips of the gables above the walls; they stay below the roof
EAVES_M = 0.5  # overhang of the roof beyond the long walls
VERGE_M = 0.4  # overhang of the roof beyond the gables
STOREYS_M = (1.5, 3.9)  # heights of the middles of the windows
PANE_M = (1.0, 1.2)  # width and height of the glass of a window
FRAME_M = (1.16, 1.36)  # width and height of the frame around it


def house(
    name: str = "house", seed: int = 0, size: tuple[float, float, float] = (9.0, 7.0, 5.2)
) -> Assembly:
    """Return a gable house with a chimney. Its long side with windows and a door faces -y.

    Parameters
    ----------
    name : name of the assembly.
    seed : number that selects which windows are lit.
    size : length, width and height of the walls, m.
    """
    length, width, height = size
    # the walls reach 60 cm into the ground
    walls = box((0, 0, height / 2 - 0.3), (length, width, height + 0.6), "walls", "wall")
    assembly = Assembly(name).add(walls)
    for side in (1, -1):
        assembly.add(_roof(size, side), _gable(size, side))
    assembly.add(*_facade(length, -width / 2, seed))
    chimney = (length * 0.25, 0.6, height + ROOF_RISE_M)
    return assembly.add(box(chimney, (0.7, 0.7, 1.6), "chimney", "roof_tile"))


def _roof(size: tuple[float, float, float], side: int) -> Piece:
    """Return one slope of the roof, from its eaves to the ridge."""
    length, width, height = size
    end = length / 2 + VERGE_M
    y = side * (width / 2 + EAVES_M)
    low = height - 0.25
    top = height + ROOF_RISE_M
    eaves = [(-end, y, low), (end, y, low)]
    ridge = [(-end, 0, top), (end, 0, top)]
    return flat(grid(np.array([eaves, ridge]), "roof", "roof_tile"))


def _gable(size: tuple[float, float, float], side: int) -> Piece:
    """Return the triangle of wall below the roof at one end."""
    length, width, height = size
    x = side * length / 2
    corners = [(x, -width / 2, height), (x, width / 2, height), (x, 0, height + GABLE_RISE_M)]
    return flat(Piece("gable", np.array(corners), np.array([[0, 1, 2]]), "wall"))


def _facade(length: float, y: float, seed: int) -> list[Piece]:
    """Return the windows of the long wall at `y`, and the door in place of one of them."""
    parts = []
    number = 0  # number of the next window
    for z in STOREYS_M:
        for x in np.linspace(-length * 0.36, length * 0.36, 4):
            if z == STOREYS_M[0] and abs(x - length * 0.12) < 0.3:
                parts.append(box((x, y - 0.03, 1.0), (1.0, 0.08, 2.1), "door", "wood", 0.01))
                continue
            shines = (number * 7 + seed) % 3 == 0
            parts += _window((x, y, z), f"window{number}", shines)
            number += 1
    return parts


def _window(at: tuple[float, float, float], name: str, shines: bool) -> list[Piece]:
    """Return a window with its middle at `at`: frame, pane, glazing bar and sill."""
    x, y, z = at
    wide, high = PANE_M
    pane = box((x, y - 0.035, z), (wide, 0.06, high), name, "window_dark")
    return [
        box((x, y - 0.01, z), (FRAME_M[0], 0.08, FRAME_M[1]), "frame", "lamp_white", 0.01),
        *(lit(pane, "window", (0.0, -1.0, 0.0)) if shines else [pane]),
        box((x, y - 0.07, z), (0.05, 0.03, high), "bar", "lamp_white"),
        box((x, y - 0.12, z - 0.70), (1.3, 0.22, 0.06), "sill", "concrete"),
    ]
