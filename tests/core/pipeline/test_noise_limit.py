"""Noise limits of cameras: closed forms for a uniform field."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import isethdr_core as hdr
from isethdr_core.pipeline.chain import chain, plan
from isethdr_core.pipeline.noise_limit import CameraNoise, limit_of, sharp_light
from isethdr_core.plugins.registry import build
from isethdr_core.uncertainty import propagation
from isethdr_core.uncertainty.ledger import Ledger

SIDE_UM = 3.0


def field(level_cd_m2, tiles=(12, 16)):
    """Return a uniform scene, its mixed radiance, and a lens whose tiles are `SIDE_UM` wide."""
    size = {"width": tiles[1], "height": tiles[0], "horizontal_field_deg": 1.0}
    scene = build("scene", "uniform", luminance_cd_m2=level_cd_m2, **size)().load()
    mixed = build("lighting", "ideal")(scene)
    focal_mm = SIDE_UM * 1e-3 * tiles[1] / mixed.attrs["field_width"]
    lens = build("lens", "ideal", f_number=2.0, focal_length_mm=focal_mm, falloff="none")
    return scene, mixed, lens


def test_a_lens_that_only_images_makes_the_sharp_light():
    _, mixed, lens = field(3.0)
    light = sharp_light(lens, mixed)
    whole = lens(mixed, flares=())
    np.testing.assert_allclose(light.values, whole.values, rtol=1e-6)  # float32
    np.testing.assert_allclose(light.x.values, whole.x.values, rtol=1e-9)
    assert light.attrs["field_width"] == pytest.approx(whole.attrs["field_width"])


@pytest.mark.parametrize("k1", [-0.2, -1e-3, 1e-3, 0.2])
def test_a_lens_that_distorts_images_the_whole_field(k1):
    scene, mixed, lens = field(2.0)
    distorting = replace(lens, distortion={"model": "brown_conrady", "k1": k1})
    assert sharp_light(distorting, mixed) is None
    sensor = build("sensor", "bayer", pitch_um=SIDE_UM)
    lighting = build("lighting", "ideal")
    found = CameraNoise(lighting, distorting, {"one": sensor}, distorting, hdr.generator(0))(scene)
    sharp = CameraNoise(lighting, lens, {"one": sensor}, None, hdr.generator(0))(scene)
    # in a field of 1 degree the distortion moves light by less than 2e-5 of the field
    inner = np.s_[:, 2:-2, 2:-2]
    np.testing.assert_allclose(found.xyz[inner], sharp.xyz[inner], rtol=1e-3)


def test_a_lens_whose_illumination_is_a_table_images_the_whole_field():
    _, mixed, lens = field(2.0)

    def tabulated(mixed, flares=()):
        table = {"angle_deg": [0.0, 0.01], "relative": [1.0, 1.0]}  # ends with a few tiles
        return lens(mixed, flares=flares).assign_attrs(falloff="table", falloff_table=table)

    assert sharp_light(tabulated, mixed) is None


@pytest.mark.parametrize("pitch_um", [SIDE_UM, 2 * SIDE_UM])
def test_light_as_noisy_as_its_limit_is_as_noisy_as_the_camera(pitch_um):
    scene, mixed, lens = field(2.0)
    light = sharp_light(lens, mixed)
    captures = build("sensor", "bayer", pitch_um=pitch_um)(light, hdr.generator(0))
    limit = limit_of(captures, light, mixed)
    xyz = hdr.quantities.tristimulus(mixed).xyz.values
    # state the limit as noise of the scene's tiles; `propagation` carries it to the pixels by code
    # that the limit does not use
    relative = np.where(np.isfinite(limit), limit, 0) / np.moveaxis(xyz, -1, 0)
    assert np.isfinite(limit[1]).all()
    scene["xyz_noise"] = (
        ("light_group", "xyz_channel", "y", "x"),
        (relative * np.moveaxis(xyz, -1, 0))[None],
    )
    exposure = propagation.Exposure(captures, light, mixed, scene)
    ratios = [s.renderer / s.sigma for s in propagation.electrons(exposure)]
    # the least noisy channel sets the limit and has a ratio of 1; noisier channels have less
    assert max(r.max() for r in ratios) == pytest.approx(1.0, rel=1e-3)


def test_nobody_limits_light_that_saturates_every_capture():
    _, mixed, lens = field(1e9)
    light = sharp_light(lens, mixed)
    captures = build("sensor", "bayer", exposure_s=0.03)(light, hdr.generator(0))
    assert captures.saturated.values.all()
    assert np.isinf(limit_of(captures, light, mixed)).all()


def test_nobody_looks_beyond_the_field_of_the_camera():
    _, mixed, lens = field(2.0)
    mixed.attrs["field_width"] *= 0.5  # four tiles on either side lie beyond it
    light = sharp_light(lens, mixed)
    limit = limit_of(
        build("sensor", "bayer", pitch_um=SIDE_UM)(light, hdr.generator(0)), light, mixed
    )
    assert np.isfinite(limit[1]).any(0).tolist() == [False] * 4 + [True] * 8 + [False] * 4


def test_automatic_exposure_follows_the_light_that_is_shown_and_says_that_it_may_change():
    scene, _, lens = field(500.0)
    fixed = build("sensor", "bayer")
    auto = build("sensor", "bayer", exposure_rule="centre")
    cameras = lambda sensor: CameraNoise(
        build("lighting", "ideal"), lens, {"one": sensor}, None, hdr.generator(0)
    )
    assert cameras(fixed)(scene).steady
    found = cameras(auto)(scene)
    assert not found.steady
    brighter = cameras(auto)(scene.assign(radiance=2 * scene.radiance))
    assert brighter.exposures[0] == pytest.approx(found.exposures[0] / 2, rel=0.02)


def test_a_sensor_that_does_not_tell_its_noise_has_a_relative_limit():
    scene, mixed, lens = field(5.0)

    def untold(light, generator):
        return build("sensor", "bayer")(light, generator).drop_vars("read_noise_e")

    lighting = build("lighting", "ideal")
    found = CameraNoise(lighting, lens, {"one": untold}, None, hdr.generator(0))(scene)
    xyz = np.moveaxis(hdr.quantities.tristimulus(mixed).xyz.values, -1, 0)
    np.testing.assert_allclose(found.xyz, 0.1 * xyz, rtol=1e-5)  # light is float32


def test_a_run_with_noisy_cameras_tells_the_renderer_their_limit():
    cameras = ["scene=uniform", "~renderer", "lighting=ideal", "sensor=bayer"]
    demand = plan(chain(hdr.compose(cameras)), Ledger())
    assert demand.noise_limit is not None
    quiet = plan(chain(hdr.compose([*cameras, "sensor.noise=false"])), Ledger())
    assert quiet.noise_limit is None
