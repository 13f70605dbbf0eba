"""The noise that the renderer states for each tile, propagated to electrons and scores, against
repeated renderings.
"""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.renderer import MitsubaRenderer

import isethdr_core as hdr
from isethdr_core.physics.photometry import xyz_weights
from isethdr_core.plugins.registry import build
from isethdr_core.truth import truth
from isethdr_core.uncertainty import propagation, score_errors
from isethdr_core.uncertainty.changed_scenes import ScoredShot

SEEDS = 12


@pytest.mark.slow
@pytest.mark.parametrize("pitch_um", [3.0, 7.0])
def test_the_stated_error_of_electrons_agrees_with_repeats(make, pitch_um):
    """A street with sodium, white and red lamps; pixels of half a tile and of more than a tile."""
    description = make.street(8)
    expected = []
    stated = []
    for seed in range(SEEDS):
        scene = MitsubaRenderer(width=64, height=36, samples=16, step_nm=30.0, seed=seed)(
            description
        )
        mixed = build(
            "lighting", "weights", weights=dict.fromkeys(map(str, scene.light_group.values), 1.0)
        )(scene)
        light = build(
            "lens", "ideal", f_number=2.0, focal_length_mm=6e-3 * 64 / mixed.attrs["field_width"]
        )(mixed)
        sensor = build("sensor", "bayer", pitch_um=pitch_um)
        (shot,) = propagation.electrons(
            propagation.Exposure(sensor(light, hdr.generator(seed=0)), light, mixed, scene)
        )
        expected.append(sensor.expected(light).values[0])
        stated.append(np.where(shot.unsaturated, shot.renderer / shot.sigma, np.nan))
        sigma = shot.sigma
    true = np.std(expected, axis=0, ddof=1) / sigma
    kept = np.isfinite(stated).all(axis=0)
    assert kept.mean() > 0.9
    for one in (stated[0], stated[-1]):  # the error stated by a single rendering
        for figure in (
            lambda e: np.sqrt(np.mean(e[kept] ** 2)),
            lambda e: np.quantile(e[kept], 0.99),
        ):
            print(pitch_um, "true", figure(true), "stated", figure(one))
            assert 1 / 1.5 < figure(one) / figure(true) < 1.5


@pytest.mark.slow
def test_the_stated_error_of_scores_agrees_with_repeats(make):
    """Compare stated errors of scores with repeats: 24 renderings with 96 samples per tile against
    one with 4096 (48 x 27 tiles).
    """
    description = make.street(8)
    scores = {}
    errors = {}
    metrics = [
        build("metric", name)
        for name in (
            "ideal",
            "dynamic_range",
            "ciede2000",
            "ssim",
            "log_luminance_error",
            "contrast_detection",
        )
    ]
    # Bins of a decade: the median of about 500 pixels is nearly continuous. A bin of a sixth of a
    # decade holds about 110 pixels, which are up to 0.9 dB apart at the median. In such bins the
    # stated error is 0.4 to 4.8 times the one found (1, 2 and 3 cd/m2, 6 renderings); in bins of a
    # decade it is 0.8 to 1.0 times.
    metrics.append(build("metric", "snr_curve", luminances_cd_m2=(2.0,), bins_per_decade=1))
    sensor = build("sensor", "bayer", pitch_um=3.0)
    isp = build("isp", "linear")
    again = lambda changed: isp(sensor(changed, hdr.generator(seed=0)))
    for seed in (*range(24), 99):
        scene = MitsubaRenderer(
            width=48,
            height=27,
            margin=0.0,
            samples=4096 if seed == 99 else 96,
            step_nm=50.0,
            seed=seed,
        )(description)
        mixed = build(
            "lighting", "weights", weights=dict.fromkeys(map(str, scene.light_group.values), 1.0)
        )(scene)
        light = build(
            "lens", "ideal", f_number=2.0, focal_length_mm=3e-3 * 48 / mixed.attrs["field_width"]
        )(mixed)
        picture = again(light)
        reference = truth(mixed, picture)
        one = [s for metric in metrics for s in metric(picture, reference, None)]
        shot = ScoredShot(picture, reference, None, one, light, mixed, scene, again)
        stated = score_errors.of_scores(shot, metrics)
        for s in one:
            scores.setdefault(s.metric, []).append(s.value)
        for term in stated.terms:
            errors.setdefault(term.part, []).append(term.value)
    ratios = {}
    for name in (
        "luminance",
        "snr_at_2",
        "dynamic_range_bottom",
        "dynamic_range_top",
        "ciede2000",
        "ssim",
        "log_luminance_error",
        "contrast_detection",
    ):
        found = np.sqrt(np.mean((np.array(scores[name][:-1]) - scores[name][-1]) ** 2))
        stated = np.sqrt(np.mean(np.square(errors[name][:-1])))
        ratios[name] = float(stated / found)
    # required: within 1.5. The rms of 24 errors is itself known to 14 %. Measured: the largest
    # ratio of 32 renderings is 1.42
    assert all(1 / 1.6 < ratio < 1.6 for ratio in ratios.values()), ratios


def test_noise_is_stated_for_every_group_and_is_0_in_the_dark(make):
    scene = MitsubaRenderer(width=16, height=9, margin=0.0, step_nm=100.0, samples=8)(
        make.street(2)
    )
    noise = scene["xyz_noise"]
    assert (
        noise.dims == ("light_group", "xyz_channel", "y", "x") and noise.attrs["units"] == "cd m-2"
    )
    assert np.isfinite(noise.values).all() and (noise.values >= 0).all()
    assert (noise.values[:, 1].max((1, 2)) > 0).any()
    dark = scene["radiance"].values.max(1) == 0
    assert (noise.values.max(1)[dark] == 0).all()


def test_a_tile_without_rare_samples_still_states_their_noise():
    """One sample in 60 is 30 times as bright as the others, so that three of four tiles with 16
    samples contain none. The mean light rises along x by 30 and falls in the lower half by 5.
    """
    from isethdr_mitsuba.paths.passes import Frame, estimate

    shape = (24, 32)
    bands = np.array([550.0])
    rare_share = 1 / 60
    level = np.geomspace(1.0, 30.0, 32)[None] * np.where(np.arange(24) < 12, 1.0, 0.2)[:, None]

    def one_pass(seed, samples, wanted):
        rng = np.random.default_rng(seed)
        rare = rng.poisson(rare_share * samples, shape) / samples
        common = rng.gamma(samples, 1 / samples, shape)
        yield 0, 0, (level * (common + 30 * rare)).ravel()

    found = [
        estimate(
            one_pass,
            SimpleNamespace(samples=16, error_allowed=None, seed=k),
            Frame(("lamps",), bands, shape),
        )
        for k in range(40)
    ]
    stated = np.array([e.xyz_noise[0, 1] for e in found]) / xyz_weights(bands)[1, 0]
    true = level * np.sqrt((1 + 30**2 * rare_share) / 16)
    # 25 tiles of 16 samples contain 7 rare ones, so their variance is known to 40 % and its root to
    # 20 %; the mean of nine tiles is known about as well
    assert 1 / 1.5 < np.median(stated / true) < 1.5
    z = (np.array([e.radiance[0, 0] for e in found]) - level * (1 + 30 * rare_share)) / stated
    # 95 % of a normal distribution are within two standard errors; for few skewed samples it is
    # somewhat less
    assert 0.9 < np.mean(np.abs(z) < 2) < 0.99 and np.mean(np.abs(z) < 3) > 0.96


def test_one_sample_per_tile_states_no_noise(make):
    scene = MitsubaRenderer(width=16, height=9, margin=0.0, step_nm=100.0, samples=1)(
        make.street(2)
    )
    assert np.isnan(scene["xyz_noise"].values).all()
