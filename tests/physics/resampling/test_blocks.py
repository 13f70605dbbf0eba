"""Blocks: means over cells of an array, also at borders and with pixels that do not count."""

import numpy as np
import pytest

from isethdr_core.physics.resampling.blocks import (
    UNKNOWN_ARRAY,
    Block,
    alike,
    block_means,
    block_of,
)


@pytest.mark.parametrize("block", [(1, 1), (2, 2), (2, 3), (4, 4), (16, 16)])
@pytest.mark.parametrize("shape", [(8, 12), (9, 15), (17, 33), (4, 4), (3, 1), (2, 9), (1, 7)])
def test_a_block_has_the_mean_of_its_pixels_that_count(shape, block):
    block = Block(*block)
    rng = np.random.default_rng(0)
    values = rng.random(shape)
    use = rng.random(shape) < 0.7
    values[~use] = np.nan  # pixels that do not count must not matter
    found = block_means(values, use, block)
    for y, x in np.argwhere(use):
        top, left = (
            min(k // side * side, max(n - side, 0))
            for k, side, n in zip((y, x), block, shape, strict=True)
        )
        part = np.s_[top : top + block.rows, left : left + block.columns]
        assert found[y, x] == pytest.approx(values[part][use[part]].mean(), rel=1e-14)


@pytest.mark.parametrize("side", [1, 2, 4])
def test_a_repeated_cell_leaves_no_pattern(side):
    cell = np.random.default_rng(1).random((side, side))
    values = np.tile(cell, (8, 8))[: 4 * side + 7, : 5 * side + 6]
    found = block_means(values, np.ones(values.shape, bool), UNKNOWN_ARRAY)
    np.testing.assert_allclose(found, cell.mean(), rtol=1e-14)


@pytest.mark.parametrize(
    ("pattern", "block"),
    [
        ("W", (1, 1)),
        ("RGGB", (2, 2)),
        ("RG/WB", (2, 2)),
        ("RGB/RGB", (2, 3)),
        ("RRGG/RRGG/GGBB/GGBB", (4, 4)),
        (None, (4, 4)),
    ],
)
def test_a_block_is_a_cell_of_the_array(pattern, block):
    assert block_of(pattern) == block


def test_a_block_without_pixels_that_count_has_the_mean_zero():
    use = np.ones((8, 8), bool)
    use[:4, 4:] = False
    found = block_means(np.full((8, 8), 3.0), use, Block(4, 4))
    assert (found[use] == 3).all() and (found[~use] == 0).all()


def test_a_pixel_is_like_its_block_within_a_factor_of_two():
    values = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0])
    means = np.array([0.0, 1.0, 0.49, 0.5, 2.0, 2.01])
    assert alike(values, means).tolist() == [True, False, False, True, True, False]
