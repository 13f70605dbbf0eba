"""Chassis of trucks and trailers: frame, wheels, guards, markers, rear lamps and plate."""

from __future__ import annotations

import numpy as np

from ..mesh.piece import Assembly, lit
from ..mesh.primitives import box, grid
from ..vehicles.panels import BACK
from ..vehicles.wheels import Wheel, plate, wheel

AXLE_STEP_M = 1.31


def axle(m: Assembly, x: float, half: float, tyre: float, twin: bool, name: str) -> None:
    """Add the wheels of an axle, one or two on each side.

    Parameters
    ----------
    m : assembly that gets the wheels.
    x : place of the axle ahead of the origin, m.
    half : half the width of the vehicle, m.
    tyre : radius of the tyres, m.
    twin : whether each side has two wheels.
    name : first part of the names of the wheels.
    """
    shape = Wheel(tyre, 0.29, 0.58, style="steel")
    for s in (1, -1):
        m.add(*wheel(shape, x, s * (half - 0.18), f"{name}.{s}"))
        if twin:
            inner = wheel(shape, x, s * (half - 0.50), f"{name}.i{s}")
            m.add(*[part for part in inner if part.material == "tyre"])


def mudguards(m: Assembly, x: float, half: float, tyre: float) -> None:
    """Add a guard over the wheels of an axle.

    Parameters
    ----------
    m : assembly that gets the guards.
    x : place of the axle ahead of the origin, m.
    half : half the width of the vehicle, m.
    tyre : radius of the tyres, m.
    """
    a = np.linspace(0.2, np.pi - 0.2, 12)
    arc = np.stack([x + 1.18 * tyre * np.cos(a), 0 * a, tyre + 1.18 * tyre * np.sin(a)], 1)
    for s in (1, -1):
        ends = [arc + [0, s * (half - 0.60), 0], arc + [0, s * (half - 0.01), 0]]
        strip = np.stack(ends if s > 0 else ends[::-1], 1)
        m.add(grid(strip, "mudguard", "plastic_black"))


def frame(m: Assembly, x0: float, x1: float, z: float) -> None:
    """Add the two beams of a frame from x0 back to x1.

    Parameters
    ----------
    m : assembly that gets the beams.
    x0 : front end, m ahead of the origin.
    x1 : rear end, m ahead of the origin.
    z : height of the middle of the beams, m.
    """
    for s in (1, -1):
        m.add(
            box(((x0 + x1) / 2, s * 0.40, z), (x0 - x1, 0.09, 0.22), "chassis", "underbody"),
        )


def side_guards(m: Assembly, x0: float, x1: float, half: float) -> None:
    """Add rails between axles, on both sides.

    Parameters
    ----------
    m : assembly that gets the rails.
    x0 : front end, m ahead of the origin.
    x1 : rear end, m ahead of the origin.
    half : half the width of the vehicle, m.
    """
    for s in (1, -1):
        for z in (0.55, 0.82):
            at = ((x0 + x1) / 2, s * (half - 0.05), z)
            m.add(box(at, (x0 - x1, 0.03, 0.11), "side_guard", "galvanised"))


def markers(m: Assembly, x0: float, x1: float, half: float, z: float) -> None:
    """Add the amber side markers between x0 and x1, at most 3 m apart (UN R48, 6.18.4.3).

    Parameters
    ----------
    m : assembly that gets the markers.
    x0 : front end, m ahead of the origin.
    x1 : rear end, m ahead of the origin.
    half : half the width of the vehicle, m.
    z : height of the markers, m.
    """
    count = max(2, int(np.ceil((x0 - x1) / 3.0)) + 1)
    for s, tag in ((1, "left"), (-1, "right")):
        for k, x in enumerate(np.linspace(x1 + 0.4, x0 - 0.4, count)):
            piece = box((x, s * (half + 0.012), z), (0.10, 0.02, 0.05), f"marker.{tag}{k}")
            m.add(*lit(piece.named(piece.name, "lamp_amber"), "marker", (0.0, float(s), 0.0)))


def rear(m: Assembly, x: float, half: float, z: float = 0.84) -> None:
    """Add lamps, underrun bar, reflectors and plate at the rear end x.

    Parameters
    ----------
    m : assembly that gets the parts.
    x : rear end, m ahead of the origin.
    half : half the width of the vehicle, m.
    z : height of the lamps, m.
    """
    for s, tag in ((1, "left"), (-1, "right")):
        kinds = (
            ("indicator_rear", "lamp_amber"),
            ("brake", "lamp_red"),
            ("tail", "lamp_red"),
            ("reverse", "lamp_white"),
        )
        for k, (kind, material) in enumerate(kinds):
            at = (x - 0.01, s * (half - 0.12 - 0.13 * k), z)
            m.add(*lit(box(at, (0.05, 0.12, 0.12), f"{kind}.{tag}", material, 0.012), kind, BACK))
        bar = box((x + 0.015, s * (half - 0.32), z), (0.05, 0.58, 0.17), "lamp_bar")
        m.add(bar)
        m.add(box((x + 1.0, s * (half - 0.24), 0.52), (0.015, 0.48, 0.5), "mudflap"))
        at = (x - 0.02, s * (half - 0.49), z + 0.28)
        m.add(box(at, (0.012, 0.9, 0.07), "contour", "reflector_red"))
    m.add(box((x + 0.06, 0, 0.58), (0.10, 2 * half - 0.2, 0.14), "underrun", "galvanised"))
    m.add(*plate(x - 0.02, z - 0.10, -1, seed=5))
