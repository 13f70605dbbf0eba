"""City buses, coaches, articulated buses and double deckers, with doors on the right."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ...lamps import lamp
from ..mesh.piece import Assembly, pose
from ..mesh.primitives import box, tube
from ..vehicles.body import Body
from ..vehicles.panels import BACK, FRONT, Region, cut_region, mirrors
from ..vehicles.shell import Shell
from ..vehicles.wheels import Wheel, plate, wheel
from .cab import front_lamps
from .shapes import ROOF_UNIT_M, Bus

JOINT_M = 1.0  # length of the bellows
DOOR_M = 1.2
DECK_M = 1.95  # height from the windows of one deck to those of the next
POST_M = 0.10  # width of a post between windows
SKIRT_M = 0.32  # clearance
STEP_M = 0.10  # spacing of the cross sections of a body; 1.5 times as much if the bus has a joint


def build(c: Bus, name: str = "bus") -> Assembly:
    """Return the mesh of a bus."""
    front = c.length / 2
    m = Assembly(name)
    first = c.joint - JOINT_M / 2 if c.joint else c.length
    body = _section(c, first, True, not c.joint)
    _put(m, c, body, front - first / 2)
    if c.joint:
        length = c.length - c.joint - JOINT_M / 2
        _put(m, c, _section(c, length, False, True), -front + length / 2)
        _bellows(m, c, front - c.joint)
    axles = [c.front_axle, c.length - c.rear_axle]
    if c.joint:
        axles.insert(1, c.joint - 2.1)
    for k, u in enumerate(axles):
        for s in (1, -1):
            y = s * (c.width / 2 - 0.18)
            m.add(*wheel(Wheel(c.tyre, 0.29, 0.58, style="steel"), front - u, y, f"wheel{k}"))
    _inside(m, c, front)
    m.add(*plate(front + 0.03, 0.46, 1), *plate(-front - 0.03, 0.50, -1, seed=2))
    mirrors(m, front - 0.10, c.width / 2 - 0.12, min(c.window_top, 2.2) - 0.25, (0.10, 0.18, 0.34))
    if c.roof_unit:
        at = (-0.12 * c.length, 0, c.height + ROOF_UNIT_M / 2 - 0.03)
        size = (0.26 * c.length, 0.68 * c.width, ROOF_UNIT_M + 0.06)
        m.add(box(at, size, "roof_unit", "paint_white", 0.06))
    return m


def _section(c: Bus, length: float, has_front: bool, has_rear: bool) -> Body:
    """Return the body of a whole bus, or of the part before or behind its joint."""
    rake = c.rake if has_front else 0.02
    low = 1.30 if has_front else c.belt
    top = c.height
    upper = (
        (0, low),
        (0.04, low + 0.06),
        (0.04 + rake, top - 0.32),
        (0.04 + rake + 0.30, top - 0.05),
        (0.04 + rake + 0.9, top),
        (length - 0.5, top),
        (length - 0.10, top - 0.18),
        (length, 1.25 if has_rear else top - 0.25),
    )
    shell = Shell(
        length,
        c.width,
        upper,
        ((0, 1.18), (length, 1.18)),
        SKIRT_M,
        0.025,
        10.0,
        (0.32, 0.14, 0.84) if has_front else (0.06, 0.04, 0.97),
        (0.22, 0.12, 0.86) if has_rear else (0.06, 0.04, 0.97),
        (0.05 if has_front else 0.0, 0.03 if has_rear else 0.0),
        0.03,
        STEP_M * (1.5 if c.joint else 1.0),
        0.008,
    )
    offset = 0.0 if has_front else c.length - length
    axles = [c.front_axle, c.length - c.rear_axle]
    if c.joint:
        axles.append(c.joint - 2.1)
    inside = tuple(u - offset for u in axles if 0.6 < u - offset < length - 0.3)
    b = Body(shell, inside, c.tyre)
    if has_front:
        _face(b, c)
    doors = [d - offset for d in c.doors if 0.3 < d - offset < length - DOOR_M]
    _doors(b, c, doors)
    _windows(b, c, doors, length, has_front)
    if has_rear:
        _back(b, c, length)
    return b


def _face(b: Body, c: Bus) -> None:
    """Cut windscreen, sign and lamps of the front."""
    low = 1.0 if c.coach else 1.22
    sign_at = c.height - 0.40 if c.decks == 1 else c.belt + 1.30
    top = c.height - 0.30 if c.coach else sign_at - 0.18
    wide = c.width / 2
    cut_region(
        b,
        Region(
            "windscreen",
            "glass",
            [(0, low), (0.88 * wide, low), (0.86 * wide, top), (0, top + 0.02)],
            face="front",
            trim="gloss_black",
        ),
    )
    if c.decks == 2:
        up = c.belt + DECK_M
        cut_region(
            b,
            Region(
                "windscreen.upper",
                "glass",
                [(0, up), (0.86 * wide, up), (0.82 * wide, c.height - 0.38), (0, c.height - 0.36)],
                face="front",
                trim="gloss_black",
            ),
        )
    if c.sign:
        _sign(b, sign_at, wide)
    front_lamps(b, None, c.lamp_shape, wide)


def _sign(b: Body, z0: float, wide: float) -> None:
    sign = cut_region(
        b,
        Region(
            "sign.front",
            "gloss_black",
            [(0, z0 - 0.12), (0.75 * wide, z0 - 0.12), (0.74 * wide, z0 + 0.12), (0, z0 + 0.12)],
            face="front",
        ),
    )
    for k, y in enumerate(np.linspace(-0.57, 0.57, 9) * wide):
        _, _, z, yy = b.at(sign)
        if k % 4 == 1:
            continue
        hole = 0.030 - np.hypot(yy - y, z - z0 - 0.02 * (k % 3 - 1))
        glyph = np.max([np.abs(yy - y) - 0.05, np.abs(z - z0) - 0.075, hole], 0)
        _, sign = b.carve(sign, "sign", "lamp_amber", glyph, lamp("sign", FRONT))


def _doors(b: Body, c: Bus, doors: list[float]) -> None:
    top = min(c.window_top, c.belt + 1.2)
    for k, d0 in enumerate(doors):
        middle = d0 + DOOR_M / 2
        for a, z in ((d0 + 0.05, middle - 0.04), (middle + 0.04, d0 + DOOR_M - 0.05)):
            cut_region(
                b,
                Region(
                    f"door{k}",
                    "glass_tinted",
                    [(a, 0.46), (z, 0.46), (z, top + 0.04), (a, top + 0.04)],
                    face="right",
                    trim="gloss_black",
                    margin_m=0.045,
                ),
            )


def _windows(b: Body, c: Bus, doors: list[float], length: float, has_front: bool) -> None:
    """Cut the side windows of every deck, including the driver's window."""
    start = 0.55 + 0.5 * c.rake if has_front else 0.35
    count = max(2, round((length - start - 0.5) / c.panes))
    edges = np.linspace(start, length - 0.5, count + 1)
    for deck in range(c.decks):
        low = c.belt + deck * DECK_M
        top = c.window_top if deck == c.decks - 1 else c.belt + 1.05
        for s in (1, -1):
            for a, z in pairwise(edges):
                blocked = any(z > d - 0.1 and a < d + DOOR_M + 0.1 for d in doors)
                if s < 0 and deck == 0 and blocked:
                    continue
                inner = (a + POST_M / 2, z - POST_M / 2)
                cut_region(
                    b,
                    Region(
                        "side_window",
                        "glass_tinted",
                        [(inner[0], low), (inner[1], low), (inner[1], top), (inner[0], top)],
                        face="left" if s > 0 else "right",
                        trim="gloss_black",
                        margin_m=POST_M / 2 if c.coach else 0.03,
                    ),
                )


def _back(b: Body, c: Bus, length: float) -> None:
    """Cut rear windows, engine grille and lamps."""
    wide = c.width / 2
    for deck in range(c.decks):
        low = max(c.belt, 1.55) + deck * DECK_M
        top = c.height - 0.45 if deck == c.decks - 1 else c.belt + 1.0
        cut_region(
            b,
            Region(
                "rear_window",
                "glass_tinted",
                [(0, low), (0.78 * wide, low), (0.75 * wide, top), (0, top)],
                trim="gloss_black",
            ),
        )
    cut_region(
        b,
        Region(
            "engine_grille",
            "gap",
            [(0, 0.62), (0.48 * wide, 0.62), (0.48 * wide, 1.02), (0, 1.02)],
            trim="plastic_black",
        ),
    )
    for s, tag in ((1, "left"), (-1, "right")):
        for kind, z0, material in (
            ("tail", 0.80, "lamp_red"),
            ("brake", 0.98, "lamp_red"),
            ("indicator_rear", 1.16, "lamp_amber"),
            ("reverse", 0.63, "lamp_white"),
        ):
            u, _, z, y = b.at()
            b.take(
                f"{kind}.{tag}",
                material,
                np.maximum(np.hypot(y - s * 0.80 * wide, z - z0) - 0.075, length - 0.45 - u),
                sunk=-0.012,
                rim="plastic_black",
                lamp=lamp(kind, BACK),
            )


def _put(m: Assembly, c: Bus, b: Body, x: float) -> None:
    """Add a body with its painted skirt, its wheel houses and its lining."""
    _, _, z, _ = b.at()
    b.take("lower", f"paint_{c.lower}", z - 0.98)
    skirt = b.parts[-1]
    _, _, z, _ = b.at(skirt)
    b.carve(skirt, "bumper", "plastic_black", z - 0.44)
    keep = b.paint
    b.paint = next(part for part in b.parts if part.name == "lower")
    b.parts = [part for part in b.parts if part is not b.paint]
    b.arches(0.07, 0.55)
    b.parts.append(b.paint)
    b.paint = keep
    pieces = [b.paint.named("body", f"paint_{c.paint}"), *b.parts, b.lining(1.0)]
    m.add(*Assembly("section", pieces).moved(pose(x)).parts)


def _bellows(m: Assembly, c: Bus, x: float) -> None:
    """Add the folds of the joint."""
    for k, at in enumerate(np.linspace(-0.5, 0.5, 9) * JOINT_M):
        inset = 0.06 if k % 2 else 0.14
        size = (0.13, c.width - 2 * inset, c.height - SKIRT_M - 0.12 - inset)
        middle = (x + at, 0, (c.height + SKIRT_M) / 2)
        m.add(box(middle, size, "bellows", "plastic_black"))


def _inside(m: Assembly, c: Bus, front: float) -> None:
    """Add what is seen through the windows: floors, seats and dashboard; add the wipers."""
    for deck in range(c.decks):
        z = 0.45 + deck * DECK_M
        m.add(box((0, 0, z), (c.length - 0.9, c.width - 0.2, 0.06), "floor", "underbody"))
        if deck:
            m.add(box((0, 0, z + 0.1), (c.length - 0.9, c.width - 0.12, 0.16), "floor", "interior"))
        for u in np.arange(2.6, c.length - 0.9, 0.85):
            if c.joint and abs(u - c.joint) < 0.9:
                continue
            for y in (0.34, 0.17, -0.34):
                blocked = any(d - 0.4 < u < d + DOOR_M + 0.4 for d in c.doors)
                if deck == 0 and y < 0 and blocked:
                    continue
                at = (front - u, y * c.width, z + 0.72)
                m.add(box(at, (0.08, 0.42, 0.75), "seat.back", "seat"))
    m.add(box((front - 0.75, 0, 1.08), (0.45, c.width - 0.4, 0.2), "dashboard", "interior"))
    for y in (-0.25, 0.35):
        m.add(tube([(front, y, 1.24), (front - 0.02, y - 0.45, 1.60)], 0.01, "wiper", sides=5))
