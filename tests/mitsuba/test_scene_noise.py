"""The noise that the renderer states tile by tile, carried to electrons, against renderings with other random numbers."""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.renderer import MitsubaRenderer

import isethdr_core as hdr
from isethdr_core import noise_units
from isethdr_core.registry import build

SEEDS = 12


@pytest.mark.slow
@pytest.mark.parametrize("pitch_um", [3.0, 7.0])
def test_electrons_are_as_far_off_as_one_rendering_says(make, pitch_um):
    """64 x 36 tiles, half a tile and more than a tile per pixel: sodium and white lamps, red tail lamps."""
    description, expected, said = make.street(8), [], []
    for seed in range(SEEDS):
        scene = MitsubaRenderer(width=64, height=36, samples=16, step_nm=30.0, seed=seed)(description)
        mixed = build("lighting", "weights", weights=dict.fromkeys(map(str, scene.light_group.values), 1.0))(scene)
        light = build("lens", "ideal", f_number=2.0, focal_length_mm=6e-3 * 64 / mixed.attrs["field_width"])(mixed)
        sensor = build("sensor", "bayer", pitch_um=pitch_um)
        (shot,) = noise_units.electrons(sensor(light, hdr.generator(seed=0)), light, mixed, scene)
        expected.append(sensor.expected(light).values[0])
        said.append(np.where(shot.unsaturated, shot.renderer / shot.sigma, np.nan))
        sigma = shot.sigma
    true = np.std(expected, axis=0, ddof=1) / sigma
    kept = np.isfinite(said).all(axis=0)
    assert kept.mean() > 0.9
    for one in (said[0], said[-1]):  # what a single run states
        for figure in (lambda e: np.sqrt(np.mean(e[kept] ** 2)), lambda e: np.quantile(e[kept], 0.99)):
            print(pitch_um, "true", figure(true), "stated", figure(one))
            assert 1 / 1.5 < figure(one) / figure(true) < 1.5


def test_every_group_states_its_noise_and_darkness_none(make):
    scene = MitsubaRenderer(width=16, height=9, margin=0.0, step_nm=100.0, samples=8)(make.street(2))
    noise = scene["xyz_noise"]
    assert noise.dims == ("light_group", "xyz_channel", "y", "x") and noise.attrs["units"] == "cd m-2"
    assert np.isfinite(noise.values).all() and (noise.values >= 0).all()
    assert (noise.values[:, 1].max((1, 2)) > 0).any()
    dark = scene["radiance"].values.max(1) == 0
    assert (noise.values.max(1)[dark] == 0).all()


def test_one_pass_knows_no_noise_and_the_scores_say_so(make):
    scene = MitsubaRenderer(width=16, height=9, margin=0.0, step_nm=100.0, samples=1)(make.street(2))
    assert np.isnan(scene["xyz_noise"].values).all()
