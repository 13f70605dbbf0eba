"""Letters and digits: strokes on a grid of 4 by 6, as convex patches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

# strokes of each letter, separated by |: points "xy" of a grid that is 4 wide and 6 high
STROKES = {
    "0": "00 40 46 06 00",
    "1": "15 26 20",
    "2": "05 06 46 43 03 00 40",
    "3": "06 46 40 00|03 43",
    "4": "06 03 43|46 40",
    "5": "46 06 03 43 40 00",
    "6": "46 06 00 40 43 03",
    "7": "06 46 20",
    "8": "00 40 46 06 00|03 43",
    "9": "43 03 06 46 40 00",
    "A": "00 04 26 44 40|02 42",
    "B": "00 06 36 44 33 03|33 42 41 30 00",
    "D": "00 06 26 44 42 20 00",
    "E": "46 06 00 40|03 33",
    "G": "46 06 00 40 43 23",
    "H": "00 06|40 46|03 43",
    "I": "20 26",
    "K": "00 06|46 03 40",
    "L": "06 00 40",
    "M": "00 06 23 46 40",
    "N": "00 06 40 46",
    "O": "00 40 46 06 00",
    "P": "00 06 46 43 03",
    "R": "00 06 46 43 03|23 40",
    "S": "46 06 03 43 40 00",
    "T": "06 46|26 20",
    "U": "06 00 40 46",
    "V": "06 20 46",
    " ": "",
    "-": "13 33",
}
GRID = (4.0, 6.0)
SPACING = 6.0  # distance from one letter to the next, in cells
WIDTH = 0.95  # width of a stroke, in cells


def stroke_patches(points: np.ndarray, width: float) -> list[np.ndarray]:
    """Return a polyline (n, 2) as convex quads (4, 2).

    Each quad extends beyond both ends of its segment by half the width.
    """
    points = np.asarray(points, float)
    patches = []
    for a, b in zip(points[:-1], points[1:], strict=True):
        along = (b - a) / max(float(np.linalg.norm(b - a)), 1e-9) * width / 2
        aside = np.array([-along[1], along[0]])
        patches.append(
            np.array([a - along - aside, b + along - aside, b + along + aside, a - along + aside])
        )
    return patches


def text_patches(
    text: str, height: float, middle: Sequence[float] = (0.0, 0.0)
) -> list[np.ndarray]:
    """Return a line of text as convex quads (4, 2) of (right, up), centred at `middle`.

    Parameters
    ----------
    text : letters of `STROKES`.
    height : height of the letters; the quads have its unit.
    middle : (right, up) of the middle of the line, in the same unit.
    """
    scale = height / GRID[1]
    width = SPACING * (len(text) - 1) + GRID[0]
    patches = []
    for place, letter in enumerate(text):
        start = np.array([SPACING * place - width / 2, -GRID[1] / 2])
        for stroke in filter(None, STROKES[letter].split("|")):
            points = np.array([[float(p[0]), float(p[1])] for p in stroke.split()]) + start
            patches += [scale * quad + middle for quad in stroke_patches(points, WIDTH)]
    return patches


def text_width(text: str, height: float) -> float:
    """Return the width of a line of text with letters of this height, in the unit of `height`."""
    return height / GRID[1] * (SPACING * (len(text) - 1) + GRID[0])
