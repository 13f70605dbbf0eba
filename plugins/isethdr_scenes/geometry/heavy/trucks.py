"""Rigid trucks, tractors with semi-trailers, and trucks with drawbar trailers."""

from __future__ import annotations

from ..mesh.piece import Assembly, pose
from ..mesh.primitives import box, tube
from . import chassis
from .cab import AXLE_M, cab
from .loads import Place, add_load
from .shapes import Truck

TRACTOR_M = 3.6  # wheelbase of a tractor
SADDLE_M = 1.12  # least height of the floor of a semi-trailer


def build(c: Truck, name: str = "truck", seed: int = 0) -> Assembly:
    """Return the mesh of a truck, with its trailer if it has one.

    Parameters
    ----------
    c : measures and paints of the truck.
    name : name of the assembly.
    seed : seed of the crates on a flatbed and of the gravel in a trough.
    """
    front = c.length / 2
    half = c.width / 2
    m = Assembly(name).add(*cab(c).moved(pose(front - c.cab_length / 2)).parts)
    chassis.axle(m, front - AXLE_M, half, c.tyre, False, "wheel.front")
    if c.trailer == "semi":
        _tractor(m, c, front, half)
        first = front - c.cab_length - c.gap - 0.35
        _trailer(m, c, first, seed)
        return m
    x0 = front - c.cab_length - c.gap
    x1 = x0 - c.load_length
    _carried(m, c, Place(x0, x1, c.floor, c.floor + c.load_height, half, c.load_paint, seed))
    _axles(m, c, x1 + min(1.75, 0.3 * c.load_length), half, c.rear_axles)
    chassis.frame(m, front - 0.6, x1 + 0.1, c.floor - 0.18)
    lowest = x1 + min(1.75, 0.3 * c.load_length) + c.tyre + 0.2
    if x0 - lowest > 1.2:
        chassis.side_guards(m, x0 - 0.35, lowest + 0.1, half)
        tank = [(x0 - 0.35, half - 0.28, 0.72), (x0 - 1.15, half - 0.28, 0.72)]
        m.add(tube(tank, 0.25, "fuel", "alloy", 20))
    chassis.markers(m, x0, x1, half, c.floor - 0.03)
    if c.trailer == "drawbar":
        bar = [(x1 + 0.3, 0, 0.62), (x1 - 1.3, 0, 0.62)]
        m.add(tube(bar, 0.07, "drawbar", "underbody", 8))
        _trailer(m, c, x1 - 1.3, seed + 1)
        _plain_rear(m, x1, half, c)
    else:
        chassis.rear(m, x1, half)
    return m


def _tractor(m: Assembly, c: Truck, front: float, half: float) -> None:
    x = front - AXLE_M - TRACTOR_M
    chassis.axle(m, x, half, c.tyre, True, "wheel.drive")
    chassis.mudguards(m, x, half, c.tyre)
    chassis.frame(m, front - 0.6, x - 0.9, 0.82)
    m.add(box((x, 0, 0.98), (1.0, 0.9, 0.10), "fifth_wheel", "underbody"))
    for s in (1, -1):
        start = front - c.cab_length - 0.1
        tank = [(start, s * (half - 0.32), 0.70), (start - 0.9, s * (half - 0.32), 0.70)]
        m.add(tube(tank, 0.29, "fuel", "alloy", 20))


def _trailer(m: Assembly, c: Truck, x0: float, seed: int) -> None:
    """Add a trailer from x0 to the rear end."""
    x1 = -c.length / 2
    half = c.width / 2
    semi = c.trailer == "semi"
    floor = max(c.floor, SADDLE_M) if semi else c.floor
    top = c.floor + c.load_height
    _carried(m, c, Place(x0, x1, floor, top, half, c.load_paint, seed))
    chassis.frame(m, x0 - 0.1, x1 + 0.1, floor - 0.16)
    rear = x1 + 1.6
    if semi:
        _axles(m, c, rear, half, 3)
        legs = x0 - 2.6
        for s in (1, -1):
            m.add(box((legs, s * 0.75, 0.72), (0.12, 0.12, 0.75), "leg", "galvanised"))
        chassis.side_guards(m, legs - 0.2, rear + 2.2 * chassis.AXLE_STEP_M + 0.4, half)
    else:
        _axles(m, c, x0 - 1.3, half, 1)
        _axles(m, c, rear, half, 1)
    chassis.markers(m, x0, x1, half, floor - 0.03)
    chassis.rear(m, x1, half)


def _carried(m: Assembly, c: Truck, place: Place) -> None:
    add_load(m, c.load, place)


def _axles(m: Assembly, c: Truck, x: float, half: float, count: int) -> None:
    """Add `count` axles; the rearmost is at x. Three axles have single wheels, fewer have twins."""
    for k in range(count):
        at = x + k * chassis.AXLE_STEP_M * c.tyre / 0.5
        chassis.axle(m, at, half, c.tyre, count < 3, f"wheel.{x:.1f}.{k}")
        chassis.mudguards(m, at, half, c.tyre)


def _plain_rear(m: Assembly, x: float, half: float, c: Truck) -> None:
    m.add(box((x + 0.06, 0, 0.62), (0.10, 2 * half - 0.2, 0.14), "underrun", "galvanised"))
