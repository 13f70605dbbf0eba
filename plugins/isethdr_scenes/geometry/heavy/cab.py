"""The cab of a truck, over its engine: windows, grille, lamps, doors, mirrors."""

from __future__ import annotations

import numpy as np

from ...lamps import lamp
from ..mesh.cutting import Within, polygon
from ..mesh.piece import Assembly, Piece, lit, pose
from ..mesh.primitives import box, tube
from ..vehicles.body import Body
from ..vehicles.headlamp import RoundLamp, round_lamp
from ..vehicles.panels import FRONT, Region, cut_region, mirrors
from ..vehicles.shell import Shell
from ..vehicles.wheels import plate
from .shapes import LampShape, Truck

RAKE_M = 0.34  # distance of the windscreen's top behind the front end
BUMPER_M = (0.38, 0.82)  # heights of its lower and upper edge
AXLE_M = 1.36  # distance of the front axle behind the front end


def cab(c: Truck) -> Assembly:
    """Return the cab with its front end at x = cab_length / 2, without wheels."""
    half = c.width / 2
    body = Body(_shell(c), (AXLE_M,), c.tyre)
    _windows(body, c, half)
    _grille(body, c)
    low = BUMPER_M[0]
    bumper = cut_region(
        body,
        Region(
            "bumper",
            "plastic_black" if c.lamp_shape != "strip" else f"paint_{c.paint}",
            [(0, low), (1.3, low), (1.3, BUMPER_M[1]), (0, BUMPER_M[1])],
            face="front",
        ),
    )
    front_lamps(body, bumper, c.lamp_shape, half)
    side = lambda p: np.max(
        [0.8 * half - body.at(p)[1], p.vertices[:, 2] - c.screen_top, 0.62 - p.vertices[:, 2]], 0
    )
    for u in (RAKE_M + 0.06, min(1.62, c.cab_length - 0.12)):
        body.line(lambda p, u=u: body.at(p)[0] - u, side)
    body.arches(0.07, 0.55)
    out = Assembly("cab").add(
        body.paint.named("cab", f"paint_{c.paint}"), *body.parts, body.lining(0.9)
    )
    front = c.cab_length / 2
    out.add(box((front - 0.8, 0, c.belt - 0.02), (0.5, c.width - 0.4, 0.2), "dash", "interior"))
    for y in (0.45 * half, -0.45 * half):
        out.add(
            box((-front + 0.55, y, c.belt + 0.12), (0.16, 0.5, 0.9), "seat", "seat", 0.05),
        )
    out.add(*[p.moved(pose(front + 0.02)) for p in plate(0, 0.58, 1)])
    mirrors(out, front - 0.30, half, c.belt + 0.52)
    for s in (1, -1):
        out.add(box((front - 1.0, s * (half - 0.05), 0.50), (0.5, 0.16, 0.03), "step", "steel"))
        handle = (front - min(1.45, c.cab_length - 0.25), s * (half + 0.012), c.belt - 0.06)
        out.add(box(handle, (0.16, 0.02, 0.03), "handle", "plastic_black"))
    return out


def _shell(c: Truck) -> Shell:
    length = c.cab_length
    over = c.screen_top + 0.12
    upper = (
        (0, c.belt + 0.12),
        (0.03, c.belt + 0.16),
        (RAKE_M, c.screen_top),
        (RAKE_M + 0.24, over),
        (min(RAKE_M + 0.24 + 0.9 * (c.cab_top - over) + 0.1, length - 0.2), c.cab_top),
        (length, c.cab_top - 0.03),
    )
    return Shell(
        length,
        c.width,
        upper,
        ((0, c.belt), (length, c.belt + 0.02)),
        0.40,
        0.05,
        9.0,
        (0.30, 0.14, 0.86),
        (0.10, 0.06, 0.95),
        (0.05, 0.0),
        0.03,
        0.06,
        0.01,
    )


def _windows(b: Body, c: Truck, half: float) -> None:
    low = c.belt + 0.18
    top = c.screen_top - 0.08
    cut_region(
        b,
        Region(
            "windscreen",
            "glass",
            [(0, low), (0.84 * half, low), (0.79 * half, top), (0, top + 0.02)],
            face="front",
            trim="gloss_black",
        ),
    )
    rear = min(1.50, c.cab_length - 0.28)
    cut_region(
        b,
        Region(
            "side_window",
            "glass",
            [
                (RAKE_M + 0.10, c.belt + 0.10),
                (rear, c.belt + 0.10),
                (rear, top - 0.08),
                (RAKE_M + 0.24, top - 0.08),
            ],
            face="sides",
            trim="gloss_black",
            sunk_m=0.006,
        ),
    )


def _grille(b: Body, c: Truck) -> None:
    low = BUMPER_M[1] + 0.10
    high = c.belt - 0.03
    wide = c.grille_width
    cut_region(
        b,
        Region(
            "grille",
            "gap",
            [(0, low), (wide, low), (wide + 0.06, high), (0, high)],
            face="front",
            trim="chrome",
            margin_m=0.02,
        ),
    )
    for z in np.linspace(low + 0.05, high - 0.05, c.grille_bars):
        path = [
            (c.cab_length / 2 + 0.016 - 0.05 * y * y, y, z)
            for y in np.linspace(-wide - 0.02, wide + 0.02, 9)
        ]
        b.parts.append(tube(path, 0.016, "grille.bar", "plastic_black", 6))


def front_lamps(b: Body, part: Piece | None, shape: LampShape, half: float) -> None:
    """Cut the front lamps of a truck or bus out of its body.

    Each side gets a dipped beam, a daytime running lamp, a position lamp and an indicator.

    Parameters
    ----------
    b : body of the cab or bus; its paint and parts are changed.
    part : piece that the lamps are cut out of; None: the paint.
    shape : `round`, `square` or `strip`.
    half : half the width of the vehicle, m.
    """
    z0 = 0.64
    rest = part
    for s, tag in ((1, "left"), (-1, "right")):
        if shape == "round":
            for kind, y0, z, r, material in (
                ("daytime", half - 0.53, z0, 0.05, "lamp_white"),
                ("low_beam", half - 0.38, z0, 0.075, "lamp_white"),
                ("position", half - 0.22, z0, 0.050, "lamp_white"),
                ("indicator_front", half - 0.12, z0 + 0.1, 0.036, "lamp_amber"),
            ):
                rest = round_lamp(b, rest, RoundLamp(kind, tag, (s * y0, z), r, 0.015, material))
            continue
        tall = 0.09 if shape == "square" else 0.055
        for kind, y0, y1, z, h, material in (
            ("low_beam", half - 0.46, half - 0.28, z0, tall, "lamp_white"),
            ("position", half - 0.26, half - 0.19, z0, tall, "lamp_white"),
            ("indicator_front", half - 0.17, half - 0.09, z0, tall, "lamp_amber"),
            ("daytime", half - 0.46, half - 0.12, z0 - tall - 0.035, 0.018, "lamp_white"),
        ):
            rest = _pane_lamp(b, rest, kind, tag, (s, y0, y1, z - h, z + h), material)


def _pane_lamp(
    b: Body, part: Piece | None, kind: str, tag: str, where: tuple[float, ...], material: str
) -> Piece | None:
    """Cut a rectangular lens; return what is left of `part`."""
    s, y0, y1, z0, z1 = where
    outline = polygon([(y0, z0), (y1, z0), (y1, z1), (y0, z1)], 0.006)

    def outside(p: Piece | None, grow: float = 0.0) -> np.ndarray:
        u, _, z, y = b.at(p)
        within = Within((p or b.paint).faces, u - 0.6, grow)
        return np.maximum(outline(s * y, z, within) - grow, within.beside)

    if part is None:
        ring = b.take(f"{kind}.{tag}.bezel", "gloss_black", outside(None, 0.012))
        rest = None
    else:
        ring, rest = b.carve(part, f"{kind}.{tag}.bezel", "gloss_black", outside(part, 0.012))
    lens, _ = b.carve(ring, f"{kind}.front_{tag}", material, outside(ring))
    b.parts = [p for p in b.parts if p is not lens] + lit(lens, kind, FRONT)
    return rest


def side_lamp(at: np.ndarray, side: float, kind: str, name: str) -> list[Piece]:
    """Return a small amber lamp on a side, either a marker or a repeater of the indicator.

    Parameters
    ----------
    at : (3,) middle of the lamp, m.
    side : direction in which it shines: 1 to the left, -1 to the right.
    kind : kind of lamp of `isethdr_scenes.lamps`.
    name : name of the emitting piece.
    """
    piece = box(at, (0.10, 0.02, 0.05), name, "lamp_amber")
    front, housing = lit(piece, "marker", (0.0, side, 0.0))
    return [front.named(name, lamp=lamp(kind, (0.0, side, 0.0))), housing]
