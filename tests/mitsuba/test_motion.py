"""The label `motion` against closed forms of a pinhole; nothing is rendered."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.motion import motion_label
from isethdr_mitsuba.world.view import view_of

from isethdr_core.scene import Camera, NextFrame, Placed, SceneDescription

AHEAD = Camera((0.0, 0.0, 0.0), (10.0, 0.0, 0.0), 40.0, 2.0)
WALL_M = 25.0


def shifted(x_m=0.0, y_m=0.0, z_m=0.0):
    pose = np.eye(4)
    pose[:3, 3] = x_m, y_m, z_m
    return pose


def motion(camera, pose, number=1, projection="tangent", first=AHEAD):
    """Return view, x, y and motion of a wall 25 m ahead, or of the sky, on 20 x 10 tiles."""
    objects = (Placed("wall", "wall", "building", np.eye(4)),)
    following = NextFrame(0.1, camera, (pose,))
    scene = SceneDescription("wall", {}, objects, {}, first, None, following)
    view = view_of(first, 20, 10, 0.0)
    x, y = np.meshgrid(view.x, view.y)
    cosine = view.rays(x, y)[..., 2]
    labels = {
        "instance": np.full(view.shape, number),
        "distance": np.where(number, WALL_M / cosine, np.inf),
    }
    return view, x, y, motion_label(scene, view, labels)["motion"]


def test_a_camera_that_drives_on_sees_everything_flow_from_the_axis():
    view, x, y, found = motion(Camera((2.0, 0.0, 0.0), (12.0, 0.0, 0.0), 40.0, 2.0), np.eye(4))
    # 1e-7: float32, 6e-8 of a coordinate below 0.4
    growth = WALL_M / (WALL_M - 2.0) - 1
    np.testing.assert_allclose(found[..., 0], growth * x, atol=1e-7)
    np.testing.assert_allclose(found[..., 1], growth * y, atol=1e-7)


def test_an_object_moves_by_its_way_over_its_distance():
    # left in the world is left in the picture; x of the field points right, y down
    *_, found = motion(AHEAD, shifted(0.0, 0.5, 0.25))
    np.testing.assert_allclose(found[..., 0], -0.5 / WALL_M, atol=1e-7)
    np.testing.assert_allclose(found[..., 1], -0.25 / WALL_M, atol=1e-7)


def test_object_and_camera_that_move_alike_stand_still():
    *_, found = motion(Camera((2.0, 1.0, 0.0), (12.0, 1.0, 0.0), 40.0, 2.0), shifted(2.0, 1.0))
    np.testing.assert_allclose(found, 0.0, atol=1e-7)


def test_the_sky_moves_by_turns_alone():
    turn = np.radians(2.0)
    turned = Camera((5.0, 0.0, 0.0), (5 + np.cos(turn), np.sin(turn), 0.0), 40.0, 2.0)
    _, x, y, found = motion(turned, np.eye(4), number=0)
    # a turn of the camera to the left moves the picture to the right, by the angle of the turn
    np.testing.assert_allclose(x + found[..., 0], np.tan(np.arctan(x) + turn), atol=1e-6)
    wide = Camera((0.0, 0.0, 0.0), (10.0, 0.0, 0.0), 40.0, 2.0, "equidistant")
    level = Camera((5.0, 0.0, 0.0), turned.target_m, 40.0, 2.0, "equidistant")
    view, x, y, found = motion(level, np.eye(4), number=0, first=wide)
    middle = np.abs(view.y).argmin()  # half a tile from the horizon, so angles almost add
    np.testing.assert_allclose(found[middle, :, 0], turn, rtol=2e-3)


def test_what_gets_behind_the_camera_has_no_motion_on_tangents():
    *_, found = motion(Camera((40.0, 0.0, 0.0), (50.0, 0.0, 0.0), 40.0, 2.0), np.eye(4))
    assert np.isnan(found).all()


def test_a_scene_without_a_next_frame_has_no_such_label():
    scene = SceneDescription("still", {}, (), {}, AHEAD)
    assert motion_label(scene, view_of(AHEAD, 4, 2, 0.0), {}) == {}
