"""Motorcycles: naked, sports and touring machines, and cruisers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..mesh.piece import Assembly, Piece
from ..mesh.primitives import box, grid, tube
from . import fittings
from .hull import hull

FRAME_M = 0.10  # distance of the frame's and the swing arm's beams from the middle
ENGINE_M = 0.40  # height of the middle of the engine


@dataclass(frozen=True)
class Motorcycle:
    """Proportions of a motorcycle, m. It stands on y = 0, and x = 0 is half-way between the ends of
    its tyres.
    """

    wheelbase: float
    front_wheel: float  # radius
    rear_wheel: float
    front_tyre: float  # width
    rear_tyre: float
    rake_deg: float  # angle of the fork from upright
    seat: float  # height
    bar_height: float
    bar_width: float
    # distance along x from the steering head to the grips; negative: the grips are further back
    bar_reach: float
    tank: float  # half the height of the tank
    fairing: Literal["none", "half", "full"] = "none"
    screen: float = 0.0  # height of the windscreen over the steering head
    tail: float = 0.10  # rise of the tail over the seat
    panniers: bool = False
    wired: bool = False  # wire spokes
    spokes: int = 6
    pegs: float = 0.0  # distance of the foot pegs ahead of the usual place
    colour: str = "red"
    seed: int = 0  # seed of the glyphs of the plate

    @property
    def points(self) -> dict[str, np.ndarray]:
        """Return points (3,), m, by name: axles, steering head, middle of the seat, left grip, left
        foot, pivot of the swing arm, and the place on the ground below the engine.
        """
        rear_x = -(self.wheelbase + self.front_wheel - self.rear_wheel) / 2
        rear = np.array([rear_x, 0, self.rear_wheel])
        front = np.array([rear_x + self.wheelbase, 0, self.front_wheel])
        rake = np.radians(self.rake_deg)
        rise = self.bar_height - 0.10 - self.front_wheel
        head = front + [-rise * np.tan(rake) - 0.02, 0, rise]
        grip = np.array([head[0] + self.bar_reach, self.bar_width / 2 - 0.07, self.bar_height])
        seat = np.array([rear_x + 0.36 * self.wheelbase, 0, self.seat])
        foot = np.array([rear_x + 0.42 * self.wheelbase + self.pegs, 0.26, 0.34])
        return {
            "rear": rear,
            "front": front,
            "head": head,
            "grip": grip,
            "seat": seat,
            "foot": foot,
            "pivot": rear + [0.40 * self.wheelbase, 0, 0.10],
            "engine": np.array([rear_x + 0.53 * self.wheelbase, 0, 0.0]),
        }

    @property
    def mirror(self) -> tuple[float, float]:
        """Return half the distance between the middles of the mirrors, and their height, m."""
        return max(self.bar_width / 2 - 0.05, 0.30), self.bar_height + 0.18

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Return length, width and height, m."""
        half, top = self.mirror
        width = max(self.bar_width, 2 * (half + 0.07), 0.94 if self.panniers else 0.0)
        length = self.wheelbase + self.front_wheel + self.rear_wheel
        return length, width, max(top + 0.045, self.points["head"][2] + self.screen)


def build(shape: Motorcycle, name: str = "motorcycle") -> Assembly:
    """Return all parts of a motorcycle."""
    model = Assembly(name)
    at = shape.points
    model.add(
        *fittings.wheel(
            at["front"][0], shape.front_wheel, shape.front_tyre, shape.spokes, shape.wired
        ),
        *fittings.wheel(
            at["rear"][0], shape.rear_wheel, shape.rear_tyre, shape.spokes, shape.wired
        ),
        *fittings.fork(at["front"], at["head"], 0.20, "alloy"),
        fittings.guard(
            at["front"][0],
            at["front"][2],
            shape.front_wheel + 0.02,
            shape.front_tyre + 0.04,
            (0.7, 2.5),
            f"paint_{shape.colour}",
        ),
    )
    _frame_and_engine(model, at)
    model.add(_tank(shape, at), _seat(shape, at), _tail_cover(shape, at))
    _handlebar(model, shape, at)
    _front(model, shape, at)
    _rear(model, shape, at)
    if shape.panniers:
        _panniers(model, shape, at)
    return model


def _frame_and_engine(model: Assembly, at: dict[str, np.ndarray]) -> None:
    for side in (1, -1):
        model.add(*_frame(at, side), _peg(at, side), _engine_cover(at, side))
    model.add(*_engine(at), *_exhaust(at))


def _frame(at: dict[str, np.ndarray], side: int) -> list[Piece]:
    """Return one side of the frame: swing arm, beam to its pivot, down tube and shock absorber."""
    across = np.array([0, side * FRAME_M, 0])
    rear = at["rear"]
    pivot = at["pivot"] + across
    beam = [at["head"] + [-0.02, side * 0.03, -0.06], pivot + [0.02, 0, 0.14], pivot]
    down = [
        at["head"] + [-0.03, side * 0.03, -0.16],
        at["engine"] + [0.16, side * FRAME_M, 0.26],
        at["engine"] + [-0.12, side * FRAME_M, 0.22],
    ]
    shock = [rear + [0.02, side * FRAME_M, 0.02], at["seat"] + [-0.16, side * 0.09, -0.09]]
    return [
        tube([rear + across, pivot], 0.028, "swing_arm", "alloy", 10),
        tube(beam, 0.024, "frame", "plastic_black", 10),
        tube(down, 0.02, "frame", "plastic_black", 10),
        tube(shock, 0.03, "shock", "steel", 10),
    ]


def _peg(at: dict[str, np.ndarray], side: int) -> Piece:
    """Return the foot peg of one side."""
    centre = at["foot"] * [1, side, 1] + [0, -side * 0.03, 0]
    return box(centre, (0.04, 0.12, 0.03), "peg", "plastic_black", 0.008)


def _engine_cover(at: dict[str, np.ndarray], side: int) -> Piece:
    centre = at["engine"] + [-0.02, side * 0.15, ENGINE_M]
    return box(centre, (0.24, 0.08, 0.22), "engine.cover", "alloy", 0.05, 4)


def _engine(at: dict[str, np.ndarray]) -> list[Piece]:
    """Return the block of the engine, and the fins of its cylinders, which lean forwards."""
    block = at["engine"] + [-0.02, 0, ENGINE_M]
    parts = [box(block, (0.46, 0.26, 0.30), "engine", "plastic_black", 0.05)]
    lean = 0.10  # tangent of the angle
    for k in range(6):
        z = 0.52 + 0.03 * k
        fin = at["engine"] + [0.07 + lean * (z - 0.5), 0, z]
        parts.append(box(fin, (0.22, 0.30, 0.018), "cylinder", "steel", 0.006))
    return parts


def _exhaust(at: dict[str, np.ndarray]) -> list[Piece]:
    """Return the pipe from the cylinders below the engine to the right of the rear wheel, and the
    silencer at its end.
    """
    engine = at["engine"]
    rear = at["rear"]
    pipe = [
        engine + [0.20, -0.08, 0.56],
        engine + [0.28, -0.12, 0.36],
        engine + [0.10, -0.14, 0.20],
        rear + [0.30, -0.17, -0.05],
        rear + [0.06, -0.19, 0.02],
    ]
    silencer = [rear + [0.26, -0.18, -0.03], rear + [-0.18, -0.20, 0.10]]
    return [
        tube(pipe, 0.024, "exhaust", "chrome", 12),
        tube(silencer, [0.05, 0.055], "silencer", "chrome", 16),
    ]


def _tank(shape: Motorcycle, at: dict[str, np.ndarray]) -> Piece:
    """Return the tank, between the steering head and the seat."""
    head = at["head"]
    seat = at["seat"]
    top = max(seat[2] + 0.16, head[2] - 0.03)
    nose = head[0] - 0.05
    back = seat[0] + 0.20
    length = nose - back
    h = shape.tank
    sections = [
        (nose, top - h, 0.07, 0.5 * h),
        (nose - 0.25 * length, top - h + 0.01, 0.155, h),
        (nose - 0.6 * length, top - h - 0.02, 0.16, 0.95 * h),
        (back, seat[2] + 0.01, 0.10, 0.45 * h),
    ]
    return hull(sections, "tank", f"paint_{shape.colour}", 2.5, 0.05)


def _seat(shape: Motorcycle, at: dict[str, np.ndarray]) -> Piece:
    """Return the seat, which rises to the rear where the passenger sits."""
    x, _, z = at["seat"]
    sections = [
        (x + 0.24, z - 0.03, 0.09, 0.04),
        (x, z - 0.05, 0.15, 0.05),
        (x - 0.16, z - 0.03, 0.14, 0.05),
        (x - 0.24, z + 0.4 * shape.tail, 0.12, 0.05),
        (x - 0.46, z + 0.7 * shape.tail, 0.10, 0.04),
    ]
    return hull(sections, "seat", "leather", 3.0, 0.03)


def _tail_cover(shape: Motorcycle, at: dict[str, np.ndarray]) -> Piece:
    """Return the painted cover below the seat and behind it."""
    x, _, z = at["seat"]
    tail = x - 0.52
    sections = [
        (x + 0.16, z - 0.12, 0.11, 0.05),
        (x - 0.15, z - 0.10, 0.13, 0.06),
        (tail + 0.10, z - 0.02 + 0.5 * shape.tail, 0.10, 0.055),
        (tail, z + 0.6 * shape.tail, 0.06, 0.035),
    ]
    return hull(sections, "tail_cover", f"paint_{shape.colour}", 2.6, 0.05)


def _handlebar(model: Assembly, shape: Motorcycle, at: dict[str, np.ndarray]) -> None:
    head = at["head"]
    grip = at["grip"]
    for side in (1, -1):
        end = grip * [1, side, 1]
        model.add(
            tube(
                [
                    head + [0, 0, 0.03],
                    head + [0.01, side * 0.10, 0.06],
                    end + [0.02, -side * 0.10, 0],
                    end,
                ],
                0.013,
                "handlebar",
                "alloy",
            ),
            tube(
                [end - [0, side * 0.06, 0], end + [0, side * 0.07, 0]],
                0.018,
                "grip",
                "plastic_black",
            ),
        )
    half, top = shape.mirror
    model.add(*fittings.mirrors(grip[0] + 0.02, half, top))
    model.add(box(head + [0.06, 0, 0.06], (0.03, 0.16, 0.09), "instruments", "gloss_black", 0.02))


def _front(model: Assembly, shape: Motorcycle, at: dict[str, np.ndarray]) -> None:
    head = at["head"]
    front = at["front"]
    paint = f"paint_{shape.colour}"
    lamp_x = head[0] + 0.20
    lamp = np.array([lamp_x, 0, head[2] - 0.06])
    if shape.fairing == "none":
        model.add(*fittings.head_lamp(lamp, 0.085, "chrome" if shape.wired else "plastic_black"))
    else:
        nose = front[0] + 0.05 if shape.fairing == "full" else lamp_x + 0.10
        lamp = np.array([nose + 0.005, 0, head[2] - 0.10])
        model.add(
            hull(
                [
                    (nose - 0.01, lamp[2], 0.075, 0.07),
                    (nose - 0.12, lamp[2] + 0.01, 0.17, 0.13),
                    (nose - 0.30, lamp[2] + 0.01, 0.22, 0.15),
                    (head[0] + 0.02, head[2] - 0.10, 0.20, 0.12),
                ],
                "fairing",
                paint,
                2.4,
                0.06,
            ),
            *fittings.head_lamp(lamp, 0.07, "gloss_black"),
        )
    if shape.fairing == "full":
        _belly(model, at, paint)
    if shape.screen:
        _screen(model, shape, lamp[0] - 0.10, head)
    model.add(
        *fittings.indicators(
            (lamp[0] - 0.09, 0.24, lamp[2] - 0.02),
            (at["seat"][0] - 0.44, 0.19, at["seat"][2] - 0.06 + 0.3 * shape.tail),
        )
    )


def _belly(model: Assembly, at: dict[str, np.ndarray], paint: str) -> None:
    """Add the side panels of a full fairing, from the steering head to below the engine."""
    head = at["head"]
    rear = at["rear"]
    for side in (1, -1):
        top = [(head[0] + 0.16, 0.20, head[2] - 0.14), (head[0] - 0.22, 0.20, head[2] - 0.26)]
        mid = [(head[0] + 0.18, 0.23, 0.58), (rear[0] + 0.56, 0.24, 0.50)]
        low = [(head[0] - 0.06, 0.17, 0.20), (rear[0] + 0.55, 0.15, 0.18)]
        rows = []
        for share in np.linspace(0, 1, 10):
            edge = [np.array(a) + share * (np.array(b) - a) for a, b in (top, mid, low)]
            t = np.linspace(0, 1, 14)[:, None]
            bend = (1 - t) ** 2 * edge[0] + 2 * t * (1 - t) * edge[1] + t**2 * edge[2]
            rows.append(bend * [1, side, 1])
        outer = np.array(rows)
        inner = outer - [0, side * 0.012, 0]
        sheets = (outer[::-1] if side < 0 else outer, inner if side < 0 else inner[::-1])
        model.add(*(grid(sheet, "fairing.side", paint) for sheet in sheets))


def _screen(model: Assembly, shape: Motorcycle, x: float, head: np.ndarray) -> None:
    """Add a curved windscreen that leans to the rear."""
    low = head[2] - 0.02
    high = head[2] + shape.screen
    angle = np.linspace(-1.0, 1.0, 12)
    rows = [
        np.stack(
            [
                x - 0.55 * (z - low) - 0.10 * (1 - np.cos(angle)) * 2.2,
                0.21 * np.sin(angle) * (1 - 0.25 * (z - low) / max(high - low, 1e-3)),
                np.full(len(angle), z),
            ],
            1,
        )
        for z in np.linspace(low, high, 8)
    ]
    model.add(grid(np.array(rows)[:, ::-1], "windscreen", "glass_tinted"))


def _rear(model: Assembly, shape: Motorcycle, at: dict[str, np.ndarray]) -> None:
    seat = at["seat"]
    rear = at["rear"]
    tail = np.array([seat[0] - 0.53, 0, seat[2] + 0.5 * shape.tail])
    model.add(*fittings.rear_lamps(tail, 0.14))
    end = rear[0] - 0.9 * shape.rear_wheel
    model.add(
        *fittings.rear_plate(end + 0.03, shape.rear_wheel * 2 + 0.06, shape.seed),
        tube(
            [tail + [0.08, 0, -0.03], (end + 0.06, 0, shape.rear_wheel * 2 + 0.10)],
            0.016,
            "plate.holder",
            "plastic_black",
            8,
        ),
        fittings.guard(
            rear[0],
            rear[2],
            shape.rear_wheel + 0.025,
            shape.rear_tyre + 0.04,
            (1.2, 2.7),
            "plastic_black",
        ),
    )


def _panniers(model: Assembly, shape: Motorcycle, at: dict[str, np.ndarray]) -> None:
    """Add a case on either side of the rear wheel, and the top case."""
    rear = at["rear"]
    seat = at["seat"]
    for side in (1, -1):
        model.add(
            box(
                (rear[0] + 0.04, side * 0.35, seat[2] - 0.18),
                (0.44, 0.22, 0.34),
                "pannier",
                "alloy",
                0.03,
            ),
            box(
                (rear[0] + 0.04, side * 0.35, seat[2] - 0.03),
                (0.45, 0.23, 0.02),
                "pannier.lid",
                "plastic_black",
                0.008,
            ),
        )
    model.add(
        box(
            (rear[0] + 0.0, 0, seat[2] + shape.tail + 0.20),
            (0.38, 0.42, 0.28),
            "top_case",
            "plastic_black",
            0.06,
        )
    )
