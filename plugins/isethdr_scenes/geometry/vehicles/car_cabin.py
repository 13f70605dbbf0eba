"""Fittings of a passenger car: mirrors, handles, rails and wipers; seats and dashboard."""

from __future__ import annotations

import numpy as np

from ..mesh.piece import Assembly, Piece, shift
from ..mesh.primitives import box, lathe, tube
from .body import Body
from .car_shapes import Car

ROWS_M = (0.36, 1.22, 2.08)  # distances of the rows of seats behind the top of the windscreen
SEATS_M = (0.37, -0.37)  # y of the middles of the two seats of a row


def fittings(model: Assembly, body: Body, car: Car) -> None:
    """Add mirrors, door handles, roof rails, wipers and aerial.

    Parameters
    ----------
    model : assembly that gets the parts.
    body : body of the car.
    car : measures, styles and paint.
    """
    coarse = body.shell.coarse
    for side in (1, -1):
        model.add(*_mirror(body, car, side))
        if not coarse:
            model.add(*_handles(body, car, side))
        if car.rails:
            model.add(_rail(body, car, side))
        if not coarse:
            model.add(_wiper(body, car, side))
    if car.aerial and not car.panel and not coarse:
        model.add(_aerial(car))


def _mirror(body: Body, car: Car, side: int) -> list[Piece]:
    """Return an outside mirror with its arm, and with its glass unless the car is coarse.

    Parameters
    ----------
    body : body of the car.
    car : measures, styles and paint.
    side : +1 (left) or -1 (right).
    """
    behind = car.roof[2][0] + 0.36  # distance behind the front end, m
    x = car.length / 2 - behind
    y = side * car.width / 2
    z = float(body.belt(behind)) + 0.10
    middle = (x, y + side * 0.06, z)
    arm = [(x + 0.01, y - side * 0.10, z - 0.085), (x, y + side * 0.02, z - 0.045)]
    parts = [
        box(middle, (0.14, 0.21, 0.14), "mirror", f"paint_{car.paint}", 0.062, 5),
        tube(arm, 0.022, "mirror.arm", "plastic_black"),
    ]
    if not body.shell.coarse:
        glass = (x - 0.069, y + side * 0.06, z)
        parts.append(box(glass, (0.006, 0.15, 0.09), "mirror.glass", "chrome", 0.002))
    return parts


def _handles(body: Body, car: Car, side: int) -> list[Piece]:
    """Return the door handles of one side; the parameters are those of `_mirror`."""
    doors = 1 if car.panel or car.two_doors else 2
    handles = []
    for behind in (car.doors[1] - 0.16, car.doors[2] - 0.14)[:doors]:
        x = car.length / 2 - behind
        z = float(body.belt(behind)) - 0.085
        inside = side * (car.width / 2 - 0.018)
        outside = side * (car.width / 2 + 0.012)
        bar = [
            (x + 0.10, inside, z),
            (x + 0.07, outside, z),
            (x - 0.07, outside, z),
            (x - 0.10, inside, z),
        ]
        handles.append(tube(bar, 0.014, "handle", "chrome"))
    return handles


def _rail(body: Body, car: Car, side: int) -> Piece:
    """Return a roof rail; the parameters are those of `_mirror`."""
    behind = np.linspace(car.roof[3][0] + 0.15, car.roof[5][0] - 0.05, 12)
    y = side * car.width / 2 * 0.66
    above_roof = np.full(len(behind), 0.028)
    above_roof[[0, -1]] = -0.02  # the ends of the rail are below the surface of the roof
    z = body.tops_at(behind, y) + above_roof
    bar = [(car.length / 2 - u, y, height) for u, height in zip(behind, z, strict=True)]
    return tube(bar, 0.016, "rail", "alloy")


def _wiper(body: Body, car: Car, side: int) -> Piece:
    """Return a wiper at the foot of the windscreen; the parameters are those of `_mirror`."""
    y = side * 0.38
    cowl = car.roof[2][0]  # distance behind the front end, m
    ends = [(cowl + 0.07, y, 0.012), (cowl + 0.13, y - 0.50, 0.017)]
    blade = [(car.length / 2 - u, y, float(body.upper(u)) + above) for u, y, above in ends]
    return tube(blade, 0.008, "wiper", "plastic_black", 6)


def _aerial(car: Car) -> Piece:
    """Return the aerial at the rear end of the roof."""
    behind, z = car.roof[5]
    x = car.length / 2 - behind
    rod = [(x + 0.02, 0, z - 0.02), (x - 0.10, 0, z + 0.10)]
    return tube(rod, [0.018, 0.004], "aerial", "plastic_black")


def interior(model: Assembly, body: Body, car: Car) -> None:
    """Add dashboard, steering wheel, seats and floor.

    Parameters
    ----------
    model : assembly that gets the parts.
    body : body of the car.
    car : measures, styles and paint.
    """
    front = car.length / 2
    cowl = car.roof[2][0]
    top = car.roof[3][0]  # distance of the windscreen's top behind the front end, m
    belt = float(body.belt(top))
    rounding_steps = 1 if body.shell.coarse else 3
    board = (front - cowl - 0.22, 0, belt - 0.05)
    rim = [(0.175, 0.012), (0.19, 0), (0.175, -0.012), (0.16, 0), (0.175, 0.012)]
    wheel = lathe(rim, "steering_wheel", "plastic_black", 24, "x")
    model.add(
        box(board, (0.5, car.width * 0.82, 0.16), "dashboard", "interior", 0.06),
        wheel.moved(shift(front - top + 0.12, 0.37, belt + 0.04)),
    )
    rows = (0.42,) if car.panel else ROWS_M[: car.rows]
    for x in (front - (top + row) for row in rows):
        if x - 0.1 < -front + 0.35:  # the row would stand in the boot
            continue
        for y in SEATS_M:
            model.add(*_seat(x, y, belt, rounding_steps))
    floor = (front - car.length * 0.52, 0, car.clearance + 0.10)
    model.add(box(floor, (car.length * 0.72, car.width * 0.8, 0.05), "floor", "underbody"))


def _seat(x: float, y: float, belt: float, rounding_steps: int) -> list[Piece]:
    """Return a seat.

    Parameters
    ----------
    x, y : place of the seat, m.
    belt : height of the car's belt line, m.
    rounding_steps : number of steps of its rounded edges.
    """
    back = ((x - 0.14, y, belt - 0.12), (0.16, 0.48, 0.62), 0.07)
    cushion = ((x + 0.12, y, belt - 0.42), (0.52, 0.50, 0.16), 0.06)
    head = ((x - 0.17, y, belt + 0.27), (0.10, 0.25, 0.17), 0.045)
    named = {"seat.back": back, "seat.cushion": cushion, "seat.head": head}
    return [
        box(middle, size, name, "seat", radius, rounding_steps)
        for name, (middle, size, radius) in named.items()
    ]
