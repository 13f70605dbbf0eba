"""Animals drawn from ranges: sizes known without a mesh, ground contact, sound meshes, budgets of
triangles, eyes that shine.
"""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_scenes import things
from isethdr_scenes.geometry.mesh.piece import Assembly
from isethdr_scenes.materials import MATERIALS
from isethdr_scenes.things.animals import families as animals
from isethdr_scenes.things.detail import extent_m
from isethdr_scenes.things.shapes import Ball, Block, Limb, Loft, Mass, Ring, Rod

from isethdr_core.data.categories import CATEGORIES

SIZE_M = 0.03  # what `Thing.size_m` promises
GROUND_M = 0.01
BUDGETS = {"animal": animals.TRIANGLES}


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


@pytest.mark.parametrize("family", things.names("animal"))
def test_an_animal_keeps_its_promises(family):
    check(one("animal", family), "far")


def test_an_animal_keeps_its_promises_near_and_in_the_middle():
    check(one("animal", "fox", 1), "middle")
    fox = check(one("animal", "fox", 1), "near")
    eyes = [part for part in fox.parts if part.name == "eye"]
    coat = next(part for part in fox.parts if part.name == "coat")
    assert len(eyes) == 2
    for eye in eyes:
        assert MATERIALS[eye.material].retro is not None
        # a third of the eye lies in the head, by where its centre is placed
        assert 0.3 < _share_outside(coat, eye) < 0.95


def _share_outside(coat, eye):
    apart = np.linalg.norm(coat.vertices[None] - eye.vertices[:, None], axis=2)
    nearest = apart.argmin(1)
    above = ((eye.vertices - coat.vertices[nearest]) * coat.normals[nearest]).sum(1)
    return (above > 0).mean()


@pytest.mark.slow
@pytest.mark.parametrize("detail", ["near", "middle"])
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
    # a grid of 0.02 m cuts at most 0.02^2 / (8 * 0.07) off a curvature of 1 / 0.07 m
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
    # 8 mm: flat sides between the corners of a round section of 10 sides
    assert low == pytest.approx(shape.extent()[0], abs=8e-3)
    assert high == pytest.approx(shape.extent()[1], abs=8e-3)


def _only(pieces):
    return Assembly("one", pieces)
