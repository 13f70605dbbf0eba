"""A city bus on the lofted shell."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...lamps import lamp
from ..mesh.piece import Assembly, Piece
from ..mesh.primitives import box, tube
from .body import Body
from .headlamp import RoundLamp, round_lamp
from .panels import BACK, FRONT, Region, cut_region, mirrors
from .shell import Shell
from .wheels import Wheel, plate, wheel

WIDTH_M = 2.52
HALF_M = WIDTH_M / 2  # half the width
HEIGHT_M = 3.05  # height of the roof
TYRE_M = 0.48  # radius of the tyres
WINDOWS_M = (1.30, 2.38)  # lower and upper edge of the side windows
DOORS_M = (0.48, 2.42)  # lower and upper edge of the panes of the doors
SIGN_M = 2.68  # height of the middle of the letters of the sign
SKIRT_M = 0.98  # upper edge of the lower body
SIDES = ((1, "left"), (-1, "right"))


@dataclass(frozen=True)
class _Plan:
    """Places of axles and doors along a bus, m behind its front end."""

    length: float  # length of the bus

    @property
    def front(self) -> float:
        """Return x of the front end."""
        return self.length / 2

    @property
    def axles(self) -> tuple[float, float]:
        return 2.65, self.length - 3.3

    @property
    def doors(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return where each door of the right side begins and ends."""
        second = self.length * 0.46
        return (0.62, 1.72), (second, second + 1.25)

    def at_a_door(self, start: float, end: float, margin: float) -> bool:
        """Return whether a door, widened by `margin` at both ends, overlaps start to end, m."""
        return any(end > d0 - margin and start < d1 + margin for d0, d1 in self.doors)


def bus(
    name: str = "bus",
    length: float = 11.8,
    paint: str = "paint_yellow",
    lower: str = "paint_red",
) -> Assembly:
    """Return a city bus with its doors on the right.

    Parameters
    ----------
    name : name of the assembly.
    length : length of the bus, m.
    paint : name of the material of the upper body.
    lower : name of the material of the lower body.
    """
    plan = _Plan(length)
    body = Body(_shell(length), plan.axles, TYRE_M)
    _windscreen(body)
    _sign(body)
    _doors(body, plan)
    _side_windows(body, plan)
    _rear_openings(body)
    for side, tag in SIDES:
        _front_lamps(body, side, tag)
        _rear_lamps(body, side, tag)
    _lower_body(body, lower)
    model = Assembly(name)
    model.add(body.paint.named("body", paint), *body.parts, body.lining(1.0))
    _wheels(model, plan)
    model.add(
        box((0, 0, 0.50), (length - 0.8, 2.3, 0.06), "floor", "underbody"),
        *plate(plan.front + 0.04, 0.48, 1),
        *plate(-plan.front - 0.035, 0.50, -1, seed=2),
    )
    _seats(model, plan)
    dashboard = (plan.front - 0.75, 0, 1.08)
    model.add(box(dashboard, (0.45, 2.1, 0.2), "dashboard", "interior", 0.05))
    mirrors(model, plan.front - 0.05, HALF_M - 0.12, 2.1, (0.10, 0.20, 0.36))
    _wipers(model, plan)
    roof_unit = (-1.5, 0, HEIGHT_M + 0.10)
    model.add(box(roof_unit, (3.2, 1.7, 0.26), "roof_unit", "paint_white", 0.08))
    return model


def _shell(length: float) -> Shell:
    return Shell(
        length=length,
        width=WIDTH_M,
        upper=(
            (0, 1.30),
            (0.04, 1.36),
            (0.24, 2.70),
            (0.50, 2.98),
            (0.8, HEIGHT_M),
            (length - 0.6, HEIGHT_M),
            (length - 0.12, 2.85),
            (length, 1.25),
        ),
        belt=((0, 1.18), (length, 1.18)),
        clearance=0.32,
        lean=0.03,
        crown=10.0,
        front_round=(0.32, 0.14, 0.84),
        rear_round=(0.22, 0.12, 0.86),
        sweep=(0.05, 0.03),
        soft=0.03,
        step=0.09,
        flare=0.008,
    )


def _windscreen(b: Body) -> None:
    outline = [(0, 1.22), (1.10, 1.22), (1.08, 2.45), (0, 2.47)]
    cut_region(b, Region("windscreen", "glass", outline, "front", trim="gloss_black"))


def _sign(b: Body) -> None:
    """Cut the destination sign above the windscreen, and glowing letters out of it."""
    outline = [(0, 2.56), (0.95, 2.56), (0.93, 2.80), (0, 2.80)]
    sign = cut_region(b, Region("sign.front", "gloss_black", outline, "front"))
    for k, middle in enumerate(np.linspace(-0.72, 0.72, 9)):
        if k % 4 == 1:  # space between words
            continue
        _, _, z, y = b.at(sign)
        across = np.abs(y - middle) - 0.05
        upwards = np.abs(z - SIGN_M) - 0.075
        # a round hole at a height that differs from letter to letter
        hole = 0.030 - np.hypot(y - middle, z - SIGN_M - 0.02 * (k % 3 - 1))
        letter = np.max([across, upwards, hole], 0)
        _, sign = b.carve(sign, "sign", "lamp_amber", letter, lamp("sign", FRONT))


def _doors(b: Body, plan: _Plan) -> None:
    """Cut two panes for each door."""
    low, high = DOORS_M
    for k, (start, end) in enumerate(plan.doors):
        middle = 0.5 * (start + end)
        for u0, u1 in ((start + 0.05, middle - 0.04), (middle + 0.04, end - 0.05)):
            pane = Region(
                f"door{k}",
                "glass_tinted",
                [(u0, low), (u1, low), (u1, high), (u0, high)],
                "right",
                trim="gloss_black",
                margin_m=0.045,
            )
            cut_region(b, pane)


def _side_windows(b: Body, plan: _Plan) -> None:
    """Cut up to seven windows into each side, none at a door, and the driver's window."""
    low, high = WINDOWS_M
    posts = np.linspace(1.95, plan.length - 0.55, 8)
    for side, tag in SIDES:
        for start, end in pairwise(posts):
            if side < 0 and plan.at_a_door(start, end, 0.1):
                continue
            u0 = start + 0.05
            u1 = end - 0.05
            window = Region(
                "side_window",
                "glass_tinted",
                [(u0, low), (u1, low), (u1, high), (u0, high)],
                tag,
                trim="gloss_black",
                margin_m=0.03,
            )
            cut_region(b, window)
    outline = [(0.50, low), (1.80, low), (1.80, high), (0.62, high)]
    cut_region(b, Region("driver_window", "glass", outline, "left", trim="gloss_black"))


def _rear_openings(b: Body) -> None:
    """Cut the rear window, and the grille of the engine below it."""
    window = [(0, 1.62), (0.98, 1.62), (0.95, 2.45), (0, 2.45)]
    grille = [(0, 0.62), (0.60, 0.62), (0.60, 1.02), (0, 1.02)]
    cut_region(b, Region("rear_window", "glass_tinted", window, trim="gloss_black"))
    cut_region(b, Region("engine_grille", "gap", grille, trim="plastic_black"))


def _front_lamps(b: Body, side: int, tag: str) -> None:
    """Cut the round lamps of one side of the front."""
    for kind, y, z, radius, material in (
        ("low_beam", 0.93, 0.70, 0.085, "lamp_white"),
        ("position", 0.74, 0.70, 0.06, "lamp_white"),
        ("indicator_front", 1.09, 0.72, 0.045, "lamp_amber"),
    ):
        round_lamp(b, None, RoundLamp(kind, tag, (side * y, z), radius, 0.02, material))


def _rear_lamps(b: Body, side: int, tag: str) -> None:
    """Cut the round lamps of one side of the rear, one above the other."""
    for kind, height, material in (
        ("tail", 0.80, "lamp_red"),
        ("brake", 0.98, "lamp_red"),
        ("indicator_rear", 1.16, "lamp_amber"),
        ("reverse", 0.63, "lamp_white"),
    ):
        u, _, z, y = b.at()
        beyond = np.hypot(y - side * 1.0, z - height) - 0.075
        b.take(
            f"{kind}.{tag}",
            material,
            np.maximum(beyond, b.shell.length - 0.45 - u),
            sunk=-0.015,
            rim="plastic_black",
            lamp=lamp(kind, BACK),
        )


def _lower_body(b: Body, material: str) -> None:
    """Cut the lower body out of the paint, both bumpers out of it, and open its wheel houses."""
    _, _, z, _ = b.at()
    skirt = b.take("lower", material, z - SKIRT_M)
    u, _, z, _ = b.at(skirt)
    between_the_ends = (u > 0.4) & (u < b.shell.length - 0.4)
    _, skirt = b.carve(skirt, "bumper", "plastic_black", z - 0.46 + 9 * between_the_ends)
    _wheel_houses(b, skirt)


def _wheel_houses(b: Body, skirt: Piece) -> None:
    """Open the wheel houses in the lower body, in place of the paint above it."""
    upper = b.paint
    b.paint = skirt
    b.parts = [part for part in b.parts if part is not skirt]
    b.arches(0.07, 0.55)
    b.parts.append(b.paint)
    b.paint = upper


def _wheels(model: Assembly, plan: _Plan) -> None:
    shape = Wheel(TYRE_M, 0.29, 0.58, style="steel")
    for k, u in enumerate(plan.axles):
        for side, _ in SIDES:
            model.add(*wheel(shape, plan.front - u, side * (HALF_M - 0.18), f"wheel{k}"))


def _seats(model: Assembly, plan: _Plan) -> None:
    """Add rows of two seats on the left and one on the right, none at a door."""
    for u in np.arange(2.6, plan.length - 1.0, 0.85):
        x = plan.front - u
        for y in (0.85, 0.40, -0.85):
            if y < 0 and plan.at_a_door(u, u, 0.4):
                continue
            model.add(
                box((x, y, 1.15), (0.08, 0.42, 0.75), "seat.back", "seat", 0.03),
                box((x + 0.2, y, 0.88), (0.42, 0.42, 0.08), "seat", "seat", 0.03),
            )


def _wipers(model: Assembly, plan: _Plan) -> None:
    for y in (-0.25, 0.35):
        path = [(plan.front, y, 1.25), (plan.front - 0.03, y - 0.45, 1.62)]
        model.add(tube(path, 0.01, "wiper", "plastic_black", 6))
