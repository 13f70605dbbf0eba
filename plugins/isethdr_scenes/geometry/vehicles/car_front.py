"""The front of a passenger car: grille, headlamps, intake and plate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...lamps import lamp
from ..mesh.cutting import Within, polygon
from ..mesh.piece import Piece, greatest, lit, shift
from ..mesh.primitives import lathe
from .body import Body
from .car_shapes import Car
from .grille import AHEAD_M, grille
from .headlamp import RoundLamp, round_lamp
from .wheels import blank_plate, plate

NARROW_M = 0.88  # half the width of a car; the headlamps of narrower cars lie closer to the middle
FORWARD = (1.0, 0.0, 0.0)


def front(b: Body, c: Car) -> None:
    """Cut grille, headlamps, position lamps, intake and fog lamps; add badge and plate."""
    half = c.width / 2
    nose = c.roof[0][1]
    z1 = nose - 0.035
    z0 = nose - (0.035 + c.grille[1])
    grille(b, c, z0, z1)
    if c.front.headlamp == "round":
        _round_headlamps(b, c, half, 0.5 * (z0 + z1) + 0.01)
    else:
        _headlamps(b, c, z0, z1)
    u, ay, z, _ = b.at()
    low = c.clearance + 0.05
    intake = polygon([(0, low), (0.52, low), (0.60, low + 0.10), (0, low + 0.12)], 0.015)
    value = np.maximum(intake(ay, z, Within(b.paint.faces, u - AHEAD_M)), u - AHEAD_M)
    b.take("intake", "gap", value, sunk=0.02, rim="plastic_black")
    u, ay, z, _ = b.at()
    fog = polygon(
        [(0.66, low + 0.03), (0.80, low + 0.05), (0.80, low + 0.14), (0.68, low + 0.11)], 0.015
    )
    value = np.maximum(fog(ay, z, Within(b.paint.faces, u - AHEAD_M)), u - AHEAD_M)
    bezel = b.take("fog_bezel", "plastic_black", value, sunk=0.012)
    if c.front.daytime == "bumper":
        _daytime_bar(b, bezel, low)
    zp = z0 - 0.125
    if b.shell.coarse:
        b.parts.append(blank_plate(c.length / 2 + 0.034, zp))
        return
    b.parts += plate(c.length / 2 + 0.034, zp, 1)
    b.parts.append(
        lathe([(0.001, 0.008), (0.040, 0.008), (0.046, 0)], "badge", "chrome", 20, "x").moved(
            shift(c.length / 2 + 0.028, 0, z1 - 0.06)
        )
    )


def _headlamps(b: Body, c: Car, z0: float, z1: float) -> None:
    """Cut a housing on each side with dipped beam, reflector, indicator and position lamp.

    The housing also has the daytime running lamp, unless that is in the bumper.
    """
    half = c.width / 2
    closer = max(0.0, NARROW_M - half)  # shift of the lamps towards the middle, m
    corners = _housing(c, closer, z0, z1)
    outline = polygon(corners, 0.01)
    u, ay, z, y = b.at()
    house = b.take(
        "headlamp.housing",
        "lamp_dark",
        np.maximum(outline(ay, z, Within(b.paint.faces, u - 0.46)), u - 0.46),
        sunk=0.008,
        rim="gloss_black",
    )
    slim = c.front.headlamp == "slim"
    mid = z1 - 0.025 if slim else 0.5 * (z0 + z1) + 0.005
    # Distance of the indicator from the side of the car. The small lens of a slim headlamp must lie
    # where the body faces ahead.
    aside = 0.16 if slim else 0.085
    base, above = (z1, -0.045) if slim else (z0, 0.028)
    for s, tag in ((1, "left"), (-1, "right")):
        for kind, material, yc, zc, r in (
            ("low_beam", "lamp_white", 0.70 - closer, mid + 0.012, 0.047),
            ("reflector", "chrome", 0.585 - closer, mid + 0.012, 0.043),
            ("indicator_front", "lamp_amber", half - aside, mid + 0.035, 0.034),
        ):
            shape = RoundLamp(
                kind, tag, (s * yc, zc), r * (0.62 if slim else 1.0), material=material
            )
            house = round_lamp(b, house, shape)
        u, ay, z, y = b.at(house)
        _, house = b.carve(
            house,
            f"position.{tag}",
            "lamp_white",
            greatest(
                np.abs(z - base - above - 0.20 * np.maximum(ay - 0.72 + closer, 0)) - 0.008,
                0.52 - closer - ay,
                ay - half + 0.07,
                -s * y,
            ),
            lamp("position", (1.0, 0.0, 0.0)),
        )
        if c.front.daytime in ("brow", "hook"):
            # The upper edge of a tall headlamp lies on the bonnet, which faces up. The lamp lies
            # lower.
            lower = 0.03 if c.front.headlamp == "tall" else 0.0
            seen = [(across, up - lower) for across, up in corners]
            house = _daytime(b, house, (s, tag), seen, c.front.daytime)


def _housing(c: Car, closer: float, z0: float, z1: float) -> list[tuple[float, float]]:
    """Return the outline (|y|, z), m, of a headlamp, starting at its inner lower corner."""
    out = c.width / 2 + 0.05
    inner = 0.50 - closer
    if c.front.headlamp == "slim":
        return [(inner - 0.04, z1 - 0.06), (out, z1 - 0.05), (out, z1 + 0.05), (inner, z1)]
    if c.front.headlamp == "tall":
        return [(inner, z0 - 0.03), (out, z0 - 0.02), (out, z1 + 0.06), (inner, z1 + 0.05)]
    return [
        (inner, z0 + 0.015),
        (0.72 - closer, z0 + 0.0),
        (out, z0 + 0.06),
        (out, z1 + 0.045),
        (0.74 - closer, z1 + 0.02),
        (inner, z1 - 0.01),
    ]


def _daytime(
    b: Body,
    house: Piece,
    where: tuple[int, str],
    corners: Sequence[tuple[float, float]],
    place: str,
) -> Piece:
    """Cut a daytime running lamp out of a headlamp; return the rest of the headlamp."""
    side, tag = where
    _, ay, z, y = b.at(house)
    top = sorted({corner for corner in corners if corner[1] > np.mean([k[1] for k in corners])})
    edge = np.interp(ay, *np.array(top).T)
    if place == "brow":
        value = np.maximum(np.abs(z - edge + 0.014) - 0.009, corners[0][0] + 0.02 - ay)
    else:
        value = np.maximum(np.abs(ay - corners[0][0] - 0.022) - 0.011, z - edge + 0.012)
        value = np.maximum(value, corners[0][1] + 0.012 - z)
    shown = greatest(value, ay - corners[2][0] + 0.10, -side * y)
    lens, rest = b.carve(house, f"daytime.{tag}", "lamp_white", shown)
    b.parts = [p for p in b.parts if p is not lens] + lit(lens, "daytime", FORWARD)
    return rest


def _daytime_bar(b: Body, bezel: Piece, low: float) -> None:
    """Cut daytime running lamps out of the corners of the bumper."""
    for side, tag in ((1, "left"), (-1, "right")):
        _, ay, z, y = b.at(bezel)
        bar = greatest(np.abs(z - low - 0.085) - 0.016, 0.665 - ay, ay - 0.80, -side * y)
        lens, bezel = b.carve(bezel, f"daytime.{tag}", "lamp_white", bar)
        b.parts = [p for p in b.parts if p is not lens] + lit(lens, "daytime", FORWARD)


def _round_headlamps(b: Body, c: Car, half: float, z0: float) -> None:
    """Cut round housings with the dipped beam in the middle.

    The position lamp is an arc below the beam. The daytime running lamp is an arc above it.
    """
    y0 = half - 0.25
    radius = min(0.115, c.grille[1] + 0.01)
    u, ay, z, _ = b.at()
    circle = np.maximum(np.hypot(ay - y0, z - z0) - radius, u - 0.46)
    house = b.take("headlamp.housing", "lamp_dark", circle, sunk=0.006, rim="chrome")
    for side, tag in ((1, "left"), (-1, "right")):
        lens = RoundLamp("low_beam", tag, (side * y0, z0), 0.45 * radius)
        house = round_lamp(b, house, lens)
        arcs = [("position", -1.0)]
        if c.front.daytime in ("brow", "hook"):
            arcs.append(("daytime", 1.0))
        for kind, up in arcs:
            _, ay, z, y = b.at(house)
            away = np.hypot(ay - y0, z - z0)
            arc = np.abs(away - 0.83 * radius) - 0.10 * radius
            value = greatest(arc, 0.25 * radius - up * (z - z0), -side * y)
            glow, house = b.carve(house, f"{kind}.{tag}", "lamp_white", value)
            b.parts = [p for p in b.parts if p is not glow] + lit(glow, kind, FORWARD)
        at = (side * (y0 - 1.65 * radius), z0 - 0.01)
        round_lamp(b, None, RoundLamp("indicator_front", tag, at, 0.026, material="lamp_amber"))
