"""A gable house with windows, some of them lit."""

from __future__ import annotations

import numpy as np

from ..mesh.piece import Assembly, Piece, flat, lit
from ..mesh.primitives import box, grid


def house(name="house", seed=0, size=(9.0, 7.0, 5.2)):
    """Gable house with windows, a door and a chimney; long side faces -y."""
    l, w, h = size
    m = Assembly(name).add(box((0, 0, h / 2 - 0.3), (l, w, h + 0.6), "walls", "wall"))
    for s in (1, -1):
        m.add(
            flat(
                grid(
                    np.array(
                        [
                            [
                                (-l / 2 - 0.4, s * (w / 2 + 0.5), h - 0.25),
                                (l / 2 + 0.4, s * (w / 2 + 0.5), h - 0.25),
                            ],
                            [(-l / 2 - 0.4, 0, h + 2.6), (l / 2 + 0.4, 0, h + 2.6)],
                        ]
                    ),
                    "roof",
                    "roof_tile",
                )
            )
        )
        m.add(
            flat(
                Piece(
                    "gable",
                    np.array(
                        [(s * l / 2, -w / 2, h), (s * l / 2, w / 2, h), (s * l / 2, 0, h + 2.35)]
                    ),
                    np.array([[0, 1, 2]]),
                    "wall",
                )
            )
        )
    k = 0
    for z in (1.5, 3.9):
        for x in np.linspace(-l * 0.36, l * 0.36, 4):
            if z < 2 and abs(x - l * 0.12) < 0.3:
                m.add(box((x, -w / 2 - 0.03, 1.0), (1.0, 0.08, 2.1), "door", "wood", 0.01))
                continue
            pane = [box((x, -w / 2 - 0.035, z), (1.0, 0.06, 1.2), f"window{k}", "window_dark")]
            if (k * 7 + seed) % 3 == 0:
                pane = lit(pane[0], "window", (0.0, -1.0, 0.0))
            m.add(
                box((x, -w / 2 - 0.01, z), (1.16, 0.08, 1.36), "frame", "lamp_white", 0.01),
                *pane,
                box((x, -w / 2 - 0.07, z), (0.05, 0.03, 1.2), "bar", "lamp_white"),
                box((x, -w / 2 - 0.12, z - 0.70), (1.3, 0.22, 0.06), "sill", "concrete"),
            )
            k += 1
    return m.add(box((l * 0.25, 0.6, h + 2.6), (0.7, 0.7, 1.6), "chimney", "roof_tile"))
