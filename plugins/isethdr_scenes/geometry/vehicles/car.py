"""Passenger cars: a body with a shape of `car_shapes`, its windows, gaps, wheels and fittings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..mesh.cutting import Within, polygon
from ..mesh.piece import Assembly, greatest
from .body import Body
from .car_cabin import fittings, interior
from .car_front import front
from .car_rear import rear
from .car_shapes import Car
from .shell import Shell
from .wheels import Wheel, wheel

if TYPE_CHECKING:
    from ..mesh.piece import Piece

TRACK_INSET_M = 0.125
TYRE_WIDTH_M = 0.215


@dataclass(frozen=True)
class _Pane:
    """Windscreen or rear window. At each height it is as wide as the cabin, less a margin."""

    name: str
    material: str
    z_m: tuple[float, float]  # lower and upper border
    u_m: tuple[float, float]  # distances of its start and end from the front of the car
    margin_m: float  # distance between the glass and the border of the cabin
    post_m: float = 0.0  # half the width of a post in its middle; 0: no post


def build(car: Car, name: str = "car", coarse: bool = False) -> Assembly:
    """Return all parts of a car.

    Parameters
    ----------
    car : measures, styles and paint.
    name : name of the assembly.
    coarse : whether the car has larger faces and lacks details that cells of 10 cm do not resolve:
        gaps around doors and lids, bars, glyphs, handles and wipers.
    """
    axles = (car.overhang, car.overhang + car.wheelbase)
    shell = Shell(
        car.length,
        car.width,
        car.roof,
        car.belt,
        car.clearance,
        car.lean,
        car.crown,
        step=car.step,
        coarse=coarse,
    )
    body = Body(shell, axles, car.tyre)
    _screens(body, car)
    if not car.open_roof:
        _side_windows(body, car)
    front(body, car)
    rear(body, car)
    if not coarse:
        _door_gaps(body, car)
        _lid_gaps(body, car)
    _sills(body, car, axles)
    if car.bed:
        _bed(body, car)
    if car.open_roof:
        _open_roof(body, car)
    body.arches()
    model = Assembly(name).add(
        body.paint.named("body", f"paint_{car.paint}"), *body.parts, body.lining(0.55)
    )
    for end, u in zip(("front", "rear"), axles):
        for side, tag in ((1, "left"), (-1, "right")):
            y = side * (car.width / 2 - TRACK_INSET_M)
            model.add(
                *wheel(
                    Wheel(car.tyre, TYRE_WIDTH_M, spokes=car.spokes),
                    car.length / 2 - u,
                    y,
                    f"wheel.{end}_{tag}",
                )
            )
    fittings(model, body, car)
    interior(model, body, car)
    return model


def _screens(b: Body, c: Car) -> None:
    """Cut windscreen and rear window. A panel van has two panes at the rear, 12 to 16 cm apart."""
    cowl, top, back, base = (c.roof[k] for k in (2, 3, 5, 6))
    _screen(
        b,
        c,
        _Pane(
            "windscreen",
            "glass",
            (cowl[1] + 0.045, top[1] - 0.01),
            (cowl[0] - 0.25, top[0] + 0.10),
            0.135,
        ),
    )
    if c.open_roof:
        return
    if c.panel:
        z = (1.16, back[1] - 0.22)
        u = (back[0], c.length + 0.2)
        margin = 0.17
    else:
        z = (max(base[1], c.tail_lamp[2][1]) + 0.03, back[1] - 0.04)
        u = (back[0] + 0.03, c.length + 0.1)
        margin = 0.13
    _screen(b, c, _Pane("rear_window", "glass_tinted", z, u, margin, 0.08 if c.panel else 0.0))


def _screen(b: Body, c: Car, pane: _Pane) -> None:
    """Cut a pane with a dark frame."""
    z = np.linspace(*pane.z_m, 9)
    shoulder = float(b.belt(np.mean(pane.u_m)))
    y = c.width / 2 * 0.93 * (1 - c.lean * np.maximum(z - shoulder, 0)) - pane.margin_m
    outline = polygon(np.concatenate([np.stack([y, z], 1), np.stack([-y, z], 1)[::-1]]), 0.015)

    def outside(part: Piece, post: float, grow: float) -> np.ndarray:
        u, ay, zz, _ = b.at(part)
        beside = np.maximum(pane.u_m[0] - u, u - pane.u_m[1])
        if post:
            beside = np.maximum(beside, post - ay)
        return np.maximum(outline(ay, zz, Within(part.faces, beside, grow)), beside) - grow

    frame = outside(b.paint, max(0.0, pane.post_m - 0.02), 0.02)
    trim = b.take(pane.name + ".trim", "gloss_black", frame)
    b.carve(trim, pane.name, pane.material, outside(trim, pane.post_m, 0.0))


def _side_windows(b: Body, c: Car) -> None:
    """Cut the side windows between belt and roof line, with posts between them.

    The glass is tinted behind the middle post.
    """
    cowl = c.roof[2]
    top = c.roof[3]
    back = c.roof[5]
    u = np.linspace(cowl[0] + 0.12, c.glass_end, 20 if b.shell.coarse else 60)
    frame = np.interp(
        u, [cowl[0], top[0], back[0], c.glass_end + 0.01], [0.105, 0.115, 0.115, 0.12]
    )
    high = b.upper(u) - frame
    low = b.belt(u) + 0.035
    open_ = high > low + 0.03
    u = u[open_]
    high = high[open_]
    low = low[open_]
    # slants down at the rear end
    high = np.minimum(high, low + np.maximum(0, (c.glass_end - u) * 1.9) + 0.015)
    outline = polygon(np.concatenate([np.stack([u, high], 1), np.stack([u, low], 1)[::-1]]), 0.012)
    u, ay, z, _ = b.at()
    within = Within(b.paint.faces, 0.4 * c.width / 2 - ay, 0.022)
    trim = b.take(
        "window.trim",
        "gloss_black",
        np.maximum(outline(u, z, within) - within.grow_m, within.beside),
        sunk=0.006,
    )
    u, ay, z, _ = b.at(trim)
    posts = 0.045 - np.abs(u - c.doors[1])
    if not (c.panel or c.two_doors):
        posts = np.maximum(posts, 0.022 - np.abs(u - c.doors[2] - 0.02))
    side, _ = b.carve(trim, "side_window", "glass", np.maximum(outline(u, z), posts))
    b.carve(side, "side_window.rear", "glass_tinted", c.doors[1] - b.at(side)[0])


def _door_gaps(b: Body, c: Car) -> None:
    sill = c.clearance + 0.13
    half = c.width / 2

    def off_the_door(p: Piece) -> np.ndarray:
        u, ay, z, _ = b.at(p)
        return greatest(sill - z, z - b.belt(u) - 0.04, 0.5 * half - ay)

    front_only = c.panel or c.two_doors
    for k, door in enumerate(c.doors[:2] if front_only else c.doors):
        slant = 0.22 if k == 2 else 0.0
        b.line(
            lambda p, d=door, k=slant: b.at(p)[0] - d + k * (b.belt(d) - b.at(p)[2]), off_the_door
        )
    ends = (c.doors[0], c.doors[1] if front_only else c.doors[2] - 0.1)

    def beyond_the_doors(p: Piece) -> np.ndarray:
        u, ay, _, _ = b.at(p)
        return greatest(ends[0] - u, u - ends[1], 0.5 * half - ay)

    b.line(lambda p: b.at(p)[2] - sill, beyond_the_doors)


def _lid_gaps(b: Body, c: Car) -> None:
    """Cut the gaps around the hood, and those of the trunk lid or the rear doors."""
    cowl = c.roof[2]
    base = c.roof[6]
    half = c.width / 2

    def off_the_hood(p: Piece) -> np.ndarray:
        u, _, z, _ = b.at(p)
        return greatest(u - cowl[0] + 0.02, 0.10 - u, b.belt(u) - z)

    b.line(lambda p: b.at(p)[1] - half * (0.70 + 0.10 * b.at(p)[0] / cowl[0]), off_the_hood)
    if c.panel:
        b.line(lambda p: b.at(p)[3], lambda p: c.length - 0.35 - b.at(p)[0])
        return
    if c.bed:
        return
    low = 0.62 * (c.tail_lamp[0][1] - 0.02) + 0.2
    b.line(
        lambda p: b.at(p)[2] - low,
        lambda p: np.maximum(c.length - 0.3 - b.at(p)[0], b.at(p)[1] - half * 0.72),
    )
    b.line(
        lambda p: b.at(p)[1] - half * 0.72,
        lambda p: np.maximum(base[0] - b.at(p)[0], low - b.at(p)[2]),
    )


def _sills(b: Body, c: Car, axles: tuple[float, float]) -> None:
    u, ay, z, _ = b.at()
    if c.cladding:
        ring = np.min([np.hypot(u - a, z - c.tyre) - c.tyre - 0.095 for a in axles], 0)
        outside = np.minimum(z - c.cladding, np.maximum(ring, 0.6 * c.width / 2 - ay))
        b.take("cladding", "plastic_black", outside)
    else:
        b.take("sill", "plastic_black", z - c.clearance - 0.045)


def _bed(b: Body, c: Car) -> None:
    """Sink the bed of a pickup between its side walls, and mark the tailgate."""
    front = c.roof[6][0] + 0.12
    half = c.width / 2
    u, ay, z, _ = b.at()
    b.take(
        "bed",
        "plastic_black",
        greatest(front - u, u - c.length + 0.09, ay - half * 0.80, b.belt(u) - 0.05 - z),
        sunk=c.bed,
    )
    low = c.roof[7][1] - 0.42
    behind = lambda p: c.length - 0.3 - b.at(p)[0]
    b.line(lambda p: b.at(p)[2] - low, lambda p: np.maximum(behind(p), b.at(p)[1] - half * 0.76))
    b.line(lambda p: b.at(p)[1] - half * 0.76, lambda p: np.maximum(behind(p), low - b.at(p)[2]))


def _open_roof(b: Body, c: Car) -> None:
    """Take away roof and side walls above the belt, except the frame of the windscreen."""
    top = c.roof[3]
    base = c.roof[6]
    half = c.width / 2

    u, ay, z, _ = b.at()
    beside = np.maximum(0.55 * half - ay, 0.12 - (b.upper(u) - z))
    opening = [b.belt(u) + 0.03 - z, u - base[0], np.minimum(top[0] + 0.06 - u, beside)]
    b.open(greatest(*opening))
