"""Motion in the field of the point that a tile shows, until the next frame."""

import numpy as np
import pytest

from isethdr_core.motion.visible_motion import displacement
from isethdr_core.quantities import scene_radiance
from isethdr_core.scene import Camera, NextFrame, Placed, SceneDescription

STRAIGHT = Camera((0.0, 0.0, 1.0), (10.0, 0.0, 1.0))
X = np.linspace(-0.3, 0.3, 5)
Y = np.linspace(-0.2, 0.2, 3)


def seen(instance: int, distance_m: float, projection: str = "tangent"):
    shape = (3, 5)
    return scene_radiance(
        np.ones((1, 1, *shape)),
        ["sky"],
        [550.0],
        X,
        Y,
        projection=projection,
        instance=np.full(shape, instance, np.uint32),
        distance=np.full(shape, distance_m),
    )


def described(later: Camera, shift_m: tuple[float, float, float] = (0, 0, 0)) -> SceneDescription:
    pose = np.eye(4)
    moved = np.eye(4)
    moved[:3, 3] = shift_m
    objects = (Placed("wall", "wall", "car", pose),)
    following = NextFrame(0.01, later, (moved,))
    return SceneDescription("test", {}, objects, {}, STRAIGHT, next_frame=following)


def test_a_point_on_the_axis_moves_by_its_shift_over_its_distance():
    motion = displacement(described(STRAIGHT, (0.0, 0.4, 0.0)), seen(1, 20.0))
    # rounding of numbers of 20 m in float64
    assert motion[1, 2] == pytest.approx(0.4 / 20.0, rel=1e-12)


def test_driving_on_moves_points_away_from_the_axis():
    later = Camera((0.5, 0.0, 1.0), (10.5, 0.0, 1.0))
    motion = displacement(described(later), seen(1, 20.0))
    depth_m = 20.0 / np.sqrt(1 + X[None, :] ** 2 + Y[:, None] ** 2)
    radius = np.hypot(X[None, :], Y[:, None])
    np.testing.assert_allclose(motion, radius * (depth_m / (depth_m - 0.5) - 1), atol=1e-15)


@pytest.mark.parametrize("projection", ["tangent", "equidistant"])
def test_the_sky_moves_with_the_turns_of_the_camera_only(projection):
    on = Camera((3.0, 0.0, 1.0), (13.0, 0.0, 1.0))
    np.testing.assert_allclose(
        displacement(described(on), seen(0, np.inf, projection)), 0.0, atol=1e-15
    )
    angle = 0.01
    turned = Camera((0.0, 0.0, 1.0), (10 * np.cos(angle), 10 * np.sin(angle), 1.0))
    motion = displacement(described(turned), seen(0, np.inf, projection))
    on_axis = {"tangent": np.tan(angle), "equidistant": angle}[projection]
    assert motion[1, 2] == pytest.approx(on_axis, rel=1e-12)


def test_a_point_that_gets_behind_the_camera_has_no_motion():
    later = Camera((30.0, 0.0, 1.0), (40.0, 0.0, 1.0))
    assert np.isnan(displacement(described(later), seen(1, 20.0))).all()
