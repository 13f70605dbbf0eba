"""The digest of a scene's content changes if and only if light or labels may change."""

from dataclasses import replace

import numpy as np
import pytest

from isethdr_core.scene import Material, flat
from isethdr_core.sequence.equal_content import content_of

from .waiting import Waiting, shifted


def test_another_time_at_which_nothing_has_changed_has_equal_content():
    first, later = (content_of(Waiting(t)()) for t in (0.25, 0.75))
    assert first is not None and first == later


def with_renamed_object(scene):
    first, *others = scene.objects
    return replace(scene, objects=(replace(first, name="crate"), *others))


def with_lamp_changed(_):
    return Waiting(1.5)()


def with_box_moved(_):
    return Waiting(2.1)()


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


CHANGES = [
    with_renamed_object,
    with_lamp_changed,
    with_box_moved,
    with_material,
    with_camera,
    with_vertex,
    with_sky,
    with_instances,
]


@pytest.mark.parametrize("change", CHANGES)
def test_whatever_light_or_labels_follow_from_changes_the_content(change):
    assert content_of(Waiting()()) != content_of(change(Waiting()()))


def test_a_later_motion_changes_the_label_of_motion_and_so_the_content():
    waits, starts = (content_of(Waiting(t, frames_per_s=10.0)()) for t in (1.5, 1.95))
    assert waits != starts


def test_a_description_that_is_no_plain_data_has_no_content():
    assert content_of(replace(Waiting()(), fog=np.random.default_rng())) is None
