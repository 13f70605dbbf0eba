"""Openings: shadow rays aimed at the sky through an opening find the same light as random
directions, with less noise.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

import mitsuba as mi
from isethdr_mitsuba.renderer import MitsubaRenderer
from isethdr_scenes.geometry.surroundings import tube as tube_of_road
from isethdr_scenes.geometry.surroundings.ground import Ground

from isethdr_core.data.sky import SkyDome, SkyPart
from isethdr_core.scene import Opening, flat

HALF_M = 2.0  # half width and half height of the tube's mouth
LONG_M = 12.0
NEAR = Opening((5.0, -1.0, -2.0), (0.0, 2.0, 0.0), (0.0, 0.0, 4.0))
FAR = Opening((20.0, 4.0, -2.0), (0.0, 6.0, 0.0), (0.0, 0.0, 4.0))


@pytest.fixture(autouse=True)
def llvm():
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))


def rectangle_sr(half_a, half_b, away):
    """Return the solid angle of a rectangle, seen from a point on the normal through its middle."""
    a = half_a / away
    b = half_b / away
    return 4 * np.arcsin(a * b / np.sqrt((1 + a * a) * (1 + b * b)))


def test_directions_are_drawn_as_the_density_says():
    from isethdr_mitsuba.lamps.sky_openings import SkyOpenings

    count = 100_000
    place = mi.Point3f(*np.zeros((3, count), np.float32))
    for openings, size_sr in (((NEAR,), rectangle_sr(1, 2, 5.0)), ((NEAR, FAR), None)):
        table = SkyOpenings(openings)
        way, density = table.aim(mi.PCG32(count), place, mi.Bool(True))
        density = np.array(density)
        # 1e-3: both are computed in float32, one of them from the point on the rectangle
        np.testing.assert_allclose(np.array(table.density(place, way, True)), density, rtol=1e-3)
        way = np.array(way).T
        hit = way / way[:, :1]
        in_near = np.abs(hit[:, 1]) * 5 <= 1 + 1e-5
        assert in_near.mean() == pytest.approx(1 / len(openings), abs=0.01)
        if size_sr is not None:
            # 0.5 %: 1 / density has a relative standard deviation of 0.3, over the root of 100,000
            assert (1 / density).mean() == pytest.approx(size_sr, rel=0.005)


def test_only_what_lies_behind_an_opening_aims_at_it():
    from isethdr_mitsuba.lamps.sky_openings import SkyOpenings

    table = SkyOpenings([NEAR])
    outside = mi.Point3f(*np.tile([[9.0], [0.0], [0.0]], 500).astype(np.float32))
    _, density = table.aim(mi.PCG32(500), outside, mi.Bool(True))
    assert not np.array(density).any()
    away = mi.Vector3f(*np.tile([[1.0], [0.0], [0.0]], 500).astype(np.float32))
    assert not np.array(table.density(outside, away, True)).any()


def tube(make, sky, share):
    """Return a square tube that is open ahead; the camera looks at the closed end from its middle.

    `share` is the width and height of the opening over those of the mouth. None: no opening is
    stated.
    """
    corners = np.array([[0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]], float) * HALF_M
    v = np.concatenate([corners, corners + [LONG_M, 0, 0]])
    sides = [[k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4] for k in range(4)] + [[0, 1, 2, 3]]
    faces = np.array([t for a, b, c, d in sides for t in ([a, b, c], [a, c, d])])
    scene = make.describe(
        [("tube", "tunnel", (make.part((v, faces)),), make.pose())],
        make.camera((LONG_M / 2, 0, 0), (0, 0, 0), 30.0, 1.0),
        sky,
    )
    if share is None:
        return scene
    low = (LONG_M, -share * HALF_M, -share * HALF_M)
    size = 2 * share * HALF_M
    return replace(scene, openings=(Opening(low, (0.0, size, 0.0), (0.0, 0.0, size)),))


def rendered(scene, samples, depth, seed=0):
    settings = MitsubaRenderer(
        width=8, height=8, margin=0.0, step_nm=100.0, samples=samples, max_depth=depth, seed=seed
    )
    return settings(scene).radiance.values[0, 1].astype(float)


def facing_lux(away):
    """Return the irradiance by a mouth of radiance 1 at a point that faces its middle.

    It is pi times the form factor from a small parallel surface to a rectangle.
    """
    a = HALF_M / away
    return 4 * a / np.sqrt(1 + a * a) * np.arctan(a / np.sqrt(1 + a * a))


@pytest.mark.parametrize(("share", "within"), [(1.0, 0.005), (0.6, 0.12), (1.4, 0.04)])
def test_direct_light_is_the_form_factor_for_any_size_of_the_opening(make, share, within):
    """Compare with the form factor, also for an opening smaller or larger than the mouth.

    Of a larger opening, the walls cover the border.
    """
    found = rendered(tube(make, flat(1.0), share), 1024, 2)
    wanted = 0.5 / np.pi * facing_lux(LONG_M)
    # The four middle tiles are 0.2 m from the middle: 1e-3. The noise of 4,096 paths is 0.1 %, but
    # 3 % if random directions must find the rest of the mouth, and 1 % if half of the shadow rays
    # are blocked.
    assert found[3:5, 3:5].mean() == pytest.approx(wanted, rel=within)


@pytest.mark.slow
@pytest.mark.parametrize("sky", ["uniform", "dome"])
def test_all_light_is_that_found_by_chance(make, sky):
    """Compare aimed with random directions over ten bounces and 16 renderings each.

    The means agree, and the noise is lower.
    """
    light = flat(1.0)
    if sky == "dome":
        pattern = np.linspace(0.2, 3.0, 9)[:, None] * (1 + 0.5 * np.cos(np.arange(12) * np.pi / 6))
        light = SkyDome((SkyPart(flat(1.0), pattern), SkyPart(flat(0.3), pattern[::-1])))
    by_chance, aimed = (
        np.array([rendered(tube(make, light, share), 256, 10, seed) for seed in range(16)])
        for share in (None, 1.0)
    )
    means = [one.mean((1, 2)) for one in (by_chance, aimed)]
    error = np.sqrt(sum(m.var(ddof=1) / len(m) for m in means))
    # a normal deviate is beyond four standard errors with a probability of 6e-5
    assert abs(means[0].mean() - means[1].mean()) < 4 * error
    assert error < 0.01 * means[1].mean()
    assert by_chance.var(0, ddof=1).mean() > 2 * aimed.var(0, ddof=1).mean()


def test_no_light_comes_through_the_lining_of_a_tunnel():
    """Rays that start behind the lining meet a surface in all directions.

    A ray may leave a smoothly shaded surface on its back side; the outer skin of the tunnel stops
    it.
    """
    ground = Ground(0.0, 0)
    assembly = tube_of_road.tunnel(ground, -10.0, 30.0)
    corners = [part.vertices[part.faces].reshape(-1, 3) for part in assembly.parts]
    vertices = np.concatenate(corners).astype(np.float32)
    mesh = mi.Mesh("tunnel", len(vertices), len(vertices) // 3)
    values = mi.traverse(mesh)
    values["vertex_positions"] = vertices.ravel().tolist()
    values["faces"] = list(range(len(vertices)))
    values.update()
    scene = mi.load_dict({"type": "scene", "tunnel": mesh})
    rng = np.random.default_rng(0)
    outline = tube_of_road.section()
    between = outline + 0.05 * np.sign(outline - [0, tube_of_road.SPRING_M / 2])
    point = between[rng.integers(1, len(outline) - 1, 20_000)]
    start = np.stack([rng.uniform(-9, 29, 20_000), point[:, 0], point[:, 1]])
    way = rng.normal(size=(3, 20_000))
    way /= np.linalg.norm(way, axis=0)
    as_point = mi.Point3f(*start.astype(np.float32))
    ray = mi.Ray3f(as_point, mi.Vector3f(*way.astype(np.float32)))
    assert np.array(scene.ray_test(ray)).all()
