"""Panels of signs: outline, border, field and pictures as layers of retro-reflective sheeting.

`data/signs.yaml` describes the faces. Its unit is half the width of the panel. Coordinates are
(right, up) as viewers see them. Every patch is convex.
"""

from __future__ import annotations

import numpy as np

from ...geometry.mesh.piece import Piece, flat
from ..ranges import read
from .lettering import stroke_patches, text_patches

FILE = "signs.yaml"
LAYER_M = 0.0015  # distance between the layers of a panel
COLOURS = {
    "white": "sheeting_white",
    "red": "sheeting_red",
    "yellow": "sheeting_yellow",
    "blue": "sheeting_blue",
    "green": "sheeting_green",
    "black": "plate_ink",
}
ROUND = 24  # number of corners of a disc


def sign_data(name: str) -> dict:
    """Return the entry of a sign in the data file."""
    return read(FILE)["signs"][name]


def outline(shape: str, aspect: float = 1.0) -> np.ndarray:
    """Return the corners (n, 2) of a panel, in half widths; `aspect` is width / height."""
    if shape in ("triangle", "triangle_down"):
        corners = np.array([(-1, -1 / 3**0.5), (1, -1 / 3**0.5), (0, 2 / 3**0.5)])
        return corners if shape == "triangle" else -corners
    if shape == "disc":
        return _disc(0.0, 0.0, 1.0)
    if shape == "octagon":
        turn = np.radians(22.5 + 45 * np.arange(8))
        return np.stack([np.cos(turn), np.sin(turn)], 1) / np.cos(np.pi / 8)
    if shape == "diamond":
        return np.array([(-1.0, 0), (0, -1), (1, 0), (0, 1)])
    half = 1 / aspect
    if shape == "arrow":
        return np.array([(-1, -half), (0.82, -half), (1, 0), (0.82, half), (-1, half)])
    return np.array([(-1, -half), (1, -half), (1, half), (-1, half)])


def _disc(x: float, y: float, radius: float) -> np.ndarray:
    turn = 2 * np.pi * np.arange(ROUND) / ROUND
    return np.stack([x + radius * np.cos(turn), y + radius * np.sin(turn)], 1)


def extent(name: str, radius_m: float) -> tuple[float, float, float]:
    """Return (width, bottom, top) of a face about its middle, m."""
    entry = sign_data(name)
    corners = radius_m * outline(entry["shape"], entry.get("aspect", 1.0))
    low = corners.min(0)
    high = corners.max(0)
    return float(high[0] - low[0]), float(low[1]), float(high[1])


def face(name: str, radius_m: float, at: tuple[float, float, float]) -> list[Piece]:
    """Return the layers of a panel that faces +x.

    Parameters
    ----------
    name : name of the sign in `data/signs.yaml`.
    radius_m : half the width of the panel, m.
    at : x, y, z of the middle of its back, m.
    """
    entry = sign_data(name)
    rim = outline(entry["shape"], entry.get("aspect", 1.0))
    inside = _inside(rim, entry.get("rim", 0.12))
    pieces = [
        _panel(rim * radius_m, at, 0, "back", "alloy", back=True),
        _panel(rim * radius_m, at, 1, "border", COLOURS[entry["border"]]),
        _panel(inside * radius_m, at, 2, "field", COLOURS[entry["field"]]),
    ]
    for figure in entry.get("figures", ()):
        pieces += _figure(figure, radius_m, at)
    return pieces


def _inside(rim: np.ndarray, width: float) -> np.ndarray:
    """Return a convex outline with its sides moved inwards by `width`; all in half widths of the
    panel.
    """
    before = np.roll(rim, 1, 0)
    after = np.roll(rim, -1, 0)
    one = (rim - before) / np.linalg.norm(rim - before, axis=1, keepdims=True)
    two = (after - rim) / np.linalg.norm(after - rim, axis=1, keepdims=True)
    sine = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    return rim + (two - one) * (width / sine)[:, None]


def _figure(figure: dict, radius_m: float, at: tuple[float, float, float]) -> list[Piece]:
    material = COLOURS[figure.get("colour", "black")]
    layer = 3 + int(figure.get("layer", 0))
    patches = _patches(figure)
    return [_panel(radius_m * patch, at, layer, "figure", material) for patch in patches]


def _patches(figure: dict) -> list[np.ndarray]:
    """Return the convex patches (n, 2) of one figure, in half widths of the panel."""
    if "picture" in figure:
        scale = float(figure.get("scale", 1.0))
        mirror = -1.0 if figure.get("mirror") else 1.0
        middle = np.asarray(figure.get("at", (0.0, 0.0)), float)
        inner = [p for f in read(FILE)["pictures"][figure["picture"]] for p in _patches(f)]
        turned = [p[::-1] if mirror < 0 else p for p in inner]
        return [scale * p * [mirror, 1.0] + middle for p in turned]
    if "text" in figure:
        return text_patches(figure["text"], figure["height"], figure.get("at", (0.0, 0.0)))
    if "stroke" in figure:
        return stroke_patches(figure["stroke"], figure["width"])
    if "disc" in figure:
        return [_disc(*figure["disc"])]
    if "ring" in figure:
        x, y, radius, width = figure["ring"]
        return stroke_patches(_disc(x, y, radius)[np.r_[0:ROUND, 0]], width)
    return [np.asarray(figure["polygon"], float)]


def _panel(
    corners: np.ndarray,
    at: tuple[float, float, float],
    layer: int,
    name: str,
    material: str,
    back: bool = False,
) -> Piece:
    """Return a flat convex piece that faces +x, or -x if `back` is true.

    Parameters
    ----------
    corners : (n, 2) corners (right, up) as viewers see them, m.
    at : x, y, z of the middle of the panel's back, m.
    layer : number of the layer, counted from the back.
    name : name of the piece.
    material : name of the material.
    back : whether it is the back of the panel.
    """
    x, y, z = at
    right, up = np.asarray(corners, float).T
    vertices = np.stack([np.full(len(right), x + LAYER_M * layer), y + right, z + up], 1)
    k = np.arange(1, len(vertices) - 1)
    faces = np.stack([0 * k, k, k + 1], 1)
    signed = np.sum(right * np.roll(up, -1) - np.roll(right, -1) * up)  # twice the area
    if (signed < 0) != back:
        faces = faces[:, ::-1]
    return flat(Piece(name, vertices, faces, material))
