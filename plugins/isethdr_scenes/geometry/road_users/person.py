"""Clothed people: implicit garments around posed joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.cutting import cut
from ..mesh.implicit import Field, blend, cone, skin_of
from ..mesh.piece import Assembly, Piece, pose, unit
from ..mesh.primitives import box
from .head import head
from .poses import walk


@dataclass(frozen=True)
class Person:
    """Size, clothes, skin and hair of a person.

    `height` is in metres, and `coat_length` lowers the jacket's hem by its value in metres. `step`
    is the spacing, m, at which the surfaces of jacket and trousers are sampled.
    """

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
HEIGHT_M = 1.76  # height of the figure before it is scaled to the height of the person
LEFT = np.array([0, 1.0, 0])
COLLAR_M = (0.078, 0.060)  # radius of the collar at its root and its end
BANDS_M = (0.02, -0.16)  # heights of the middles of the reflective bands above the joint `chest`
BAND_M = 0.052  # width of a band


@dataclass(frozen=True, eq=False)
class _Wearer:
    """Joints and looks of a person who is dressed."""

    joints: dict[str, np.ndarray]  # (3,) by name, m
    look: Person
    up: np.ndarray  # (3,) unit vector along the trunk, from the pelvis to the neck
    ahead: np.ndarray  # (3,) unit vector across the trunk, forwards
    seed: int  # seed of the folds in the clothes

    @property
    def hem(self) -> np.ndarray:
        """Return the middle (3,), m, of the lower end of the jacket."""
        return self.joints["pelvis"] - self.up * (0.02 + self.look.coat_length)


def figure(
    j: dict[str, np.ndarray], look: Person = Person(), name: str = "person", seed: int = 0
) -> Assembly:
    """Return a clothed body around joints.

    Parameters
    ----------
    j : joints by name, (3,) m each, such as those of `poses.walk`.
    look : build, skin and clothes.
    name : name of the assembly.
    seed : seed of the folds in the clothes.
    """
    up = unit(j["neck"] - j["pelvis"])
    wearer = _Wearer(j, look, up, unit(np.array([1, 0, 0]) - up * up[0]), seed)
    model = Assembly(name).add(_trousers(wearer))
    jacket = _jacket(wearer)
    if look.bands:
        bands, jacket = _reflective_bands(wearer, jacket)
        model.add(*bands)
    model.add(jacket)
    head(model, j["head"], j["neck"], look)
    for tag, side in (("l", 1), ("r", -1)):
        model.add(_hand(wearer, tag, side), *_shoe(wearer, tag))
    if look.backpack:
        model.add(_backpack(wearer, look.backpack))
    scale = look.height / HEIGHT_M
    return model.moved(pose(scale=(scale, scale, scale)))


def _trousers(w: _Wearer) -> Piece:
    """Return both legs and the hips between them."""
    j = w.joints
    g = w.look.build
    left_hip, right_hip = (j["pelvis"] + LEFT * 0.055 * side + w.up * 0.04 for side in (1, -1))
    legs = [cone(left_hip, right_hip, 0.105 * g, 0.105 * g)]
    for tag in "lr":
        hip = j[f"hip_{tag}"]
        knee = j[f"knee_{tag}"]
        legs += [
            cone(hip, knee, 0.098 * g, 0.072 * g),
            cone(knee, j[f"ankle_{tag}"] + [0, 0, -0.01], 0.070 * g, 0.064 * g),
        ]
    cloth = blend(legs, 0.03, 0.007, w.seed)
    return skin_of(cloth, w.look.step, "trousers", w.look.legs)


def _jacket(w: _Wearer) -> Piece:
    """Return the jacket with its sleeves, open below its hem."""
    trunk = blend([*_chest(w), *_skirt(w)], 0.05, 0.006, w.seed + 1)
    end = w.hem - w.up * 0.06
    open_below = trunk.within(lambda p: (end - p) @ w.up)
    cloth = blend([open_below, *(_sleeve(w, tag) for tag in "lr")], 0.025)
    return skin_of(cloth, w.look.step, "jacket", w.look.top)


def _chest(w: _Wearer) -> list[Field]:
    """Return both halves of the chest, the collar, and the shoulders."""
    j = w.joints
    g = w.look.build
    halves = [
        cone(
            j["chest"] + LEFT * 0.075 * side + w.up * 0.02,
            j["pelvis"] + LEFT * 0.06 * side + w.up * 0.08,
            0.112 * g,
            0.098 * g,
        )
        for side in (1, -1)
    ]
    wide, narrow = COLLAR_M
    collar = cone(j["neck"] - w.up * 0.05, j["neck"] + w.up * 0.012, wide, narrow)
    shoulders = [
        cone(j["neck"] - w.up * 0.045, j[f"shoulder_{tag}"] - w.up * 0.012, wide, narrow)
        for tag in "lr"
    ]
    return [*halves, collar, *shoulders]


def _skirt(w: _Wearer) -> list[Field]:
    """Return both halves of the jacket from the hips to its hem."""
    g = w.look.build
    flare = (0.118 + 0.1 * w.look.coat_length) * g
    return [
        cone(
            w.joints["pelvis"] + LEFT * 0.05 * side + w.up * 0.05,
            w.hem + LEFT * 0.06 * side + w.ahead * 0.01,
            0.112 * g,
            flare,
        )
        for side in (1, -1)
    ]


def _sleeve(w: _Wearer, tag: str) -> Field:
    shoulder = w.joints[f"shoulder_{tag}"]
    elbow = w.joints[f"elbow_{tag}"]
    wrist = w.joints[f"wrist_{tag}"]
    g = w.look.build
    arm = [
        cone(shoulder, elbow, 0.062 * g, 0.051 * g),
        cone(elbow, wrist, 0.051 * g, 0.043 * g),
    ]
    return blend(arm, 0.02, 0.006, w.seed + 2)


def _reflective_bands(w: _Wearer, jacket: Piece) -> tuple[list[Piece], Piece]:
    """Return the bands around a jacket, and the rest of it."""
    bands = []
    for height in BANDS_M:
        above_chest = (jacket.vertices - w.joints["chest"]) @ w.up
        band, jacket, _ = cut(jacket, np.abs(above_chest - height) - BAND_M / 2)
        bands.append(band.named("reflective_band", "reflective_band"))
    return bands, jacket


def _hand(w: _Wearer, tag: str, side: int) -> Piece:
    """Return palm, fingers and thumb in line with the forearm."""
    wrist = w.joints[f"wrist_{tag}"]
    along = unit(wrist - w.joints[f"elbow_{tag}"])
    root = wrist + along * 0.03
    thumb = root + along * 0.085 + w.ahead * 0.05 - LEFT * side * 0.01
    hand = [
        cone(root, root + along * 0.065, 0.031, 0.034),
        cone(root + along * 0.065, root + along * 0.135 + w.ahead * 0.02, 0.030, 0.018),
        cone(root + along * 0.03, thumb, 0.017, 0.012),
    ]
    return skin_of(blend(hand, 0.02), 0.007, f"hand_{tag}", w.look.skin)


def _shoe(w: _Wearer, tag: str) -> tuple[Piece, Piece]:
    """Return the upper of a shoe and its sole."""
    ankle = w.joints[f"ankle_{tag}"]
    along = _along_the_foot(ankle, w.joints[f"toe_{tag}"])
    up = unit(np.cross(along, np.cross([0, 0, 1.0], along)))  # off the sole
    heel = ankle - along * 0.05 - up * 0.045
    shoe = [
        cone(ankle, heel + up * 0.02, 0.050, 0.042),
        cone(heel + up * 0.012, heel + along * 0.12 + up * 0.005, 0.042, 0.047),
        cone(heel + along * 0.12, heel + along * 0.225 - up * 0.002, 0.046, 0.036),
        cone(ankle, heel + along * 0.12 + up * 0.02, 0.048, 0.036),
    ]
    flat_below = blend(shoe, 0.02).within(lambda p: (heel - up * 0.040 - p) @ up)
    whole = skin_of(flat_below, 0.009, f"shoe_{tag}", w.look.shoes)
    sole, upper, _ = cut(whole, (whole.vertices - heel) @ up + 0.022)
    return upper, sole.named(f"sole_{tag}", "sole")


def _along_the_foot(ankle: np.ndarray, toe: np.ndarray) -> np.ndarray:
    """Return the direction (3,) of a sole. It is level if the foot is almost flat on the ground."""
    way = toe - ankle
    if abs(way[2]) < 0.08:
        return unit(way - [0, 0, way[2]])
    return unit(way + [0, 0, 0.045])  # the ankle is above the heel


def _backpack(w: _Wearer, material: str) -> Piece:
    """Return a rucksack on the back, turned with the trunk."""
    turn = np.eye(4)
    turn[:3, :3] = np.stack([w.ahead, LEFT, w.up], 1)
    turn[:3, 3] = w.joints["chest"] - w.ahead * 0.19 - w.up * 0.08
    return box((0, 0, 0), (0.17, 0.30, 0.42), "backpack", material, 0.06).moved(turn)


def pedestrian(
    look: Person = Person(),
    phase: float = 0.12,
    name: str = "pedestrian",
    seed: int = 0,
    stride: float = 26.0,
) -> Assembly:
    """Return a walking person with the lowest point at z = 0.

    Parameters
    ----------
    look : build, skin and clothes.
    phase : phase of the gait; 0 to 1 is one full cycle.
    name : name of the assembly.
    seed : seed of the folds in the clothes.
    stride : largest angle of the thighs from the vertical, degrees.
    """
    m = figure(walk(phase, stride), look, name, seed)
    low = min(p.vertices[:, 2].min() for p in m.parts)
    return m.moved(pose(z=-low))
