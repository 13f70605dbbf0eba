"""Vehicles drawn from ranges: sizes known without a mesh, sound meshes, lamps that shine outwards,
levels of detail.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from isethdr_scenes import things
from isethdr_scenes.geometry.mesh.piece import face_areas
from isethdr_scenes.materials import MATERIALS
from isethdr_scenes.things.detail import extent_m

from isethdr_core.data.categories import CATEGORIES

GROUPS = ("car",)
FAMILIES = [(group, family) for group in GROUPS for family in things.names(group)]
SIZE_M = 0.03  # what `Thing.size_m` promises
GROUND_M = 0.01
TRIANGLES = {"near": 160_000, "middle": 60_000, "far": 16_000}
LAMPS = {"low_beam", "position", "tail", "brake", "indicator_front", "indicator_rear"}


def one(group, family, seed=0):
    return things.draw(group, np.random.default_rng([seed]), family)


@cache
def near(thing):
    return things.build(thing, "near")


def triangles(model):
    return sum(len(part.faces) for part in model.parts)


def check_mesh(model, thing):
    low, high = extent_m(model)
    assert high - low == pytest.approx(thing.size_m, abs=SIZE_M)
    assert (low + high)[:2] == pytest.approx([0, 0], abs=SIZE_M)
    assert low[2] == pytest.approx(0, abs=GROUND_M)
    for part in model.parts:
        assert np.isfinite(part.vertices).all()
        assert part.faces.min() >= 0 and part.faces.max() < len(part.vertices)
        assert np.linalg.norm(face_areas(part), axis=1).min() > 0, part.name
        assert part.material in MATERIALS
        if part.normals is not None:
            length = np.linalg.norm(part.normals, axis=1)
            assert length == pytest.approx(1, abs=1e-6), part.name  # rounding of a square root


def check_lamps(model, kinds):
    low, high = extent_m(model)
    parts = {}
    for part in model.parts:
        if part.lamp is None:
            continue
        parts.setdefault(part.lamp.kind, []).append(part)
        area = face_areas(part).sum(0)
        axis = np.array(part.lamp.axis)
        assert area @ axis > 0.5 * np.linalg.norm(area), part.name
        # a lamp ahead of the middle shines ahead, one behind it to the rear
        if abs(axis[0]) > 0.5 and part.lamp.kind != "brake_high":
            assert axis[0] * part.vertices[:, 0].mean() > 0, part.name
    assert kinds <= set(parts)
    return parts


@pytest.mark.parametrize(("group", "family"), FAMILIES)
def test_a_vehicle_has_its_size_a_sound_mesh_and_all_lamps(group, family):
    thing = one(group, family)
    assert thing.category in CATEGORIES
    check_mesh(near(thing), thing)
    check_lamps(near(thing), LAMPS)
    assert triangles(near(thing)) < TRIANGLES["near"]


@pytest.mark.slow
@pytest.mark.parametrize(("group", "family"), FAMILIES)
@pytest.mark.parametrize("detail", ["near", "middle", "far"])
def test_every_level_of_several_members_of_each_family(group, family, detail):
    for seed in range(1, 5):
        thing = one(group, family, seed)
        model = things.build(thing, detail)
        check_mesh(model, thing)
        check_lamps(model, LAMPS)
        assert triangles(model) < TRIANGLES[detail]


def test_far_is_coarser_and_keeps_extent_and_lamps():
    thing = one("car", "sedan")
    far = things.build(thing, "far")
    check_mesh(far, thing)
    assert triangles(far) < TRIANGLES["far"]
    lamps = {part.name: part for part in near(thing).parts if part.lamp}
    assert {part.name for part in far.parts if part.lamp} == set(lamps)


def test_the_same_variant_is_the_same_car_and_another_one_differs():
    thing = one("car", "sedan")
    again = one("car", "sedan")
    other = one("car", "sedan", 1)
    assert thing == again and hash(thing) == hash(again)
    assert thing.size_m != other.size_m


def test_families_are_drawn_by_their_shares():
    rng = np.random.default_rng(3)
    drawn = [things.draw("car", rng).family for _ in range(200)]
    assert set(drawn) == set(things.names("car"))


def test_unknown_names_are_told():
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="no group of things 'ship'; expected car"):
        things.draw("ship", rng)
    with pytest.raises(ValueError, match="no family 'tram' in group 'car'; expected sedan"):
        things.draw("car", rng, "tram")
