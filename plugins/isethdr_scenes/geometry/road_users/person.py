"""Clothed people: implicit garments around posed joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.cutting import cut
from ..mesh.implicit import blend, cone, skin_of
from ..mesh.piece import Assembly, pose, unit
from ..mesh.primitives import box
from .head import head
from .poses import walk


@dataclass(frozen=True)
class Person:
    """Looks; height in metres. `coat_length` lowers the jacket's hem (m)."""

    height: float = 1.76
    build: float = 1.0
    top: str = "cloth_red"
    legs: str = "denim"
    shoes: str = "leather"
    skin: str = "skin"
    hair: str = "hair_dark"
    long_hair: bool = False
    coat_length: float = 0.0
    backpack: str | None = None
    helmet: str | None = None
    bands: bool = False
    step: float = 0.0135


LOOKS = (
    Person(),
    Person(
        height=1.66,
        build=0.92,
        top="cloth_navy",
        legs="cloth_dark",
        hair="hair_fair",
        long_hair=True,
        coat_length=0.22,
    ),
    Person(
        height=1.83,
        build=1.1,
        top="cloth_olive",
        legs="cloth_grey",
        skin="skin_dark",
        backpack="cloth_dark",
    ),
    Person(height=1.72, top="cloth_vest", legs="cloth_navy", bands=True),
    Person(height=1.30, build=0.85, top="cloth_white", legs="denim"),
)


def figure(
    j: dict[str, np.ndarray], look: Person = Person(), name: str = "person", seed: int = 0
) -> Assembly:
    """Clothed body around joints.

    Parameters
    ----------
    j : joints by name, (3,) m each, as those of `poses.walk`.
    look : build, skin and clothes.
    name : name of the assembly.
    seed : of folds in the clothes.
    """
    g = look.build
    h = look.step
    up = unit(j["neck"] - j["pelvis"])
    fwd = unit(np.array([1, 0, 0]) - up * up[0])
    side = np.array([0, 1.0, 0])
    m = Assembly(name)
    legs = [
        cone(
            j["pelvis"] + side * 0.055 + up * 0.04,
            j["pelvis"] - side * 0.055 + up * 0.04,
            0.105 * g,
            0.105 * g,
        )
    ]
    for s in "lr":
        legs += [
            cone(j[f"hip_{s}"], j[f"knee_{s}"], 0.098 * g, 0.072 * g),
            cone(j[f"knee_{s}"], j[f"ankle_{s}"] + [0, 0, -0.01], 0.070 * g, 0.064 * g),
        ]
    m.add(skin_of(blend(legs, 0.03, 0.007, seed), h, "trousers", look.legs))
    hem_at = j["pelvis"] - up * (0.02 + look.coat_length)
    top = [
        cone(
            j["chest"] + side * 0.075 + up * 0.02,
            j["pelvis"] + side * 0.06 + up * 0.08,
            0.112 * g,
            0.098 * g,
        ),
        cone(
            j["chest"] - side * 0.075 + up * 0.02,
            j["pelvis"] - side * 0.06 + up * 0.08,
            0.112 * g,
            0.098 * g,
        ),
        cone(j["neck"] - up * 0.05, j["neck"] + up * 0.012, 0.078, 0.060),
    ]
    top += [
        cone(j["neck"] - up * 0.045, j[f"shoulder_{s}"] - up * 0.012, 0.078, 0.060) for s in "lr"
    ]
    top += [
        cone(
            j["pelvis"] + side * 0.05 * q + up * 0.05,
            hem_at + side * 0.06 * q + fwd * 0.01,
            0.112 * g,
            (0.118 + 0.1 * look.coat_length) * g,
        )
        for q in (1, -1)
    ]
    jacket = blend(top, 0.05, 0.006, seed + 1)
    below = lambda p: (hem_at - up * 0.06 - p) @ up
    body = jacket.within(below)
    sleeves = [
        blend(
            [
                cone(j[f"shoulder_{s}"], j[f"elbow_{s}"], 0.062 * g, 0.051 * g),
                cone(j[f"elbow_{s}"], j[f"wrist_{s}"], 0.051 * g, 0.043 * g),
            ],
            0.02,
            0.006,
            seed + 2,
        )
        for s in "lr"
    ]
    coat = skin_of(blend([body, *sleeves], 0.025), h, "jacket", look.top)
    if look.bands:
        for k in (0.02, -0.16):
            t = (coat.vertices - j["chest"]) @ up
            band, coat, _ = cut(coat, np.abs(t - k) - 0.026)
            m.add(band.named("reflective_band", "reflective_band"))
    m.add(coat)
    head(m, j["head"], j["neck"], look)
    for s, q in (("l", 1), ("r", -1)):
        d = unit(j[f"wrist_{s}"] - j[f"elbow_{s}"])
        w = j[f"wrist_{s}"] + d * 0.03
        hand = [
            cone(w, w + d * 0.065, 0.031, 0.034),
            cone(w + d * 0.065 + side * 0, w + d * 0.135 + fwd * 0.02, 0.030, 0.018),
            cone(w + d * 0.03, w + d * 0.085 + fwd * 0.05 - side * q * 0.01, 0.017, 0.012),
        ]
        m.add(skin_of(blend(hand, 0.02), 0.007, f"hand_{s}", look.skin))
        a = j[f"ankle_{s}"]
        t = j[f"toe_{s}"]
        f = (
            unit(t - a - [0, 0, (t - a)[2] + 0.0])
            if abs((t - a)[2]) < 0.08
            else unit(t - a + [0, 0, 0.045])
        )
        n = unit(np.cross(f, np.cross([0, 0, 1.0], f)))
        heel = a - f * 0.05 - n * 0.045
        shoe = [
            cone(a, heel + n * 0.02, 0.050, 0.042),
            cone(heel + n * 0.012, heel + f * 0.12 + n * 0.005, 0.042, 0.047),
            cone(heel + f * 0.12, heel + f * 0.225 - n * 0.002, 0.046, 0.036),
            cone(a, heel + f * 0.12 + n * 0.02, 0.048, 0.036),
        ]
        base = blend(shoe, 0.02)
        flat_below = base.within(lambda p, o=heel, n=n: (o - n * 0.040 - p) @ n)
        part = skin_of(flat_below, 0.009, f"shoe_{s}", look.shoes)
        sole, part, _ = cut(part, (part.vertices - heel) @ n + 0.022)
        m.add(part, sole.named(f"sole_{s}", "sole"))
    if look.backpack:
        c = j["chest"] - fwd * 0.19 - up * 0.08
        b = box((0, 0, 0), (0.17, 0.30, 0.42), "backpack", look.backpack, 0.06)
        turn = np.eye(4)
        turn[:3, :3], turn[:3, 3] = np.stack([fwd, side, up], 1), c
        m.add(b.moved(turn))
    k = look.height / 1.76
    out = m.moved(pose(scale=(k, k, k)))
    return out


def pedestrian(
    look: Person = Person(),
    phase: float = 0.12,
    name: str = "pedestrian",
    seed: int = 0,
    stride: float = 26.0,
) -> Assembly:
    """Return a walker who stands on z = 0; `phase` of the gait 0..1, `stride` of the hips in
    degrees.

    Parameters
    ----------
    look : build, skin and clothes.
    phase : of the gait: 0 to 1 is one full cycle.
    name : name of the assembly.
    seed : of folds in the clothes.
    stride : largest angle of the thighs from the vertical, degrees.
    """
    m = figure(walk(phase, stride), look, name, seed)
    low = min(p.vertices[:, 2].min() for p in m.parts)
    return m.moved(pose(z=-low))
