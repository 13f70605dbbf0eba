"""Errors in units of the sensor's noise: closed forms, and repeats with simulated noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import isethdr_core as hdr
from isethdr_core.data import quantities
from isethdr_core.errors import PluginError
from isethdr_core.ledger import Row
from isethdr_core.plugins.registry import build
from isethdr_core.runs import radiance_cache
from isethdr_core.truth import mean_over_pixels
from isethdr_core.uncertainty import ledger, propagation
from isethdr_core.uncertainty.error_terms import ErrorMaps, Quantity
from isethdr_core.uncertainty.propagation import UNIT, Electrons
from isethdr_core.uncertainty.render_noise import NOISE, nearest_xyz, pixel_variance

from ..stated_rows import row, said

TILES = (12, 16)


def noisy(relative, level=100.0):
    """Return a uniform scene with a relative noise of each tile, its mixed radiance, and its light.

    The focal length of the lens makes tiles 3 um wide.
    """
    size = {"width": TILES[1], "height": TILES[0], "horizontal_field_deg": 1.0}
    scene = build("scene", "uniform", luminance_cd_m2=level, **size)().load()
    groups = [str(g) for g in scene.light_group.values]
    # XYZ of the only group at weight 1
    xyz = quantities.tristimulus(build("lighting", "ideal")(scene)).xyz.values
    scene[NOISE] = (
        ("light_group", "xyz_channel", "y", "x"),
        np.stack([relative * np.moveaxis(xyz, -1, 0)] * len(groups)),
    )
    mixed = build("lighting", "weights", weights={groups[0]: 1.0})(scene)
    focal_mm = 3e-3 * TILES[1] / mixed.attrs["field_width"]
    return (
        scene,
        mixed,
        build("lens", "ideal", f_number=2.0, focal_length_mm=focal_mm, falloff="none")(mixed),
    )


def shots_of(scene, mixed, light, **fields):
    sensor = build("sensor", "bayer", **fields)
    captures = sensor(light, hdr.generator(seed=0))
    return (
        propagation.electrons(propagation.Exposure(captures, light, mixed, scene)),
        captures,
        sensor,
    )


def test_a_tile_per_pixel_has_its_tile_s_noise():
    scene, mixed, light = noisy(0.02)
    (shot,), captures, sensor = shots_of(scene, mixed, light, pitch_um=3.0, exposure_s=0.004)
    mean_e = sensor.expected(light).values[0] - float(captures.dark_e[0])
    # 1e-6: light is float32, and is summed in another order
    np.testing.assert_allclose(shot.total, mean_e, rtol=1e-6)
    np.testing.assert_allclose(shot.image, mean_e, rtol=1e-6)  # no blur
    np.testing.assert_allclose(shot.renderer, 0.02 * mean_e, rtol=1e-5)
    read2 = float(captures.read_noise_e[0]) ** 2 + float(captures.quantisation_e[0]) ** 2 / 12
    np.testing.assert_allclose(
        shot.sigma, np.sqrt(mean_e + float(captures.dark_e[0]) + read2), rtol=1e-6
    )


def test_four_tiles_per_pixel_halve_it():
    (fine,), *_ = shots_of(*noisy(0.02), pitch_um=3.0, exposure_s=0.002)
    (coarse,), *_ = shots_of(*noisy(0.02), pitch_um=6.0, exposure_s=0.002)
    assert np.median(coarse.renderer / coarse.total) == pytest.approx(
        0.5 * np.median(fine.renderer / fine.total), rel=1e-5
    )


@pytest.mark.parametrize("pitch_um", [2.0, 3.0, 4.4])
def test_variance_of_a_mean_as_a_repeat_finds_it(pitch_um):
    _, mixed, light = noisy(0.0)
    captures = build("sensor", "bayer", pitch_um=pitch_um)(light, hdr.generator(seed=0))
    rng = np.random.default_rng(3)
    sd = rng.uniform(0, 1, TILES)
    found = np.var(
        [mean_over_pixels(sd * rng.standard_normal(TILES), mixed, captures) for _ in range(400)],
        axis=0,
    )
    # a variance of 400 draws is known to 7.1 %: five of these
    np.testing.assert_allclose(found, pixel_variance(sd**2, mixed, captures), rtol=0.36)


def test_bounds_add_up_and_statistics_add_up_in_squares():
    ones = np.ones((2, 2))
    shot = Electrons("a", 1000 * ones, 900 * ones, 40 * ones, 3 * ones, ones > 0, 2.0)
    stated = row(
        "lens l",
        said(1e-3, "relative", "bound"),
        said(0.5, "electrons", "bound"),
        said(0.25, quantities.IRRADIANCE, "measured"),
        said(0.03, "relative", "statistical", part="halo"),
        said(0.1, UNIT, "statistical"),
        rest="halo",
    )
    [shot] = propagation.with_parts([shot], None, [stated])
    # bounds: 1 + 0.5 + 0.25 x 2 electrons of all light. Statistical errors: 3 % of the hundred
    # electrons of spread light, and a tenth of the noise of 40
    for found, want in zip(propagation.after(shot, stated.errors), (2.0, np.hypot(3.0, 4.0))):
        np.testing.assert_allclose(found, want, rtol=1e-14)


@pytest.mark.filterwarnings("error")
def test_an_error_without_a_bound_is_none_of_pixels_without_light():
    ones = np.ones((2, 2))
    light = np.array([[0.0, 1000.0], [1000.0, 1000.0]])
    shot = Electrons("a", light, light, 40 * ones, 0 * ones, ones > 0, 2.0)
    for how in ("bound", "statistical"):
        stated = row("lens l", said(np.inf, "relative", how))
        bound, deviation = propagation.after(shot, stated.errors)
        np.testing.assert_array_equal(bound + deviation, np.where(light > 0, np.inf, 0.0))
        assert propagation.figures_of(shot, stated.errors).all_stages == np.inf


def test_what_a_lens_knows_of_its_kernels_takes_the_place_of_what_it_stated():
    ones = np.ones((2, 2))
    maps = ErrorMaps(5 * ones, 0.25 * ones, ("grain", "border"), "errors tile by tile")
    shot = Electrons("a", 1000 * ones, 900 * ones, 40 * ones, 3 * ones, ones > 0, 2.0, maps)
    stated = row(
        "lens l",
        said(0.02, "relative", "statistical", key="grain", part="halo"),
        said(1e-3, "relative", "bound"),
        said(0.015, "relative", "measured", key="border", part="halo"),
        said(0.01, "relative", "measured", key="band phase", part="halo"),
        rest="halo",
    )
    [shot] = propagation.with_parts([shot], None, [stated])
    terms, _ = propagation.terms_after([stated], maps.replaces)
    bound, deviation = propagation.after(shot, terms)
    # the bound of the map, a thousandth of all light, and a hundredth of the halo
    np.testing.assert_allclose(bound, 0.25 + 1.0 + 1.0, rtol=1e-14)
    np.testing.assert_allclose(deviation, 5.0, rtol=1e-14)
    label = _said([shot], [stated], 0.01)
    assert "of the allowed 0.01 in" in label and "by: errors tile by tile" in label
    assert "more than allowed" not in _said([shot], [stated], 1.0)
    unnamed = replace(shot, maps=maps._replace(label=""))
    assert "by: errors that the lens states tile" in _said([unnamed], [stated], 0.01)
    bare = row("lens l", said(0.5, "relative", "bound"))
    assert _said([replace(shot, maps=None)], [bare], 0.01).endswith("by: lens/l")


def _said(shots, rows, allowed):
    with ledger.stage(ledger.Ledger(), "picture") as row:
        propagation.record_figures(shots, rows, allowed, propagation.Seconds(0.0, 0.0))
    return row.errors[0].label


def test_a_share_of_all_errors_is_within():
    rng = np.random.default_rng(5)
    bound = rng.uniform(0, 0.2, 60000)
    deviation = 10.0 ** rng.uniform(-3, 0, 60000)
    wrong = bound + np.abs(deviation * rng.standard_normal(60000))
    # the share of 60000 that are below is known to 0.04 %: five of these
    assert np.mean(wrong <= propagation.within(bound, deviation)) == pytest.approx(0.99, abs=0.002)
    assert propagation.within(np.full(9, 0.3), np.zeros(9)) == pytest.approx(0.3, rel=2e-4)
    # 99 % of normal deviates are within this
    assert propagation.within(np.zeros(9), np.ones(9)) == pytest.approx(2.5758, rel=2e-4)
    # 99.5 % of the errors are 0 or almost 0, and the others are 30 or 300 decades larger
    for small in (0.0, 1e-300, 1e-31):
        few = np.where(np.arange(1000) < 995, small, 0.2)
        assert propagation.within(few, np.zeros(1000)) <= 1e-30
    assert propagation.within(np.array([0.1, np.inf]), np.ones(2)) == np.inf
    assert propagation.within(np.zeros(3), np.array([1.0, 1.0, np.inf])) == np.inf


def test_what_the_renderer_and_targets_say_is_not_counted_twice():
    noise = said(0.1, "relative", "statistical", part="sky")
    with ledger.stage(rows := ledger.Ledger(), "renderer r"):
        ledger.error(**noise)
    with ledger.stage(rows, "radiance"):  # restates that term, and adds one
        ledger.record(*rows[0].errors, radiance_cache.rounding_term(5e-4))
    rows.append(
        row(
            "lighting night",
            said(1e-7, "relative", "bound"),
            said(0.3, "relative", "measured", acts_on=Quantity.TARGET),
        )
    )
    rows.append(
        row(
            "lens l",
            said(0.01, "relative", "statistical", "2 to 4", key="grain", part="halo"),
            said(0.03, "relative", "statistical", "4 to 8", key="grain", part="halo"),
            said(0.2, "fraction of energy", "measured", "light beyond"),
        )
    )
    kept, without = propagation.terms_after(rows)
    assert sorted(n.value for n in kept) == [1e-7, 5e-4, 0.03]
    assert [n.value for n in without] == [0.2]
    assert propagation.stated_noise(rows) == 0.1


def test_a_sensor_s_channel_takes_the_noise_of_its_colour():
    nm = np.arange(400.0, 701.0, 10.0)
    blue, green, red = (np.exp(-0.5 * ((nm - c) / 25) ** 2) for c in (450, 545, 610))
    assert [nearest_xyz(c, nm) for c in (red, green, blue)] == [0, 1, 2]


def test_a_run_ends_with_how_wrong_its_picture_is():
    config = hdr.compose(
        [
            "scene=macbeth",
            "scene.width=24",
            "scene.height=16",
            "scene.horizontal_field_deg=4",  # makes the sensor small
            "~renderer",
            "lighting=ideal",
            "~versions",
            "lens=ideal",
            "~flare.dirt",
            "isp=linear",
            "sensor=bayer",
            *(
                f"~metric.{m}"
                for m in (
                    "shares",
                    "dynamic_range",
                    "snr",
                    "colour",
                    "ssim",
                    "log_luminance",
                    "contrast",
                    "detection",
                )
            ),
        ]
    )
    row = hdr.run(config).ledger[-1]
    assert row.stage == "picture bayer" and row.error_unit == UNIT and 0 < row.error < 0.1
    assert "renderer 0 in 0 s" in row.errors[0].label and "allowed 0.1" in row.errors[0].label


@pytest.mark.slow
def test_a_run_with_lamps_and_dust_keeps_what_is_allowed():
    """Five discs up to 1e6 cd/m2 through dust, on tiles so coarse that most of the frame lies
    beyond the exact core of the kernels.
    """
    config = [
        "scene=point_lights",
        "scene.width=32",
        "scene.height=18",
        "scene.step_nm=50",
        "~renderer",
        "lighting=ideal",
        "~versions",
        "lens.focal_length_mm=0.3",
        "isp=linear",
        "sensor=bayer",
        "draws=1",
        "report=false",
        *(
            f"~metric.{m}"
            for m in (
                "shares",
                "dynamic_range",
                "snr",
                "colour",
                "ssim",
                "log_luminance",
                "contrast",
                "detection",
            )
        ),
    ]
    ledger_of = {row.stage: row for row in hdr.run(hdr.compose(config)).ledger}
    first, *others = ledger_of["picture bayer"].errors
    reached = next(e.value for e in others if e.source.key == propagation.AFTER_RENDERER)
    # kernels are not exact
    assert any(
        e.source.key == "kernel speckle" for e in ledger_of["lens diffraction_limited"].errors
    )
    assert (
        0 < reached < 0.1
        and f"later stages {reached:.3g} of the allowed 0.1" in first.label
        and "more than" not in first.label
    )


def test_noise_stated_as_one_number_is_taken_for_all_direct_light():
    scene, mixed, light = noisy(0.02)
    del scene[NOISE]
    captures = build("sensor", "bayer", pitch_um=3.0, exposure_s=0.004)(
        light, hdr.generator(seed=0)
    )
    whole = propagation.stated_noise(
        [
            row(
                "renderer r",
                said(0.03, "relative", "statistical"),
                said(0.9, "relative", "bound"),
            )
        ]
    )
    (shot,) = propagation.electrons(propagation.Exposure(captures, light, mixed, scene), whole)
    np.testing.assert_allclose(shot.renderer, 0.03 * shot.image, rtol=1e-12)


def test_error_maps_on_other_tiles_are_refused():
    scene, mixed, light = noisy(0.02)
    captures = build("sensor", "bayer", pitch_um=3.0)(light, hdr.generator(seed=0))
    plane = np.zeros((3, TILES[0], TILES[1] - 1))
    exposure = propagation.Exposure(captures, light, mixed, scene)
    with pytest.raises(PluginError, match="light_errors of the lens: deviation has the shape"):
        propagation.electrons(exposure, 0.0, lambda *_: ErrorMaps(plane, plane))


def test_some_pixels_stand_for_all():
    y, x = np.meshgrid(np.linspace(-1, 1, 1050), np.linspace(-1, 1, 1402), indexing="ij")
    # two slopes, and a peak that takes some per cent of the frame
    wrong = np.exp(-20 * ((x - 0.3) ** 2 + (y + 0.2) ** 2)) + 0.3 * x * y
    colour = np.add.outer(2 * (np.arange(1050) % 2), np.arange(1402) % 2)
    captures = xr.Dataset({"wrong": (("y", "x"), wrong), "filter": (("y", "x"), colour)})
    with ledger.stage(rows := ledger.Ledger(), "picture"):
        few = propagation.regular_sample(captures)
    [left] = rows[0].left_out
    looked_at = few["wrong"].size
    assert (
        propagation.ENOUGH <= looked_at < 2 * propagation.ENOUGH
        and left.what == f"errors of {1050 * 1402 - looked_at} of {1050 * 1402} pixels"
    )
    below = np.mean(wrong <= np.quantile(few["wrong"], propagation.SHARE))
    assert (
        left.bound == pytest.approx(3 * np.sqrt(0.99 * 0.01 / looked_at), rel=1e-12)
        and abs(below - propagation.SHARE) <= left.bound
    )
    # all colours of the filter array are in the sample; an even step would miss some
    np.testing.assert_allclose(
        np.bincount(few["filter"].values.ravel()) / looked_at, 0.25, atol=0.01
    )


def test_some_pixels_hold_what_they_hold_among_all():
    scene, mixed, light = noisy(0.02)
    captures = build("sensor", "bayer", pitch_um=0.05, rows=600, columns=800)(
        light, hdr.generator(seed=0)
    )
    (few,), (every,) = (
        propagation.electrons(propagation.Exposure(c, light, mixed, scene))
        for c in (propagation.regular_sample(captures), captures)
    )
    for name in ("total", "image", "renderer", "sigma", "unsaturated"):
        np.testing.assert_array_equal(getattr(few, name), getattr(every, name)[1::3, 1::3])


def test_saturation_may_be_stated_by_integers():
    scene, mixed, light = noisy(0.02)
    captures = build("sensor", "bayer", pitch_um=0.5)(light, hdr.generator(seed=0))
    captures["saturated"][0, :2] = True
    stated = captures.assign(saturated=captures["saturated"].astype(np.uint8))
    shots = (
        propagation.electrons(propagation.Exposure(c, light, mixed, scene))[0]
        for c in (captures, stated)
    )
    of_bools, of_integers = (shot.unsaturated for shot in shots)
    assert of_integers.dtype == bool and not of_bools.all()
    np.testing.assert_array_equal(of_integers, of_bools)


def test_small_pictures_and_those_of_lenses_that_distort_are_looked_at_whole():
    captures = xr.Dataset({"a": (("y", "x"), np.zeros((600, 800)))})
    bent = captures.assign_attrs(distortion={"model": "brown_conrady", "k1": -0.1})
    assert (
        propagation.regular_sample(bent) is bent
        and propagation.regular_sample(small := captures.isel(x=slice(0, 400))) is small
    )
    line = xr.Dataset({"a": (("y", "x"), np.zeros((1, 600_000)))})
    assert dict(propagation.regular_sample(line).sizes) == {"y": 1, "x": 200_000}


def test_noise_that_is_not_known_is_said_to_be_so():
    scene, mixed, light = noisy(np.nan)
    (shot,), *_ = shots_of(scene, mixed, light, pitch_um=3.0, exposure_s=0.004)
    rows = ledger.Ledger()
    with ledger.stage(rows, "picture"):
        propagation.record_figures([shot], [Row("radiance")], 0.1, propagation.Seconds(0.0, 0.0))
    assert [(o.what, o.bound) for o in rows[0].left_out] == [("noise of the renderer", np.inf)]
