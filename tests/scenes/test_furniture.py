"""Street furniture, signs and buildings: sizes known without a mesh, materials, lamps, pictures."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_scenes.geometry.mesh.piece import face_areas
from isethdr_scenes.materials import MATERIALS
from isethdr_scenes.things import build, draw, names
from isethdr_scenes.things.furniture import signs, traffic_lights
from isethdr_scenes.things.furniture.sign_faces import face
from isethdr_scenes.things.registry import group_named

from isethdr_core.data.categories import CATEGORIES

GROUPS = ("street lamp", "traffic light", "sign", "building", "barrier", "furniture")
EVERY = [(group, family) for group in GROUPS for family in names(group)]


@pytest.fixture(scope="module")
def built():
    """Return two members of every family: one with near detail, one with far detail."""
    made = {}
    for group, family in EVERY:
        for variant, detail in ((1, "near"), (2, "far")):
            thing = group_named(group).thing(family, variant)
            made[family, detail] = thing, build(thing, detail).model()
    return made


@pytest.mark.parametrize("group, family", EVERY)
def test_the_size_is_known_without_a_mesh(built, group, family):
    for detail in ("near", "far"):
        thing, model = built[family, detail]
        corners = np.concatenate([p.vertices for p in model.parts])
        low = corners.min(0)
        high = corners.max(0)
        # the height is measured above the ground; posts and walls extend below it, for slopes
        assert np.abs([*(high - low)[:2], high[2]] - np.array(thing.size_m)).max() < 0.03
        assert np.abs(low + high)[:2].max() / 2 < 0.02 and low[2] <= 0.02
        assert thing.category in CATEGORIES and thing.group == group
        assert hash(thing) == hash(group_named(group).thing(family, thing.variant))


@pytest.mark.parametrize("group, family", EVERY)
def test_meshes_are_sound_and_lamps_face_their_axis(built, group, family):
    for detail in ("near", "far"):
        parts = built[family, detail][1].parts
        for part in parts:
            assert part.material in MATERIALS and np.isfinite(part.vertices).all()
            weight = face_areas(part)
            along = (weight * part.normals[part.faces].mean(1)).sum(1)
            # normals and faces agree about the outer side, except on thin triangles of bent tubes
            assert -along[along < 0].sum() < 0.02 * np.linalg.norm(weight, axis=1).sum(), part.name
            if part.lamp:
                seen = weight.sum(0) @ np.array(part.lamp.axis)
                assert seen > 0.5 * np.linalg.norm(weight, axis=1).sum(), part.name
        lamps = [p.name for p in parts if p.lamp]
        assert len(lamps) == len(set(lamps))


def test_far_meshes_are_smaller(built):
    count = {
        detail: sum(
            len(p.faces) for (_, d), (_, m) in built.items() if d == detail for p in m.parts
        )
        for detail in ("near", "far")
    }
    assert count["far"] < 0.5 * count["near"]


def test_there_are_signs_of_every_kind_with_pictures_of_their_own():
    kinds = {name: signs.kind(name) for name in signs.shares()}
    assert len(kinds) >= 12
    assert {"warning", "priority", "prohibition", "mandatory", "direction"} == set(kinds.values())
    pictures = set()
    for name in kinds:
        pieces = face(name, 0.45, (0, 0, 0))
        pictures.add(
            tuple(
                (p.material, tuple(np.round(p.vertices[:, 1:], 3).ravel().tolist())) for p in pieces
            )
        )
        # all layers but the back face +x and lie within the panel, one in front of the other
        rim = np.abs(pieces[0].vertices[:, 1:]).max(0)
        for piece in pieces[1:]:
            assert (face_areas(piece)[:, 0] > 0).all(), name
            assert (np.abs(piece.vertices[:, 1:]) <= rim + 1e-9).all(), name
    assert len(pictures) == len(kinds)


def test_a_signal_has_a_lamp_for_each_state(built):
    kinds = {p.lamp.kind for p in built["signal_post", "near"][1].parts if p.lamp}
    assert kinds == {kind for on in traffic_lights.STATES.values() for kind in on}
    height = {
        p.lamp.kind: p.vertices[:, 2].mean()
        for p in built["signal_post", "near"][1].parts
        if p.lamp
    }
    assert height["signal_red"] > height["signal_amber"] > height["signal_green"]


def test_windows_are_lit_by_their_area(built):
    """The luminance of lit windows and shop windows, cd/m2, is that of rooms and shops."""
    for family in ("house", "apartments", "shop", "office"):
        for part in (p for p in built[family, "near"][1].parts if p.lamp):
            area = np.linalg.norm(face_areas(part), axis=1).sum()
            low, high = (30, 150) if part.lamp.kind == "shop_window" else (5, 20)
            assert low < part.lamp.intensity_cd / area < high, (family, part.name)


def test_members_of_a_family_differ():
    rng = np.random.default_rng(3)
    houses = [draw("building", rng) for _ in range(30)]
    assert len({h.size_m for h in houses}) == 30 and len({h.family for h in houses}) >= 4
