"""The head of a person: skull, face, hair or helmet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..mesh.cutting import cut
from ..mesh.implicit import blend, cone, skin_of
from ..mesh.primitives import ball

if TYPE_CHECKING:
    from ..mesh.piece import Assembly
    from .person import Person


def head(m: Assembly, c: np.ndarray, neck: np.ndarray, look: Person) -> None:
    """Add the head of a person to an assembly.

    Parameters
    ----------
    m : assembly that gets the parts.
    c : (3,) joint of the head, m.
    neck : (3,) joint of the neck, m.
    look : skin, hair and helmet.
    """
    c = np.asarray(c, float)
    at = lambda x, y, z: c + [x, y, z]
    skull = [
        cone(at(-0.022, 0, 0.03), at(0.012, 0, 0.032), 0.092, 0.088),
        cone(at(0.015, 0.0, 0.0), at(0.028, 0, -0.055), 0.074, 0.056),
        cone(at(0.045, 0, -0.07), at(0.05, 0, -0.085), 0.036, 0.03),
        cone(at(0.02, 0.03, -0.02), at(0.02, -0.03, -0.02), 0.06, 0.06),
        cone(at(0.092, 0, 0.01), at(0.108, 0, -0.022), 0.009, 0.014),
        cone(neck - [0.0, 0, 0.05], at(-0.005, 0, -0.05), 0.058, 0.056),
    ]
    skull += [
        cone(at(-0.005, s * 0.076, 0.005), at(-0.012, s * 0.086, -0.02), 0.018, 0.012)
        for s in (1, -1)
    ]
    m.add(skin_of(blend(skull, 0.025), 0.0065, "head", look.skin))
    for s in (1, -1):
        m.add(
            ball(at(0.081, s * 0.031, 0.012), (0.010, 0.014, 0.008), "eye", "plastic_black", 6),
            ball(at(0.086, s * 0.033, 0.033), (0.010, 0.020, 0.005), "brow", look.hair, 6),
        )
    m.add(ball(at(0.084, 0, -0.052), (0.010, 0.022, 0.006), "mouth", "cloth_red", 6))
    if look.helmet:
        shell = blend([cone(at(-0.05, 0, 0.052), at(0.035, 0, 0.058), 0.108, 0.098)], 0.01)
        cap = shell.within(lambda p: (at(0, 0, 0.035)[2] - p[:, 2]) + 0.12 * (p[:, 0] - c[0]))
        part = skin_of(cap, 0.009, "helmet", look.helmet)
        v = part.vertices - c
        vent, part, _ = cut(
            part,
            np.minimum(np.abs(v[:, 1]) - 0.010, np.abs(np.abs(v[:, 1]) - 0.045) - 0.010)
            + 99 * (v[:, 2] < 0.09),
        )
        m.add(part, vent.named("helmet.vent", "gap"))
        return
    hair = [cone(at(-0.035, 0, 0.048), at(0.012, 0, 0.056), 0.096, 0.086)]
    if look.long_hair:
        hair += [
            cone(at(-0.06, 0, 0.02), at(-0.075, 0, -0.14), 0.075, 0.055),
            cone(at(-0.03, 0.05, 0.02), at(-0.05, 0.055, -0.11), 0.05, 0.035),
            cone(at(-0.03, -0.05, 0.02), at(-0.05, -0.055, -0.11), 0.05, 0.035),
        ]
    full = blend(hair, 0.03, 0.006, 5)
    face = lambda p: np.minimum((p[:, 0] - c[0] - 0.045) + 0.9 * (c[2] + 0.075 - p[:, 2]), 9) * 0.7
    low = (
        (lambda p: -(p[:, 2] - c[2] + 0.20))
        if look.long_hair
        else (lambda p: -(p[:, 2] - c[2] + 0.035))
    )
    cap = full.within(lambda p: np.maximum(face(p), low(p)))
    m.add(skin_of(cap, 0.007, "hair", look.hair))
