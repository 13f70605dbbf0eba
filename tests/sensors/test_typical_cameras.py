"""The typical cameras at night: noise before denoising, and the loss of edges by denoising."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from isethdr_isp.spectra import LIGHTS
from isethdr_isp.spectra import light as white

import isethdr_core as hdr
from isethdr_core.data.reference_picture import before_denoising, truth
from isethdr_core.plugins.registry import build_from_config

LEAST_DB = {"typical_bayer": 15.0, "typical_rgbw": 15.0, "typical_split_pixel": 10.0}
INNER = slice(8, -8)  # leaves out the border, where samples are mirrored


@cache
def parts(camera):
    config = hdr.compose([f"sensor={camera}", "lens=typical_f1_6", "isp=merge_denoised"])
    return [build_from_config(kind, config[kind]) for kind in ("lens", "sensor", "isp")]


@pytest.mark.slow
@pytest.mark.parametrize("camera", LEAST_DB)
def test_half_a_candela_stands_out_of_the_noise(camera):
    """A flat field of 0.5 cd/m2 has a signal-to-noise ratio (mean over standard deviation of its
    pixels) above LEAST_DB in every light. The noise contains shot noise, read noise, fixed pattern,
    demosaic and colour matrix.
    """
    lens, sensor, isp = parts(camera)
    fields = {"width": 64, "height": 64, "horizontal_field_deg": 2.6}
    mixed = hdr.build("lighting", "ideal")(hdr.build("scene", "uniform", **fields)())
    for name in LIGHTS:
        spectrum = 0.5 * white(name, mixed.wavelength.values)
        lit = mixed.copy(data=np.broadcast_to(spectrum[:, None, None], mixed.shape).copy())
        shot = sensor(lens(lit), hdr.generator(seed=1))
        assert float(shot["exposure_s"].max()) <= 0.033
        y = before_denoising(isp(shot))["xyz"].values[INNER, INNER, 1]
        assert y.mean() == pytest.approx(0.5, rel=0.02)  # noise of 2304 pixels, and the aperture
        assert 20 * np.log10(y.mean() / y.std()) > LEAST_DB[camera]


@pytest.mark.parametrize("camera", LEAST_DB)
def test_the_read_noise_at_a_gain_of_one_is_that_of_its_source(camera):
    sensor = parts(camera)[1]
    found = [reading.read_noise_e for reading in sensor.model().readings]
    # 3.05 e and 0.83 e are the values of ISETCam; 1e-3: the presets state a floor and a voltage to
    # three digits
    np.testing.assert_allclose(found, [3.05, 0.83, 0.83][: len(found)], rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("camera", LEAST_DB)
@pytest.mark.parametrize("contrast", [2.0, 10.0])
def test_denoising_takes_at_most_a_fifth_of_mtf50(camera, contrast):
    """The comparison is with the same demosaic without denoising, because the demosaic alone also
    changes MTF50.
    """
    lens, sensor, isp = parts(camera)
    noisy_isp = replace(isp, denoise="none")
    scene = hdr.build(
        "scene",
        "slanted_edge",
        width=240,
        height=200,
        horizontal_field_deg=7.0,
        luminance_cd_m2=2.0,
        contrast_ratio=contrast,
    )()
    mixed = hdr.build("lighting", "ideal")(scene)
    light = lens(mixed)
    metric = hdr.build("metric", "slanted_edge")
    found = []
    for seed in range(3):  # noise moves one measurement by some per cent
        shot = sensor(light, hdr.generator(seed=seed))
        picture = isp(shot)
        reference = truth(mixed, picture)
        pair = [metric(p, reference)[0] for p in (picture, noisy_isp(shot))]
        assert all(score.metric == "slanted_edge_mtf50" for score in pair)
        found.append([score.value for score in pair])
    smooth, plain = np.mean(found, axis=0)
    assert 0.8 * plain < smooth < 1.1 * plain


@pytest.mark.parametrize(
    ("experiment", "f_number", "pupil", "denoise"),
    [
        ("night_drive_typical", 1.6, "aplanatic", "nl_means"),
        ("night_drive_isethdr", 4.0, "tangent", "none"),
    ],
)
def test_the_main_job_runs_with_either_cameras(experiment, f_number, pupil, denoise):
    config = hdr.compose([f"experiment={experiment}"])
    assert (config.lens.f_number, config.lens.pupil) == (f_number, pupil)
    assert config.isp.denoise == denoise
    cameras = {name: build_from_config("sensor", node) for name, node in config.cameras.items()}
    assert list(cameras) == ["bayer", "split_pixel", "rgbw"]
    automatic = experiment == "night_drive_typical"
    for sensor in cameras.values():
        assert (sensor.exposure_rule != "fixed") == automatic == (sensor.auto_gain_max > 1)
        assert sensor.exposure_max_s <= 0.033


@pytest.mark.slow
def test_a_deer_stands_out_of_its_ring_in_every_camera():
    """In one coarse shot of the main job, the deer exceeds the goal of d' = 5 against temporal
    noise. The lens is clean, because its kernels take less time.
    """
    size = ["renderer.width=96", "renderer.height=54", "renderer.samples=8"]
    others = ("shares", "dynamic_range", "snr", "colour", "ssim", "log_luminance", "detection")
    few = ["draws=1", "report=false", "~flare.dirt", *(f"~metric.{name}" for name in others)]
    result = hdr.run(hdr.compose([*size, *few]))
    found = {
        (score["camera"], score["metric"]): score["value"]
        for score in result.scores
        if score["object"] == "stag"
    }
    for camera in ("bayer", "split_pixel", "rgbw"):
        assert found[camera, "object_d_prime"] > 5
        # the deer is brighter than its ring, by more than the ring's own spread
        assert found[camera, "object_contrast"] > 0
        assert found[camera, "object_d_prime_clutter"] > 1
