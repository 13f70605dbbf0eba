"""People, animals and plants drawn from ranges: sizes known without a mesh, ground contact, valid
meshes, limits on triangles, retroreflecting eyes.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from isethdr_scenes import things
from isethdr_scenes.geometry.mesh.piece import Assembly, face_areas
from isethdr_scenes.materials import MATERIALS
from isethdr_scenes.things.animals import families as animals
from isethdr_scenes.things.detail import extent_m
from isethdr_scenes.things.people import families as people
from isethdr_scenes.things.people.body import Body, Limbs, Pose, Swing, joints, walking
from isethdr_scenes.things.plants import bushes, ground_cover, trees
from isethdr_scenes.things.ranges import generator
from isethdr_scenes.things.shapes import Ball, Block, Limb, Loft, Mass, Ring, Rod

from isethdr_core.data.categories import CATEGORIES

SIZE_M = 0.03  # largest error of `Thing.size_m` that is promised
GROUND_M = 0.01
BUDGETS = {"animal": animals.TRIANGLES, "person": people.TRIANGLES}
TREES = {"tree": trees, "spring tree": trees, "autumn tree": trees, "winter tree": trees}
PLANTS = TREES | {"bush": bushes, "grass": ground_cover, "rock": ground_cover}
BUDGETS |= {group: module.TRIANGLES for group, module in PLANTS.items()}


def one(group, family, seed=0):
    return things.draw(group, np.random.default_rng([seed]), family)


def check(thing, detail):
    model = things.build(thing, detail)
    low, high = extent_m(model)
    assert high - low == pytest.approx(thing.size_m, abs=SIZE_M)
    assert abs(low[2]) < GROUND_M
    assert (low + high)[:2] == pytest.approx(0, abs=SIZE_M)
    assert thing.category in CATEGORIES
    assert sum(len(part.faces) for part in model.parts) <= BUDGETS[thing.group][detail]
    for part in model.parts:
        assert part.material in MATERIALS
        assert np.isfinite(part.vertices).all()
        assert part.faces.min() >= 0 and part.faces.max() < len(part.vertices)
        # 1e-6: float64 normals scaled to 1
        assert np.linalg.norm(part.normals, axis=1) == pytest.approx(1, abs=1e-6)
    return model


@pytest.mark.parametrize("group", ["animal", "bush", "grass", "person", "rock", "tree"])
def test_families_keep_their_promises(group):
    for family in things.names(group):
        check(one(group, family), "far")


def test_a_person_keeps_its_promises_near_and_in_the_middle():
    check(one("person", "worker", 1), "middle")
    worker = check(one("person", "worker", 1), "near")
    band = [part for part in worker.parts if part.name == "reflective_band"]
    # two bands around the chest and one around each shin, 5.2 cm high: at least 0.1 m2 in all
    assert sum(np.linalg.norm(face_areas(part), axis=1).sum() for part in band) > 0.1


@pytest.mark.parametrize("group,family", [("tree", "oak"), ("bush", "hazel"), ("rock", "slab")])
def test_a_plant_or_rock_keeps_its_promises_near_and_in_the_middle(group, family):
    near, middle = (check(one(group, family, 1), detail) for detail in ("near", "middle"))
    if group != "rock":
        # coarser levels have fewer and larger leaves; 25 %: stretching the plant to its size
        # changes their area
        assert _area(middle, "leaves") == pytest.approx(_area(near, "leaves"), rel=0.25)


def _area(model, name):
    parts = [part for part in model.parts if part.name == name]
    return sum(np.linalg.norm(face_areas(part), axis=1).sum() for part in parts)


def test_trees_change_with_the_seasons():
    green, bare = (
        {part.material for part in things.build(one(group, "oak"), "far").parts}
        for group in ("tree", "winter tree")
    )
    assert green & {"leaf", "leaf_dark"} and not any("leaf" in name for name in bare)
    needles = things.build(one("winter tree", "spruce"), "far").parts
    assert "needle" in {part.material for part in needles}


PIXELS = 72  # height of the picture of a silhouette, pixels


def silhouette(model, across):
    """Return a silhouette (z, x or y) of the faces, scaled to a common height.

    `across` is the horizontal axis of the picture: 0 is x, 1 is y.
    """
    low, high = extent_m(model)
    scale = 0.95 * PIXELS / (high[2] - low[2])
    picture = np.zeros((2 * PIXELS, PIXELS), bool)
    for part in model.parts:
        x = (part.vertices[:, across] - (low + high)[across] / 2) * scale + PIXELS
        z = (part.vertices[:, 2] - low[2]) * scale
        corners = np.stack([x, z], 1)[part.faces]
        sides = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2)
        steps = int(np.clip(np.ceil(1.5 * np.percentile(sides, 99)), 2, 24))
        for i in range(steps + 1):
            for j in range(steps + 1 - i):
                at = np.array([steps - i - j, i, j]) / steps @ corners
                column, row = at.astype(int).T
                picture[np.clip(column, 0, 2 * PIXELS - 1), np.clip(row, 0, PIXELS - 1)] = True
    return picture


@pytest.mark.slow
@pytest.mark.parametrize("group,each", [("person", 5), ("tree", 4), ("bush", 4)])
def test_no_two_silhouettes_are_the_same(group, each):
    pictures = []
    for family in things.names(group):
        for seed in range(each):
            model = things.build(one(group, family, seed), "far")
            pictures.append([silhouette(model, across) for across in (0, 1)])
    for first, second in combinations(pictures, 2):
        # intersection over union of side and front views
        shared = [(a & b).sum() / (a | b).sum() for a, b in zip(first, second, strict=True)]
        assert np.mean(shared) < 0.94  # the most similar pair has 0.931


@pytest.mark.slow
def test_more_than_seventy_plants_are_distinct():
    def told(group, family, seed):
        thing = one(group, family, seed)
        length, width, height = thing.size_m
        materials = frozenset(p.material for p in things.build(thing, "far").parts)
        # sizes are rounded in steps of 15 %
        return family, materials, round(np.log(height) / 0.15), round(np.log(length / width) / 0.15)

    groups = ("tree", "autumn tree", "bush")
    drawn = {
        told(group, family, seed)
        for group in groups
        for family in things.names(group)
        for seed in range(4)
    }
    assert len(drawn) >= 70


def test_bones_keep_their_lengths_in_every_pose():
    body = Body(height_m=1.70)
    for phase in (0.0, 0.3, 0.6, 0.9):
        at = joints(body, walking(body, phase, Swing(25.0)))
        for side in "lr":
            for a, b, length in (
                ("hip", "knee", body.thigh_m),
                ("knee", "ankle", body.shin_m),
                ("shoulder", "elbow", body.upper_arm_m),
                ("elbow", "wrist", body.forearm_m),
            ):
                apart = np.linalg.norm(at[f"{a}_{side}"] - at[f"{b}_{side}"])
                assert apart == pytest.approx(length, rel=1e-9)


def test_an_upright_body_is_as_tall_as_its_height():
    straight = Limbs(hip=0, knee=0, foot=0, arm=0, elbow=0)
    for height in (1.1, 1.76):
        body = Body(height_m=height, heads=6.0 if height < 1.3 else 7.5)
        at = joints(body, Pose(straight, straight, 0.0))
        crown = at["head"][2] + 0.122 * body.head_scale
        assert crown == pytest.approx(height, abs=0.01)  # the neck is inclined by a few degrees
        soles = at["ankle_l"][2] - 0.087 * body.scale
        assert soles == pytest.approx(0, abs=1e-9)


def test_a_child_is_no_small_adult():
    rng = np.random.default_rng(0)
    man = people.look_of("man", rng).body
    boy = people.look_of("boy", rng).body
    assert boy.height_m < 1.35 < man.height_m
    assert boy.heads < 6.1 < man.heads  # a child's head is a larger part of it
    assert boy.leg < man.leg


def test_thirty_people_are_distinct():
    def told(family, variant):
        look = people.look_of(family, generator(family, variant))
        clothes = look.outfit
        return (
            family,
            clothes.lower_kind,
            clothes.top,
            clothes.lower,
            look.head.hat,
            look.head.style,
            look.carried,
        )

    drawn = [told(family, variant) for family in things.names("person") for variant in range(5)]
    # at least 35 of 40 people (8 families, five members each) differ in family, garments, colours,
    # hat, hair or bag
    assert len(set(drawn)) >= 35


def test_an_animal_keeps_its_promises_near_and_in_the_middle():
    check(one("animal", "fox", 1), "middle")
    fox = check(one("animal", "fox", 1), "near")
    eyes = [part for part in fox.parts if part.name == "eye"]
    coat = next(part for part in fox.parts if part.name == "coat")
    assert len(eyes) == 2
    for eye in eyes:
        assert MATERIALS[eye.material].retro is not None
        # about a third of the eye lies inside the head, by the position of its centre
        assert 0.3 < _share_outside(coat, eye) < 0.95


def _share_outside(coat, eye):
    apart = np.linalg.norm(coat.vertices[None] - eye.vertices[:, None], axis=2)
    nearest = apart.argmin(1)
    above = ((eye.vertices - coat.vertices[nearest]) * coat.normals[nearest]).sum(1)
    return (above > 0).mean()


@pytest.mark.slow
@pytest.mark.parametrize("detail", ["near", "middle", "far"])
@pytest.mark.parametrize("group", sorted(BUDGETS))
def test_all_families_keep_their_promises_at_every_detail(group, detail):
    for family in things.names(group):
        for seed in range(3):
            check(one(group, family, seed), detail)


def test_the_same_variant_is_the_same_thing():
    a = one("animal", "cow", 3)
    b = one("animal", "cow", 3)
    assert a == b and hash(a) == hash(b)
    assert a != one("animal", "cow", 4)


@pytest.mark.parametrize(
    "shape",
    [
        Limb((0.1, 0.2, 0.3), (0.4, 0.1, 0.9), 0.2, 0.1, 0.7),
        Limb((0, 0, 0), (0, 0, 0), 0.2, 0.2),
    ],
)
def test_the_extent_of_a_limb_is_that_of_its_surface(shape):
    mass = Mass("limb", "fur", (shape,), step_m=0.02)
    low, high = extent_m(_only(mass.pieces("near")))
    # chords of a grid of 0.02 m lie at most 0.02^2 / (8 * 0.07) m inside a curvature of 1 / 0.07 m
    assert low == pytest.approx(mass.extent()[0], abs=1e-3)
    assert high == pytest.approx(mass.extent()[1], abs=1e-3)


@pytest.mark.parametrize(
    "shape",
    [
        Rod("rod", "fur", ((0, 0, 0), (0.3, 0.1, 0.5)), (0.1, 0.1)),
        Ball("ball", "fur", (1, 2, 3), (0.1, 0.2, 0.3)),
        Block("block", "fur", (1, 2, 3), (0.5, 0.3, 0.2), 0.02),
        Loft("loft", "fur", (Ring((0, 0, 1), 0.1, 0.2), Ring((0.1, 0, 0), 0.3, 0.2))),
    ],
)
def test_the_extent_of_a_shape_is_that_of_its_mesh(shape):
    low, high = extent_m(_only(shape.pieces("near")))
    # 8 mm: a round section is a polygon of 10 sides
    assert low == pytest.approx(shape.extent()[0], abs=8e-3)
    assert high == pytest.approx(shape.extent()[1], abs=8e-3)


def _only(pieces):
    return Assembly("one", pieces)
