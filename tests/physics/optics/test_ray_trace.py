"""Exact rays: Snell's law, conics without aberration, aspheres, misses, paths, and their paraxial
limit.
"""

import numpy as np
import pytest

from isethdr_core.physics.optics.paraxial import matrices
from isethdr_core.physics.optics.ray_trace import (
    collimated,
    follow,
    ghost_path,
    reflect,
    refract,
    sequential,
)
from isethdr_core.physics.optics.surfaces import Surface, intersect, normal, sag_mm


def test_refraction_is_snell_and_keeps_length_and_plane():
    rng = np.random.default_rng(1)
    d, n = (v / np.linalg.norm(v, axis=0) for v in rng.normal(size=(2, 3, 500)))
    out = refract(d, n, 1.0, 1.6)
    np.testing.assert_allclose(np.linalg.norm(out, axis=0), 1.0, rtol=1e-13)
    # Snell's law, n' sin' = n sin, and the common plane of incidence
    np.testing.assert_allclose(1.6 * np.cross(out, n, axis=0), np.cross(d, n, axis=0), atol=1e-13)
    assert np.all(np.sum(out * n, axis=0) * np.sum(d * n, axis=0) > 0)
    np.testing.assert_allclose(refract(-out, n, 1.6, 1.0), -d, atol=1e-12)  # reversible
    np.testing.assert_allclose(reflect(reflect(d, n), n), d, atol=1e-14)
    steep = np.array([[0.9], [0.0], [np.sqrt(1 - 0.81)]])
    # total reflection
    assert np.isnan(refract(steep, np.array([[0.0], [0.0], [1.0]]), 1.6, 1.0)).all()


@pytest.mark.parametrize(
    "surface",
    [
        Surface(1.0, 0.05),
        Surface(1.0, -0.08, -1.0),
        Surface(-2.0, 0.04, -3.2),
        Surface(0.0, 0.06, 0.7, (1e-5, -3e-8)),
        Surface(3.0, 0.0, 0.0, (2e-5,)),
    ],
)
def test_intersections_lie_on_the_surface_and_on_the_ray(surface):
    rng = np.random.default_rng(2)
    x, y = rng.uniform(-6, 6, (2, 300))
    p, d = collimated(x, y, 0.0, rng.uniform(-0.4, 0.4, 300), rng.uniform(-0.4, 0.4, 300))
    hit = intersect(surface, p, d)
    ok = np.isfinite(hit[0])
    assert ok.mean() > 0.9
    r2 = hit[0] ** 2 + hit[1] ** 2
    np.testing.assert_allclose((hit[2] - surface.z_mm)[ok], sag_mm(surface, r2)[ok], atol=1e-11)
    np.testing.assert_allclose(np.cross(hit - p, d, axis=0)[:, ok], 0, atol=1e-11)
    # compare the normal with finite differences of the sag
    step = 1e-5
    n = normal(surface, hit)
    rise = (
        sag_mm(surface, (hit[0] + step) ** 2 + hit[1] ** 2)
        - sag_mm(surface, (hit[0] - step) ** 2 + hit[1] ** 2)
    ) / (2 * step)
    # 1e-8: rounding of differences over 1e-5 mm
    np.testing.assert_allclose((-n[0] / n[2])[ok], rise[ok], atol=1e-8)


def test_a_paraboloid_has_a_perfect_focus_and_a_hyperboloid_too():
    x = np.linspace(-8, 8, 41)
    # a mirror concave to light along +z: the focus is 10 mm in front of it
    mirror = Surface(10.0, -1 / 20, -1.0)
    start = collimated(x, 0 * x, -30.0, 0.0, 0.0)
    rays = follow([mirror, Surface(0.0)], [1.0, 1.0, 1.0], [(0, True), (1, False)], start)
    np.testing.assert_allclose(rays.position_mm[:2], 0, atol=1e-12)
    # collimated light in glass n leaves through a hyperboloid with k = -n^2 (Cartesian oval for an
    # object at infinity): the focal distance is R / (n - 1)
    n = 1.6
    radius = -12.0
    surfaces = [Surface(0.0, 1 / radius, -(n**2)), Surface(-radius / (n - 1))]
    start = collimated(x / 2, 0 * x, -30.0, 0.0, 0.0)
    rays = follow(surfaces, [n, 1.0, 1.0], sequential(2), start)
    np.testing.assert_allclose(rays.position_mm[0], 0, atol=1e-11)


def test_rays_that_miss_a_surface_are_dark_and_stay_so():
    ball = Surface(0.0, 1 / 5, semi_diameter_mm=4.0)
    start = collimated(np.array([0.0, 3.9, 4.5, 5.5]), np.zeros(4), -10.0, 0.0, 0.0)
    rays = follow([ball, Surface(6.0)], [1.0, 1.5, 1.5], sequential(2), start)
    assert list(rays.margin > 0) == [True, True, False, False]
    assert rays.weight[3] == 0 and rays.margin[3] == -np.inf and np.isnan(rays.position_mm[0, 3])


def lens():
    return [Surface(0.0, 1 / 30), Surface(4.0, -1 / 45), Surface(6.0), Surface(40.0)], [
        1.0,
        1.6,
        1.0,
        1.0,
        1.0,
    ]


@pytest.mark.parametrize(
    "path", [sequential(4), ghost_path(4, 1, 0), ghost_path(4, 3, 1), ghost_path(4, 3, 0)]
)
def test_small_rays_follow_the_matrices(path):
    """The exact trace differs from paraxial matrices by the square of the aperture, along every
    kind of path.
    """
    surfaces, indices = lens()
    matrix = matrices(surfaces, indices, path, 0.0)[-1]
    error = []
    for size in (0.1, 0.05):
        start = collimated(np.array([size]), np.zeros(1), 0.0, 0.005 * size, 0.0)
        rays = follow(surfaces, indices, path, start)
        height, angle = matrix @ [size, 0.005 * size]
        slope = rays.direction[0, 0] / abs(rays.direction[2, 0])
        error.append([abs(rays.position_mm[0, 0] - height) / size, abs(slope - angle) / size])
    assert np.max(error[0]) < 1e-3
    # third-order aberration: the relative difference goes as the square of the size
    np.testing.assert_allclose(np.array(error[0]) / error[1], 4, rtol=0.02)


def test_paths():
    assert ghost_path(3, 2, 0) == [
        (0, False),
        (1, False),
        (2, True),
        (1, False),
        (0, True),
        (1, False),
        (2, False),
    ]
    with pytest.raises(ValueError, match="front < back"):
        ghost_path(3, 1, 1)
