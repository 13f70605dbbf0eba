"""A rigid truck: a cab on the lofted shell, and a cargo box of plain parts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.piece import Assembly, Piece, lit, pose
from ..mesh.primitives import box, grid, tube
from .panels import BACK
from .truck_cab import CAB_LENGTH_M, FRONT_AXLE_M, SIDES, TYRE_M, cab
from .wheels import Wheel, plate, wheel

BEHIND_CAB_M = 0.22  # gap between cab and box
FLOOR_M = 1.02  # height of the lower edge of the box
BOX_WIDTH_M = 2.50
WALL_M = BOX_WIDTH_M / 2  # distance of the side walls of the box from the middle
FRAME_M = 0.84  # height of the middle of the frame and of the rear lamps
REAR_AXLE_M = 1.75  # distance of the rear axle ahead of the rear end
FRONT_WHEEL = Wheel(TYRE_M, 0.30, 0.58, style="steel")
REAR_WHEEL = Wheel(TYRE_M, 0.29, 0.58, style="steel")


@dataclass(frozen=True)
class _Box:
    """Place of the cargo box, m, and its paint."""

    front: float  # x of its front wall
    rear: float  # x of its doors: the rear end of the truck
    height: float
    paint: str  # material

    @property
    def length(self) -> float:
        return self.front - self.rear

    @property
    def centre_x(self) -> float:
        """Return x of its centre."""
        return (self.front + self.rear) / 2

    @property
    def top(self) -> float:
        return FLOOR_M + self.height

    @property
    def centre_z(self) -> float:
        return (FLOOR_M + self.top) / 2


def truck(
    name: str = "truck",
    box_length: float = 6.1,
    box_height: float = 2.45,
    paint: str = "paint_blue",
    box_paint: str = "box_white",
    stripe: str = "paint_orange",
) -> Assembly:
    """Return a rigid truck, 8.5 m long with the default box.

    Parameters
    ----------
    name : name of the assembly.
    box_length : length of the box, m.
    box_height : height of the box, m.
    paint : name of the material of the cab.
    box_paint : name of the material of the box.
    stripe : name of the material of the stripe on the box.
    """
    # x of the front end. The truck is 3 cm longer than cab, gap and `box_length` together, and the
    # box is longer by these 3 cm.
    front = (CAB_LENGTH_M + box_length + 0.25) / 2
    load = _Box(front - CAB_LENGTH_M - BEHIND_CAB_M, -front, box_height, box_paint)
    model = Assembly(name)
    model.add(*cab(paint).moved(pose(front - CAB_LENGTH_M / 2)).parts)
    model.add(*_box_and_stripe(load, stripe))
    for side, tag in SIDES:
        model.add(
            *_side_wall(load, side),
            *_side_markers(load, side, tag),
            *_frame_and_guards(load, side),
            *_rear_door(load, side),
            *_rear_lamps(load, side, tag),
            *_mudflap_and_contour(load, side),
        )
    model.add(_tank(load), *_rear_end(load))
    _wheels(model, front - FRONT_AXLE_M, load.rear + REAR_AXLE_M)
    return model


def _box_and_stripe(load: _Box, stripe: str) -> list[Piece]:
    centre = (load.centre_x, 0, load.centre_z)
    size = (load.length, BOX_WIDTH_M, load.height)
    low = (load.centre_x, 0, FLOOR_M + 0.55)
    band = (load.length * 0.995, BOX_WIDTH_M + 0.012, 0.34)
    return [
        box(centre, size, "cargo", load.paint, 0.03),
        box(low, band, "stripe", stripe, 0.004),
    ]


def _side_wall(load: _Box, side: int) -> list[Piece]:
    """Return the ribs of one side wall of the box, and the rails and posts at its edges."""
    parts = []
    for x in np.linspace(load.rear + 0.06, load.front - 0.06, 9):
        at = (x, side * (WALL_M + 0.003), load.centre_z)
        parts.append(box(at, (0.035, 0.014, load.height - 0.1), "rib", load.paint, 0.005))
    for z in (FLOOR_M + 0.04, load.top - 0.03):
        at = (load.centre_x, side * (WALL_M - 0.005), z)
        parts.append(box(at, (load.length + 0.01, 0.05, 0.08), "rail", "alloy", 0.01))
    for x in (load.front - 0.02, load.rear + 0.02):
        at = (x, side * (WALL_M - 0.015), load.centre_z)
        parts.append(box(at, (0.07, 0.07, load.height), "post", "alloy", 0.012))
    return parts


def _side_markers(load: _Box, side: int, tag: str) -> list[Piece]:
    """Return the four amber side markers below one side wall."""
    parts = []
    for k, x in enumerate(np.linspace(load.rear + 0.5, load.front - 0.5, 4)):
        at = (x, side * (WALL_M + 0.012), FLOOR_M - 0.02)
        lens = box(at, (0.10, 0.02, 0.05), f"marker.{tag}{k}", "lamp_amber", 0.008)
        parts += lit(lens, "marker", (0.0, float(side), 0.0))
    return parts


def _frame_and_guards(load: _Box, side: int) -> list[Piece]:
    """Return one beam of the frame, and the side guards between the axles on that side."""
    beam = (load.centre_x + 0.3, side * 0.40, FRAME_M)
    parts = [box(beam, (load.length + 1.2, 0.09, 0.22), "chassis", "underbody")]
    for z in (0.55, 0.82):
        at = (load.centre_x + 0.35, side * 1.19, z)
        parts.append(box(at, (1.9, 0.03, 0.11), "side_guard", "galvanised", 0.01))
    return parts


def _rear_door(load: _Box, side: int) -> list[Piece]:
    """Return one of the two rear doors and its locking bars."""
    at = (load.rear - 0.012, side * 0.62, FLOOR_M + load.height / 2)
    parts = [box(at, (0.02, 1.20, load.height - 0.12), "rear_door", load.paint, 0.008)]
    x = load.rear - 0.045
    for y in (0.22, 0.95):
        bar = [(x, side * y, FLOOR_M + 0.1), (x, side * y, load.top - 0.1)]
        parts.append(tube(bar, 0.017, "door_bar", "steel"))
    return parts


def _rear_lamps(load: _Box, side: int, tag: str) -> list[Piece]:
    """Return the rear lamps of one side, from the outside inwards, and the bar that holds them."""
    parts = []
    for k, (kind, material) in enumerate(
        (
            ("indicator_rear", "lamp_amber"),
            ("brake", "lamp_red"),
            ("tail", "lamp_red"),
            ("reverse", "lamp_white"),
        )
    ):
        at = (load.rear - 0.01, side * (1.12 - 0.13 * k), FRAME_M)
        lens = box(at, (0.05, 0.12, 0.12), f"{kind}.{tag}", material, 0.012)
        parts += lit(lens, kind, BACK)
    bar = (load.rear + 0.015, side * 0.92, FRAME_M)
    return [*parts, box(bar, (0.05, 0.58, 0.17), "lamp_bar", "plastic_black", 0.01)]


def _mudflap_and_contour(load: _Box, side: int) -> list[Piece]:
    """Return the flap behind the wheels of one side, and the reflective strip on its door."""
    flap = (load.rear + 1.0, side * 1.0, 0.52)
    strip = (load.rear - 0.02, side * 0.75, FLOOR_M + 0.10)
    return [
        box(flap, (0.015, 0.48, 0.5), "mudflap", "plastic_black"),
        box(strip, (0.012, 0.9, 0.07), "contour", "reflector_red", 0.003),
    ]


def _tank(load: _Box) -> Piece:
    """Return the fuel tank, a drum along the left beam of the frame."""
    ends = [(load.centre_x + 0.9, 1.0, 0.74), (load.centre_x + 1.75, 1.0, 0.74)]
    return tube(ends, 0.27, "tank", "alloy", 24)


def _rear_end(load: _Box) -> list[Piece]:
    """Return the underrun bar, the sill below the doors, and the licence plate."""
    underrun = (load.rear + 0.06, 0, 0.58)
    sill = (load.rear - 0.02, 0, FLOOR_M + 0.02)
    return [
        box(underrun, (0.10, 2.3, 0.14), "underrun", "galvanised", 0.02),
        box(sill, (0.06, 2.44, 0.10), "rear_sill", "steel", 0.01),
        *plate(load.rear - 0.02, 0.74, -1, seed=5),
    ]


def _wheels(model: Assembly, front_x: float, rear_x: float) -> None:
    """Add the wheels of both axles, twin ones at the rear, and the guards over the rear wheels."""
    for side, tag in SIDES:
        model.add(
            *wheel(FRONT_WHEEL, front_x, side * 1.08, f"wheel.front_{tag}"),
            *wheel(REAR_WHEEL, rear_x, side * 1.06, f"wheel.rear_{tag}"),
            *wheel(REAR_WHEEL, rear_x, side * 0.74, f"wheel.inner_{tag}"),
            _mudguard(rear_x, side),
        )


def _mudguard(x: float, side: int) -> Piece:
    """Return the guard over the rear wheels of one side, 10 cm above the tyres."""
    turn = np.linspace(0.2, np.pi - 0.2, 14)  # angles about the axle, from straight ahead
    radius = 0.60
    arc = np.stack([x + radius * np.cos(turn), 0 * turn, TYRE_M + radius * np.sin(turn)], 1)
    edges = [arc + [0, side * 0.65, 0], arc + [0, side * 1.24, 0]]
    return grid(np.stack(edges, 1), "mudguard", "plastic_black")
