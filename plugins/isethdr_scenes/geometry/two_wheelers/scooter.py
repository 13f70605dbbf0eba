"""Scooters: a step-through body with an apron ahead of the rider's legs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.piece import Assembly
from ..mesh.primitives import box, grid, tube
from . import fittings
from .hull import hull


@dataclass(frozen=True)
class Scooter:
    """Proportions of a scooter, m. It stands on y = 0, and x = 0 is half-way between the ends of
    its tyres.
    """

    wheelbase: float
    wheel: float  # radius
    tyre: float  # width
    seat: float  # height
    floor: float  # height of the foot board
    apron: float  # half the width of the apron
    bar_height: float
    bar_width: float
    body: float  # half the width of the body under the seat
    round_tail: float = 2.6  # exponent of the body's section; 2 is an ellipse
    screen: float = 0.0  # height of the windscreen over the handlebar
    top_case: bool = False
    colour: str = "white"
    seed: int = 0  # seed of the glyphs of the plate

    @property
    def points(self) -> dict[str, np.ndarray]:
        """Return points (3,), m, by name: axles, steering head, seat, left grip and left foot."""
        half = self.wheelbase / 2
        head = np.array([half - 0.20, 0, self.bar_height - 0.10])
        return {
            "rear": np.array([-half, 0, self.wheel]),
            "front": np.array([half, 0, self.wheel]),
            "head": head,
            "grip": np.array([head[0] - 0.10, self.bar_width / 2 - 0.07, self.bar_height]),
            "seat": np.array([-half + 0.34, 0, self.seat]),
            "foot": np.array([half - 0.46, 0.13, self.floor + 0.01]),
        }

    @property
    def mirror(self) -> tuple[float, float]:
        """Return half the distance between the middles of the mirrors, and their height, m."""
        return self.bar_width / 2 - 0.06, self.bar_height + 0.18

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Return length, width and height, m."""
        half, top = self.mirror
        width = max(self.bar_width, 2 * (half + 0.07))
        return (
            self.wheelbase + 2 * self.wheel,
            width,
            max(top + 0.045, self.bar_height + self.screen),
        )


def build(shape: Scooter, name: str = "scooter") -> Assembly:
    """Return all parts of a scooter."""
    model = Assembly(name)
    at = shape.points
    paint = f"paint_{shape.colour}"
    for axle in (at["front"], at["rear"]):
        model.add(*fittings.wheel(axle[0], shape.wheel, shape.tyre, 5))
    model.add(
        *fittings.fork(at["front"], at["front"] + 0.45 * (at["head"] - at["front"]), 0.17, "alloy"),
        fittings.guard(
            at["front"][0], at["front"][2], shape.wheel + 0.02, shape.tyre + 0.06, (0.5, 2.7), paint
        ),
    )
    _apron(model, shape, at, paint)
    _body(model, shape, at, paint)
    _handlebar(model, shape, at, paint)
    if shape.screen:
        _screen(model, shape, at)
    if shape.top_case:
        middle = (at["rear"][0] + 0.02, 0, shape.seat + 0.20)
        model.add(box(middle, (0.36, 0.38, 0.30), "top_case", paint, 0.07))
    return model


def _apron(model: Assembly, shape: Scooter, at: dict[str, np.ndarray], paint: str) -> None:
    """Add the shield ahead of the legs, its nose over the fork, and the foot board."""
    head = at["head"]
    front = at["front"]
    low = np.array([front[0] - shape.wheel - 0.08, 0, shape.floor])
    angle = np.linspace(-1.25, 1.25, 18)
    rows = []
    for share in np.linspace(0, 1, 14):
        middle = low + share * (head + [0.03, 0, -0.06] - low)
        wide = shape.apron * (0.72 + 0.5 * share - 0.45 * share**2)
        rows.append(
            np.stack(
                [
                    middle[0] + 0.14 * np.cos(angle) - 0.05,
                    wide * np.sin(angle) / np.sin(1.25),
                    middle[2] + 0 * angle,
                ],
                1,
            )
        )
    outer = np.array(rows)
    inner = outer - [0.012, 0, 0]
    model.add(
        grid(outer[:, ::-1], "apron", paint),
        grid(inner, "apron.inside", "plastic_black"),
        hull(
            [
                (head[0] + 0.17, head[2] - 0.28, 0.05, 0.09),
                (head[0] + 0.10, head[2] - 0.24, 0.09, 0.20),
                (head[0] + 0.02, head[2] - 0.24, 0.10, 0.24),
            ],
            "nose",
            paint,
            2.4,
            0.03,
        ),
        box(
            ((low[0] + at["seat"][0]) / 2 + 0.08, 0, shape.floor - 0.03),
            (low[0] - at["seat"][0] + 0.02, 2 * shape.apron * 0.78, 0.06),
            "floor",
            "plastic_black",
            0.02,
        ),
        tube(
            [low + [0, 0, -0.03], (at["rear"][0] + 0.30, 0, shape.floor - 0.05)],
            0.05,
            "frame",
            "underbody",
            10,
        ),
    )


def _body(model: Assembly, shape: Scooter, at: dict[str, np.ndarray], paint: str) -> None:
    """Add the body under the seat with engine and rear wheel, the seat, and the rear lamps."""
    seat = at["seat"]
    rear = at["rear"]
    wide = shape.body
    bottom = shape.floor - 0.02
    middle = (seat[2] - 0.06 + bottom) / 2
    half = (seat[2] - 0.06 - bottom) / 2
    tail = rear[0] - 0.10
    above = rear[2] + shape.wheel + 0.04
    high = (seat[2] - 0.05 - above) / 2
    model.add(
        hull(
            [
                (seat[0] + 0.24, middle, 0.7 * wide, half),
                (seat[0] + 0.05, middle + 0.02, wide, half - 0.02),
                (rear[0] + 0.18, (above + seat[2] - 0.08) / 2, wide, high + 0.05),
                (tail, above + high + 0.02, 0.65 * wide, 0.75 * high),
            ],
            "body",
            paint,
            shape.round_tail,
            0.05,
        ),
        hull(
            [
                (seat[0] + 0.26, seat[2] - 0.06, 0.10, 0.05),
                (seat[0], seat[2] - 0.05, 0.15, 0.05),
                (seat[0] - 0.20, seat[2] - 0.02, 0.14, 0.05),
                (seat[0] - 0.42, seat[2] + 0.0, 0.11, 0.04),
            ],
            "seat",
            "leather",
            3.0,
            0.04,
        ),
        box(rear + [0.16, 0.12, 0.0], (0.44, 0.12, 0.18), "engine", "plastic_black", 0.04),
        tube(
            [rear + [0.26, -0.13, -0.04], rear + [-0.14, -0.15, 0.04]],
            [0.045, 0.055],
            "silencer",
            "steel",
            14,
        ),
        *fittings.rear_lamps((tail - 0.03, 0, above + high + 0.05), 0.18),
        *fittings.rear_plate(tail - 0.02, above + 0.02, shape.seed),
        fittings.guard(
            rear[0], rear[2], shape.wheel + 0.02, shape.tyre + 0.05, (1.3, 2.6), "plastic_black"
        ),
    )
    model.add(
        *fittings.indicators(
            (at["head"][0] + 0.12, 0.17, at["head"][2] - 0.16), (tail + 0.02, 0.15, above + high)
        )
    )


def _handlebar(model: Assembly, shape: Scooter, at: dict[str, np.ndarray], paint: str) -> None:
    head = at["head"]
    grip = at["grip"]
    lamp = head + [0.13, 0, 0.06]
    model.add(
        hull(
            [
                (lamp[0] - 0.01, lamp[2], 0.08, 0.065),
                (lamp[0] - 0.10, lamp[2] + 0.01, 0.13, 0.08),
                (lamp[0] - 0.24, lamp[2] + 0.02, 0.10, 0.05),
            ],
            "head",
            paint,
            2.4,
            0.03,
        ),
        *fittings.head_lamp(lamp, 0.07, "gloss_black"),
    )
    for side in (1, -1):
        end = grip * [1, side, 1]
        model.add(
            tube([head + [0, 0, 0.06], end], 0.015, "handlebar", "plastic_black"),
            tube(
                [end - [0, side * 0.06, 0], end + [0, side * 0.07, 0]],
                0.019,
                "grip",
                "plastic_black",
            ),
        )
    half, top = shape.mirror
    model.add(*fittings.mirrors(grip[0] + 0.03, half, top))


def _screen(model: Assembly, shape: Scooter, at: dict[str, np.ndarray]) -> None:
    head = at["head"]
    low = head[2] + 0.02
    high = shape.bar_height + shape.screen
    angle = np.linspace(-1.0, 1.0, 12)
    rows = [
        np.stack(
            [
                head[0] + 0.14 - 0.35 * (z - low) - 0.2 * (1 - np.cos(angle)),
                0.24 * np.sin(angle),
                np.full(len(angle), z),
            ],
            1,
        )
        for z in np.linspace(low, high, 8)
    ]
    model.add(grid(np.array(rows)[:, ::-1], "windscreen", "glass"))
