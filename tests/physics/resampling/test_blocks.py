"""Blocks: means over blocks of 4 x 4 pixels, also at borders and with pixels that do not count."""

import numpy as np
import pytest

from isethdr_core.physics.resampling.blocks import SIDE, alike, block_means


@pytest.mark.parametrize("shape", [(8, 12), (9, 15), (4, 4), (3, 1), (2, 9), (1, 7)])
def test_a_block_has_the_mean_of_its_pixels_that_count(shape):
    rng = np.random.default_rng(0)
    values = rng.random(shape)
    use = rng.random(shape) < 0.7
    values[~use] = np.nan  # pixels that do not count must not matter
    found = block_means(values, use)
    for y, x in np.argwhere(use):
        top, left = (
            min(k // SIDE * SIDE, max(n - SIDE, 0)) for k, n in zip((y, x), shape, strict=True)
        )
        block = np.s_[top : top + SIDE, left : left + SIDE]
        assert found[y, x] == pytest.approx(values[block][use[block]].mean(), rel=1e-14)


@pytest.mark.parametrize("side", [1, 2, 4])
def test_a_repeated_cell_leaves_no_pattern(side):
    cell = np.random.default_rng(1).random((side, side))
    values = np.tile(cell, (8, 8))[: 4 * side + 7, : 5 * side + 6]
    found = block_means(values, np.ones(values.shape, bool))
    np.testing.assert_allclose(found, cell.mean(), rtol=1e-14)


def test_a_block_without_pixels_that_count_has_the_mean_zero():
    use = np.ones((8, 8), bool)
    use[:4, 4:] = False
    found = block_means(np.full((8, 8), 3.0), use)
    assert (found[use] == 3).all() and (found[~use] == 0).all()


def test_a_pixel_is_like_its_block_within_a_factor_of_two():
    values = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0])
    means = np.array([0.0, 1.0, 0.49, 0.5, 2.0, 2.01])
    assert alike(values, means).tolist() == [True, False, False, True, True, False]
