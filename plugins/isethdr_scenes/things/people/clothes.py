"""Garments and shoes around the joints of a body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.mesh.piece import unit
from ..shapes import Limb, Loft, Mass, Patch, Ring, Shape, Values
from .body import ANKLE_M, HEEL, LEFT, SIDES, TOE, Body, Joints, foot_across

STEP_M = 0.020  # sampling step of garments at near detail, for a height of 1.76 m
BANDS_M = (0.02, -0.16)  # heights of the reflective bands of a vest above the joint `chest`
BAND_M = 0.026  # half the width of a band


@dataclass(frozen=True)
class Outfit:
    """Garments and their materials; see `data/people.yaml`."""

    top: str = "cloth_red"
    lower: str = "denim"
    shoes: str = "leather"
    skin: str = "skin"
    tights: str = "cloth_tights"
    long_sleeves: bool = True
    lower_kind: str = "trousers"  # trousers, shorts, skirt or dress
    tail_m: float = 0.0  # length of a coat's tail below the hip
    hem_m: float = 0.5  # height of a skirt's hem above the ground
    flare: float = 1.2
    loose: float = 1.0
    bands: bool = False


def garment_shapes(outfit: Outfit, body: Body, j: Joints, seed: int) -> list[Shape]:
    """Return all garments, hands and shoes.

    Parameters
    ----------
    outfit : garments and their materials.
    body : measures of the person.
    j : joints of the person, m.
    seed : seed of the folds.
    """
    shapes = _lower(outfit, body, j, seed)
    shapes += _top(outfit, body, j, seed)
    for tag, side in SIDES:
        shapes += [_hand(outfit, body, j, tag, side), _shoe(outfit, body, j, tag)]
    return shapes


def _legs(body: Body, j: Joints, name: str, material: str, fit: float, folds: float) -> Mass:
    """Return hips and legs down to the ankles."""
    g = body.girth * fit * body.scale
    k = body.scale
    hips = j["pelvis"] + [0.0, 0.0, 0.02 * k]
    limbs = [Limb(hips + LEFT * 0.055 * k, hips - LEFT * 0.055 * k, 0.100 * g, 0.100 * g)]
    for tag, _ in SIDES:
        hip, knee, ankle = (j[f"{part}_{tag}"] for part in ("hip", "knee", "ankle"))
        limbs.append(Limb(hip, knee, 0.092 * g, 0.070 * g))
        limbs.append(Limb(knee, ankle - [0, 0, 0.012 * k], 0.068 * g, 0.060 * g))
    return Mass(name, material, tuple(limbs), 0.03 * k, STEP_M * k, folds * k)


def _lower(outfit: Outfit, body: Body, j: Joints, seed: int) -> list[Shape]:
    k = body.scale
    if outfit.lower_kind == "trousers":
        legs = _legs(body, j, "trousers", outfit.lower, 1.0, 0.007)
        if not outfit.bands:
            return [legs]
        band = Patch("reflective_band", "reflective_band", _shin_band(j, k))
        return [
            Mass(legs.name, legs.material, legs.limbs, 0.03 * k, STEP_M * k, 0.006, seed, (band,))
        ]
    bare = _legs(body, j, "legs", outfit.tights, 0.72, 0.0)
    if outfit.lower_kind == "shorts":
        return [bare, _shorts(outfit, body, j, seed)]
    return [bare, _skirt(outfit, body, j)]


def _shin_band(j: Joints, k: float) -> Values:
    """Return the field of a band across both shins, negative inside."""

    def inside(points: np.ndarray) -> np.ndarray:
        out = np.full(len(points), 9.0)
        for tag, _ in SIDES:
            knee = j[f"knee_{tag}"]
            ankle = j[f"ankle_{tag}"]
            way = unit(ankle - knee)
            along = (points - knee) @ way
            beside = np.linalg.norm(points - knee - along[:, None] * way, axis=1)
            middle = 0.55 * np.linalg.norm(ankle - knee)
            out = np.minimum(out, np.maximum(np.abs(along - middle) - BAND_M, beside - 0.12 * k))
        return out

    return inside


def _shorts(outfit: Outfit, body: Body, j: Joints, seed: int) -> Mass:
    g = body.girth * body.scale
    k = body.scale
    hips = j["pelvis"] + [0.0, 0.0, 0.02 * k]
    limbs = [Limb(hips + LEFT * 0.055 * k, hips - LEFT * 0.055 * k, 0.102 * g, 0.102 * g)]
    for tag, _ in SIDES:
        hip = j[f"hip_{tag}"]
        knee = j[f"knee_{tag}"]
        limbs.append(Limb(hip, hip + 0.86 * (knee - hip), 0.095 * g, 0.094 * g))
    return Mass("shorts", outfit.lower, tuple(limbs), 0.03 * k, STEP_M * k, 0.008 * k, seed)


def _leg_at(j: Joints, tag: str, height: float) -> np.ndarray:
    """Return the point (3,), m, of a leg's middle line at a height, m."""
    hip, knee, ankle = (j[f"{part}_{tag}"] for part in ("hip", "knee", "ankle"))
    a, b = (hip, knee) if height > knee[2] else (knee, ankle)
    t = np.clip((a[2] - height) / max(a[2] - b[2], 1e-6), 0, 1)
    return a + t * (b - a)


@dataclass(frozen=True)
class _Cloth:
    """Cloth that hangs from the waist."""

    name: str
    material: str
    waist: tuple[float, float]  # half its extent in x and y for a body of girth 1, m
    low_m: float  # height of the hem
    flare: float  # increase of its width towards the hem; 1 hangs straight


def _hanging(cloth: _Cloth, body: Body, j: Joints) -> Loft:
    """Return cloth that hangs around the legs and is wide enough for them."""
    waist = cloth.waist
    k = body.scale
    g = body.girth * body.scale
    start = j["pelvis"] + j["up"] * 0.13 * k
    hip = j["pelvis"] - [0, 0, 0.02 * k]
    rings = [Ring(start, waist[0] * g, waist[1] * g)]
    rings.append(Ring(hip, max(waist[0], 0.140) * g, max(waist[1] + 0.04, 0.178) * g))
    for share in (0.35, 0.7, 1.0):
        height = hip[2] + share * (cloth.low_m - hip[2])
        legs = [_leg_at(j, tag, height) for tag, _ in SIDES]
        apart = abs(legs[0][0] - legs[1][0]) / 2
        wide = 1 + 0.30 * (cloth.flare - 1) * share
        half_x = max(apart + 0.098 * g, rings[1].half_x) * wide
        centre = np.array([(legs[0][0] + legs[1][0]) / 2, hip[1], height])
        rings.append(Ring(centre, half_x, rings[1].half_y * wide))
    pleat_m = 0.022 * cloth.flare * k
    return Loft(cloth.name, cloth.material, tuple(rings), pleats=14, pleat_m=pleat_m)


def _skirt(outfit: Outfit, body: Body, j: Joints) -> Loft:
    ground = min(j["ankle_l"][2], j["ankle_r"][2]) - ANKLE_M * body.scale
    low = ground + outfit.hem_m * body.scale
    skirt = _Cloth("skirt", outfit.lower, (0.112, 0.142), low, outfit.flare)
    return _hanging(skirt, body, j)


def _top(outfit: Outfit, body: Body, j: Joints, seed: int) -> list[Shape]:
    k = body.scale
    g = body.girth * body.scale * outfit.loose
    up = unit(j["neck"] - j["chest"])
    ahead = np.array([up[2], 0.0, -up[0]])
    dressed = outfit.lower_kind in ("skirt", "dress")
    waist_r = (0.088 if dressed else 0.100) * g
    # shift of the chest's sides, for shoulders that are wider or narrower than the template's
    wide = (body.shoulders * body.height_m - 0.103 * k) * LEFT
    # the hem is higher if the thighs are level, as those of a rider
    thigh = unit(j["knee_l"] - j["hip_l"] + j["knee_r"] - j["hip_r"])
    hem = 0.05 * k * max(0.0, -float(thigh[2]) * 1.6 - 0.6)
    limbs = []
    for _, side in SIDES:
        chest = j["chest"] + side * (0.075 * k * LEFT + wide) + up * 0.02 * k
        waist = j["pelvis"] + side * 0.055 * k * LEFT + j["up"] * 0.12 * k
        hip = j["pelvis"] + side * 0.068 * k * LEFT - j["up"] * hem
        limbs.append(Limb(chest, waist, 0.110 * g, waist_r))
        if not dressed:
            limbs.append(Limb(waist, hip, 1.06 * waist_r, max(0.122 * g, 0.118 * body.girth * k)))
        if body.bust:
            bust = j["chest"] + side * 0.07 * k * LEFT + ahead * (0.07 * k) - up * 0.04 * k
            radius = 0.055 * k + body.bust * k * 0.6
            limbs.append(Limb(bust, bust - up * 0.02 * k, radius, radius))
    if body.paunch:
        belly = j["pelvis"] + j["up"] * 0.13 * k + ahead * (0.02 * k + body.paunch * k)
        limbs.append(Limb(belly + LEFT * 0.03 * k, belly - LEFT * 0.03 * k, 0.105 * g, 0.105 * g))
    breast = j["chest"] + ahead * 0.018 * k
    middle = j["pelvis"] + j["up"] * 0.12 * k + ahead * 0.012 * k
    limbs.append(Limb(breast + up * 0.02 * k, middle, 0.112 * g, 1.04 * waist_r))
    neck = j["neck"]
    limbs.append(Limb(neck - up * 0.05 * k, neck + up * 0.008 * k, 0.078 * k, 0.062 * k))
    for tag, _ in SIDES:
        shoulder, elbow, wrist = (j[f"{part}_{tag}"] for part in ("shoulder", "elbow", "wrist"))
        limbs.append(Limb(neck - up * 0.045 * k, shoulder - up * 0.012 * k, 0.075 * k, 0.060 * g))
        end = elbow if outfit.long_sleeves else shoulder + 0.72 * (elbow - shoulder)
        limbs.append(Limb(shoulder, end, 0.062 * g, 0.052 * g))
        if outfit.long_sleeves:
            limbs.append(Limb(elbow, wrist, 0.051 * g, 0.042 * g))
    bands = tuple(
        Patch("reflective_band", "reflective_band", _band(j["chest"], up, at * k)) for at in BANDS_M
    )
    folds = 0.006 * k
    top = Mass(
        "top",
        outfit.top,
        tuple(limbs),
        0.03 * k,
        STEP_M * k,
        folds,
        seed + 1,
        bands if outfit.bands else (),
    )
    shapes: list[Shape] = [top]
    if not outfit.long_sleeves:
        shapes.append(_bare_arms(outfit, body, j))
    if outfit.tail_m:
        low = j["pelvis"][2] - (0.05 + outfit.tail_m) * k
        waist = (0.125 * outfit.loose, 0.165 * outfit.loose)
        tail = _Cloth("tail", outfit.top, waist, low, 1.35 * outfit.loose)
        shapes.append(_hanging(tail, body, j))
    return shapes


def _band(chest: np.ndarray, up: np.ndarray, at: float) -> Values:
    return lambda points: np.abs((points - chest) @ up - at) - BAND_M


def _bare_arms(outfit: Outfit, body: Body, j: Joints) -> Mass:
    k = body.scale
    g = (0.5 + 0.5 * body.girth) * body.scale
    limbs = []
    for tag, _ in SIDES:
        shoulder, elbow, wrist = (j[f"{part}_{tag}"] for part in ("shoulder", "elbow", "wrist"))
        limbs.append(Limb(0.5 * (shoulder + elbow), elbow, 0.043 * g, 0.038 * g))
        limbs.append(Limb(elbow, wrist, 0.038 * g, 0.029 * g))
    return Mass("arms", outfit.skin, tuple(limbs), 0.02 * k, 0.8 * STEP_M * k)


def _hand(outfit: Outfit, body: Body, j: Joints, tag: str, side: float) -> Mass:
    k = body.scale
    wrist = j[f"wrist_{tag}"]
    way = unit(wrist - j[f"elbow_{tag}"])
    ahead = unit(np.array([1.0, 0.0, 0.0]) - way * way[0])
    palm = wrist + way * 0.035 * k
    limbs = (
        Limb(wrist, palm, 0.028 * k, 0.031 * k),
        Limb(palm, palm + way * 0.05 * k, 0.031 * k, 0.033 * k),
        Limb(palm + way * 0.05 * k, palm + way * 0.12 * k + ahead * 0.02 * k, 0.029 * k, 0.017 * k),
        Limb(
            palm + way * 0.02 * k,
            palm + way * 0.07 * k + (ahead * 0.045 - side * 0.01 * LEFT) * k,
            0.016 * k,
            0.011 * k,
        ),
    )
    return Mass("hand", outfit.skin, limbs, 0.02 * k, 0.010 * k)


def _shoe(outfit: Outfit, body: Body, j: Joints, tag: str) -> Mass:
    """Return a shoe. Its limbs touch the plane of its sole."""
    k = body.scale
    ankle = j[f"ankle_{tag}"]
    along = j[f"foot_{tag}"]
    across = foot_across(along)
    point = lambda x, radius: ankle + k * (x * along - (ANKLE_M - radius) * across)
    limbs = (
        Limb(point(*HEEL), point(0.105, 0.040), HEEL[1] * k, 0.040 * k),
        Limb(point(0.105, 0.040), point(*TOE), 0.040 * k, TOE[1] * k, 1.12),
        Limb(ankle, point(0.09, 0.045), 0.047 * k, 0.040 * k),
        Limb(ankle, point(-0.045, 0.05), 0.047 * k, 0.043 * k),
    )
    floor = ankle - ANKLE_M * k * across
    inside = lambda points: (points - floor) @ across - 0.018 * k
    sole = Patch("sole", "sole", inside, "middle")
    return Mass("shoe", outfit.shoes, limbs, 0.02 * k, 0.012 * k, patches=(sole,))
