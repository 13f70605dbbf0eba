"""Digests of content: what changes light changes them, and nothing else does."""

from dataclasses import replace

import numpy as np
import pytest

from isethdr_core.scene import Material, flat
from isethdr_core.sequence.equal_content import content_of

from .waiting import Waiting, shifted


def test_another_time_at_which_nothing_has_changed_has_equal_content():
    first, later = (content_of(Waiting(t)()) for t in (0.25, 0.75))
    assert first == later and set(first.groups) == {"sky", "steady", "blinker"}


def test_a_lamp_that_changes_changes_its_own_group_alone():
    dark, bright = (content_of(Waiting(t)()) for t in (0.5, 1.5))
    assert dark.whole != bright.whole
    assert [g for g in dark.groups if dark.groups[g] != bright.groups[g]] == ["blinker"]


def test_a_box_that_moves_changes_every_group():
    here, there = (content_of(Waiting(t)()) for t in (2.0, 2.1))
    assert all(here.groups[g] != there.groups[g] for g in here.groups)


def test_a_later_motion_changes_labels_but_no_light():
    waits, starts = (content_of(Waiting(t, frames_per_s=10.0)()) for t in (1.5, 1.95))
    assert waits.groups == starts.groups and waits.whole != starts.whole


def with_material(scene):
    return replace(scene, materials={"matt": Material("matt", reflectance=flat(0.3))})


def with_camera(scene):
    return replace(scene, camera=replace(scene.camera, position_m=(0.0, 0.0, 1.0 + 1e-12)))


def with_vertex(scene):
    scene.models["box"].parts[0].vertices[0, 0] = 1e-9
    return scene


def with_sky(scene):
    return replace(scene, sky=flat(2e-4))


def with_instances(scene):
    first, *others = scene.objects
    return replace(scene, objects=(first, *others, replace(first, pose=shifted(30.0))))


@pytest.mark.parametrize(
    "change", [with_material, with_camera, with_vertex, with_sky, with_instances]
)
def test_whatever_light_follows_from_changes_every_group(change):
    before = content_of(Waiting()())
    after = content_of(change(Waiting()()))
    assert before.whole != after.whole
    assert not set(before.groups.values()) & set(after.groups.values())


def test_names_of_objects_change_labels_but_no_light():
    scene = Waiting()()
    first, *others = scene.objects
    renamed = replace(scene, objects=(replace(first, name="crate"), *others))
    assert content_of(renamed).groups == content_of(scene).groups
    assert content_of(renamed).whole != content_of(scene).whole


def test_a_description_that_is_no_plain_data_has_no_content():
    assert content_of(replace(Waiting()(), fog=np.random.default_rng())) is None
