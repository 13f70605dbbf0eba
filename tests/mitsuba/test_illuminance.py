"""Illuminance of objects against closed forms: one lamp, a shadow, a sky."""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

import mitsuba as mi
from isethdr_mitsuba.doctor import choose_variant

from isethdr_core.physics.photometry import LM_PER_W, v_lambda
from isethdr_core.scene import SkyDome, SkyPart

CANDELA = 3000.0
NM = np.arange(360.0, 831.0)
# luminance, cd/m2, of a uniform sky of 1e-3 W m-2 sr-1 nm-1
UNIT = LM_PER_W * 1e-3 * float(v_lambda(NM).sum())


def lit(make, objects, camera=None, sky=None, variant="llvm"):
    """Return the illuminance, lx, of visible objects: {name: {light group: lx}}.

    Nothing is rendered.
    """
    mi.set_variant(choose_variant(variant))
    from isethdr_mitsuba.labels import label_tiles
    from isethdr_mitsuba.world.geometry import build_world
    from isethdr_mitsuba.world.materials import ramp_surfaces
    from isethdr_mitsuba.world.view import view_of

    scene = make.describe(objects, camera or make.camera((0, 0, 0), (1, 0, 0), 1.0, 1.0), sky)
    view = view_of(scene.camera, 24, 24, 0.0)
    _, rows = label_tiles(build_world(scene, ramp_surfaces(scene)), view, scene, {"instance"})
    return {row["name"]: row["illuminance_lx"] for row in rows}


def facing_back(mesh):
    """Return a rectangle that faces -x, towards the camera."""
    return mesh[0] * [-1, 1, 1], mesh[1][:, ::-1]


def panel(make, x_m, half_m=0.5):
    """Return a wall across the line of sight."""
    return "wall", "building", (make.part(facing_back(make.quad(half_m, half_m))),), make.pose(x_m)


def lamp_at(make, x_m, y_m, group="headlights", turn_deg=0.0):
    """Return a small Lambertian lamp that shines along +x, turned to the left by an angle."""
    lamp = make.lamp("test", group, CANDELA, make.flat(1.0))
    part = make.part(make.quad(0.01, 0.01), "black", lamp)
    return "lamp", "post", (part,), make.pose(x_m, y_m, 0, turn_deg)


def test_one_lamp_follows_inverse_square_and_cosine(make):
    """Compare with the closed form for a lamp 10 m from the wall and 0, 5 and 10 m to the side."""
    for aside_m in (0.0, 5.0, 10.0):
        found = lit(make, [panel(make, 20.0, 0.05), lamp_at(make, 10.0, aside_m)])["wall"]
        away_m = np.hypot(10.0, aside_m)
        cosine = 10.0 / away_m  # at the lamp and at the wall
        # 1 %: points of the wall are up to 5 cm from its middle, which is 0.5 % of the distance
        assert found["headlights"] == pytest.approx(CANDELA * cosine**2 / away_m**2, rel=0.01)


def test_the_plane_is_upright_and_turned_to_the_camera_whatever_the_surface(make):
    """The illuminance of a floor and a slope is that on an upright plane at their position."""
    floor = facing_back(make.quad(0.05, 0.3))
    for pitch_deg in (-90.0, -160.0):
        part = make.part(floor)
        scene = [
            ("floor", "road", (part,), make.pose(20.0, 0, -1.5, pitch_deg=pitch_deg)),
            lamp_at(make, 10.0, 0.0),
        ]
        camera = make.camera((0, 0, 0.0), (20.0, 0, -1.5), 1.0, 1.0)
        found = lit(make, scene, camera)["floor"]["headlights"]
        away_m = np.hypot(10.0, 1.5)
        assert found == pytest.approx(CANDELA * (10 / away_m) ** 2 / away_m**2, rel=0.02)


def test_each_light_group_has_its_own_light_and_all_are_there(make):
    behind = lamp_at(make, 30.0, 0.0, "other", 180.0)
    scene = [panel(make, 20.0, 0.05), lamp_at(make, 10.0, 0.0), ("behind", *behind[1:])]
    found = lit(make, scene)["wall"]
    assert found["headlights"] == pytest.approx(CANDELA / 100, rel=0.01)
    assert found["other"] == 0.0  # it shines on the back of the wall


def test_an_occluder_takes_the_light_away(make):
    board = make.part(make.quad(0.5, 0.5))
    scene = [panel(make, 20.0, 0.05), lamp_at(make, 10.0, 5.0)]
    assert lit(make, scene)["wall"]["headlights"] > 10.0
    shade = ("shade", "post", (board,), make.pose(15.0, 2.5))
    assert lit(make, [*scene, shade])["wall"]["headlights"] == 0.0
    beside = ("shade", "post", (board,), make.pose(15.0, -2.5))
    assert lit(make, [*scene, beside]) == lit(make, scene)


def test_a_lamp_does_not_light_its_own_object(make):
    lamp = make.lamp("test", "headlights", CANDELA, make.flat(1.0), (-1.0, 0, 0))
    housing = make.part(facing_back(make.quad(0.5, 0.5)))
    bulb = make.part(facing_back(make.quad(0.05, 0.05, 0.2)), "black", lamp)
    found = lit(make, [("lamp", "post", (housing, bulb), make.pose(20.0))])
    assert found["lamp"]["headlights"] == 0.0


def test_an_even_sky_gives_half_of_pi_l_above_ground_and_all_of_it_without(make):
    sky = make.flat(1e-3)
    wall = panel(make, 20.0, 0.1)
    assert lit(make, [wall], sky=sky)["wall"]["sky"] == pytest.approx(np.pi * UNIT, rel=1e-6)
    ground = make.quad(4000.0, 4000.0)[0][:, [2, 1, 0]] * [1, 1, -1], make.quad(1, 1)[1][:, ::-1]
    road = "road", "road", (make.part(ground),), make.pose(0.0, 0, -1.0)
    found = lit(make, [wall, road], sky=sky)["wall"]["sky"]
    # 2 %: of 16 x 64 stratified directions, a few are on the wrong side of the horizon
    assert found == pytest.approx(np.pi * UNIT / 2, rel=0.02)


def test_a_sky_with_a_gradient_is_integrated_over_the_half_that_the_wall_sees(make):
    """Compare with the closed form for L = L0 (1 + cos(azimuth)) and a wall that faces 180 degrees.

    With the azimuth a counted from there, the term 1 gives pi. The term -cos(a) gives -(integral of
    cos(up)^2) (integral of cos(a)^2) = -(pi / 2)^2.
    """
    azimuth = np.radians(np.arange(360.0))
    sky = SkyDome((SkyPart(make.flat(1e-3), np.tile(1 + np.cos(azimuth), (181, 1))),))
    found = lit(make, [panel(make, 20.0, 0.1)], sky=sky)["wall"]["sky"]
    # 1 %: 16 points with 64 directions each, a mean of 1024 values that vary by a third
    assert found == pytest.approx(UNIT * (np.pi - np.pi**2 / 4), rel=0.01)


@pytest.mark.slow
def test_a_matt_wall_is_as_bright_as_its_illuminance_says(make):
    """Compare the rendered luminance of a wall with L = reflectance x E / pi, with direct light
    only.

    A board shades half of the wall from one of two lamps, and the ground hides half of the sky.
    """
    from isethdr_mitsuba.renderer import MitsubaRenderer
    from scipy.ndimage import binary_erosion

    from isethdr_core.demand import Demand
    from isethdr_core.physics.photometry import luminance

    ground = make.quad(4000.0, 4000.0)[0][:, [2, 1, 0]] * [1, 1, -1], make.quad(1, 1)[1][:, ::-1]
    objects = [
        panel(make, 20.0, 0.1),
        lamp_at(make, 10.0, 5.0),
        ("beside", *lamp_at(make, 12.0, -4.0)[1:]),
        ("shade", "post", (make.part(make.quad(0.1, 0.5)),), make.pose(19.0, 0.6)),
        ("road", "road", (make.part(ground, "black"),), make.pose(0.0, 0, -1.0)),
    ]
    camera = make.camera((0, 0, 0), (1, 0, 0), 1.0, 1.0)
    scene = make.describe(objects, camera, make.flat(1e-3))
    settings = {"margin": 0.0, "step_nm": 20.0, "max_depth": 2, "samples": 256}
    ds = MitsubaRenderer(width=24, height=24, **settings)(scene, Demand(labels={"instance"}))
    wall = binary_erosion(ds.instance.values == 1)  # edge tiles also show sky
    [row] = [row for row in ds.attrs["objects"] if row["name"] == "wall"]
    for group, lux in row["illuminance_lx"].items():
        seen = luminance(ds.radiance.sel(light_group=group).values, ds.wavelength.values)[wall]
        # 1.5 %: 0.5 % of noise in the picture; 32 points and 14 rows of tiles sample the edge of
        # the shadow
        assert seen.mean() == pytest.approx(0.5 * lux / np.pi, rel=0.015), group
        assert lux > 1.0


@pytest.mark.slow
def test_few_places_are_near_many_on_a_night_drive(monkeypatch):
    """Compare values above 0.01 lx with ten times the points of objects and four times those of
    lamps.

    Half of the values are within 10 %, and nine of ten within 30 %. Edges of beams and shadows lie
    on objects, and 32 points of a half lit object have a standard error of 18 %.
    """
    from isethdr_core.config.composition import compose
    from isethdr_core.pipeline.chain import chain

    mi.set_variant(choose_variant("llvm"))
    from isethdr_mitsuba import illuminance
    from isethdr_mitsuba.labels import label_tiles
    from isethdr_mitsuba.world.geometry import build_world
    from isethdr_mitsuba.world.materials import ramp_surfaces
    from isethdr_mitsuba.world.view import view_of

    scene = chain(compose(["scene=night_drive", "scene.street_lamps=[6,6]"])).scene()
    view = view_of(scene.camera, 640, 360, 0.1)
    world = build_world(scene, ramp_surfaces(scene))
    found = []
    for places, points in ((32, 4), (320, 16)):
        monkeypatch.setattr(illuminance, "POINTS", places)
        monkeypatch.setattr(illuminance, "LAMP_POINTS", points)
        found.append(label_tiles(world, view, scene, {"instance"})[1])
    pairs = [
        (few["illuminance_lx"][group], many)
        for few, row in zip(*found, strict=True)
        for group, many in row["illuminance_lx"].items()
        if many > 0.01
    ]
    off = np.array([abs(few / many - 1) for few, many in pairs])
    print(
        f"{len(off)} values: half within {np.median(off):.3f}, 9 of 10 {np.quantile(off, 0.9):.3f}"
    )
    assert len(off) > 100
    assert np.median(off) < 0.1 and np.quantile(off, 0.9) < 0.3


def test_without_a_compiler_the_same(make):
    scene = [panel(make, 20.0, 0.05), lamp_at(make, 10.0, 5.0)]
    compiled = lit(make, scene, sky=make.flat(1e-3))["wall"]
    assert lit(make, scene, sky=make.flat(1e-3), variant="scalar")["wall"] == pytest.approx(
        compiled, rel=1e-5
    )
