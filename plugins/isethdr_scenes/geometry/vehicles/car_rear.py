"""The rear of a passenger car: tail lamps, diffuser, exhausts and plate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..mesh.cutting import Within, halves, polygon
from ..mesh.piece import greatest, lit
from ..mesh.primitives import box, tube
from .body import Body
from .car_shapes import Car
from .wheels import blank_plate, plate

if TYPE_CHECKING:
    from ..mesh.piece import Piece


BACK = (-1.0, 0.0, 0.0)
# lamps from outside to inside: kind, material, and where the lamp begins and ends as shares of the
# tail lamp's width; in a tall tail lamp from top to bottom, as shares of its height
LAMPS = (
    ("tail", "lamp_red", 0.06, 0.52),
    ("brake", "lamp_red", 0.56, 0.72),
    ("indicator_rear", "lamp_amber", 0.76, 0.88),
    ("reverse", "lamp_white", 0.91, 1.0),
)


def rear(body: Body, car: Car) -> None:
    """Cut tail lamps and diffuser; add reflectors, exhausts, plate and high brake lamp.

    Parameters
    ----------
    body : body of the car, which gets the parts.
    car : measures and styles.
    """
    _tail_lamps(body, car)
    _diffuser(body, car)
    for side in (1, -1):
        body.parts += _reflector_and_exhaust(body, car, side)
    place = (-car.length / 2 - 0.034, max(0.60 * car.tail_lamp[0][1] + 0.13, 0.52))
    if body.shell.coarse:
        body.parts.append(blank_plate(*place))
    else:
        body.parts += plate(*place, -1, seed=3)
    body.parts += _high_brake_lamp(body, car)


def _tail_lamps(body: Body, car: Car) -> None:
    """Cut both tail lamps out of the body, and divide each into its lamps.

    Parameters
    ----------
    body : body of the car.
    car : measures and styles.
    """
    u, across, z, _ = body.at()
    ahead = car.length - 0.30 - u
    shape = polygon(car.tail_lamp, 0.012)
    lens = body.take(
        "tail_lamp",
        "lamp_red",
        np.maximum(shape(across, z, Within(body.paint.faces, ahead)), ahead),
        sunk=-0.006,
        rim="gloss_black",
    )
    for side in (1, -1):
        for lamp in LAMPS:
            lens = _cut_lamp(body, car, lens, side, lamp)


def _cut_lamp(
    body: Body, car: Car, lens: Piece, side: int, lamp: tuple[str, str, float, float]
) -> Piece:
    """Cut a lamp out of the lens of the tail lamps, and return the rest of the lens.

    Parameters
    ----------
    body : body of the car, which gets the lamp and the rest of the lens.
    car : measures and styles.
    lens : the remaining lens of both tail lamps.
    side : +1 (left) or -1 (right).
    lamp : one of `LAMPS`.
    """
    kind, material, first, last = lamp
    shape = polygon(car.tail_lamp, 0.012)
    high = np.max(car.tail_lamp, axis=0)
    size = high - np.min(car.tail_lamp, axis=0)
    tall = size[1] > size[0]

    def band(part: Piece) -> list[np.ndarray]:
        """Return four arrays (vertices,), which are all negative within the lamp."""
        _, across, z, y = body.at(part)
        share = (high[1] - z) / size[1] if tall else (high[0] - across) / size[0]
        return [first - share, share - last, shape(across, z) + 0.014, -side * y]

    name = f"{kind}.{'left' if side > 0 else 'right'}"
    glow, rest = halves(lens, greatest(*band(lens)))
    # the part of the lens that wraps around the side of the car does not emit
    found = lit(glow.named(name, material), kind, BACK)
    if not len(found[0].faces):
        lens = body.refine(lens, band)
        glow, rest = halves(lens, greatest(*band(lens)))
        found = lit(glow.named(name, material), kind, BACK)
    body.parts = [part for part in body.parts if part is not lens] + [rest, *found]
    return rest


def _diffuser(body: Body, car: Car) -> None:
    """Cut the diffuser out of the bumper; the parameters are those of `_tail_lamps`."""
    u, across, z, _ = body.at()
    half = car.width / 2
    low = car.clearance + 0.06
    outline = [(0, low), (half * 0.72, low), (half * 0.66, low + 0.13), (0, low + 0.13)]
    ahead = car.length - 0.5 - u
    within = Within(body.paint.faces, ahead)
    inside = np.maximum(polygon(outline, 0.02)(across, z, within), ahead)
    body.take("diffuser", "plastic_black", inside, sunk=0.01)


def _reflector_and_exhaust(body: Body, car: Car, side: int) -> list[Piece]:
    """Return the reflector of one side, and its exhaust unless the car is coarse.

    Parameters
    ----------
    body : body of the car.
    car : measures and styles.
    side : +1 (left) or -1 (right).
    """
    x = -car.length / 2
    low = car.clearance + 0.06
    middle = (x - 0.004, side * car.width / 2 * 0.74, low + 0.20)
    parts = [box(middle, (0.02, 0.16, 0.035), "reflector", "reflector_red", 0.008)]
    if not body.shell.coarse:
        pipe = [(x + 0.12, side * 0.52, low - 0.01), (x - 0.015, side * 0.52, low - 0.01)]
        parts.append(tube(pipe, 0.032, "exhaust", "steel", 14))
    return parts


def _high_brake_lamp(body: Body, car: Car) -> list[Piece]:
    """Return the brake lamp at the upper edge of the rear window, or at the rear window base of a
    car with an open roof. The parameters are those of `_tail_lamps`.
    """
    behind, z = body.shell.upper[6 if car.open_roof else 5]
    below = 0.0 if car.open_roof else 0.045
    middle = (car.length / 2 - behind - 0.10, 0, z - below + 0.012)
    lamp = box(middle, (0.03, 0.26, 0.018), "brake.high", "lamp_red", 0.006)
    return lit(lamp, "brake_high", BACK)
