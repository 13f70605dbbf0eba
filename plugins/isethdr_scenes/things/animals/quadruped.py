"""The shapes of a four-legged animal from its proportions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry.mesh.piece import unit
from ..shapes import Ball, Figure, Limb, Mass, Rod, Shape
from .coat import Landmarks, patches, tail_patches
from .head import Head, head_shapes

NEAR_STEP = 0.018  # sampling step, in shoulder heights
WAVES_M = 0.004  # height of the waves of fur, at a shoulder height of 1 m


@dataclass(frozen=True)
class Animal:
    """A drawn animal: proportions in shoulder heights, with the names of `data/animals.yaml`."""

    name: str
    shoulder_m: float
    parts: Mapping[str, Any]  # body, neck, head, ears, legs, tail and the rest of the file
    coat: Mapping[str, Any]  # materials
    grazes: bool
    turn: float  # turn of the head to the left, -1 to 1
    gait: float  # phase of the stride, 0 to 1
    seed: int = 0


def figure(animal: Animal) -> Figure:
    """Return the shapes of an animal, in metres."""
    trunk, ends = _trunk(animal)
    legs, feet = _legs(animal, ends)
    neck, head = _neck(animal, ends)
    k = animal.shoulder_m
    step = _step_m(animal)
    marks = Landmarks(
        shoulder_m=k,
        chest=k * ends.chest,
        hip=k * ends.hip,
        chest_depth_m=k * animal.parts["body"]["chest"],
        poll=k * head.poll,
        nose=k * head.nose,
        seed=animal.seed,
    )
    limbs = tuple(_scaled(limb, k) for limb in (*trunk, *legs, *neck, *head.limbs()))
    coat = Mass(
        "coat",
        animal.coat["main"],
        limbs,
        blend_m=0.055 * k,
        step_m=step,
        folds_m=WAVES_M * k,
        seed=animal.seed,
        patches=patches(animal.coat, marks),
    )
    shapes: list[Shape] = [coat, *feet, *_tail(animal, ends)]
    if "wool" in animal.parts:
        shapes.append(_fleece(animal, trunk, neck))
    if "mane" in animal.parts:
        shapes.append(_mane(animal, ends, head))
    shapes += head_shapes(animal.parts, animal.coat, head, k)
    if animal.parts.get("udder"):
        at = k * (ends.hip + np.array([0.13, 0.0, -0.36]))
        shapes.append(Ball("udder", "snout", at, (0.11 * k, 0.09 * k, 0.08 * k)))
    return Figure(animal.name, tuple(shapes))


def _step_m(animal: Animal) -> float:
    """Return the sampling step at near detail, m. All animals get about as many faces with it."""
    body = animal.parts["body"]
    fine = NEAR_STEP * (1.3 if "wool" in animal.parts else 1.0)
    return fine * animal.shoulder_m * float(np.sqrt(body["length"] * body["chest"] / 0.42))


def _fleece(animal: Animal, trunk: list[Limb], neck: list[Limb]) -> Mass:
    """Return curly wool over trunk and neck."""
    k = animal.shoulder_m
    thick = animal.parts["wool"]
    limbs = tuple(
        Limb(
            k * limb.a,
            k * limb.b,
            k * (limb.radius_a + thick),
            k * (limb.radius_b + thick),
            limb.width,
        )
        for limb in (*trunk, *neck[:1])
    )
    waves = 0.6 * thick * k
    material = animal.coat["main"]
    return Mass("fleece", material, limbs, 0.06 * k, _step_m(animal), waves, animal.seed + 1)


def _mane(animal: Animal, ends: _Ends, head: Head) -> Mass:
    """Return the hair along the crest of the neck, from the forehead to the withers."""
    k = animal.shoulder_m
    high = animal.parts["mane"]
    neck = animal.parts["neck"]
    base = ends.chest + np.array([-0.02, 0.0, 0.36 * animal.parts["body"]["chest"]])
    way = unit(head.poll - base)
    across = unit(np.array([-way[2], 0.0, way[0]]))
    top = head.poll + across * (0.75 * neck["top"] + 0.3 * high)
    middle = 0.5 * (base + head.poll) + across * (0.5 * neck["base"] + 0.5 * high)
    brow = head.poll + head.ahead * 0.14 + head.up * 0.9 * head.measures["skull"]
    points = [base + across * 0.1 * high, middle, top, brow]
    radii = [0.7 * high, high, 0.9 * high, 0.35 * high]
    limbs = tuple(
        _scaled(Limb(a, b, p, q, 0.75), k)
        for a, b, p, q in zip(points, points[1:], radii, radii[1:], strict=False)
    )
    step = 0.8 * _step_m(animal)
    return Mass("mane", animal.coat.get("mane", animal.coat["main"]), limbs, 0.03 * k, step)


@dataclass(frozen=True)
class _Ends:
    """Points of the trunk, in shoulder heights."""

    chest: np.ndarray  # middle of the chest, above the fore legs
    hip: np.ndarray  # middle of the rump, above the hind legs
    floor: float  # height of the underside of the chest


def _scaled(limb: Limb, k: float) -> Limb:
    a = k * np.asarray(limb.a, float)
    b = k * np.asarray(limb.b, float)
    return Limb(a, b, k * limb.radius_a, k * limb.radius_b, limb.width)


def _trunk(animal: Animal) -> tuple[list[Limb], _Ends]:
    body = animal.parts["body"]
    half = body["length"] / 2
    chest_r = body["chest"] / 2
    belly_r = body["belly"] / 2
    rump_r = body["rump"] / 2
    chest = np.array([half - 0.02, 0.0, 1.0 - chest_r])
    hip = np.array([-half, 0.0, body["rump_height"] - rump_r])
    top = 0.5 * (1.0 + body["rump_height"]) - 0.02
    belly = np.array([-0.10 * half, 0.0, top - belly_r])
    width = body["width"]
    limbs = [
        Limb(chest, belly, chest_r, belly_r, width),
        Limb(belly, hip, belly_r, rump_r, width),
        Limb(chest + [0.04, 0, -0.15 * chest_r], chest, 0.78 * chest_r, 0.8 * chest_r, width),
        Limb(hip, hip - [0.06, 0, 0.02], 0.86 * rump_r, 0.72 * rump_r, width),
    ]
    if body["hump"]:
        crest = chest + [-0.06, 0, 0.45 * chest_r + body["hump"]]
        limbs.append(Limb(crest, belly + [0, 0, 0.5 * belly_r], 0.55 * chest_r, 0.4 * belly_r, 0.6))
    return limbs, _Ends(chest, hip, 1.0 - body["chest"])


def _legs(animal: Animal, ends: _Ends) -> tuple[list[Limb], list[Shape]]:
    """Return the legs, and the feet as separate shapes.

    Paws have the material of the coat's socks. Hooves are of leather.
    """
    legs = animal.parts["legs"]
    k = animal.shoulder_m
    y = legs["stance"]
    foot = legs["foot"]
    swing = animal.parts["stride"] / 2
    paws = bool(animal.parts.get("paws"))
    limbs: list[Limb] = []
    feet: list[Shape] = []
    for left in (1, -1):
        for fore in (True, False):
            step = swing * left * (1 if fore else -1) * np.cos(2 * np.pi * animal.gait)
            path, radii = _fore(ends, legs, step) if fore else _hind(ends, legs, step)
            path = [np.array([x, left * y * spread, z]) for x, spread, z in path]
            limbs += [
                Limb(a, b, p, q)
                for a, b, p, q in zip(path, path[1:], radii, radii[1:], strict=False)
            ]
            end = path[-1]
            at = k * np.array([end[0] + 0.35 * foot, end[1], 0.62 * foot])
            if paws:
                material = animal.coat.get("socks", animal.coat["main"])
                size = (1.25 * foot * k, 0.85 * foot * k, 0.62 * foot * k)
                feet.append(Ball("paw", material, at, size))
            else:
                path_up = (at + [0, 0, 0.5 * foot * k], at - [0.0, 0, 0.62 * foot * k])
                radii_up = (0.95 * foot * k, 1.15 * foot * k)
                feet.append(Rod("hoof", "leather", path_up, radii_up))
    return limbs, feet


def _fore(ends: _Ends, legs: Mapping[str, float], step: float) -> tuple[list[Any], list[float]]:
    x = ends.chest[0] + 0.02
    floor = ends.floor
    foot = legs["foot"]
    path = [
        (x - 0.04, 0.75, floor + 0.20),
        (x - 0.05 + 0.15 * step, 0.95, floor + 0.02),
        (x + 0.02 + 0.55 * step, 1.0, 0.52 * floor),
        (x - 0.01 + 0.9 * step, 0.97, 0.14 * floor + foot),
        (x + 0.02 + step, 0.97, 0.9 * foot),
    ]
    radii = [1.15 * legs["upper"], 0.68 * legs["upper"], legs["knee"], legs["shank"], 0.9 * foot]
    return path, radii


def _hind(ends: _Ends, legs: Mapping[str, float], step: float) -> tuple[list[Any], list[float]]:
    x = ends.hip[0] + 0.02
    floor = ends.floor
    foot = legs["foot"]
    path = [
        (x, 0.85, ends.hip[2] - 0.02),
        (x + 0.09 + 0.2 * step, 1.05, floor + 0.06),
        (x - 0.10 + 0.6 * step, 1.0, 0.60 * floor),
        (x - 0.05 + 0.9 * step, 0.95, 0.16 * floor + foot),
        (x - 0.02 + step, 0.95, 0.9 * foot),
    ]
    radii = [1.5 * legs["upper"], 0.95 * legs["upper"], legs["knee"], legs["shank"], 0.9 * foot]
    return path, radii


def _neck(animal: Animal, ends: _Ends) -> tuple[list[Limb], Head]:
    neck = animal.parts["neck"]
    head = animal.parts["head"]
    angle = np.radians(neck["down"] if animal.grazes else neck["up"])
    droop = np.radians((35.0 if animal.grazes else 0.0) + head["droop"])
    aside = 0.5 * animal.turn
    way = np.array([np.cos(angle) * np.cos(0.5 * aside), np.cos(angle) * np.sin(0.5 * aside), 0.0])
    way[2] = np.sin(angle)
    depth = animal.parts["body"]["chest"]
    base = ends.chest + np.array([0.05, 0.0, 0.18 * depth])
    poll = base + neck["length"] * unit(way)
    face = np.array([np.cos(droop) * np.cos(aside), np.cos(droop) * np.sin(aside), -np.sin(droop)])
    lower = base - np.array([0.0, 0.0, 0.22 * depth])
    middle = 0.5 * (base + poll)
    between = 0.5 * (neck["base"] + neck["top"])
    width = 0.75
    limbs = [
        Limb(base, middle, neck["base"], between, width),
        Limb(middle, poll, between, neck["top"], 0.5 * (width + 1)),
        Limb(lower, middle - [0.0, 0.0, 0.25 * between], 0.85 * neck["base"], 0.7 * between, width),
    ]
    return limbs, Head(poll, unit(face), head)


def _tail(animal: Animal, ends: _Ends) -> list[Shape]:
    tail = animal.parts["tail"]
    k = animal.shoulder_m
    angle = np.radians(tail["angle"])
    rump = animal.parts["body"]["rump"] / 2
    high = 0.72 if tail.get("root") == "high" else 0.55
    root = ends.hip + np.array([-0.72 * rump - 0.02, 0.0, high * rump])
    way = np.array([-np.cos(angle), 0.0, -np.sin(angle)])
    sag = np.array([-0.10, 0.0, 0.06 if tail["angle"] < 0 else -0.06]) * tail["length"]
    length = tail["length"]
    points = [root, root + 0.5 * length * way - 0.6 * sag, root + length * way]
    radii = tail["radii"]
    limbs = tuple(
        _scaled(Limb(a, b, p, q), k)
        for a, b, p, q in zip(points, points[1:], radii, radii[1:], strict=False)
    )
    return [
        Mass(
            "tail",
            animal.coat.get("tail", animal.coat["main"]),
            limbs,
            blend_m=0.03 * k,
            # a step that also keeps the thin end at middle detail
            step_m=min(0.8 * _step_m(animal), 0.9 * k * min(radii)),
            patches=tail_patches(animal.coat, k * points[-1], 0.26 * k * length),
        )
    ]
