"""Fog against closed forms: transmission, airlight of one lamp, Koschmieder's law, shadows."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

import mitsuba as mi
from isethdr_mitsuba.doctor import choose_variant
from isethdr_mitsuba.renderer import MitsubaRenderer

from isethdr_core import ledger
from isethdr_core.errors import ConfigError
from isethdr_core.physics.photometry import LM_PER_W, v_lambda
from isethdr_core.scene import Fog, Model, PhaseLobe, Placed, SkyDome, SkyPart, flat, fog_of

BAND = {"first_nm": 550.0, "last_nm": 550.0, "margin": 0.0}
NM = np.arange(360.0, 831.0)
# radiant intensity of a flat spectrum, W sr-1 nm-1 per candela
PER_CD = 1 / (LM_PER_W * float(v_lambda(NM).sum()))


@pytest.fixture(autouse=True)
def llvm():
    mi.set_variant(choose_variant("llvm"))


def light(scene, samples=256, **settings):
    """Return radiance (group, y, x) at 550 nm."""
    settings = {"width": 4, "height": 4, "max_depth": 2} | settings
    return MitsubaRenderer(**BAND, samples=samples, **settings)(scene).radiance.values[:, 0]


def lamp_beside(make, place, candela=100.0):
    """Return a small Lambertian lamp that shines along -y, towards the line of sight."""
    lamp = make.lamp("lamp", "other", candela, make.flat(1.0), (0, -1.0, 0))
    lying = (make.quad(0.02, 0.02)[0][:, [1, 0, 2]], make.quad(0.02, 0.02)[1])
    return "lamp", "post", (make.part(lying, "black", lamp),), make.pose(*place)


def airlight(fog, place, until_m=400.0, candela=100.0):
    """Return the radiance at 550 nm of light of that lamp that fog scatters once into the x axis.

    The integral along the axis is a plain sum with steps of 1 mm.
    """
    along = (np.arange(round(until_m * 1000)) + 0.5) * 1e-3
    way = np.asarray(place) - along[:, None] * [1.0, 0, 0]
    away = np.linalg.norm(way, axis=1)
    sent = candela * PER_CD * (way[:, 1] / away) * fog.transmission(along + away) / away**2
    scattered = fog.albedo * fog.extinction_per_m * fog.phase(way[:, 0] / away)
    return float(np.sum(sent * scattered) * 1e-3)


@pytest.mark.slow
def test_lamps_and_lit_surfaces_fade_by_the_way_of_their_light(make):
    """Compare with exp(-sigma d): a lamp at 20 m, and a wall at 30 m lit by a lamp 10 m away."""
    back = lambda half: (make.quad(half, half)[0] * [-1, 1, 1], make.quad(half, half)[1][:, ::-1])
    shown = make.lamp("drl", "headlights", 50.0, make.flat(1.0), (-1.0, 0, 0))
    onto = make.lamp("street", "streetlights", 900.0, make.flat(1.0), (1.0, 0, 0))
    scene = make.describe(
        [
            ("shown", "car", (make.part(back(0.02), "black", shown),), make.pose(20)),
            ("onto", "post", (make.part(make.quad(0.02, 0.02), "black", onto),), make.pose(20, 1)),
            ("wall", "building", (make.part(back(3)),), make.pose(30)),
        ],
        make.camera((0, 0, 0), (1, 0, 0), 1.0, 1.0),
    )
    fog = fog_of(80.0)
    clear = light(scene)
    foggy = light(replace(scene, fog=replace(fog, albedo=0.0)))
    groups = scene.light_groups()
    lamp, wall = (groups.index(g) for g in ("headlights", "streetlights"))
    lit = clear[lamp] > 0.1 * clear[lamp].max()
    # 1e-5: the part of a lamp in a tile is faded by its mean distance
    np.testing.assert_allclose(
        foggy[lamp][lit], clear[lamp][lit] * fog.transmission(20.0), rtol=1e-5
    )
    # the way of the light: 30 m from the wall to the camera, and 10 to 10.05 m from the lamp to the
    # wall
    np.testing.assert_allclose(foggy[wall], clear[wall] * fog.transmission(40.03), rtol=2e-3)


def test_airlight_of_one_lamp_is_the_integral_along_the_ray(make):
    place = (12.0, 2.0, 1.0)
    scene = make.describe([lamp_beside(make, place)], make.camera((0, 0, 0), (1, 0, 0), 0.2, 1.0))
    fog = Fog(0.04, albedo=0.9, lobes=(PhaseLobe(0.8, 0.7), PhaseLobe(0.2, -0.5)))
    found = light(replace(scene, fog=fog), 1024)[0].mean()
    # 0.5 %: 16 tiles of 1024 paths have 0.2 % of noise
    assert found == pytest.approx(airlight(fog, place), rel=5e-3)


@pytest.mark.slow
def test_no_airlight_in_a_shadow(make):
    """Airlight vanishes where a wall hides the lamp from the camera's rays.

    A wall along all of the rays leaves no light. A wall along their far part leaves the integral
    over the near part.
    """
    place = (12.0, 6.0, 0.0)
    lying = (make.quad(500, 50)[0][:, [1, 0, 2]], make.quad(500, 50)[1])
    wall = lambda x: ("wall", "building", (make.part(lying, "black"),), make.pose(x, 3))
    fog = Fog(0.04, lobes=(PhaseLobe(1.0, 0.3),))
    camera = make.camera((0, 0, 0), (1, 0, 0), 0.2, 1.0)
    behind = lambda x: replace(make.describe([lamp_beside(make, place), wall(x)], camera), fog=fog)
    assert light(behind(0), 64).max() == 0
    # the wall begins at 12 m, below the lamp, and hides the lamp from all points farther away; 1 %:
    # noise of 0.2 %, and a lamp 4 cm wide
    found = light(behind(512), 1024)[0].mean()
    assert found == pytest.approx(airlight(fog, place, until_m=12.0), rel=1e-2)


@pytest.mark.slow
def test_black_targets_fade_into_the_sky_as_koschmieder_says(make):
    """Compare with Koschmieder's law, L = L_sky (1 - exp(-sigma d)), for a small black target.

    The extinction is constant or depends on wavelength. The radiance of the uniform sky does not
    change.
    """
    sky = make.flat(1e-3)
    target = (make.quad(0.02, 0.02)[0] * [-1, 1, 1], make.quad(0.02, 0.02)[1][:, ::-1])
    scene = make.describe(
        [("target", "chart", (make.part(target, "black"),), make.pose(50.0))],
        make.camera((0, 0, 0), (1, 0, 0), 0.02, 1.0),
        sky,
    )
    wide = (PhaseLobe(1.0, 0.3),)
    for fog in (replace(fog_of(150.0), lobes=wide), Fog(0.01, 1.5, lobes=wide)):
        found = light(replace(scene, fog=fog), 1024)[0]
        # 0.5 %: the target shades the fog within a decimetre in front of it, which is 0.2 %
        wanted = 1e-3 * (1 - fog.transmission(50.0, 550.0))
        assert found.mean() == pytest.approx(wanted, rel=5e-3)
    beside = replace(scene, camera=make.camera((0, 0, 0), (1, 1, 0), 0.2, 1.0), fog=fog_of(150.0))
    np.testing.assert_allclose(light(beside), 1e-3, rtol=1e-5)


@pytest.mark.slow
def test_no_more_light_leaves_than_came_in(make):
    """Energy conservation: under a uniform sky, no tile of a white scene is brighter than the sky.

    Ground and wall are white, and the fog does not absorb, so little light is lost.
    """
    white = make.material("white", reflectance=make.flat(1.0))
    ground = (make.quad(300, 300)[0][:, [2, 1, 0]] * [-1, 1, 1], make.quad(300, 300)[1])
    wall = (make.quad(2, 3)[0] * [-1, 1, 1], make.quad(2, 3)[1][:, ::-1])
    scene = make.describe(
        [
            ("ground", "road", (make.part(ground, "white"),), make.pose(0, 0, -1.5)),
            ("wall", "building", (make.part(wall, "white"),), make.pose(15)),
        ],
        make.camera((0, 0, 0), (1, 0, 0), 50.0, 1.0),
        make.flat(1.0),
        [white],
    )
    for visibility_m in (30.0, 300.0):
        found = light(replace(scene, fog=fog_of(visibility_m)), 1024, max_depth=8)
        assert found.max() < 1 + 1e-4  # float32 sums
        assert found.min() > 0.02


@pytest.mark.slow
def test_paths_that_share_a_camera_ray_cross_the_same_fog(make):
    """Compare few paths of a tile with many, four of which share a camera ray.

    The fog ends 5 m above the camera, and the wall begins above its end.
    """
    onto = make.lamp("street", "streetlights", 900.0, make.flat(1.0), (1.0, 0, 0))
    scene = make.describe(
        [
            ("post", "post", (make.part(make.quad(0.02, 0.02), "black", onto),), make.pose(18, 20)),
            ("wall", "building", (make.part(facing_back(make, 30)),), make.pose(20)),
        ],
        make.camera((0, 0, 0), (1, 0, 1), 1.0, 1.0),
    )
    scene = replace(scene, fog=Fog(0.05, albedo=0.0, above_camera_m=5.0))
    few, many = (light(scene, samples, width=2, height=2).mean() for samples in (256, 1024))
    # 1 %: noise of the points at which rays meet the wall
    assert few > 0 and many == pytest.approx(few, rel=0.01)


def test_drawn_directions_follow_the_phase_function():
    """Compare mean cosine and shares within cones of 400,000 directions with the phase function."""
    import drjit as dr
    from isethdr_mitsuba.paths.camera_rays import stream
    from isethdr_mitsuba.paths.fog_tables import FogTables

    fog = fog_of(100.0)
    tables = FogTables(fog, [550.0], 0.0)
    count = 400_000
    rng = stream(mi.UInt32(1), dr.arange(mi.UInt32, count), "test")
    forward = mi.Vector3f(dr.full(mi.Float, 0.6, count), 0.0, 0.8)
    cosine = np.array(dr.dot(tables.scattered(forward, rng), forward), float)
    angle = np.linspace(0, np.pi, 100_001)
    density = 2 * np.pi * fog.phase(np.cos(angle)) * np.sin(angle)
    # five standard deviations of a share of 400,000
    for cone_deg in (1.0, 10.0, 40.0, 90.0, 150.0):
        inside = angle <= np.radians(cone_deg)
        wanted = np.trapezoid(density[inside], angle[inside])
        found = np.mean(cosine >= np.cos(np.radians(cone_deg)))
        assert found == pytest.approx(wanted, abs=5 * 0.5 / np.sqrt(count) + 1e-4)
    assert cosine.mean() == pytest.approx(fog.mean_cosine(), abs=0.003)


@pytest.mark.slow
def test_far_visibility_is_clear_air_and_clear_air_calls_no_fog(make, monkeypatch):
    """With the same random numbers, the picture at a visibility of 10^9 m is that of clear air.

    Clear air is rendered with all of the fog's code removed.
    """
    from isethdr_mitsuba.paths import integrator
    from isethdr_mitsuba.paths.tracing import trace

    scene = make.street(3)
    foggy = light(replace(scene, fog=Fog(3e-9)), 16)
    for module, name in (
        (integrator, "FogTables"),
        (integrator, "AirlightLamps"),
        (trace, "cross_fog"),
    ):
        monkeypatch.setattr(module, name, None)
    clear = light(scene, 16)
    # 1e-3: extinction at a visibility of 10^9 m, float32, and tiles of sky, which are airlight in
    # fog, with another mean over a band
    np.testing.assert_allclose(foggy, clear, rtol=1e-3, atol=1e-7 * clear.max())


@pytest.mark.slow
def test_groups_do_not_depend_on_each_other(make):
    """Half of the tiles show a mirror, in which airlight is seen on a second segment."""
    from isethdr_core.demand import Demand

    scene = replace(make.street(3), fog=fog_of(60.0))
    mirror = make.material("mirror", "conductor", make.flat(0.9), 0.0)
    pane = Model("mirror", (make.part(facing_back(make, 1.0), "mirror"),))
    scene = replace(
        scene,
        models={**scene.models, "mirror": pane},
        objects=(*scene.objects, Placed("mirror", "mirror", "building", make.pose(5, 1, 1.4))),
        materials={**scene.materials, "mirror": mirror},
    )
    settings = MitsubaRenderer(**BAND, width=4, height=4, samples=16, max_depth=3)
    whole = settings(scene)
    alone = settings(scene, Demand(groups=("headlights",)))
    same = whole.radiance.sel(light_group=["headlights"]).values
    assert same.max() > 0
    np.testing.assert_array_equal(alone.radiance.values, same)


def test_illuminance_on_objects_fades(make):
    scene = make.describe(
        [
            (
                "lamp",
                "post",
                (make.part(make.quad(0.01, 0.01), "black", one_lamp(make)),),
                make.pose(10),
            ),
            ("wall", "building", (make.part(facing_back(make, 0.05)),), make.pose(20)),
        ],
        make.camera((0, 0, 0), (1, 0, 0), 1.0, 1.0),
    )
    clear, foggy = (lux_of_wall(replace(scene, fog=fog)) for fog in (None, fog_of(50.0)))
    assert foggy / clear == pytest.approx(fog_of(50.0).transmission(10.0), rel=1e-3)


def one_lamp(make):
    return make.lamp("test", "headlights", 3000.0, make.flat(1.0))


def facing_back(make, half):
    return make.quad(half, half)[0] * [-1, 1, 1], make.quad(half, half)[1][:, ::-1]


def lux_of_wall(scene):
    from isethdr_mitsuba.labels import label_tiles
    from isethdr_mitsuba.world.geometry import build_world
    from isethdr_mitsuba.world.materials import ramp_surfaces
    from isethdr_mitsuba.world.view import view_of

    view = view_of(scene.camera, 24, 24, 0.0)
    _, rows = label_tiles(build_world(scene, ramp_surfaces(scene)), view, scene, {"instance"})
    return {row["name"]: row["illuminance_lx"] for row in rows}["wall"]["headlights"]


def test_a_sky_with_a_gradient_becomes_even_in_fog(make):
    """The uniform sky gives the same illuminance on level ground as the sky with a gradient.

    The variant without a compiler refuses fog.
    """
    from isethdr_mitsuba.fog import in_fog

    pattern = np.linspace(0, 2, 9)[:, None] * np.ones((9, 8))
    dome = SkyDome((SkyPart(make.flat(1e-3), pattern),))
    scene = replace(make.describe([], sky=dome), fog=fog_of(100.0))
    even = in_fog(scene, "llvm_ad_spectral").sky
    assert even.at(550.0) == pytest.approx(dome.irradiance(550.0) / np.pi, rel=1e-12)
    assert in_fog(replace(scene, fog=None), "scalar_spectral").sky is dome
    with pytest.raises(ConfigError, match="visibility_m=null"):
        in_fog(scene, "scalar_spectral")


@pytest.mark.parametrize("with_lamps", [False, True])
@pytest.mark.parametrize("with_sky", [False, True])
def test_only_light_that_is_rendered_is_stated_as_left_out(with_lamps, with_sky):
    from isethdr_mitsuba.fog import state_fog

    with ledger.gathered("fog") as row:
        state_fog(fog_of(100.0), with_lamps, with_sky)
    expected = ["scattered twice"] * with_lamps + ["reflected into the fog"] * with_sky
    assert [left.key for left in row.left_out] == expected


@pytest.mark.slow
def test_volpath_finds_the_same_light():
    """Compare with Mitsuba's own integrator `volpath`.

    By night, paths have two segments: from lamps by surfaces or fog. By day, surfaces are black,
    and all orders of scattering count.
    """
    from isethdr_measured import fog_scattering as study
    from isethdr_measured.fog_reference import volpath_pictures
    from isethdr_mitsuba.world.view import view_of

    for group, depth, ours_depth in (("headlights", 2, 2), ("sky", 60, 2)):
        scene = study.small_scene(group)
        if group == "sky":
            black = {n: replace(m, reflectance=flat(0.0)) for n, m in scene.materials.items()}
            scene = replace(scene, materials=black)
        scene = replace(scene, fog=fog_of(100.0))
        top_m = 500.0 if group != "sky" else 1.3 + scene.fog.above_camera_m
        view = view_of(scene.camera, study.COLUMNS, study.ROWS, 0.0)
        pictures = volpath_pictures(scene, view, group, depth, top_m)
        theirs = np.array([pictures(seed, 128) for seed in range(8)])
        ours = np.array([study.rendered(scene, group, ours_depth, 256, seed) for seed in range(8)])
        for tiles in study.regions_of(scene, group).values():
            a, b = (each[:, tiles].mean(1) for each in (ours, theirs))
            error = np.hypot(a.std(ddof=1), b.std(ddof=1)) / np.sqrt(8)
            # Student's t with 14 degrees of freedom in eight regions: beyond 5 once in 600. The
            # noise of lamps has long tails, which eight batches underestimate.
            assert abs(a.mean() - b.mean()) < max(5 * error, 0.02 * b.mean())
