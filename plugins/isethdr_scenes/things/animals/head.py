"""The head of an animal: skull, eyes that shine, ears, antlers, horns and tusks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry.mesh.piece import unit
from ..shapes import Ball, Limb, Rod, Shape

# Beams of antlers and their tines: points forward, outward and upward from the root, scaled by the
# height of the antlers / 1.22. A tine has the index of the point of the beam where it begins, and
# its direction.
BEAM = ((-0.05, 0.12, 0.2), (-0.22, 0.38, 0.42), (-0.26, 0.62, 0.76), (-0.05, 0.74, 1.02))
BEAM_END = (0.2, 0.62, 1.22)
TINES = (
    (1, (0.42, 0.02, 0.16)),
    (2, (0.44, 0.08, 0.24)),
    (3, (-0.24, 0.18, 0.34)),
    (4, (0.26, -0.12, 0.22)),
)


@dataclass(frozen=True)
class Head:
    """Place and measures of a head, in shoulder heights: its back end, its direction, its sizes."""

    poll: np.ndarray
    ahead: np.ndarray
    measures: Mapping[str, float]

    @property
    def nose(self) -> np.ndarray:
        """Return the tip of the nose."""
        return self.poll + self.ahead * self.measures["length"]

    @property
    def left(self) -> np.ndarray:
        """Return the direction to the left of the head."""
        return unit(np.array([-self.ahead[1], self.ahead[0], 0.0]))

    @property
    def up(self) -> np.ndarray:
        """Return the direction out of the forehead, across `ahead` and `left`."""
        return np.cross(self.ahead, self.left)

    def limbs(self) -> list[Limb]:
        """Return skull, muzzle and jaw."""
        skull = self.measures["skull"]
        muzzle = self.measures["muzzle"]
        nose = self.measures["nose"]
        length = self.measures["length"]
        brow = self.poll + self.ahead * 0.36 * length
        stop = self.up * self.measures["stop"]
        end = self.nose - self.ahead * nose
        jaw = self.poll + self.ahead * 0.25 * length - self.up * 0.45 * skull
        return [
            Limb(self.poll, brow, skull, 0.86 * skull),
            Limb(brow - stop, end - stop, max(muzzle, 0.62 * skull), nose),
            Limb(jaw, end - stop - self.up * 0.35 * nose, 0.6 * skull, 0.75 * nose),
        ]


def head_shapes(
    parts: Mapping[str, Any], coat: Mapping[str, Any], head: Head, scale: float
) -> list[Shape]:
    """Return the shapes of eyes, ears, antlers, horns and tusks, in metres.

    Parameters
    ----------
    parts : measures of the ears, and of antlers, horns and tusks if the family has them.
    coat : names of the materials of the coat.
    head : place and measures of the head, in shoulder heights.
    scale : shoulder height, m.
    """
    shapes: list[Shape] = []
    skull = head.measures["skull"]
    length = head.measures["length"]
    eye = np.clip(0.13 * skull, 0.007 / scale, 0.02 / scale)
    for side in (1.0, -1.0):
        out = unit(0.80 * side * head.left + 0.45 * head.up + 0.30 * head.ahead)
        at = head.poll + 0.34 * length * head.ahead + 0.93 * skull * out
        shapes.append(Ball("eye", "eye_deer", scale * at, (scale * eye,) * 3))
        shapes.append(_ear(parts["ears"], coat, head, side, scale))
        if "antlers" in parts:
            shapes += _antler(head, side, scale, parts["antlers"])
        if "horns" in parts:
            shapes.append(_horn(head, side, scale, parts["horns"]))
        if "tusks" in parts:
            root = head.nose - head.ahead * 0.2 * length + side * head.left * head.measures["nose"]
            way = unit(0.35 * side * head.left + 0.9 * head.up + 0.15 * head.ahead)
            path = (scale * root, scale * (root + parts["tusks"] * way))
            shapes.append(Rod("tusk", "horn", path, (0.018 * scale, 0.004 * scale), "middle"))
    return shapes


def _ear(
    ears: Mapping[str, float], coat: Mapping[str, Any], head: Head, side: float, scale: float
) -> Rod:
    skull = head.measures["skull"]
    hangs = ears["up"] < 0
    root = (
        head.poll
        + head.ahead * 0.02
        + 0.72 * skull * unit(side * head.left * 0.75 + head.up * (0.75 if not hangs else 0.55))
    )
    back = -0.12 if not hangs else 0.06
    world_up = np.array([0.0, 0.0, 1.0])
    way = unit(ears["out"] * side * head.left + ears["up"] * world_up + back * head.ahead)
    middle = root + 0.45 * ears["length"] * way
    tip = root + ears["length"] * way
    width = ears["width"]
    radii = (0.72 * width, width, 0.12 * width) if not hangs else (0.5 * width, width, 0.6 * width)
    material = coat.get("ears", coat.get("face", coat["main"]))
    path = (scale * root, scale * middle, scale * tip)
    return Rod("ear", material, path, tuple(scale * r for r in radii))


def _point(head: Head, side: float, forward: float, out: float, up: float) -> np.ndarray:
    world_up = np.array([0.0, 0.0, 1.0])
    return forward * unit(head.ahead * [1, 1, 0]) + out * side * head.left + up * world_up


def _antler(head: Head, side: float, scale: float, height: float) -> list[Shape]:
    """Return a beam of an antler with four tines; its height is `height` shoulder heights."""
    root = head.poll + head.up * 0.8 * head.measures["skull"]
    k = height / 1.22
    beam = [root + k * _point(head, side, *p) for p in ((0, 0.08, 0), *BEAM, BEAM_END)]
    path = tuple(scale * p for p in beam)
    radii = tuple(scale * r for r in (0.022, 0.019, 0.017, 0.015, 0.012, 0.004))
    shapes: list[Shape] = [Rod("antler", "antler", path, radii)]
    for index, tine in TINES:
        start = beam[index]
        end = start + k * _point(head, side, *tine)
        middle = 0.5 * (start + end) - 0.03 * k * np.array([0.0, 0.0, 1.0])
        path = tuple(scale * p for p in (start, middle, end))
        radii = tuple(scale * r for r in (0.013, 0.010, 0.003))
        shapes.append(Rod("tine", "antler", path, radii))
    return shapes


def _horn(head: Head, side: float, scale: float, length: float) -> Rod:
    root = head.poll + 0.75 * head.measures["skull"] * unit(head.up + 0.7 * side * head.left)
    middle = root + length * _point(head, side, 0.1, 0.7, 0.15)
    end = root + length * _point(head, side, 0.45, 0.95, 0.6)
    path = tuple(scale * p for p in (root, middle, end))
    return Rod("horn", "horn", path, tuple(scale * r for r in (0.028, 0.022, 0.006)))
