"""The head of a person: skull, face, hair, hats and helmets.

Coordinates are in metres from the joint of a head that measures 0.235 m from chin to crown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..shapes import Ball, Limb, Mass, Rod, Shape, Values

STEP_M = 0.011
SKULL = (
    ((-0.022, 0, 0.030), (0.012, 0, 0.032), 0.092, 0.088),
    ((0.015, 0, 0.0), (0.028, 0, -0.055), 0.074, 0.056),
    ((0.045, 0, -0.070), (0.050, 0, -0.085), 0.036, 0.030),
    ((0.020, 0.030, -0.02), (0.020, -0.030, -0.02), 0.060, 0.060),
    ((0.092, 0, 0.010), (0.108, 0, -0.022), 0.009, 0.014),
    ((-0.005, 0.076, 0.005), (-0.012, 0.086, -0.02), 0.018, 0.012),
    ((-0.005, -0.076, 0.005), (-0.012, -0.086, -0.02), 0.018, 0.012),
)
CAP_OF_HAIR = (((-0.035, 0, 0.048), (0.012, 0, 0.056), 0.096, 0.086),)
HAIR = {  # limbs of each style in addition to `CAP_OF_HAIR`
    "short": (),
    "bald": (),
    "long": (
        ((-0.060, 0, 0.02), (-0.075, 0, -0.15), 0.075, 0.058),
        ((-0.030, 0.055, 0.02), (-0.050, 0.060, -0.12), 0.050, 0.036),
        ((-0.030, -0.055, 0.02), (-0.050, -0.060, -0.12), 0.050, 0.036),
    ),
    "bob": (
        ((-0.055, 0, 0.02), (-0.060, 0, -0.06), 0.078, 0.066),
        ((-0.020, 0.062, 0.02), (-0.020, 0.068, -0.07), 0.046, 0.042),
        ((-0.020, -0.062, 0.02), (-0.020, -0.068, -0.07), 0.046, 0.042),
    ),
    "bun": (((-0.115, 0, 0.09), (-0.120, 0, 0.092), 0.045, 0.045),),
    "tail": (
        ((-0.105, 0, 0.05), (-0.150, 0, 0.00), 0.034, 0.030),
        ((-0.150, 0, 0.00), (-0.155, 0, -0.14), 0.032, 0.012),
    ),
}
LOWEST_HAIR = {"short": -0.035, "bald": 0.0, "long": -0.22, "bob": -0.10, "bun": -0.03}


@dataclass(frozen=True)
class HeadLook:
    """Skin, hair and hat of a head."""

    skin: str = "skin"
    hair: str = "hair_dark"
    style: str = "short"
    hat: str = "none"  # none, cap, beanie, brim, hard_hat, cycle_helmet, full_helmet, open_helmet
    hat_material: str = "cloth_navy"


def head_shapes(look: HeadLook, at: np.ndarray, neck: np.ndarray, scale: float) -> list[Shape]:
    """Return the shapes of a head.

    Parameters
    ----------
    look : skin, hair and hat.
    at : (3,) joint of the head, m.
    neck : (3,) joint of the neck, m.
    scale : factor on all measures of the head.
    """
    place = _Place(at, scale)
    shapes: list[Shape] = []
    if look.hat != "full_helmet":
        shapes += _face(look, place, neck)
    if look.hat != "none":
        shapes += _hat(look, place)
    return shapes


@dataclass(frozen=True)
class _Place:
    at: np.ndarray
    scale: float

    def point(self, x: float, y: float, z: float) -> np.ndarray:
        return self.at + self.scale * np.array([x, y, z])

    def limb(
        self,
        a: tuple[float, float, float],
        b: tuple[float, float, float],
        radius_a: float,
        radius_b: float,
    ) -> Limb:
        return Limb(self.point(*a), self.point(*b), self.scale * radius_a, self.scale * radius_b)

    def local(self, points: np.ndarray) -> np.ndarray:
        return (points - self.at) / self.scale


def _face(look: HeadLook, place: _Place, neck: np.ndarray) -> list[Shape]:
    k = place.scale
    throat = Limb(neck - [0, 0, 0.05 * k], place.point(-0.005, 0, -0.05), 0.058 * k, 0.056 * k)
    skull = (*(place.limb(*told) for told in SKULL), throat)
    shapes: list[Shape] = [Mass("head", look.skin, skull, 0.025 * k, STEP_M * k)]
    for side in (1, -1):
        eye = place.point(0.081, side * 0.031, 0.012)
        brow = place.point(0.086, side * 0.033, 0.033)
        size = (0.010 * k, 0.014 * k, 0.008 * k)
        shapes.append(Ball("eye", "plastic_black", eye, size, "middle"))
        shapes.append(Ball("brow", look.hair, brow, (0.010 * k, 0.020 * k, 0.005 * k), "near"))
    mouth = place.point(0.084, 0, -0.052)
    shapes.append(Ball("mouth", "cloth_red", mouth, (0.010 * k, 0.022 * k, 0.006 * k), "near"))
    if look.style != "bald":
        limbs = tuple(place.limb(*told) for told in (*CAP_OF_HAIR, *HAIR[look.style]))
        low = LOWEST_HAIR.get(look.style, -0.17)
        trim = _hairline(place, low, covered=look.hat != "none")
        hair = Mass("hair", look.hair, limbs, 0.03 * k, STEP_M * k, 0.006 * k, 5, trim=trim)
        shapes.append(hair)
    return shapes


def _hairline(place: _Place, low: float, covered: bool) -> Values:
    """Return a field that is negative where hair grows.

    It keeps the face free, and the crown under a hat.
    """

    def outside(points: np.ndarray) -> np.ndarray:
        p = place.local(points)
        face = np.minimum((p[:, 0] - 0.045) + 0.9 * (0.075 - p[:, 2]), 9) * 0.7
        # hair at the back may hang lower than at the temples
        lowest = np.where(p[:, 0] < -0.09, min(low, -0.17), low)
        out = np.maximum(face, lowest - p[:, 2])
        if covered:
            out = np.maximum(out, p[:, 2] - 0.06)
        return place.scale * out

    return outside


def _dome(place: _Place, name: str, material: str, limbs: tuple, low: float, tilt: float) -> Mass:
    """Return a cap. Its rim is at the height `low + tilt * x` in the coordinates of the head."""
    made = tuple(place.limb(*told) for told in limbs)

    def outside(points: np.ndarray) -> np.ndarray:
        p = place.local(points)
        return place.scale * (low + tilt * p[:, 0] - p[:, 2])

    return Mass(name, material, made, 0.01 * place.scale, STEP_M * place.scale, trim=outside)


def _hat(look: HeadLook, place: _Place) -> list[Shape]:
    k = place.scale
    material = look.hat_material
    crown = (((-0.03, 0, 0.050), (0.018, 0, 0.052), 0.104, 0.098),)
    if look.hat == "beanie":
        crown = (*crown, ((-0.03, 0, 0.08), (-0.01, 0, 0.08), 0.095, 0.095))
        return [_dome(place, "beanie", material, crown, 0.035, 0.1)]
    if look.hat == "cap":
        peak = Ball(
            "peak", material, place.point(0.135, 0, 0.062), (0.075 * k, 0.07 * k, 0.008 * k)
        )
        return [_dome(place, "cap", material, crown, 0.05, 0.1), peak]
    if look.hat == "brim":
        brim = Ball("brim", material, place.point(0, 0, 0.07), (0.19 * k, 0.17 * k, 0.010 * k))
        top = (((-0.03, 0, 0.075), (0.018, 0, 0.075), 0.098, 0.094),)
        return [_dome(place, "hat", material, top, 0.06, 0.0), brim]
    if look.hat == "hard_hat":
        brim = Ball("brim", material, place.point(0.03, 0, 0.07), (0.17 * k, 0.13 * k, 0.010 * k))
        top = (((-0.03, 0, 0.065), (0.018, 0, 0.065), 0.118, 0.112),)
        return [_dome(place, "hard_hat", material, top, 0.06, 0.0), brim]
    if look.hat == "cycle_helmet":
        shell = (((-0.06, 0, 0.055), (0.040, 0, 0.060), 0.108, 0.098),)
        rear = Limb(place.point(-0.13, 0, 0.05), place.point(-0.15, 0, 0.03), 0.05 * k, 0.03 * k)
        ribs = tuple(
            Rod(
                "vent",
                "gap",
                tuple(
                    place.point(x, y, z + 0.004)
                    for x, z in ((0.09, 0.135), (0, 0.163), (-0.1, 0.145))
                ),
                (0.009 * k,) * 3,
                "middle",
            )
            for y in (-0.035, 0.0, 0.035)
        )
        dome = _dome(place, "helmet", material, shell, 0.045, 0.1)
        strap = _strap(place)
        return [dome, Mass("helmet_back", material, (rear,), step_m=STEP_M * k), *ribs, *strap]
    if look.hat == "open_helmet":
        shell = (((-0.03, 0, 0.035), (0.010, 0, 0.040), 0.130, 0.122),)
        visor = Ball(
            "visor", "window_dark", place.point(0.075, 0, 0.06), (0.07 * k, 0.10 * k, 0.022 * k)
        )
        return [_dome(place, "helmet", material, shell, 0.02, 1.4), visor, *_strap(place)]
    shell = (
        ((-0.035, 0, 0.025), (0.010, 0, 0.030), 0.135, 0.130),
        ((0.015, 0, -0.02), (0.055, 0, -0.065), 0.115, 0.085),
    )
    visor = Ball(
        "visor", "window_dark", place.point(0.078, 0, 0.02), (0.08 * k, 0.105 * k, 0.05 * k)
    )
    helmet = Mass(
        "helmet", material, tuple(place.limb(*told) for told in shell), 0.03 * k, STEP_M * 1.3 * k
    )
    return [helmet, visor]


def _strap(place: _Place) -> list[Shape]:
    k = place.scale
    return [
        Rod(
            "strap",
            "cloth_black",
            tuple(
                place.point(x, side * y, z) for x, y, z in ((0, 0.094, 0.03), (0.04, 0.045, -0.115))
            ),
            (0.006 * k, 0.006 * k),
            "middle",
        )
        for side in (1, -1)
    ]
