"""Road signs: panels of retro-reflective sheeting on posts."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ..mesh.piece import Assembly, Piece, face_areas, flat
from ..mesh.primitives import box, tube

SignName = Literal["deer", "limit"]
BOTTOM_M = 2.0  # height of the lower end of the panel above the ground
TRIANGLE_M = 0.90  # side
DISC_M = 0.60  # diameter
LAYER_M = 0.0015  # distance between the layers of a panel
# a leaping deer as convex patches: (right, up) of their corners as viewers see them; a unit is 0.78
# of the triangle's side
DEER = (
    ((-0.17, 0.02), (-0.14, -0.04), (0.10, -0.01), (0.13, 0.06), (-0.02, 0.06)),  # trunk
    ((0.07, 0.03), (0.13, 0.05), (0.19, 0.16), (0.15, 0.17)),  # neck
    ((0.14, 0.17), (0.17, 0.13), (0.25, 0.14), (0.24, 0.16)),  # head
    ((0.15, 0.17), (0.17, 0.17), (0.15, 0.26), (0.13, 0.26)),  # antlers
    ((0.13, 0.22), (0.15, 0.21), (0.20, 0.27), (0.19, 0.28)),
    ((0.07, 0.02), (0.12, 0.02), (0.22, -0.06), (0.20, -0.07)),  # fore legs
    ((0.06, 0.00), (0.10, 0.00), (0.15, -0.12), (0.13, -0.12)),
    ((-0.16, 0.02), (-0.12, -0.03), (-0.24, -0.12), (-0.25, -0.10)),  # hind legs
    ((-0.15, -0.02), (-0.10, -0.03), (-0.17, -0.14), (-0.19, -0.14)),
)
# strokes of the digits 7 and 0: (right, up) of their corners; a unit is the radius of the disc
SEVENTY = (
    ((-0.42, 0.28), (-0.42, 0.38), (-0.04, 0.38), (-0.04, 0.28)),
    ((-0.14, 0.30), (-0.04, 0.30), (-0.22, -0.38), (-0.33, -0.38)),
    ((0.06, -0.30), (0.06, 0.30), (0.16, 0.30), (0.16, -0.30)),
    ((0.34, -0.30), (0.34, 0.30), (0.44, 0.30), (0.44, -0.30)),
    ((0.08, 0.28), (0.12, 0.38), (0.38, 0.38), (0.42, 0.28)),
    ((0.08, -0.28), (0.12, -0.38), (0.38, -0.38), (0.42, -0.28)),
)


def sign(name: SignName) -> Assembly:
    """Return a sign with its panel facing -x: a warning of deer, or a speed limit of 70 km/h."""
    if name == "deer":
        height = TRIANGLE_M * np.sqrt(0.75)
        middle = BOTTOM_M + height / 3
        rim = np.array([(-0.5, -height / TRIANGLE_M / 3), (0.5, -height / TRIANGLE_M / 3)])
        outline = TRIANGLE_M * np.array([*rim, (0.0, 2 * height / TRIANGLE_M / 3)])
        inside = 0.70
        figures = DEER
        scale = 0.78 * TRIANGLE_M
    else:
        angle = np.linspace(0, 2 * np.pi, 33)[:-1]
        middle = BOTTOM_M + DISC_M / 2
        outline = DISC_M / 2 * np.stack([np.cos(angle), np.sin(angle)], 1)
        inside = 0.80
        figures = SEVENTY
        scale = DISC_M / 2
    at = (-0.045, middle)
    out = Assembly(f"sign_{name}").add(
        tube([(0, 0, -0.3), (0, 0, middle + 0.15)], 0.030, "post", "galvanised", 12),
        box((-0.036, 0, middle), (0.02, 0.10, 0.30), "clamp", "galvanised"),
        _panel(outline, at, 0, "back", "alloy"),
        _panel(outline, at, 1, "border", "sheeting_red"),
        _panel(inside * outline, at, 2, "field", "sheeting_white"),
    )
    return out.add(*(_panel(scale * np.array(f), at, 3, "figure", "plate_ink") for f in figures))


def _panel(
    outline: np.ndarray, at: tuple[float, float], layer: int, name: str, material: str
) -> Piece:
    """Return a flat convex piece that faces -x.

    Parameters
    ----------
    outline : (n, 2) corners (right, up) as viewers see them, m.
    at : x of the panel's back and z of the origin of `outline`, m.
    layer : number of the layer, counted from the back.
    name : name of the piece.
    material : name of the material.
    """
    x, z = at
    aside, up = np.asarray(outline, float).T
    # a viewer who looks along +x has +y on the left
    vertices = np.stack([np.full(len(aside), x - LAYER_M * layer), -aside, z + up], 1)
    k = np.arange(1, len(vertices) - 1)
    piece = Piece(name, vertices, np.stack([0 * k, k, k + 1], 1), material)
    if face_areas(piece)[:, 0].sum() > 0:
        piece = Piece(name, vertices, piece.faces[:, ::-1], material)
    return flat(piece)
