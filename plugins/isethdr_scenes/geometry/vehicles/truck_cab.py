"""The cab of the rigid truck: shell, windows, grille, bumper, gaps, inside and fittings."""

from __future__ import annotations

import numpy as np

from ..mesh.piece import Assembly, Piece, pose
from ..mesh.primitives import box, lathe, tube
from .body import Body
from .headlamp import RoundLamp, round_lamp
from .panels import Region, cut_region, mirrors
from .shell import Shell
from .wheels import plate

CAB_LENGTH_M = 2.15
CAB_WIDTH_M = 2.48
HALF_M = CAB_WIDTH_M / 2  # half the width
NOSE_M = CAB_LENGTH_M / 2  # distance of the front end ahead of the middle of the cab
FRONT_AXLE_M = 1.38  # distance behind the front end
TYRE_M = 0.50  # radius of the tyres
DOOR_EDGES_M = (0.40, 1.62)  # distances behind the front end
DOOR_HEIGHTS_M = (0.62, 2.55)  # heights of the lower and upper end of the gaps around the doors
BUMPER_M = (0.40, 0.84)  # heights of its lower and upper edge
LAMPS_M = 0.64  # height of dipped beams and position lamps
BEZEL_M = 0.02  # width of the bezels of the lamps
GRILLE_M = (0.98, 1.46)  # heights of its lower and upper edge
SEAT_M = 0.55  # distance of both seats from the middle
SIDES = ((1, "left"), (-1, "right"))


def cab(paint: str) -> Assembly:
    """Return the cab without its wheels, its middle at x = 0; `paint` is the name of its
    material.
    """
    body = Body(_shell(), (FRONT_AXLE_M,), TYRE_M)
    _windows(body)
    _grille(body)
    _bumper(body)
    _door_gaps(body)
    body.arches(0.07, 0.55)
    model = Assembly("cab").add(body.paint.named("cab", paint), *body.parts, body.lining(0.9))
    _inside(model)
    at_the_nose = pose(NOSE_M + 0.02)
    model.add(*[part.moved(at_the_nose) for part in plate(0, 0.60, 1)])
    mirrors(model, 0.80, HALF_M, 2.05)
    _steps_and_handles(model)
    return model


def _shell() -> Shell:
    return Shell(
        length=CAB_LENGTH_M,
        width=CAB_WIDTH_M,
        upper=((0, 1.62), (0.03, 1.66), (0.36, 2.70), (0.62, 2.84), (1.9, 2.90), (2.15, 2.86)),
        belt=((0, 1.50), (2.15, 1.52)),
        clearance=0.42,
        lean=0.05,
        crown=9.0,
        front_round=(0.30, 0.14, 0.86),
        rear_round=(0.10, 0.06, 0.95),
        sweep=(0.05, 0.0),
        soft=0.03,
        step=0.05,
        flare=0.01,
    )


def _windows(b: Body) -> None:
    """Cut the windscreen and the windows of both doors."""
    windscreen = Region(
        "windscreen",
        "glass",
        [(0, 1.70), (1.03, 1.70), (0.97, 2.58), (0, 2.60)],
        "front",
        trim="gloss_black",
    )
    side_window = Region(
        "side_window",
        "glass",
        [(0.42, 1.62), (1.52, 1.62), (1.52, 2.45), (0.58, 2.45)],
        "sides",
        sunk_m=0.006,
        trim="gloss_black",
    )
    cut_region(b, windscreen)
    cut_region(b, side_window)


def _grille(b: Body) -> None:
    """Cut the grille, and put five bars in front of it."""
    low, high = GRILLE_M
    outline = [(0, low), (0.72, low), (0.78, high), (0, high)]
    cut_region(b, Region("grille", "gap", outline, "front", trim="chrome", margin_m=0.02))
    across = np.linspace(-0.74, 0.74, 9)
    for k in range(5):
        # the bars have the curvature of the shell's front
        path = [(NOSE_M + 0.016 - 0.05 * y * y, y, 1.02 + 0.10 * k) for y in across]
        b.parts.append(tube(path, 0.016, "grille.bar", "plastic_black", 6))


def _bumper(b: Body) -> None:
    """Cut the bumper, and the round lamps of both sides out of it."""
    low, high = BUMPER_M
    outline = [(0, low), (1.3, low), (1.3, high), (0, high)]
    bumper = cut_region(b, Region("bumper", "plastic_black", outline, "front"))
    for side, tag in SIDES:
        for kind, y, z, radius, material in (
            ("low_beam", 0.86, LAMPS_M, 0.075, "lamp_white"),
            ("position", 1.02, LAMPS_M, 0.055, "lamp_white"),
            ("indicator_front", 1.12, LAMPS_M + 0.10, 0.036, "lamp_amber"),
        ):
            shape = RoundLamp(kind, tag, (side * y, z), radius, BEZEL_M, material)
            bumper = round_lamp(b, bumper, shape)


def _door_gaps(b: Body) -> None:
    """Cut the gaps in front of and behind both doors."""
    low, high = DOOR_HEIGHTS_M

    def off_the_door(p: Piece) -> np.ndarray:
        _, ay, z, _ = b.at(p)
        return np.max([0.8 * HALF_M - ay, z - high, low - z], 0)

    for edge in DOOR_EDGES_M:
        b.line(lambda p, u=edge: b.at(p)[0] - u, off_the_door)


def _inside(model: Assembly) -> None:
    """Add dashboard, steering wheel and both seats."""
    rim = [(0.21, 0.012), (0.23, 0), (0.21, -0.012), (0.19, 0), (0.21, 0.012)]
    model.add(
        box((0.25, 0, 1.50), (0.5, 2.1, 0.2), "dashboard", "interior", 0.06),
        lathe(rim, "steering_wheel", "plastic_black", 20, "x").moved(pose(0.05, SEAT_M, 1.68)),
    )
    for y in (SEAT_M, -SEAT_M):
        model.add(
            box((-0.42, y, 1.65), (0.18, 0.52, 0.85), "seat.back", "seat", 0.07),
            box((-0.14, y, 1.30), (0.5, 0.52, 0.16), "seat.cushion", "seat", 0.06),
        )


def _steps_and_handles(model: Assembly) -> None:
    """Add a step below each door and a handle on it."""
    for side, _ in SIDES:
        step = (NOSE_M - 1.0, side * (HALF_M - 0.05), 0.52)
        handle = (-0.52, side * (HALF_M + 0.012), 1.45)
        model.add(
            box(step, (0.5, 0.16, 0.03), "step", "steel"),
            box(handle, (0.16, 0.02, 0.03), "handle", "plastic_black", 0.008),
        )
