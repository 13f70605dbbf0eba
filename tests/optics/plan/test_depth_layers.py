"""Defocus by depth: blur diameter against the closed form, energy, and cases without defocus."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from isethdr_optics.lenses.thin_lens import DiffractionLimitedLens, IdealLens
from isethdr_optics.lenses.wavefront_lens import WavefrontLens
from isethdr_optics.plan import depth_layers
from isethdr_optics.plan.depth_layers import (
    DISC,
    EDGES,
    LEAST,
    at_edges,
    beyond_diffraction,
    layers,
)
from isethdr_optics.psf.kernels import KernelRequest, kernels
from scipy.signal import convolve2d

import isethdr_core as hdr
from isethdr_core import ledger, quantities
from isethdr_core.data.camera_geometry import map_of
from isethdr_core.data.temporal_modulation import Modulation, components, stacked
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.ledger import Ledger
from isethdr_core.physics.optics.defocus import blur_diameter_m, disc_on_tiles, hyperfocal_m
from isethdr_core.pipeline.imaging_plan import (
    Imaging,
    LightBudget,
    TrivialPlan,
    imaged,
    in_focus,
    labelled,
)

IDEAL = IdealLens(f_number=1.6, falloff="none")
LENS = DiffractionLimitedLens(f_number=1.6, pupil="aplanatic", falloff="none")
TILE_UM = 2.5
TILES = 61


def field(values, depth=None, tile_um=TILE_UM, lens=LENS):
    """Return mixed radiance (y, x) in one band of 550 nm, with or without depth, m."""
    values = np.asarray(values, np.float32)
    side = [quantities.centres(n, n * 1e-3 * tile_um / lens.focal_length_mm) for n in values.shape]
    attrs = {"field_width": len(side[1]) * (side[1][1] - side[1][0])}
    attrs["field_height"] = attrs["field_width"]
    made = quantities.plane(values[None], [550.0], *side[::-1], quantities.RADIANCE, **attrs)
    if depth is None:
        return made
    return made.assign_coords(label_depth=(("y", "x"), np.broadcast_to(depth, values.shape)))


def point(depth=None, tile_um=TILE_UM, lens=LENS):
    values = np.zeros((TILES, TILES))
    values[TILES // 2, TILES // 2] = 1.0
    return field(values, depth, tile_um, lens)


def test_blur_of_a_thin_lens():
    # by hand: 50 mm at f/2, focused at 2 m, an object at 1 m: image distances v = 51.282 mm and v'
    # = 52.632 mm. The cone from a pupil of 25 mm ends 1.3495 mm behind the sensor, so the blur
    # diameter is 25 x 1.3495 / 52.632 = 0.6410 mm
    assert blur_diameter_m(0.05, 2.0, 2.0, 1.0) == pytest.approx(6.410e-4, rel=1e-3)
    assert blur_diameter_m(0.05, 2.0, 2.0, np.inf) == pytest.approx(-6.410e-4, rel=1e-3)


def test_hyperfocal_blurs_infinity_and_its_half_alike():
    focus_m = hyperfocal_m(0.004, 1.6, 1e-6)
    far, near = blur_diameter_m(0.004, 1.6, focus_m, np.array([np.inf, focus_m / 2]))
    assert (-far, near) == (pytest.approx(1e-6), pytest.approx(1e-6))


@pytest.mark.parametrize("kind", [IdealLens, DiffractionLimitedLens])
@pytest.mark.parametrize(("depth_m", "focus_m"), [(0.1, 2.0), (2.0, 0.1)])
def test_a_point_blurs_as_the_closed_form_says(depth_m, focus_m, kind):
    lens = kind(f_number=4.0, focal_length_mm=8.0, focus_m=focus_m)
    light = lens(point(depth_m, 5.0, lens)).values[0]
    radius = np.hypot(*np.meshgrid(*[np.arange(TILES) - TILES // 2] * 2)).ravel()
    order = np.argsort(radius)
    within = np.cumsum(light.ravel()[order]) / light.sum()
    # half of the light of a uniform disc lies within 1 / sqrt(2) of its radius; whole tiles of 5 um
    # and diffraction of 2 um err by 1 % of 150 um
    diameter_um = 2 * np.sqrt(2) * 5.0 * np.interp(0.5, within, radius[order])
    expected_um = 1e6 * abs(float(blur_diameter_m(0.008, 4.0, focus_m, depth_m)))
    assert expected_um > 150.0
    assert diameter_um == pytest.approx(expected_um, rel=0.02)


def test_focus_at_the_depth_of_the_field_is_the_sharp_picture_bit_for_bit():
    values = np.random.default_rng(1).random((31, 31))
    sharp = LENS(field(values))
    for depth in (None, 2.0):
        focused = LENS if depth is None else replace(LENS, focus_m=2.0)
        assert np.array_equal(focused(field(values, depth)).values, sharp.values)


def test_layers_keep_the_energy():
    # the bright middle is more than 20 tiles from the border, so little light leaves the frame
    values = np.zeros((TILES, TILES))
    depth = np.full((TILES, TILES), np.inf)
    values[25:36, 25:36] = np.random.default_rng(2).random((11, 11))
    depth[:, 30:] = 0.4
    sharp = LENS(field(values)).values.sum()
    blurred = replace(LENS, focus_m=2.0)(field(values, depth)).values.sum()
    assert blurred == pytest.approx(sharp, rel=2e-3)  # 1e-3 is diffracted beyond 25 tiles


def test_each_layer_holds_tiles_of_nearly_the_same_blur():
    blur = np.linspace(-9.0, 3.0, 400).reshape(20, 20)
    found = layers(blur)
    assert np.array_equal(sum(one.tiles.astype(int) for one in found), np.ones((20, 20)))
    assert found[0].blur == 0.0 and np.abs(blur[found[0].tiles]).max() <= LEAST
    for one in found[1:]:
        away = np.abs(blur[one.tiles] - one.blur).max()
        assert away <= max(LEAST, 0.1 * abs(one.blur)) / 2 * 1.06  # half the layer's span


def test_edges_are_the_far_tiles_within_the_parallax_of_a_nearer_one():
    blur = np.zeros((5, 12))
    blur[:, :4] = 6.0  # a near object; the rim of the pupil sees up to 3 tiles behind it
    assert np.array_equal(np.flatnonzero(at_edges(blur)[2]), [4, 5, 6, 7])
    slope = np.linspace(0, 2.0, 12) * np.ones((5, 1))  # a road: blur changes by 0.18 per tile
    assert not at_edges(slope).any()


def test_the_error_at_edges_is_stated_on_the_light_there():
    depth = np.full((31, 31), np.inf)
    depth[:, :15] = 0.2
    rows = Ledger()
    with ledger.stage(rows, "lens x") as row:
        replace(LENS, focus_m=5.0)(field(np.ones((31, 31)), depth))
        assert row.light_parts[EDGES].light.values.sum() > 0
    assert [e.part for e in rows[0].errors if e.source.key == "occlusion"] == [EDGES]
    assert "defocus within layers" in {note.key for note in rows[0].left_out}


def test_hyperfocal_leaves_the_defocus_out_and_says_so():
    rows = Ledger()
    with ledger.stage(rows, "lens x"):
        LENS(point(0.1))
    (note,) = [n for n in rows[0].left_out if n.key == "defocus"]
    assert (note.bound, note.unit) == (LEAST, "tiles of blur diameter")
    assert LENS.narrow(Demand()).labels == frozenset()


def of_pixels(pitch_um):
    """Return the response that a sensor with this pixel pitch, um, adds to the demand."""
    return hdr.build("sensor", "bayer", pitch_um=pitch_um).narrow(Demand()).response


@pytest.mark.parametrize(("pixel_um", "blurred"), [(1.0, True), (2.5, False), (5.0, False)])
def test_blur_is_left_out_below_a_quarter_of_a_pixel(pixel_um, blurred):
    # An ideal lens has no diffraction that would hide the blur. The blur of 0.5 um is a fifth of a
    # tile of 2.5 um and half of a pixel of 1 um.
    focus_m = 2.0
    depth_m = 1 / (1 / focus_m + 0.5e-6 * IDEAL.f_number / 0.004**2 * (1 - 0.004 / focus_m))
    lens = replace(IDEAL, focus_m=focus_m)
    mixed = point(depth_m, TILE_UM, lens)
    assert depth_layers.blur_tiles(lens, mixed).max() == pytest.approx(0.2, rel=1e-9)
    light = lens.plan((), mixed, of_pixels(pixel_um)).image(mixed).values
    shares = light.sum(axis=(0, 1)) / light.sum()
    second_moment = (shares * (np.arange(TILES) - TILES // 2) ** 2).sum()
    # the second moment of a disc is 1/16 of its squared diameter; 1e-4 since float32 holds the
    # shares to 1e-7 of the light
    assert second_moment == pytest.approx(0.2**2 / 16 if blurred else 0.0, rel=1e-4)


def test_the_hyperfocal_distance_is_that_of_the_smallest_pixel():
    mixed = point()
    two = of_pixels(3.0) + of_pixels(1.0)
    assert (two.pixel_m, replace(two, pixel_m=None).pixel_m) == (1e-6, None)
    for response, side_m in ((two, 1e-6), (replace(two, pixel_m=None), 2.5e-6), (None, 2.5e-6)):
        rows = Ledger()
        with ledger.stage(rows, "lens x"):
            imaged(LENS.plan((), mixed, response), mixed)
        (note,) = [n for n in rows[0].left_out if n.key == "defocus"]
        wanted = hyperfocal_m(1e-3 * LENS.focal_length_mm, LENS.f_number, LEAST * side_m)
        assert f"distance of {wanted:.3g} m" in note.what


def test_a_lens_with_a_focus_reads_the_depth_of_the_scene():
    focused = replace(LENS, focus_m=3.0)
    scene = quantities.scene_radiance(
        np.ones((1, 1, 3, 4)), ["sky"], [550.0], np.arange(4.0), np.arange(3.0),
        depth=np.full((3, 4), 7.0),
    )  # fmt: skip
    mixed = scene["radiance"].isel(light_group=0)
    assert labelled(focused, mixed, scene)["label_depth"].values.mean() == 7.0
    assert labelled(LENS, mixed, scene) is mixed
    assert in_focus(focused) == LENS


def test_the_depth_of_tiles_is_not_that_of_a_modulation():
    scene = xr.Dataset({"depth": (("y", "x"), np.full((TILES, TILES), 7.0))})
    ripple = stacked(["lamp"], [Modulation(100.0, depth=0.5)], [point()])
    seen = labelled(replace(LENS, focus_m=5.0), ripple, scene)
    [(modulation, plane)] = components(seen)
    assert modulation.depth == 0.5 and plane["label_depth"].values.mean() == 7.0


def test_errors_of_the_light_know_the_depth_of_its_tiles():
    """A plan that leaves nothing out makes another plan to state its errors."""
    lens = replace(LENS, focus_m=5.0)
    scene = xr.Dataset({"depth": (("y", "x"), np.full((TILES, TILES), 7.0))})
    mixed = point()
    imaging = Imaging(labelled(lens, mixed, scene), lambda: TrivialPlan(lens))
    weights = np.ones((1, mixed.sizes["wavelength"]))
    assert np.isfinite(imaging.light_errors(mixed, weights).deviation).all()


@pytest.mark.parametrize("diameter", [0.3, 1.9, 2.1, 3.0, 17.3])
def test_a_disc_on_tiles_keeps_light_and_second_moment(diameter):
    shares = disc_on_tiles(diameter)
    at = np.arange(len(shares)) - len(shares) // 2
    assert shares.sum() == pytest.approx(1.0, rel=1e-12)
    assert shares.min() >= 0
    for line in shares.sum(0), shares.sum(1):
        assert (line * at**2).sum() == pytest.approx(diameter**2 / 16, rel=1e-6)  # bisection error


@pytest.mark.parametrize("blur", [1.5, 4.0, 12.0])  # in tiles; 0.7, 1.8, 5.5 wavelength x f-number
def test_a_disc_beside_diffraction_stays_within_what_is_stated(blur):
    pitch = (1.0, 1.0)
    waves = np.array([540.0, 550.0, 560.0])
    lens = DiffractionLimitedLens(f_number=4.0)
    wavefront = WavefrontLens(f_number=4.0, zernike_um={4: blur / (16 * np.sqrt(3) * 4.0)})
    sharp, exact = (
        np.array(kernels(KernelRequest(one, (), waves, pitch, (16, 16))).bands[1][:], float)
        for one in (lens, wavefront)
    )
    disc = beyond_diffraction(lens, field(np.ones((3, 3)), None, 1.0), np.full((1, 1), blur))
    made = convolve2d(sharp, disc_on_tiles(float(disc[0, 0])), mode="same")
    assert np.abs(made - exact).sum() <= min(DISC, 1.001 * np.abs(sharp - exact).sum())


def test_errors_say_what_to_type():
    with pytest.raises(ConfigError, match=r"no depth of its tiles.*lens.focus_m=hyperfocal"):
        replace(LENS, focus_m=3.0)(point())
    with pytest.raises(UnitError, match="depth of a tile is -1"):
        replace(LENS, focus_m=3.0)(point(-1.0))
    with pytest.raises(ConfigError, match="more than twice the focal length"):
        replace(LENS, focus_m=0.005)


def test_tiles_that_are_not_square_are_refused():
    wide = point(1.0).assign_coords(x=2 * point().x.values)
    lens = replace(IDEAL, focus_m=2.0)
    with pytest.raises(ConfigError, match="2 times as wide as high; .*focus_m=hyperfocal"):
        lens(wide)


def test_light_errors_lie_on_the_tiles_of_the_light():
    depth = np.full((31, 31), np.inf)
    depth[:, :15] = 0.2
    mixed = field(np.ones((31, 31)), depth)
    plan = replace(LENS, focus_m=5.0).plan((), mixed, None, LightBudget())
    light = plan.image(mixed)
    maps = plan.light_errors(mixed, np.ones((1, 1)))
    assert maps.bound.shape == maps.deviation.shape == light.shape
    assert map_of(light) is not None
