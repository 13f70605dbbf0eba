"""Projection: both kinds of coordinates give the directions, solid angles and depths of the same
sphere.
"""

import numpy as np
import pytest

from isethdr_core.physics.optics.projection import (
    angle_rad,
    cos4,
    depth_m,
    direction,
    solid_angle_per_area,
)


def test_the_same_direction_has_the_same_angle():
    theta = np.radians([0.0, 10.0, 60.0])
    phi = 0.7
    tangent = direction(np.tan(theta) * np.cos(phi), np.tan(theta) * np.sin(phi))
    angles = direction(theta * np.cos(phi), theta * np.sin(phi), "equidistant")
    np.testing.assert_allclose(tangent, angles, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(direction(2.0, 1.5, "equidistant")), 1.0, rtol=1e-15)
    assert angle_rad(3.0, 0.0, "equidistant") == 3.0 and angle_rad(1.0, 0.0) == pytest.approx(
        np.pi / 4
    )


@pytest.mark.parametrize("projection", ["tangent", "equidistant"])
def test_solid_angle_is_that_of_the_tile_on_the_sphere(projection):
    h = 1e-4
    for x, y in ((0.0, 0.0), (0.4, -0.3), (0.9, 0.2)):
        across = direction(x + h, y, projection) - direction(x - h, y, projection)
        down = direction(x, y + h, projection) - direction(x, y - h, projection)
        area = np.linalg.norm(np.cross(across, down)) / (4 * h**2)
        assert solid_angle_per_area(x, y, projection) == pytest.approx(area, rel=1e-6)  # O(h^2)
        assert cos4(x, y, projection) == pytest.approx(
            area * direction(x, y, projection)[2], rel=1e-6
        )


def test_the_whole_sphere_is_four_pi():
    x = (np.arange(800) + 0.5) / 800 * 2 * np.pi - np.pi
    r = np.hypot(x[:, None], x)
    total = (
        np.where(r < np.pi, solid_angle_per_area(x[:, None], x, "equidistant"), 0.0).sum()
        * (x[1] - x[0]) ** 2
    )
    assert total == pytest.approx(4 * np.pi, rel=1e-4)  # 800 x 800 midpoints


def test_depth_follows_the_projection():
    assert depth_m(2.0, 1.0, 0.0) == pytest.approx(2 * np.cos(np.pi / 4))
    assert depth_m(2.0, np.radians(120.0), 0.0, "equidistant") == pytest.approx(-1.0)
    assert depth_m(np.inf, np.pi / 2, 0.0, "equidistant") == np.inf
    with pytest.raises(ValueError, match="fisheye"):
        angle_rad(1.0, 0.0, "fisheye")
