"""People of `data/people.yaml`, drawn and built."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ...geometry.mesh.piece import Assembly, shift
from ..ranges import drawn, generator, one_of, read
from ..shapes import Figure
from ..thing import Detail, Thing
from .body import USUAL_HIP_DEG, Body, Joints, Pose, Swing, joints, standing, walking
from .carried import carried_shapes
from .clothes import Outfit, garment_shapes
from .head import HeadLook, head_shapes

FILE = "people.yaml"
GROUP = "person"
# largest number of triangles of any person
TRIANGLES: dict[Detail, int] = {"near": 40_000, "middle": 9_000, "far": 4_500}
MEASURES = ("height_m", "heads", "leg", "shoulders", "girth", "paunch", "bust", "stoop_deg")


@dataclass(frozen=True)
class Look:
    """Everything about a person except the pose."""

    body: Body
    outfit: Outfit
    head: HeadLook
    carried: str
    carried_material: str
    seed: int


def shares() -> dict[str, float]:
    """Return the families, each with its share."""
    return {family: ranges["share"] for family, ranges in read(FILE)["families"].items()}


def thing(family: str, variant: int) -> Thing:
    """Return a person of a family. The same variant gives the same person in the same pose."""
    return Thing(family, variant, "person", figure(family, variant).size_m(), GROUP)


def build(thing: Thing, detail: Detail) -> Assembly:
    """Return the mesh, centred in x and y on z = 0."""
    shapes = figure_of_thing(thing)
    made = shapes.assembly(detail, standing=False)
    low = min(float(part.vertices[:, 2].min()) for part in made.parts)
    # The extent of the shapes moves with the body. The extent of a mesh would differ by some mm
    # between poses.
    x, y = centre_m(shapes)
    return made.moved(shift(-x, -y, -low))


def figure_of_thing(thing: Thing) -> Figure:
    """Return the shapes of a person: at the phase of a `Walker`, else in the drawn pose."""
    phase = thing.phase if isinstance(thing, Walker) else None
    return figure(thing.family, thing.variant, phase)


def centre_m(figure: Figure) -> tuple[float, float]:
    """Return the middle of a figure's extent in plan: distances ahead and left of the pelvis, m."""
    low, high = figure.extent()
    x, y = ((low + high) / 2)[:2].tolist()
    return x, y


def look_of(family: str, rng: np.random.Generator, outfit: str | None = None) -> Look:
    """Return a random person of a family.

    Parameters
    ----------
    family : family of people.
    rng : random numbers of the draw.
    outfit : name of the outfit; None: drawn from those of the family.
    """
    ranges = read(FILE)["families"][family]
    measures = drawn({key: ranges[key] for key in MEASURES if key in ranges}, rng)
    skin = one_of(_colours("skin"), rng)
    carried = one_of(ranges["carried"], rng)
    bag = {"satchel": "satchel", "carrier_bag": "carrier_bag"}.get(carried, "bag")
    hat = one_of(ranges["hats"], rng)
    head = HeadLook(
        skin=skin,
        hair=one_of(_colours("grey_hair" if ranges.get("grey") else "hair"), rng),
        style=one_of(ranges["hair"], rng),
        hat=hat,
        hat_material=one_of(_colours("hard_hat" if hat == "hard_hat" else "hat"), rng),
    )
    named = outfit or one_of(ranges["outfits"], rng)
    clothes = _outfit(named, skin, rng)
    material = one_of(_colours(bag), rng)
    return Look(Body(**measures), clothes, head, carried, material, int(rng.integers(2**31)))


@dataclass(frozen=True)
class Walker(Thing):
    """A walking person at a phase of the gait."""

    phase: float = 0.0  # 0 to 1


def pose_of(family: str, body: Body, rng: np.random.Generator, phase: float | None = None) -> Pose:
    """Return a random standing or walking pose.

    Parameters
    ----------
    family : family of people.
    body : measures of the person.
    rng : random numbers of the draw.
    phase : phase of the gait, 0 to 1, of a walking person; None: drawn.
    """
    pace = pace_of(family, rng)
    if pace is None:
        return standing(rng)
    return walking(body, pace.phase if phase is None else phase, pace.swing)


class Pace(NamedTuple):
    """Drawn swing and phase of a walking person."""

    swing: Swing
    phase: float  # phase of the gait, 0 to 1


def pace_of(family: str, rng: np.random.Generator) -> Pace | None:
    """Return a random pace of a person; None: the person stands."""
    ranges = read(FILE)["families"][family]
    hip_deg = drawn(ranges["stride_deg"], rng)
    phase = float(rng.random())
    if rng.random() < ranges["standing"]:
        return None
    # people with shorter steps swing their arms less
    arms_deg = drawn(read(FILE)["arms_deg"], rng) * hip_deg / USUAL_HIP_DEG
    return Pace(Swing(hip_deg, arms_deg), phase)


def figure_of(look: Look, at: Joints, name: str) -> Figure:
    """Return the shapes of a person around joints.

    Parameters
    ----------
    look : measures, clothes and carried things.
    at : joints of the person, m.
    name : name of the figure.
    """
    shapes = garment_shapes(look.outfit, look.body, at, look.seed)
    shapes += head_shapes(look.head, at["head"], at["neck"], look.body.head_scale)
    shapes += carried_shapes(look.carried, look.carried_material, look.body, at)
    return Figure(name, tuple(shapes))


@lru_cache(maxsize=128)
def figure(family: str, variant: int, phase: float | None = None) -> Figure:
    """Return the shapes of a person.

    Parameters
    ----------
    family : family of people.
    variant : number of the person in the family; it seeds look and pose.
    phase : phase of the gait, 0 to 1, of a walking person; None: drawn.
    """
    rng = generator(family, variant)
    look = look_of(family, rng)
    return figure_of(look, joints(look.body, pose_of(family, look.body, rng, phase)), family)


def _colours(item: str) -> dict[str, float]:
    return read(FILE)["colours"][item]


def _outfit(name: str, skin: str, rng: np.random.Generator) -> Outfit:
    told: dict[str, Any] = drawn(read(FILE)["outfits"][name], rng)
    top = one_of(_colours(told["top"]), rng)
    kind = told["lower"]
    lower = top if told.get("same") else one_of(_colours(kind), rng)
    tights = one_of(_colours("tights"), rng)
    if tights == "bare" or kind == "shorts":
        tights = skin
    return Outfit(
        top=top,
        lower=lower,
        shoes=one_of(_colours("shoes"), rng),
        skin=skin,
        tights=tights,
        long_sleeves=told["sleeves"] == "long",
        lower_kind=kind if kind in ("shorts", "skirt", "dress") else "trousers",
        tail_m=told.get("tail_m", 0.0),
        hem_m=told.get("hem_m", 0.5),
        flare=told.get("flare", 1.2),
        loose=told.get("loose", 1.0),
        bands=told.get("bands", False),
    )
