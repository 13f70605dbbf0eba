"""Area integration: exact overlaps, conserved integrals, an error beyond the border."""

import numpy as np
import pytest

from isethdr_core.physics.resampling.area import (
    detail_error,
    integrate_tiles,
    overlaps,
    resample_mean,
)


def grid(count, pitch, centre=0.0):
    return centre + (np.arange(count) - (count - 1) / 2) * pitch


def test_constant_stays_constant():
    got = resample_mean(
        np.full((2, 7, 9), 3.5), grid(9, 1.0), grid(7, 1.0), grid(4, 1.37), grid(3, 1.1), 0.8, 0.3
    )
    np.testing.assert_allclose(got, 3.5, rtol=1e-14)  # rounding of one division


def test_adjoining_rectangles_conserve_the_integral():
    rng = np.random.default_rng(0)
    v = 10.0 ** rng.uniform(-6, 6, (3, 40, 64))
    total = integrate_tiles(
        v,
        grid(64, 0.7),
        grid(40, 0.7),
        grid(50, 64 * 0.7 / 50),
        grid(13, 40 * 0.7 / 13),
        64 * 0.7 / 50,
        40 * 0.7 / 13,
    ).sum((1, 2))
    # float64 sums of 2560 values
    np.testing.assert_allclose(total, v.sum((1, 2)) * 0.49, rtol=1e-12)


def test_matches_brute_force_in_long_double():
    rng = np.random.default_rng(1)
    v = rng.uniform(0, 1, (6, 5))
    x = grid(5, 2.0, 1.0)
    y = grid(6, 1.5, -2.0)
    xo = np.array([0.3, -0.9, 3.1])
    yo = np.array([-3.2, 0.1])
    w = 3.7
    h = 2.3
    got = integrate_tiles(v, x, y, xo, yo, w, h)
    for j, yc in enumerate(yo):
        for i, xc in enumerate(xo):
            ox = [max(0, min(a + 1.0, xc + w / 2) - max(a - 1.0, xc - w / 2)) for a in x]
            oy = [max(0, min(a + 0.75, yc + h / 2) - max(a - 0.75, yc - h / 2)) for a in y]
            assert got[j, i] == pytest.approx(
                sum(v[q, p] * ox[p] * oy[q] for p in range(5) for q in range(6)), rel=1e-13
            )


def test_identity_on_the_same_grid():
    v = np.random.default_rng(2).uniform(0, 1e9, (8, 11))
    np.testing.assert_allclose(
        resample_mean(v, grid(11, 3e-6), grid(8, 3e-6), grid(11, 3e-6), grid(8, 3e-6), 3e-6, 3e-6),
        v,
        rtol=1e-8,
    )


def test_smaller_than_a_tile_reads_that_tile():
    v = np.arange(6.0).reshape(2, 3)
    got = resample_mean(
        v, grid(3, 1.0), grid(2, 1.0), np.array([0.9, 1.2]), np.array([0.4]), 0.1, 0.1
    )
    np.testing.assert_allclose(got, [[5, 5]], rtol=1e-14)


def test_reaching_outside_is_an_error_that_says_by_how_much():
    with pytest.raises(ValueError, match="reach 0.25 .*along x"):
        overlaps(grid(4, 1.0), np.array([1.75]), 1.0)
    overlaps(grid(4, 1.0), np.array([1.5 + 1e-10]), 1.0)  # rounding is no error


def test_a_rectangle_without_a_place_is_an_error():
    tiles = np.arange(4.0)
    with pytest.raises(ValueError, match="reach nan"):
        resample_mean(np.ones((4, 4)), tiles, tiles, [1.0, np.nan], [1.0], 1.0, 1.0)


def test_float32_is_summed_in_float64():
    v = np.ones((1000, 1000), np.float32)
    v[0, 0] = 1e9  # added to this value in float32, most of the ones would be lost
    got = integrate_tiles(
        v, grid(1000, 1.0), grid(1000, 1.0), np.zeros(1), np.zeros(1), 1000.0, 1000.0
    )
    assert got[0, 0] == 1e9 + 999_999


def test_wrong_shape_or_spacing_is_refused():
    with pytest.raises(ValueError, match="shape"):
        resample_mean(np.ones((3, 3)), grid(4, 1.0), grid(3, 1.0), [0.0], [0.0], 1.0, 1.0)
    with pytest.raises(ValueError, match="evenly"):
        overlaps(np.array([0, 1, 3.0]), np.array([1.0]), 1.0)


def test_detail_within_tiles_moves_a_rectangle_s_mean_by_no_more_than_stated():
    """Compare the stated error of tiles taken as uniform with means of their 4 x 4 values.

    The rectangles have any size and position; some are aligned with the grid.
    """
    rng = np.random.default_rng(5)
    fine = rng.uniform(0, 1, (24, 32)) ** 4
    blocks = fine.reshape(6, 4, 8, 4)
    coarse = blocks.mean((1, 3))
    deviation = blocks.std((1, 3))
    worst = []
    for width, height in ((1.0, 1.0), (0.5, 0.75), (2.3, 1.9)):
        x_out, y_out = (
            np.sort(rng.uniform(-n / 2 + s / 2, n / 2 - s / 2, 60))
            for n, s in ((8, width), (6, height))
        )
        exact = resample_mean(fine, grid(32, 0.25), grid(24, 0.25), x_out, y_out, width, height)
        even = resample_mean(coarse, grid(8, 1.0), grid(6, 1.0), x_out, y_out, width, height)
        stated = detail_error(deviation, grid(8, 1.0), grid(6, 1.0), x_out, y_out, width, height)
        worst.append(np.quantile(np.abs(exact - even) / stated, 0.99))
    # The squared errors of up to twelve tiles add up. The errors of 99 % of the rectangles are
    # within the stated one, and not much smaller.
    assert 0.2 < min(worst) and max(worst) <= 1.0, worst
    aligned = detail_error(
        deviation, grid(8, 1.0), grid(6, 1.0), grid(4, 2.0), grid(6, 1.0), 2.0, 1.0
    )
    np.testing.assert_array_equal(aligned, 0.0)


def test_detail_within_a_single_tile_is_refused():
    with pytest.raises(ValueError, match="one tile along y has no known width"):
        detail_error(np.ones((1, 4)), grid(4, 1.0), [0.0], [0.0], [0.0], 1.0, 1.0)


def test_one_tile_for_each_rectangle_has_the_bits_of_the_matrix_product():
    rng = np.random.default_rng(5)
    values = rng.random((2, 9, 12))
    x = np.arange(12) * 3e-6
    y = np.arange(9) * 3e-6
    x_out = x[1::2]
    y_out = y[::2]
    side = 1e-6
    along_x = overlaps(x, x_out, side)
    along_y = overlaps(y, y_out, side)
    assert along_x.nnz == len(x_out) and along_y.nnz == len(y_out)
    product = [(along_x @ (along_y @ plane).T).T for plane in values]
    found = integrate_tiles(values, x, y, x_out, y_out, side, side)
    np.testing.assert_array_equal(found, product)
