"""A gable house with windows, some of them lit."""

from __future__ import annotations

import numpy as np

from ..mesh.piece import Assembly, Piece, flat, lit
from ..mesh.primitives import box, grid


def house(
    name: str = "house", seed: int = 0, size: tuple[float, float, float] = (9.0, 7.0, 5.2)
) -> Assembly:
    """Gable house with windows, a door and a chimney; long side faces -y.

    Parameters
    ----------
    name : name of the assembly.
    seed : of what is drawn: which windows are lit.
    size : length, width and height of the walls, m.
    """
    length, width, height = size
    assembly = Assembly(name).add(
        box((0, 0, height / 2 - 0.3), (length, width, height + 0.6), "walls", "wall")
    )
    for side in (1, -1):
        assembly.add(
            flat(
                grid(
                    np.array(
                        [
                            [
                                (-length / 2 - 0.4, side * (width / 2 + 0.5), height - 0.25),
                                (length / 2 + 0.4, side * (width / 2 + 0.5), height - 0.25),
                            ],
                            [
                                (-length / 2 - 0.4, 0, height + 2.6),
                                (length / 2 + 0.4, 0, height + 2.6),
                            ],
                        ]
                    ),
                    "roof",
                    "roof_tile",
                )
            )
        )
        assembly.add(
            flat(
                Piece(
                    "gable",
                    np.array(
                        [
                            (side * length / 2, -width / 2, height),
                            (side * length / 2, width / 2, height),
                            (side * length / 2, 0, height + 2.35),
                        ]
                    ),
                    np.array([[0, 1, 2]]),
                    "wall",
                )
            )
        )
    window_number = 0
    for z in (1.5, 3.9):
        for x in np.linspace(-length * 0.36, length * 0.36, 4):
            if z < 2 and abs(x - length * 0.12) < 0.3:
                assembly.add(
                    box((x, -width / 2 - 0.03, 1.0), (1.0, 0.08, 2.1), "door", "wood", 0.01)
                )
                continue
            pane = [
                box(
                    (x, -width / 2 - 0.035, z),
                    (1.0, 0.06, 1.2),
                    f"window{window_number}",
                    "window_dark",
                )
            ]
            if (window_number * 7 + seed) % 3 == 0:
                pane = lit(pane[0], "window", (0.0, -1.0, 0.0))
            assembly.add(
                box((x, -width / 2 - 0.01, z), (1.16, 0.08, 1.36), "frame", "lamp_white", 0.01),
                *pane,
                box((x, -width / 2 - 0.07, z), (0.05, 0.03, 1.2), "bar", "lamp_white"),
                box((x, -width / 2 - 0.12, z - 0.70), (1.3, 0.22, 0.06), "sill", "concrete"),
            )
            window_number += 1
    return assembly.add(
        box((length * 0.25, 0.6, height + 2.6), (0.7, 0.7, 1.6), "chimney", "roof_tile")
    )
