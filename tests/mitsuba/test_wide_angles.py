"""Equidistant projection: position and amount of light, labels behind the camera, and the same
scene
in tangent projection.
"""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.renderer import MitsubaRenderer
from isethdr_mitsuba.world.triangle_chords import straightened
from isethdr_mitsuba.world.view import view_of

import isethdr_core as hdr
from isethdr_core.data import camera_geometry
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics import projection as projections
from isethdr_core.physics.photometry import luminance
from isethdr_core.quantities import LABELS
from isethdr_core.truth import labels_on, truth

QUICK = {"margin": 0.0, "step_nm": 100.0, "samples": 4}


def wide(make, field_deg=190.0, aspect=16 / 9, target=(1, 0, 0), at=(0, 0, 0)):
    return make.camera(at, target, field_deg, aspect, "equidistant")


def towards(angle_deg, turn_deg):
    """Return the unit vector at an angle off the axis +x.

    A turn of 0 degrees points right (-y), 90 degrees down (-z).
    """
    a, t = np.radians([angle_deg, turn_deg])
    return np.array([np.cos(a), -np.sin(a) * np.cos(t), -np.sin(a) * np.sin(t)])


def disc(direction, distance_m, radius_m, corners=24):
    """Return a disc in a given direction that faces the origin."""
    side = np.linalg.svd(direction[None])[2][1:]
    if np.dot(np.cross(*side), direction) > 0:
        side = side[::-1]
    phi = np.arange(corners) * 2 * np.pi / corners
    v = direction * distance_m + radius_m * (
        np.cos(phi)[:, None] * side[0] + np.sin(phi)[:, None] * side[1]
    )
    return v, np.array([[0, k, k + 1] for k in range(1, corners - 1)])


def lamp_at(make, direction, camera, distance_m=20.0, radius_m=0.05):
    lamp = make.lamp("drl", "headlights", 800.0, make.flat(1.0), tuple(-direction), 90.0, 90.0, 0.0)
    return make.describe(
        [
            (
                "lamp",
                "car",
                (make.part(disc(direction, distance_m, radius_m), "black", lamp),),
                make.pose(),
            )
        ],
        camera=camera,
    )


def test_a_uniform_sky_is_uniform_at_every_angle(make):
    ds = MitsubaRenderer(width=32, height=18, margin=0.1, samples=64, step_nm=50.0)(
        make.describe([], camera=wide(make), sky=make.flat(2e-3))
    )
    assert ds.attrs["projection"] == "equidistant" and ds.attrs["field_width"] == pytest.approx(
        np.radians(190)
    )
    # a flat spectrum has no noise; 1e-5 is for float32 sums of 64 paths
    np.testing.assert_allclose(ds.radiance.values, 2e-3, rtol=1e-5)


@pytest.mark.parametrize(
    ("angle_deg", "turn_deg"),
    [
        (60.0, 0.0),
        (80.0, 160.0),
        (88.0, 0.0),
        (94.0, 160.0),
        pytest.param(60.0, 160.0, marks=pytest.mark.slow),
        pytest.param(80.0, 0.0, marks=pytest.mark.slow),
        pytest.param(88.0, 160.0, marks=pytest.mark.slow),
        pytest.param(94.0, 0.0, marks=pytest.mark.slow),
    ],
)
def test_a_lamp_is_imaged_at_its_angle_with_its_flux(make, angle_deg, turn_deg):
    direction = towards(angle_deg, turn_deg)
    ds = MitsubaRenderer(width=96, height=54, **QUICK, max_depth=1)(
        lamp_at(make, direction, wide(make))
    )
    light = luminance(ds.radiance.values[0].astype(float), ds.wavelength.values)
    row, column = np.unravel_index(light.argmax(), light.shape)
    at = np.radians(angle_deg) * np.array(
        [np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))]
    )
    # the lamp is within half a tile of the position by the law of the projection
    assert (
        abs(ds.x.values[column] - at[0]) <= ds.attrs["pitch_x"] / 2
        and abs(ds.y.values[row] - at[1]) <= ds.attrs["pitch_y"] / 2
    )
    # luminance x solid angle: the solid angle of a tile is sin(angle) / angle times its area on the
    # grid
    angle = np.linalg.norm(at)
    seen = light.sum() * ds.attrs["pitch_x"] * ds.attrs["pitch_y"] * np.sin(angle) / angle
    area = 12 * 0.05**2 * np.sin(2 * np.pi / 24)  # area of a polygon with 24 corners
    whole = ds.attrs["lamps"][0]["luminance_cd_m2"] * area / 20.0**2
    share = (
        luminance(np.ones((len(ds.wavelength), 1)), ds.wavelength.values)[0]
        / luminance(np.ones((471, 1)), np.arange(360.0, 831))[0]
    )
    # 2e-3: sin / angle changes nonlinearly by at most 1e-3 over the 5 mrad of the lamp; chords in
    # place of arcs: 1e-3
    assert seen == pytest.approx(whole * share, rel=2e-3)


@pytest.mark.slow
def test_a_large_lamp_beside_the_camera_covers_its_solid_angle(make):
    """Compare with the solid angle of a disc of 28 degrees, 85 degrees off the axis.

    Its border is curved on the grid.
    """
    direction = towards(85.0, 30.0)
    half = np.radians(14.0)
    scene = lamp_at(make, direction, wide(make, 220.0, 1.5), distance_m=1.0, radius_m=np.tan(half))
    ds = MitsubaRenderer(width=48, height=32, **QUICK, max_depth=1)(scene)
    light = luminance(ds.radiance.values[0].astype(float), ds.wavelength.values)
    # relative to the tiles that are fully covered
    light /= np.median(light[light > 0.5 * light.max()])
    ray = projections.direction(*np.meshgrid(ds.x, ds.y), "equidistant")
    world = np.stack([ray[2], -ray[0], -ray[1]])
    angle = np.arccos(np.einsum("k,kyx->yx", direction, world))
    solid = (
        projections.solid_angle_per_area(*np.meshgrid(ds.x, ds.y), "equidistant")
        * ds.attrs["pitch_x"]
        * ds.attrs["pitch_y"]
    )
    # the solid angle of a regular polygon, as a sum of spherical triangles (Van Oosterom and
    # Strackee 1983)
    v, f = disc(direction, 1.0, np.tan(half))
    a, b, c = (v[f[:, k]] / np.linalg.norm(v[f[:, k]], axis=1, keepdims=True) for k in range(3))
    dot = lambda p, q: np.einsum("nk,nk->n", p, q)
    truth = np.abs(
        2 * np.arctan2(dot(a, np.cross(b, c)), 1 + dot(a, b) + dot(b, c) + dot(c, a))
    ).sum()
    # 3e-3: sin(angle) / angle at the centres of tiles of 4.6 degrees, 1e-3; chords in place of
    # arcs, 2e-3
    assert (light * solid).sum() == pytest.approx(truth, rel=3e-3)
    inner = angle < half - np.radians(4.5)
    outer = angle > half + np.radians(4.5)
    assert inner.any()
    np.testing.assert_allclose(light[inner], 1, atol=2e-3)
    assert light[outer].max() == 0


def test_labels_agree_with_boxes_on_the_same_rays(make):
    """Compare labels with an independent intersection of rays and cubes (slab method).

    The cubes are ahead of the camera, next to it and behind it.
    """
    parts = (make.part(make.cube),)
    places = {"ahead": (11.0, 1.0, 0.0), "beside": (0.5, -6.0, 0.3), "behind": (-5.0, -4.0, 1.0)}
    scene = make.describe(
        [(name, "car", parts, make.pose(*at)) for name, at in places.items()],
        camera=wide(make, 300.0, 2.0),
        sky=make.flat(1e-3),
    )
    ds = MitsubaRenderer(width=150, height=75, margin=0.0, samples=1, step_nm=300.0)(
        scene, Demand(labels=frozenset(LABELS))
    )
    ray = projections.direction(*np.meshgrid(ds.x, ds.y), "equidistant")
    world = np.stack([ray[2], -ray[0], -ray[1]], -1)
    wanted = np.zeros(ds.instance.shape, int)
    distance = np.full(ds.instance.shape, np.inf)
    for number, at in enumerate(places.values(), 1):
        with np.errstate(divide="ignore", invalid="ignore"):
            sides = np.sort(
                (np.array(at)[None, None, None] + np.array([-1, 1])[:, None, None, None]) / world, 0
            )
        enter = sides[0].max(-1)
        leave = sides[1].min(-1)
        met = (enter < leave) & (enter > 0) & (enter < distance)
        wanted[met], distance[met] = number, enter[met]
    assert set(np.unique(wanted)) == {0, 1, 2, 3}
    # rays that graze an edge may fall on either side in float32
    assert np.mean(ds.instance.values != wanted) < 1e-3
    same = (ds.instance.values == wanted) & (wanted > 0)
    np.testing.assert_allclose(ds.distance.values[same], distance[same], rtol=1e-4)
    # depth is measured along the axis, and negative behind the camera
    np.testing.assert_allclose(
        ds.depth.values[same], (distance * world[..., 0])[same], rtol=1e-3, atol=1e-3
    )
    assert ds.depth.values[wanted == 3].max() < 0
    # no cube hides another: each is visible in full, up to grazing rays
    for entry in ds.attrs["objects"]:
        assert entry["visible_fraction"] == pytest.approx(1, abs=0.02)
        rows, columns = np.nonzero(ds.instance.values == entry["instance"])
        assert entry["box"] == [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]


@pytest.mark.slow
def test_triangles_are_cut_until_chords_replace_arcs(make):
    """The parts cover their triangle, and their sides are as straight as required."""
    rng = np.random.default_rng(5)
    view = view_of(wide(make, 240.0, 1.6), 64, 40, 0.0)
    triangles = 3 * rng.normal(size=(40, 3, 3))
    area = lambda t: np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1) / 2
    for off in (0.01, 1e-3):
        parts, which = straightened(triangles, view, off)
        flat = view.coordinates(parts)
        side = np.roll(flat, -1, 1) - flat
        assert np.linalg.norm(side, axis=-1).max() < 0.2
        share = rng.random((5, 1, 1, 1))
        arc = view.coordinates(parts + share * (np.roll(parts, -1, 1) - parts)) - flat
        found = np.abs(arc[..., 0] * side[..., 1] - arc[..., 1] * side[..., 0]) / np.linalg.norm(
            side, axis=-1
        )
        # the rule tests the middle of an arc, where the distance from the chord is almost the
        # largest
        assert off / 4 < found.max() <= 1.5 * off
        # nothing is covered twice, and triangles fully on the grid lose nothing
        whole = np.bincount(which, area(parts), len(triangles)) / area(triangles)
        assert (whole < 1 + 1e-9).all() and np.sum(whole > 1 - 1e-9) > 10


@pytest.mark.slow
def test_tangent_and_equidistant_projections_agree(make):
    """Within the common field: the tangent picture is resampled by exact areas of overlap."""
    from dataclasses import replace

    scene = make.street(0)
    at = ((0, 0, 1.4), (18, 0, 1.2))
    repeats = 6
    some = Demand(groups=("sky", "headlights"))
    lens = camera_geometry.distortion_map({"model": "kannala_brandt"}, "tangent")  # radius = angle

    def pictures(camera, tiles):
        for seed in range(repeats):
            ds = MitsubaRenderer(
                width=tiles,
                height=tiles,
                margin=0.0,
                step_nm=150.0,
                samples=8,
                seed=seed,
                max_depth=3,
            )(replace(scene, camera=camera), some)
            yield (
                ds,
                luminance(
                    np.moveaxis(ds.radiance.values.astype(float), 1, 0), ds.wavelength.values
                ),
            )

    bent = list(pictures(make.camera(*at, 120.0, 1.0, "equidistant"), 40))
    middle = slice(10, 30)  # 30 degrees around the axis: inside both
    x, y = (bent[0][0][d].values[middle] for d in "xy")
    pixels = camera_geometry.PixelGrid(x, y, x[1] - x[0])
    flat = [
        camera_geometry.mean_over_pixels(one, ds, lens, pixels)
        for ds, one in pictures(make.camera(*at, 100.0, 1.0), 60)
    ]
    # blocks of 3 x 4 tiles of the road below the lamps, where light varies little within a tile
    blocks = lambda pile: np.stack(pile)[..., 14:, :].reshape(repeats, -1, 2, 3, 5, 4).mean((3, 5))
    a = blocks(flat)
    b = blocks([one[..., middle, middle] for _, one in bent])
    error = np.sqrt((a.var(0, ddof=1) + b.var(0, ddof=1)) / repeats)
    z = (a.mean(0) - b.mean(0)) / np.hypot(error, 1e-3 * b.mean(0))
    assert np.abs(z).max() < 4
    # 2e-3: light of the sky on the road has almost no noise
    assert np.median(a[:, 0].mean(0) / b[:, 0].mean(0)) == pytest.approx(1, abs=2e-3)


@pytest.mark.slow
def test_a_fisheye_camera_from_the_street_to_the_picture(make):
    """190 degrees through a Kannala-Brandt lens: the picture equals its reference picture outside
    lamps, and labels agree with it.
    """
    from dataclasses import replace

    scene = replace(make.street(8), camera=wide(make, 190.0, 16 / 9, (18, 0, 1.2), (0, 0, 1.4)))
    radiance = MitsubaRenderer(width=96, height=54, margin=0.05, step_nm=50.0, samples=8)(
        scene, Demand(labels=frozenset({"instance", "depth"}))
    )
    mixed = hdr.build("lighting", "weights", weights={"sky": 1e5, "streetlights": 1.0})(radiance)
    lens = hdr.build(
        "lens",
        "ideal",
        f_number=2.0,
        focal_length_mm=1.5,
        distortion={"model": "kannala_brandt", "k1": -0.02},
        falloff="none",
    )
    light = lens(mixed)
    shot = hdr.build("sensor", "ideal", pitch_um=60.0)(light, hdr.generator(seed=0))
    picture = hdr.build("isp", "ideal")(shot)
    true = truth(mixed, picture)
    labels = labels_on(radiance, picture)
    assert (
        picture.attrs["projection"] == "equidistant"
        and picture.attrs["distortion"]["model"] == "kannala_brandt"
    )
    found = picture["xyz"].values[..., 1]
    wanted = true["xyz"].values[..., 1]
    # 1 %: pixels are 1.25 tiles wide, and light is resampled by exact areas twice: half a per cent
    # within uniform surfaces, more at edges
    assert np.median(np.abs(found / wanted - 1)) < 0.01
    # the picture is wider than any tangent projection: its middle row extends beyond 75 degrees on
    # both sides
    lens_map = camera_geometry.map_of(picture)
    at, _ = lens_map.inverse(picture.x.values / 1.5e-3, np.zeros(picture.sizes["x"]))
    assert np.degrees(np.abs(at).max()) > 85
    beside = np.degrees(np.abs(at)) > 76
    # the road is visible there
    assert (
        set(labels["instance"].values[-4:, beside].ravel()) == {1}
        and (found[-4:, beside] > 0).all()
    )


@pytest.mark.slow
def test_the_scalar_variant_renders_equidistant_fields(make):
    """Both variants agree in each tile, also for tiles that are not square."""
    scene = make.street(4)
    scene = replace(
        scene, camera=replace(scene.camera, projection="equidistant", horizontal_field_deg=150.0)
    )
    settings = {**QUICK, "width": 16, "height": 8}
    demand = Demand(groups=("sky", "streetlights"), labels=frozenset({"instance"}))
    slow, fast = (
        MitsubaRenderer(**settings | {"variant": v, "samples": n})(scene, demand)
        for v, n in (("scalar", 128), ("auto", 1024))
    )
    assert (slow.instance.values != fast.instance.values).sum() <= 1  # a ray that grazes an edge
    sky, lit = (np.stack([ds.radiance.values[k].mean(0) for ds in (slow, fast)]) for k in (0, 1))
    # In a tile with sky and road, 128 paths determine the shares to 1 / sqrt(4 x 128) = 0.044 at
    # worst. The worst of 128 tiles is within 4 times that.
    np.testing.assert_allclose(sky[0], sky[1], atol=4 * 0.045 * sky[1].max())
    assert sky[0].mean() == pytest.approx(sky[1].mean(), rel=0.01)
    some = lit[1] > 0.01 * np.median(lit[1])
    # the noise of a tile is skewed, about 0.5; the median of 30 tiles is within 0.1
    assert some.sum() > 30 and np.median(lit[0][some] / lit[1][some]) == pytest.approx(1, abs=0.1)
    upside_down = np.abs(sky[0][::-1] - sky[1]).max()
    assert upside_down > 0.5 * sky[1].max(), "the test could not detect an inverted picture"


def test_arcs_are_no_error_where_no_lamp_is_seen(make):
    from isethdr_mitsuba.doctor import choose_variant

    choose_variant("llvm")
    import mitsuba as mi

    mi.set_variant("llvm_ad_spectral")
    from isethdr_mitsuba.lamps.visible_lamps import Bands, visible_lamps

    view = view_of(wide(make, 100.0), 4, 4, 0.0)
    layer, error = visible_lamps(None, view, [], ["sky"], Bands(np.array([550.0]), 10.0))
    assert error == 0.0 and not layer.any()


def test_fields_beyond_the_projection_are_refused_with_advice(make):
    sky = {"sky": make.flat(1.0)}
    for camera, margin, message in (
        (make.camera((0, 0, 0), (1, 0, 0), 170.0, 1.0), 0.0, "scene.projection=equidistant"),
        (make.camera((0, 0, 0), (1, 0, 0), 145.0, 1.0), 0.25, "renderer.margin=0"),
        # without overscan these fields are too wide as well
        (make.camera((0, 0, 0), (1, 0, 0), 120.0, 0.4), 0.1, "scene.projection=equidistant$"),
        (wide(make, 300.0, 1.0), 0.0, "scene.horizontal_field_deg=254$"),
        (
            make.camera((0, 0, 0), (1, 0, 0), 90.0, 1.0, "equidistent"),
            0.0,
            "did you mean 'equidistant'",
        ),
    ):
        with pytest.raises(ConfigError, match=message):
            MitsubaRenderer(width=8, height=8, margin=margin)(
                make.describe([], camera=camera, **sky)
            )
    with pytest.raises(ConfigError, match="or scene.projection=equidistant for up to 200 degrees"):
        hdr.build("scene", "night_drive", horizontal_field_deg=170.0).plan()
    assert (
        hdr.build(
            "scene", "tunnel", horizontal_field_deg=170.0, projection="equidistant"
        ).camera_field()[2]
        == "equidistant"
    )
