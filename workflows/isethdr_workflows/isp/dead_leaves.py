"""Dead leaves: pictures of overlapping shapes of every size (Lee, Mumford, Huang 2001). Their
statistics resemble those of natural scenes.

Shapes are discs and rotated rectangles with power-law sizes. Each shape has one smooth reflectance
and one brightness. Some have stripes, which may be as fine as a pixel. One light illuminates all
shapes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter

FINE = 4  # samples per pixel along each axis
SHAPES_PER_PIXEL = 0.06
RADII_PX = (1.2, 50.0)  # smallest and largest radius of a shape
DARKEST = 0.02  # brightness of the darkest shape over that of the brightest
STRIPED = 0.35  # share of the shapes that have stripes
FINEST = 0.48  # highest frequency of stripes, cycles per pixel


def dead_leaves(rows: int, columns: int, colours: Any, rng: np.random.Generator) -> np.ndarray:
    """Return planes (channel, y, x) with a mean near 1 in the strongest channel.

    Parameters
    ----------
    rows, columns : size of the picture, pixels.
    colours : (surface, channel) response of each channel to each surface, any scale.
    rng : NumPy generator of all random numbers.
    """
    height = rows * FINE
    width = columns * FINE
    leaves = [colours[rng.integers(len(colours))].astype(np.float32)]  # the ground
    drawn = _Drawn(np.zeros((height, width), np.intp), np.ones((height, width), np.float32))
    for _ in range(int(SHAPES_PER_PIXEL * rows * columns)):
        leaves.append(_cover(drawn, len(leaves), colours, rng))
    out = np.array(leaves).T[:, drawn.leaf] * drawn.stripes
    blur = FINE * rng.uniform(0.0, 0.5)  # samples: lenses from sharp to a blur of half a pixel
    out = gaussian_filter(out, (0, blur, blur), mode="mirror")
    planes = out.reshape(len(out), rows, FINE, columns, FINE).mean((2, 4), dtype=float)
    return planes / planes.mean((1, 2)).max()


class _Drawn(NamedTuple):
    """A picture as the leaf that each sample shows; colours are filled in at the end."""

    leaf: np.ndarray  # (y, x) number of the leaf on top
    stripes: np.ndarray  # (y, x) factor of its stripes, 1 without


def _cover(drawn: _Drawn, number: int, colours: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Cover part of a picture with leaf `number`, and return its colour (channel,)."""
    height, width = drawn.leaf.shape
    # the density of radii is r^-3, so that small and large shapes are equally visible
    radius = FINE / np.sqrt(rng.uniform(RADII_PX[1] ** -2, RADII_PX[0] ** -2))
    centre_y = rng.uniform(0, height)
    centre_x = rng.uniform(0, width)
    rows = slice(int(max(centre_y - radius, 0)), int(min(centre_y + radius + 1, height)))
    columns = slice(int(max(centre_x - radius, 0)), int(min(centre_x + radius + 1, width)))
    y = (np.arange(rows.start, rows.stop) - centre_y)[:, None]
    x = np.arange(columns.start, columns.stop) - centre_x
    inside = _inside(x, y, radius, rng)
    colour = colours[rng.integers(len(colours))] * DARKEST ** rng.uniform(0, 1)
    stripes = _stripes(x, y, rng) if rng.uniform() < STRIPED else np.float32(1)
    np.copyto(drawn.leaf[rows, columns], number, where=inside)
    np.copyto(drawn.stripes[rows, columns], stripes, where=inside)
    return colour.astype(np.float32)


def _inside(x: np.ndarray, y: np.ndarray, radius: float, rng: np.random.Generator) -> np.ndarray:
    if rng.uniform() < 0.5:
        return x**2 + y**2 < radius**2
    # half of the rectangles are upright, like walls and letters
    angle = rng.uniform(0, np.pi) if rng.uniform() < 0.5 else 0.0
    u = x * np.cos(angle) + y * np.sin(angle)
    v = y * np.cos(angle) - x * np.sin(angle)
    return (np.abs(u) < radius * rng.uniform(0.1, 0.7)) & (np.abs(v) < 0.7 * radius)


def _stripes(x: np.ndarray, y: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    angle = rng.uniform(0, np.pi)
    frequency = rng.uniform(0.02, FINEST) / FINE
    phase = 2 * np.pi * (frequency * (x * np.cos(angle) + y * np.sin(angle)) + rng.uniform())
    return (1 + rng.uniform(0.1, 0.9) * np.sin(phase)).astype(np.float32)
