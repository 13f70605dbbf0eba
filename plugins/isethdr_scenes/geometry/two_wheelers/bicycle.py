"""Bicycles: frame, wheels, handlebars and fittings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...lamps import lamp
from ..mesh.piece import Assembly, shift
from ..mesh.primitives import Stem, ball, box, lathe, tube, tubes

SEAT_ANGLE = np.radians(73.0)
HEAD_ANGLE = np.radians(71.0)
CHAINSTAY_M = 0.43
BRACKET_DROP_M = 0.055
CRANK_M = 0.17
CRANK_DEG = 35.0
PEDAL_Y_M = 0.135


@dataclass(frozen=True)
class Bicycle:
    """Proportions of a bicycle, m. The wheels stand on y = 0, and x = 0 is half-way between
    them.
    """

    wheelbase: float
    wheel: float  # radius, tyre included
    tyre: float  # half the thickness of the tyre
    seat_tube: float  # length
    saddle: float  # height
    bars: Literal["flat", "drop", "swept"]
    bar_height: float
    bar_width: float
    top_tube: Literal["level", "low"] = "level"
    mudguards: bool = False
    rack: bool = False
    basket: bool = False
    lamps: bool = True
    box_length: float = 0.0  # length of a cargo box ahead of the rider; 0: no box
    frame: float = 0.017  # radius of the tubes of the frame
    colour: str = "blue"

    @property
    def points(self) -> dict[str, np.ndarray]:
        """Return the joints (3,), m, by name: axles, bracket, top of the seat tube, saddle, lower
        and upper end of the steering head, and stem.
        """
        rear = np.array([-self.wheelbase / 2, 0.0, self.wheel])
        front = np.array([self.wheelbase / 2, 0.0, self.wheel])
        bracket = rear + [CHAINSTAY_M, 0, 0.28 - self.wheel + 0.3 * (self.wheel - 0.335)]
        along = np.array([-np.cos(SEAT_ANGLE), 0, np.sin(SEAT_ANGLE)])
        seat = bracket + self.seat_tube * along
        saddle = bracket + along * (self.saddle - bracket[2]) / along[2]
        steering = np.array([-np.cos(HEAD_ANGLE), 0, np.sin(HEAD_ANGLE)])
        low = front + [-0.02, 0, 0] + (self.wheel + 0.06) * steering
        if self.box_length:
            low = np.array([front[0] - self.box_length - self.wheel - 0.05, 0, self.wheel + 0.42])
        head = low + max(0.10, 0.62 * (self.bar_height - low[2])) * steering
        stem = low + steering * (self.bar_height - low[2]) / steering[2]
        return {
            "rear": rear,
            "front": front,
            "bracket": bracket,
            "seat": seat,
            "saddle": saddle,
            "low": low,
            "head": head,
            "stem": stem,
        }

    @property
    def grips(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the middles (3,), m, of the left and the right grip."""
        stem = self.points["stem"]
        half = self.bar_width / 2
        offset = {
            "flat": [0.03, half - 0.06, 0.01],
            "swept": [-0.12, half - 0.04, 0.02],
            "drop": [0.14, half - 0.01, -0.03],
        }[self.bars]
        return stem + offset, stem + np.array(offset) * [1, -1, 1]

    @property
    def pedals(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the middles (3,), m, of the left and the right pedal."""
        bracket = self.points["bracket"]
        turn = np.radians(CRANK_DEG)
        reach = CRANK_M * np.array([np.cos(turn), 0, np.sin(turn)])
        return bracket + reach + [0, PEDAL_Y_M, 0], bracket - reach - [0, PEDAL_Y_M, 0]

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Return length, width and height, m."""
        width = max(self.bar_width, 2 * (PEDAL_Y_M + 0.043), 0.62 if self.box_length else 0.0)
        top = max(self.saddle + 0.03, self.grips[0][2] + 0.017, self.points["stem"][2] + 0.013)
        return self.wheelbase + 2 * self.wheel, width, float(top)


def build(shape: Bicycle, name: str = "bicycle") -> Assembly:
    """Return all parts of a bicycle."""
    model = Assembly(name)
    joints = shape.points
    for axle in (joints["rear"], joints["front"]):
        _wheel(model, shape, axle)
    _frame(model, shape, joints)
    _handlebar(model, shape, joints)
    _drive(model, shape, joints)
    _saddle(model, joints)
    _fittings(model, shape, joints)
    return model


def _wheel(model: Assembly, shape: Bicycle, centre: np.ndarray) -> None:
    turn = np.linspace(0, 2 * np.pi, 49)

    def ring(radius: float) -> np.ndarray:
        circle = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], 1)
        return centre + radius * circle

    middle = shape.wheel - shape.tyre
    rim = middle - shape.tyre - 0.006
    model.add(
        tube(ring(middle), shape.tyre, "tyre", "tyre", 8, False),
        tube(ring(rim), 0.011, "rim", "alloy", 6, False),
        tube([centre - [0, 0.05, 0], centre + [0, 0.05, 0]], 0.022, "hub", "steel", 10),
    )
    spokes = []
    for k in range(28):
        angle = 2 * np.pi * k / 28
        lean = angle + (1.3 if k % 2 else -1.3)
        root = 0.022 * np.array([np.cos(lean), 0, np.sin(lean)])
        root[1] = 0.03 * (-1) ** (k // 2)
        to = rim * np.array([np.cos(angle), 0, np.sin(angle)])
        spokes.append(Stem([centre + root, centre + to], 0.0014, 4))
    model.add(tubes(spokes, "spoke", "steel"))


def _frame(model: Assembly, shape: Bicycle, j: dict[str, np.ndarray]) -> None:
    paint = f"paint_{shape.colour}"
    thick = shape.frame
    top_end = j["head"] - [0, 0, 0.03]
    top_start = j["seat"] - [0, 0, 0.03]
    if shape.top_tube == "low":
        top_start = j["bracket"] + 0.35 * (j["seat"] - j["bracket"])
        top_end = j["low"] + [0, 0, 0.06]
    tubes = [
        (j["bracket"], j["seat"], thick),
        (j["bracket"], j["low"], thick + 0.004),
        (top_start, top_end, thick),
        (j["head"], j["low"] - 0.2 * (j["head"] - j["low"]), thick + 0.005),
    ]
    for side in (1, -1):
        drop = j["rear"] + [0, side * 0.055, 0]
        tubes.append((drop, j["bracket"] + [0, side * 0.03, 0], 0.009))
        tubes.append((drop, j["seat"] + [0, side * 0.018, -0.05], 0.009))
    for start, end, radius in tubes:
        model.add(tube([start, end], radius, "frame", paint, 10))
    post = j["saddle"] - [0, 0, 0.03]
    model.add(tube([j["seat"], post], 0.013, "seat_post", "steel", 10))
    if shape.box_length:
        _cargo_box(model, shape, j)
        return
    crown = j["low"] + [0.012, 0, -0.04]
    for side in (1, -1):
        path = [
            crown + [0, side * 0.045, 0],
            crown + [0.03, side * 0.05, -0.10],
            j["front"] + [0, side * 0.055, 0],
        ]
        model.add(tube(path, thick - 0.005, "fork", paint))
    model.add(tube([crown - [0, 0.045, 0], crown + [0, 0.045, 0]], 0.015, "fork.crown", paint))


def _cargo_box(model: Assembly, shape: Bicycle, j: dict[str, np.ndarray]) -> None:
    """Add the box between the steering head and the front wheel, and the frame under it."""
    paint = f"paint_{shape.colour}"
    middle = j["low"][0] + 0.06 + shape.box_length / 2
    bottom = 0.24
    high = 0.44
    wide = 0.60
    model.add(
        box((middle, 0, bottom + high / 2), (shape.box_length, wide, high), "box", "wood", 0.02),
        box(
            (middle, 0, bottom + high + 0.004),
            (shape.box_length - 0.05, wide - 0.05, 0.012),
            "box.inside",
            "gap",
        ),
        box(
            (middle, 0, bottom + high),
            (shape.box_length + 0.02, wide + 0.02, 0.03),
            "box.rim",
            paint,
            0.008,
        ),
        tube(
            [j["bracket"], (middle, 0, 0.20), j["front"] + [-shape.wheel - 0.03, 0, 0.16]],
            0.025,
            "frame",
            paint,
            10,
        ),
    )
    crown = j["front"] + [-0.02, 0, shape.wheel + 0.05]
    model.add(tube([j["front"] + [-shape.wheel - 0.03, 0, 0.16], crown], 0.02, "frame", paint, 10))
    for side in (1, -1):
        low = j["front"] + [0, side * 0.055, 0]
        model.add(tube([crown + [0, side * 0.05, 0], low], 0.014, "fork", paint))


def _handlebar(model: Assembly, shape: Bicycle, j: dict[str, np.ndarray]) -> None:
    stem = j["stem"]
    head = j["head"]
    left, right = shape.grips
    half = shape.bar_width / 2
    model.add(tube([head, stem], 0.013, "stem", "plastic_black"))
    for side, grip in ((1, left), (-1, right)):
        inner = stem + [0.02, side * 0.05, 0.0]
        if shape.bars == "flat":
            path = [stem, inner, stem + [0.03, side * (half - 0.005), 0.01]]
        elif shape.bars == "swept":
            path = [stem, stem + [0.06, side * 0.6 * half, 0.02]]
            path += [stem + [-0.02, side * (half - 0.015), 0.02]]
            path += [stem + [-0.19, side * (half - 0.03), 0.02]]
        else:
            y = side * (half - 0.015)
            ahead = ((0.07, 0.0), (0.14, -0.015), (0.155, -0.06), (0.12, -0.125), (0.03, -0.135))
            path = [stem, stem + [0.01, side * 0.7 * half, 0.0]]
            path += [stem + [x, y, z] for x, z in ahead]
        model.add(tube(path, 0.012, "handlebar", "alloy"))
        along = np.array([0.06, 0, 0]) if shape.bars != "flat" else np.array([0, 0.055, 0])
        model.add(tube([grip - along, grip + along], 0.017, "grip", "plastic_black"))


def _drive(model: Assembly, shape: Bicycle, j: dict[str, np.ndarray]) -> None:
    bracket = j["bracket"]
    ring = [(0.09, 0.045), (0.095, 0.048), (0.095, 0.052), (0.06, 0.052)]
    ring = [(r, -h) for r, h in reversed(ring)]  # on the right side
    model.add(lathe(ring, "chainring", "steel", 28).moved(shift(*bracket)))
    for side, pedal in zip((1, -1), shape.pedals):
        end = pedal - [0, side * 0.06, 0]
        model.add(
            tube([bracket + [0, side * 0.06, 0], end], 0.011, "crank", "alloy"),
            box(pedal, (0.09, 0.085, 0.022), "pedal", "plastic_black", 0.006),
        )
    for z in (0.05, -0.05):
        start = bracket + [0, -0.05, z * 1.8]
        end = j["rear"] + [0, -0.05, z * 0.7]
        model.add(tube([start, end], 0.005, "chain", "steel", 5))


def _saddle(model: Assembly, j: dict[str, np.ndarray]) -> None:
    top = j["saddle"]
    model.add(
        ball(top + [-0.07, 0, 0], (0.10, 0.085, 0.03), "saddle", "leather", 8),
        ball(top + [0.06, 0, 0.0], (0.13, 0.032, 0.025), "saddle", "leather", 8),
    )


def _fittings(model: Assembly, shape: Bicycle, j: dict[str, np.ndarray]) -> None:
    if shape.mudguards:
        for axle, turn in ((j["rear"], (0.35, 2.6)), (j["front"], (0.55, 2.2))):
            b = np.linspace(*turn, 24)
            arc = np.stack([np.cos(b), 0 * b, np.sin(b)], 1)
            path = axle + (shape.wheel + 0.018) * arc
            model.add(tube(path, 0.016, "mudguard", "plastic_black", 6))
    if shape.rack:
        top = shape.wheel * 2 + 0.05
        x = j["rear"][0]
        for y in (0.05, 0.0, -0.05):
            path = [(x + 0.20, y, top), (x - 0.20, y, top)]
            model.add(tube(path, 0.006, "rack", "steel", 6))
        for y in (0.06, -0.06):
            path = [j["rear"] + [0, y, 0], (x - 0.12, 0.9 * y, top)]
            model.add(tube(path, 0.006, "rack", "steel", 6))
    if shape.basket:
        at = j["stem"] + [0.20, 0, -0.10]
        model.add(
            box(at, (0.26, 0.36, 0.22), "basket", "wood", 0.02),
            box(at + [0, 0, 0.108], (0.23, 0.33, 0.01), "basket.inside", "gap"),
        )
    if shape.lamps:
        _lamps(model, shape, j)


def _lamps(model: Assembly, shape: Bicycle, j: dict[str, np.ndarray]) -> None:
    ahead = (1.0, 0.0, 0.0)
    behind = (-1.0, 0.0, 0.0)
    front = j["head"] + [0.05, 0, 0.03]
    if shape.basket or shape.box_length:
        front = j["front"] + [-0.02, 0, shape.wheel + 0.09]
    rear = j["seat"] + [-0.055, 0, 0.0]
    if shape.rack:
        rear = np.array([j["rear"][0] - 0.215, 0, shape.wheel * 2 + 0.04])
    model.add(
        tube([front, front + [0.06, 0, 0]], 0.032, "lamp.body", "plastic_black", 12),
        lathe([(0.028, 0), (0.001, 0.003)], "bike_front", "lamp_white", 14, "x")
        .moved(shift(*front + [0.063, 0, 0]))
        .named("bike_front", lamp=lamp("bike_front", ahead)),
        tube([rear + [0.03, 0, 0], rear], 0.028, "lamp.body", "plastic_black", 12),
        lathe([(0.001, -0.003), (0.026, 0)], "bike_tail", "lamp_red", 14, "x")
        .moved(shift(*rear + [-0.003, 0, 0]))
        .named("bike_tail", lamp=lamp("bike_tail", behind)),
    )
