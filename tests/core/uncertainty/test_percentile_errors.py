"""Errors of percentiles of noisy values: coverage of intervals, a closed form, and limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from isethdr_core.uncertainty.percentile_errors import NO_ERROR, percentile_error
from isethdr_core.uncertainty.score_intervals import student_factor

# width of the picture and of a tile, pixels
SIZE = 96
TILE = 2
SHARE = 0.98
ALL = np.ones((SIZE, SIZE), bool)


def in_pixels(tiles):
    """Return the values of tiles at pixels; a tile has TILE x TILE pixels."""
    return np.kron(tiles, np.ones((TILE, TILE)))


def levels(reach: float) -> np.ndarray:
    """Return tiles between 0 and 1, of which the brightest 4 % are spread up to `reach` instead."""
    rng = np.random.default_rng(7)
    tiles = np.sort(rng.random((SIZE // TILE) ** 2))
    bright = np.maximum(tiles / 0.96 - 1, 0.0) * 0.96 / 0.04  # 0 to 1
    return rng.permutation(tiles + bright * (reach - 1)).reshape(SIZE // TILE, SIZE // TILE)


@pytest.mark.parametrize("reach", [1.0, 10.0])
def test_intervals_hold_the_percentile_where_values_are_dense_and_where_they_are_sparse(reach):
    """A third of the tiles has noise; each states one sample of it, as half buffers do."""
    rng = np.random.default_rng(3)
    true = levels(reach)
    sigma = 0.2 * true * (rng.random(true.shape) < 1 / 3)
    middle = np.quantile(in_pixels(true), SHARE)
    inside = []
    for _ in range(120):
        noisy, sample = (sigma * rng.standard_normal(true.shape) for _ in range(2))
        values = in_pixels(true + noisy)
        changes = [
            in_pixels(sample * np.where(rng.random(true.shape) < 0.5, 1, -1)) for _ in range(4)
        ]
        error = percentile_error(values, ALL, SHARE, changes, 8 * TILE)
        scatter = student_factor(error.degrees_of_freedom) * error.standard_error
        half = math.hypot(scatter, student_factor(math.inf) * error.shift)
        inside.append(abs(np.quantile(values, SHARE) - middle) <= half)
    # a share of 0.95 in 120 trials scatters by 0.02: at most three of these below. Wider intervals
    # are allowed
    assert np.mean(inside) >= 0.89


def test_the_error_is_that_of_the_share_over_the_density():
    """Values spread evenly over 0 to 1 have a density of 1: noise moves percentile and share
    alike.
    """
    rng = np.random.default_rng(5)
    values = rng.permutation(np.linspace(0, 1, SIZE**2)).reshape(SIZE, SIZE)
    sigma = 0.1
    changes = [sigma * rng.standard_normal(values.shape) for _ in range(4)]
    error = percentile_error(values, ALL, 0.5, changes, 8)
    # a pixel that noise may move to either side of the percentile has a variance of 1 / 4. The
    # share of such pixels is twice E|noise| times the density
    expected = math.sqrt(sigma * math.sqrt(2 / math.pi) / 2 / values.size)
    # with 144 blocks and 4 changes, the error is known to 5 %, with cross terms to 10 %: two of
    # these
    assert error.standard_error == pytest.approx(expected, rel=0.2)
    assert error.shift < error.standard_error  # the density has no slope
    assert error.degrees_of_freedom > 50  # all blocks are alike


def test_values_that_share_their_noise_count_once():
    """Blocks hold tiles of 2 x 2 pixels: the error is twice that of independent pixels."""
    rng = np.random.default_rng(6)
    values = rng.permutation(np.linspace(0, 1, SIZE**2)).reshape(SIZE, SIZE)
    tiles = [0.1 * rng.standard_normal((SIZE // TILE,) * 2) for _ in range(4)]
    pixels = [0.1 * rng.standard_normal(values.shape) for _ in range(4)]
    smooth = in_pixels(values[::TILE, ::TILE])
    error = percentile_error(smooth, ALL, 0.5, map(in_pixels, tiles), 8 * TILE)
    alone = percentile_error(values, ALL, 0.5, pixels, 8 * TILE)
    assert error.standard_error == pytest.approx(2 * alone.standard_error, rel=0.3)


def test_values_that_do_not_count_and_values_without_noise():
    values = np.linspace(0, 1, SIZE**2).reshape(SIZE, SIZE)
    some = values < 0.5
    assert percentile_error(values, some, 0.5, [np.zeros_like(values)], 8) == NO_ERROR
    far = np.where(some, 0.0, 10.0) * np.random.default_rng(1).standard_normal(values.shape)
    assert percentile_error(values, some, 0.5, [far], 8) == NO_ERROR
