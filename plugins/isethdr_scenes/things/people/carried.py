"""Things that people carry: rucksacks, bags and sticks."""

from __future__ import annotations

import numpy as np

from ...geometry.mesh.piece import unit
from ..shapes import Block, Rod, Shape
from .body import LEFT, Body, Joints


def carried_shapes(kind: str, material: str, body: Body, j: Joints) -> list[Shape]:
    """Return the shapes of what a person carries.

    Parameters
    ----------
    kind : none, rucksack, satchel, shoulder_bag, carrier_bag or stick.
    material : name of the material of a bag.
    body : measures of the person.
    j : joints of the person, m.
    """
    if kind in ("rucksack", "satchel"):
        return _on_the_back(kind, material, body, j)
    if kind == "shoulder_bag":
        return _shoulder_bag(material, body, j)
    if kind == "carrier_bag":
        return _carrier_bag(material, body, j)
    if kind == "stick":
        return _stick(body, j)
    return []


def _axes(up: np.ndarray) -> np.ndarray:
    ahead = unit(np.array([up[2], 0.0, -up[0]]))
    return np.stack([ahead, LEFT, up], 1)


def _on_the_back(kind: str, material: str, body: Body, j: Joints) -> list[Shape]:
    k = body.scale
    axes = _axes(unit(j["neck"] - j["chest"]))
    ahead = axes[:, 0]
    up = axes[:, 2]
    size = np.array([0.17, 0.30, 0.42]) * k
    if kind == "satchel":
        size = np.array([0.19, 0.32, 0.34]) * k * 1.1
    centre = j["chest"] - ahead * (0.105 * body.girth * k + size[0] / 2) - up * 0.08 * k
    shapes: list[Shape] = [Block(kind, material, centre, size, 0.05 * k, axes)]
    for tag, side in (("l", 1.0), ("r", -1.0)):
        shoulder = j[f"shoulder_{tag}"] - side * 0.075 * k * LEFT + up * 0.075 * k
        low = j["chest"] + side * 0.13 * k * LEFT - up * 0.14 * k + ahead * 0.09 * k
        front = j["chest"] + side * 0.10 * k * LEFT + ahead * 0.135 * body.girth * k + up * 0.02 * k
        path = (shoulder - ahead * 0.05 * k, shoulder + ahead * 0.05 * k, front, low)
        shapes.append(Rod("strap", material, path, (0.020 * k,) * 4, "middle"))
    return shapes


def _shoulder_bag(material: str, body: Body, j: Joints) -> list[Shape]:
    k = body.scale
    hip = j["hip_r"] + np.array([-0.02, -0.17 * body.girth, 0.06]) * k
    size = np.array([0.30, 0.09, 0.24]) * k
    bag = Block("bag", material, hip, size, 0.03 * k)
    left = j["shoulder_l"] + np.array([0.0, -0.05, 0.075]) * k
    front = j["chest"] + np.array([0.15 * body.girth, 0.0, -0.05]) * k
    back = j["chest"] + np.array([-0.13 * body.girth, 0.0, -0.05]) * k
    ends = (hip + [0.12 * k, 0.02, 0.10 * k], hip + [-0.12 * k, 0.02, 0.10 * k])
    straps = [
        Rod("strap", material, (left, middle, end), (0.012 * k,) * 3)
        for middle, end in zip((front, back), ends, strict=True)
    ]
    return [bag, *straps]


def _hand(j: Joints, tag: str, body: Body) -> np.ndarray:
    return j[f"wrist_{tag}"] + 0.10 * body.scale * unit(j[f"wrist_{tag}"] - j[f"elbow_{tag}"])


def _carrier_bag(material: str, body: Body, j: Joints) -> list[Shape]:
    k = body.scale
    hand = _hand(j, "l", body)
    high = min(0.34 * k, hand[2] - 0.20 * k)
    centre = hand - np.array([0.0, 0.0, 0.12 * k + high / 2])
    bag = Block("carrier_bag", material, centre, (0.28 * k, 0.10 * k, high), 0.02 * k)
    top = centre + [0.0, 0.0, high / 2]
    handles = [
        Rod("handle", material, (top + [x, 0, -0.01], hand), (0.008 * k, 0.008 * k), "middle")
        for x in (-0.09 * k, 0.09 * k)
    ]
    return [bag, *handles]


def _stick(body: Body, j: Joints) -> list[Shape]:
    """Return a walking stick from the right hand to the ground under the lower foot."""
    k = body.scale
    hand = _hand(j, "r", body)
    ground = min(j["ankle_l"][2], j["ankle_r"][2]) - 0.080 * k
    foot = np.array([hand[0] + 0.10 * k, hand[1] - 0.06 * k, ground])
    shaft = Rod("stick", "wood", (hand, foot), (0.012, 0.011))
    handle = (hand - [0.06 * k, 0, 0], hand + [0.07 * k, 0, 0])
    return [shaft, Rod("handle", "wood", handle, (0.014, 0.014))]
