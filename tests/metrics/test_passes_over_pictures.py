"""Computations in pieces or with fewer steps agree with the direct computation, to rounding."""

import numpy as np
import pytest
from isethdr_metrics import regions
from isethdr_metrics.detection.pixel_pairs import PIECE, PairChoice
from isethdr_metrics.similarity.structural_similarity import STRIP, similarity, windowed


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
