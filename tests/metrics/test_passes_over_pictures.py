"""Computations in pieces or with fewer steps agree with the direct computation, to rounding."""

import numpy as np
import pytest
from isethdr_metrics import regions
from isethdr_metrics.detection import photon_counts
from isethdr_metrics.detection.pixel_pairs import PAIRS, PIECE, PairChoice, draw_pairs
from isethdr_metrics.detection.wedge import cube
from isethdr_metrics.similarity.structural_similarity import (
    STRIP,
    reference,
    similarity,
    similarity_to,
    windowed,
)
from scipy.ndimage import distance_transform_edt


def planes(shape=(3 * STRIP + 7, 61), seed=0):
    random = np.random.default_rng(seed)
    base = random.normal(size=shape).cumsum(0).cumsum(1)
    first = np.clip(255 * (base - base.min()) / np.ptp(base), 0, 255).round()
    return first, np.clip(first + random.normal(0, 12, shape), 0, 255).round()


def test_similarity_is_that_of_another_programme():
    from skimage.metrics import structural_similarity

    pair = planes()
    _, expected = structural_similarity(
        *pair,
        full=True,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        data_range=255,
    )
    assert np.ptp(expected) > 0.3
    # float64: a few dozen roundings of squares of 255, divided by the smallest constant, 6.5
    assert np.abs(similarity(*pair, 255.0) - expected).max() < 1e-11
    # float32: each of ten sums of squares of half the range is rounded by at most 2^-24 of them;
    # twice that, divided by the constant 58.5
    assert (
        np.abs(similarity(*(p.astype(np.float32) for p in pair), 255.0) - expected).max()
        < 2 * 10 * 2 * 127.5**2 * 2**-24 / 58.5
    )


def test_similarity_of_one_with_itself_is_one_and_knows_no_order():
    first, second = (p.astype(np.float32) for p in planes(seed=3))
    assert np.array_equal(similarity(first, first, 255.0), np.ones_like(first))
    assert np.array_equal(similarity(first, second, 255.0), similarity(second, first, 255.0))
    assert similarity(first, 255 - first, 255.0).mean() < 0.2


def test_a_window_keeps_what_is_even_or_rises_evenly():
    rows, columns = np.indices((40, 30)).astype(float)
    # the weights add up to 1 and are symmetric, so the mean of a plane is its value in the middle
    rising = 3 + 2 * rows - 5 * columns
    assert np.abs(windowed(rising) - rising[5:-5, 5:-5]).max() < 1e-12


@pytest.mark.parametrize(
    "shape, mask",
    [
        ((50, 70), np.s_[:, :]),
        ((50, 70), np.s_[20:47, 3:9]),
        ((50, 70), np.s_[45:, 60:]),
        ((5, 200), np.s_[1:, ::3]),
        ((300, 7), np.s_[::2]),
    ],
)
def test_means_over_blocks_are_those_of_one_pixel_after_the_other(shape, mask):
    values = np.random.default_rng(1).normal(size=shape)
    held = np.zeros(shape, bool)
    held[mask] = True
    held &= np.random.default_rng(2).random(shape) < 0.9
    values[~held] = np.nan  # pixels outside the mask must not matter
    sums = {}
    for (y, x), value in np.ndenumerate(values):
        if held[y, x]:
            sums.setdefault(
                (y * regions.BLOCKS // shape[0], x * regions.BLOCKS // shape[1]), []
            ).append(value)
    mean, low, high = regions.mean_interval(values, held)
    assert mean == pytest.approx(values[held].mean(), abs=1e-13)
    assert np.isnan(low) == (len(sums) < regions.FEWEST_BLOCKS)
    if np.isfinite(low):
        blocks = [sums[key] for key in sorted(sums)]
        count, total = (np.array([f(b) for b in blocks], float) for f in (len, sum))
        picks = np.random.default_rng(0).multinomial(
            len(count), np.full(len(count), 1 / len(count)), regions.RESAMPLES
        )
        assert (low, high) == pytest.approx(
            np.percentile(picks @ total / (picks @ count), [2.5, 97.5]), abs=1e-13
        )
    assert np.isnan(regions.mean_interval(values, np.zeros(shape, bool))).all()


@pytest.mark.parametrize("step", [(0, 10), (10, 0), (10, 10), (10, -10)])
@pytest.mark.parametrize("shape", [(25, PIECE // 8), (9, 30), (40, 8)])
def test_pairs_with_contrast_are_all_that_have_it(shape, step):
    dy, dx = step
    true = np.random.default_rng(5).uniform(0.9, 1.1, shape)
    true[3:5] = 0.0
    true[6, : shape[1] // 2] = 1.05 / 0.95  # exactly the lowest contrast with 1
    true[:, ::7] = 1.0
    expected = [
        y * shape[1] + x
        for y in range(shape[0] - dy)
        for x in range(shape[1])
        if 0 <= x + dx < shape[1]
        and abs(true[y, x] - true[y + dy, x + dx])
        > 0.05 * (1 - 1e-9) * (true[y, x] + true[y + dy, x + dx])
    ]
    found = PairChoice(0.05, 10)._pixels_with_contrast(true, dy, dx)
    assert found.tolist() == expected
    assert bool(expected) == (shape[0] > dy and shape[1] > abs(dx))


def test_one_reference_serves_several_comparisons():
    first, second = (p.astype(np.float32) for p in planes(seed=4))
    prepared = reference(first, 255.0)
    for other in (second, first, 255 - second):
        assert np.array_equal(
            similarity_to(prepared, other, 255.0), similarity(first, other, 255.0)
        )


def test_pixels_of_a_region_come_in_the_order_of_its_values():
    mask = np.random.default_rng(6).random((7, 9)) < 0.4
    region = regions.Region("", (slice(3, 10), slice(5, 14)), mask, (20, 30))
    values = np.random.default_rng(7).random((20, 30))
    assert np.array_equal(values.ravel()[region.pixels()], region.of(values))


def all_pairs_at_once(mask, reach):
    """Return the pairs of `draw_pairs`, with all candidates computed at once."""
    inside = np.argwhere((distance_transform_edt(mask) <= reach) & mask)
    rng = np.random.default_rng(0)
    first = inside[rng.integers(len(inside), size=8 * PAIRS)]
    steps = np.argwhere(np.hypot(*np.indices((2 * reach + 1,) * 2) - reach) <= reach) - reach
    second = first + steps[rng.integers(len(steps), size=len(first))]
    in_frame = ((second >= 0) & (second < mask.shape)).all(axis=1)
    in_frame[in_frame] = ~mask[tuple(second[in_frame].T)]
    return first[in_frame][:PAIRS].T, second[in_frame][:PAIRS].T


@pytest.mark.parametrize(
    "shape, held",
    [
        ((40, 50), np.s_[5:35, 10:20]),
        ((40, 50), np.s_[:, :20]),  # at three borders of the frame
        ((300, 300), np.s_[3:297, 3:297]),  # most steps end inside the object
        ((8, 9), np.s_[4:5, 3:4]),  # most steps end outside the frame
        ((60, 60), np.s_[:59, :]),  # few pixels outside the object
    ],
)
def test_pairs_drawn_in_pieces_are_the_first_of_all_candidates(shape, held):
    mask = np.zeros(shape, bool)
    mask[held] = True
    assert np.array_equal(draw_pairs(mask, 10), all_pairs_at_once(mask, 10))


def test_estimates_in_pieces_are_those_of_all_pairs_at_once(monkeypatch):
    random = np.random.default_rng(8)
    bright, dark = (
        photon_counts.Signal(mean, mean * 0.5 + 4.0, np.full(mean.shape, 0.5))
        for mean in random.gamma(0.7, 60.0, (2, 500))
    )
    contrast = random.uniform(0.05, 1.0, 500)
    at_once = photon_counts.estimated(bright, dark, contrast, 0.5)
    monkeypatch.setattr(photon_counts, "PIECE", 64)
    in_pieces = photon_counts.estimated(bright, dark, contrast, 0.5)
    assert np.array_equal(at_once, in_pieces)
    assert (at_once.bound == 0).any() and (at_once.bound > 0).any()


def test_a_cube_is_the_third_power():
    values = np.random.default_rng(9).lognormal(0, 8, 1000) * np.sign(np.arange(1000) - 500.5)
    # two products and the power are each rounded by at most 2^-53, and the power by one more
    np.testing.assert_allclose(cube(values), values**3, rtol=4 * 2**-53)
