"""Integrals over tiles: weights against closed forms, and tiles of a pattern against Airy's."""

import numpy as np
import pytest

from isethdr_core.physics.diffraction import integrated_airy
from isethdr_core.physics.optics import half_plane_pattern as patterns
from isethdr_core.physics.optics.exact_tiles import ExactTiles, exact_lattice
from isethdr_core.physics.optics.pattern_columns import _triangles
from isethdr_core.physics.optics.pupil import disc
from isethdr_core.physics.optics.tile_weights import STEP, SUPPORT, tile_weights


@pytest.mark.parametrize("width", [0.7, 3.3, 8.0])
@pytest.mark.parametrize("frequency", [0.0, 0.2, STEP])
def test_weights_integrate_a_band_limited_function_over_tiles(width, frequency):
    """Compare with a closed form: the mean of a cosine over source and receiving tile is the
    cosine times sinc^2, at any phase.
    """
    at = np.linspace(-20.0, 20.0, 17)
    first, weight = tile_weights(at, width)
    samples = first[:, None] + np.arange(weight.shape[1])
    found = (weight * np.cos(2 * np.pi * frequency * samples + 0.3)).sum(1)
    want = width * np.sinc(frequency * width) ** 2 * np.cos(2 * np.pi * frequency * at + 0.3)
    # linear interpolation in the table of weights errs by (2 pi f / 128)^2 / 8 at most
    np.testing.assert_allclose(found, want, atol=4e-5 * width)


def test_weights_end_past_the_tile():
    """No sample farther away than a tile and the support has a weight.

    Light there may be much brighter, so that even a tiny weight would matter.
    """
    width = 5.7
    at = np.array([100.0])
    first, weight = tile_weights(at, width)
    last = first[0] + weight.shape[1] - 1
    assert first[0] >= at[0] - width - SUPPORT and last <= at[0] + width + SUPPORT + 1
    assert abs(weight[0, -1]) < 1e-6 * weight.max()


def test_tiles_of_a_round_pupil_are_those_of_the_airy_pattern():
    radius_mm = 0.75
    distance_mm = 6.0
    wave = 450.0
    pitch = (3.0, 4.0)
    reach = (30, 40)
    blur_um = wave * 1e-3 * distance_mm / (2 * radius_mm)
    stop = [(disc(0.0, 0.0, radius_mm), 1.0)]
    pupil = patterns.RealPupil(stop, radius_mm, distance_mm, np.pi * radius_mm**2)
    pattern = patterns.half_pattern(pupil, wave, exact_lattice(pitch, reach, blur_um, 3.0))
    tiles = ExactTiles(pattern, pitch, reach)
    for scale in (1.0, 1.4):
        found = tiles.at(scale * wave)
        sides = [2 * r + 1 for r in reach]
        want = integrated_airy(radius_mm, scale * wave, distance_mm, sides, pitch, boxes=2)
        want = want[reach[0] :]
        # the table of weights errs by 2e-5 of the light in the brightest tiles
        assert np.abs(found - want).sum() < 2e-5 * want.sum()
        assert np.abs(found - want)[20:].sum() < 5e-5 * want[20:].sum()
        # 4e-4 also in the darkest tiles, with a thousandth of the light around them: strips err by
        # 2e-4 there
        np.testing.assert_allclose(found, want, rtol=4e-4)


@pytest.mark.parametrize("pitch_um", [0.5, 1.8, 6.0])
def test_triangles_of_tiles_keep_straight_lines(pitch_um):
    """Weights of samples in a tile sum to 1 and reproduce linear functions.

    This also holds for tiles narrower than the step of the samples, 1.8 um, most of which contain
    no sample. Wide tiles use a sampled triangle, which errs by up to 3 % of a step.
    """
    at_um = 1.8 * np.arange(40)
    tiles = np.arange(np.ceil(12.0 / pitch_um), np.floor(60.0 / pitch_um))
    weights = _triangles(tiles, pitch_um, at_um)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(weights @ at_um, tiles * pitch_um, atol=0.035 * 1.8)
