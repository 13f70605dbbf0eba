"""Rendering of a sky with a gradient and with the sun."""

from dataclasses import replace

import numpy as np
import pytest
from isethdr_mitsuba.renderer import MitsubaRenderer
from isethdr_scenes.sky.dome import dome_of
from isethdr_scenes.sky.state import SkyState

from isethdr_core.data.sky import SkyDisc, SkyDome, SkyPart, sky_direction
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError
from isethdr_core.physics.photometry import luminance
from isethdr_core.scene import Camera, Spectrum, flat

BANDS = {"first_nm": 450.0, "last_nm": 650.0, "step_nm": 50.0, "margin": 0.0}
# elevation and azimuth of the sun; it is on the right
SUN_DEG = 40.0
SUN_AROUND = 90.0
LABELS = frozenset({"instance", "depth"})


@pytest.fixture(scope="module")
def day():
    return dome_of(SkyState(sun_elevation_deg=SUN_DEG, sun_azimuth_deg=SUN_AROUND))


def ground(make, half_m=200.0, z=0.0):
    """Return a horizontal square whose front side faces the sky."""
    v = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float) * half_m + [0, 0, z]
    return make.part((v, np.array([[0, 1, 2], [0, 2, 3]])), "grey")


def down_at(make, sky, *more):
    """Return the ground seen from 10 m above, with more objects (name, category, parts, pose)."""
    camera = Camera((0, 0, 10.0), (0.001, 0, 0), 60.0, 1.0)
    return make.describe(
        [("ground", "road", (ground(make),), make.pose()), *more], camera=camera, sky=sky
    )


def of(ds, name="sky"):
    """Return the luminance (row, column) of a light group in the rendered bands."""
    return luminance(ds["radiance"].sel(light_group=name).values, ds.wavelength.values)


@pytest.mark.slow
def test_open_ground_has_the_irradiance_of_the_dome_and_a_shadow_that_of_its_sky(make, day):
    pole = make.part(make.quad(0.5, 0.5), "black")
    blind = make.pose(0, -10 / np.tan(np.radians(SUN_DEG)), 10, turn_deg=90)
    scene = down_at(make, day, ("blind", "sign", (pole,), blind))
    ds = MitsubaRenderer(**BANDS, width=32, height=32, samples=128, max_depth=2)(scene)
    level = of(ds)
    nm = ds.wavelength.values
    alone = SkyDome(day.parts)
    lit, shaded = (0.5 / np.pi * luminance(s.irradiance(nm), nm) for s in (day, alone))
    # 1 %: noise of the median over tiles
    assert np.median(level) == pytest.approx(lit, rel=0.01)
    # 8 %: a board of 1 m shades some tiles of 0.36 m; it hides 1 % of the sky, and the noise is 4 %
    assert np.sort(level.ravel())[1] == pytest.approx(shaded, rel=0.08)
    assert lit > 3 * shaded


def test_tiles_of_open_sky_have_its_radiance_without_noise(make, day):
    camera = Camera((0, 0, 2.0), (1, 0, 2.5), 50.0, 1.0)
    scene = make.describe([], camera=camera, sky=day)
    ds = MitsubaRenderer(**BANDS, width=8, height=8, samples=8, max_depth=2)(scene)
    x, y = np.meshgrid(ds.x.values, ds.y.values)
    forward = np.array([1, 0, 0.5]) / np.hypot(1, 0.5)
    right = np.array([0, -1.0, 0])
    below = np.cross(forward, [0, -1.0, 0])
    ray = forward + x[..., None] * right + y[..., None] * below
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    fine = ds.wavelength.values[:, None] + np.linspace(-24, 24, 9)
    expected = np.moveaxis(day.radiance(ray, fine.ravel()).reshape(8, 8, 5, 9).mean(-1), -1, 0)
    # 0.3 %: nine points per band, and float32
    assert np.allclose(ds["radiance"].values[0], expected, rtol=3e-3)
    assert ds["half_difference"].values == pytest.approx(0, abs=1e-3)


def test_the_sun_is_seen_with_its_flux_and_belongs_to_the_sky(make):
    disc = SkyDisc("sun", 0.0, 20.0, 0.53, flat(1e3))
    pattern = np.zeros((9, 8))
    sky = SkyDome((SkyPart(flat(1.0), pattern),), (disc,))
    ahead = sky_direction(20, 0)
    camera = Camera((5.0, 2, 1), tuple(np.array([5.0, 2, 1]) + ahead), 4.0, 1.0)
    ds = MitsubaRenderer(**BANDS, width=20, height=20, samples=4)(
        make.describe([], camera=camera, sky=sky), Demand(labels=LABELS)
    )
    tile = ds.attrs["pitch_x"] * ds.attrs["pitch_y"]
    # 1e-3: the solid angle of a tile differs from its area in tangents, 2 degrees off the axis
    assert ds["radiance"].values[0, 0].sum() * tile == pytest.approx(
        1e3 * disc.solid_angle_sr(), rel=1e-3
    )
    assert (ds["instance"] == 0).all()
    assert np.isinf(ds["depth"].values).all()


@pytest.mark.slow
def test_the_variant_without_a_compiler_agrees(make, day):
    scene = down_at(make, day)
    found = {
        variant: MitsubaRenderer(
            **BANDS, width=4, height=4, samples=512, max_depth=2, variant=variant
        )(scene)["radiance"]
        .values[0]
        .mean((1, 2))
        for variant in ("auto", "scalar")
    }
    # 1 %: noise of 16 tiles; the two variants have different spectra within a band
    assert found["scalar"] == pytest.approx(found["auto"], rel=0.01)


@pytest.mark.parametrize(
    "sky,last_nm,message",
    [
        ("day", 750.0, r"beyond the data of the sky \(360 to 720 nm\).*last_nm=720"),
        ("narrow", 500.0, r"material narrow \(450 to 480 nm\).*renderer.last_nm=480"),
    ],
)
def test_bands_without_data_are_refused_by_name(make, day, sky, last_nm, message):
    paint = make.material("narrow", reflectance=Spectrum((450.0, 480.0), (0.1, 0.2)))
    part = make.part(make.quad(1, 1), "narrow" if sky == "narrow" else "grey")
    scene = make.describe([("wall", "building", (part,), make.pose(5))], sky=day, materials=[paint])
    settings = {**BANDS, "last_nm": last_nm, "step_nm": 25.0}
    with pytest.raises(ConfigError, match=message):
        MitsubaRenderer(**settings, width=4, height=4, samples=1)(scene)


@pytest.mark.parametrize(
    "first_nm,last_nm,message",
    [
        (800.0, 900.0, r"this renderer \(360 to 830 nm\).*first_nm=800 renderer.last_nm=830"),
        (900.0, 1000.0, r"this renderer.*first_nm=400 renderer.last_nm=830"),
        (300.0, 500.0, r"the sky \(400 to 1000 nm\).*first_nm=400 renderer.last_nm=500"),
    ],
)
def test_bands_beyond_the_spectra_of_the_renderer_are_refused(make, first_nm, last_nm, message):
    """The sky has data up to 1000 nm, but the renderer tabulates spectra up to 830 nm."""
    scene = make.describe([], sky=Spectrum((400.0, 1000.0), (1.0, 7.0)))
    settings = {"first_nm": first_nm, "last_nm": last_nm, "step_nm": 50.0}
    with pytest.raises(ConfigError, match=message):
        MitsubaRenderer(**settings, width=4, height=4, samples=1)(scene)


def test_bands_are_checked_for_all_spectra_of_a_kind_of_lamps(make):
    """Both lamps have the same kind; the first one has no data beyond 650 nm."""
    lamps = [
        make.lamp("tail", "other", 1.0, Spectrum((360.0, last_nm), (1.0, 1.0)))
        for last_nm in (650.0, 830.0)
    ]
    scene = make.describe(
        [
            (f"car{k}", "car", (make.part(make.quad(1, 1), "black", lamp),), make.pose(5))
            for k, lamp in enumerate(lamps)
        ]
    )
    settings = {"first_nm": 400.0, "last_nm": 700.0, "step_nm": 50.0}
    with pytest.raises(ConfigError, match=r"lamp tail \(360 to 650 nm\).*renderer.last_nm=650"):
        MitsubaRenderer(**settings, width=4, height=4, samples=1)(scene)


def test_a_sun_without_any_material_is_refused(make, day):
    scene = replace(make.describe([], sky=day), materials={})
    with pytest.raises(ConfigError, match="no material.*expected at least one"):
        MitsubaRenderer(**BANDS, width=4, height=4, samples=1)(scene)
