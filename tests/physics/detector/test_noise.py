"""Random numbers by inversion: exact distributions, monotone in the mean, finite from 0 to 1e18
electrons, the same for any division of an image.
"""

import time

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import stats
from scipy.special import gammainc, gammaincc, ndtri

from isethdr_core.physics.detector import noise
from isethdr_core.physics.detector.random_words import tail, words

WORDS = words(("test", 1), 0, 400, 0, 500).ravel()
N = WORDS.size  # 200 000


def test_normal_distribution():
    for z in (noise.normal(WORDS), noise.normal_float32(WORDS)):
        assert z.shape == WORDS.shape
        assert stats.kstest(z, "norm").pvalue > 1e-3
        assert abs(z.mean()) < 5 / np.sqrt(N)  # 5 standard errors
        assert abs(z.var() - 1) < 5 * np.sqrt(2 / N)


def test_normal_float32_is_the_float64_quantile():
    word = np.concatenate([WORDS, 2 ** np.arange(63), -(2 ** np.arange(63))])
    exact = noise.normal(word)
    # 5e-7 (1 + |z|): the stated error of algorithm AS 241 in float32
    assert np.all(np.abs(noise.normal_float32(word) - exact) < 5e-7 * (1 + np.abs(exact)))
    assert np.abs(exact).max() > 9  # the words include the far tail


def test_normal_keeps_the_shape():
    assert noise.normal_float32(WORDS[:12].reshape(3, 4)).shape == (3, 4)
    assert noise.poisson(np.full((3, 4), 5.0), WORDS[:12].reshape(3, 4)).shape == (3, 4)


def test_pairs_are_normal_and_independent():
    a, b = noise.normal_pair(WORDS)
    assert stats.kstest(a, "norm").pvalue > 1e-3 and stats.kstest(b, "norm").pvalue > 1e-3
    assert abs(np.corrcoef(a, b)[0, 1]) < 5 / np.sqrt(N)
    ends = noise.normal_pair(np.array([-1, 0, -(2**63), 2**63 - 1]))
    assert np.all(np.isfinite(ends))


def test_counts_are_those_of_scipy_in_less_than_half_its_time():
    """The project's own inversion takes less than half the time of SciPy (measured: a fiftieth).

    Otherwise SciPy should replace it.
    """
    word = WORDS[:5000]
    mean = np.logspace(-1, 5, word.size)
    p, upper = tail(word)
    probability = np.where(upper, 1 - p, p)  # SciPy takes no upper tail, and 1 - p rounds it
    seconds = []
    for _ in range(3):  # alternate, keep the best of three: other processes share the machine
        for counts in (
            lambda: noise.poisson(mean, word),
            lambda: stats.poisson.ppf(probability, mean),
        ):
            start = time.process_time()
            last = counts()
            seconds.append(time.process_time() - start)
    assert_array_equal(noise.poisson(mean, word), last)
    assert min(seconds[0::2]) < 0.5 * min(seconds[1::2])


@pytest.mark.parametrize("mean", [1e-3, 0.3, 1.0, 3.99, 4.0, 8.0, 25.0, 300.0, 1e4, 1e6, 1e9])
def test_poisson_chi_square(mean):
    count = noise.poisson(np.full(N, mean), WORDS)
    inner = np.unique(np.round(stats.poisson.ppf(np.linspace(0, 1, 32)[1:-1], mean)))
    edges = np.concatenate([[-1.0], inner, [np.inf]])
    expected = np.diff(stats.poisson.cdf(edges, mean)) * N
    found = np.histogram(count, edges + 0.5)[0]
    keep = expected > 5
    # the random words are fixed, so 1e-3 fails only if the distribution is wrong
    assert (
        stats.chisquare(
            found[keep], expected[keep] / expected[keep].sum() * found[keep].sum()
        ).pvalue
        > 1e-3
    )


@pytest.mark.parametrize("mean", [0.05, 2.0, 40.0, 1e3, 1e7, 1e12])
def test_variance_is_the_mean(mean):
    count = noise.poisson(np.full(N, mean), WORDS)
    assert abs(count.mean() - mean) < 5 * np.sqrt(mean / N)
    # standard error of a Poisson variance: sqrt((2 mean^2 + mean) / n)
    assert abs(count.var() - mean) < 5 * np.sqrt((2 * mean**2 + mean) / N)


@pytest.mark.parametrize("mean", [0.5, 3.99, 4.0, 5.0, 12.0, 30.0, 1e3, 9e5])
def test_poisson_is_the_exact_quantile_into_both_tails(mean):
    word = np.concatenate([WORDS[:20_000], 2 ** np.arange(63), -(2 ** np.arange(63)), [0, -1]])
    p, upper = tail(word)
    k = noise.poisson(np.full(word.size, mean), word)
    # P(count >= k) = gammainc(k, mean); the quantile lies at or beyond step k and before step k + 1
    reached = np.where(
        upper, p < gammainc(np.maximum(k, 1), mean), p > gammaincc(np.maximum(k, 1), mean)
    ) | (k == 0)
    beyond = np.where(upper, p < gammainc(k + 1, mean), p > gammaincc(k + 1, mean))
    assert np.all(reached) and not np.any(beyond)


def test_small_means_are_right_too():
    # P(count >= 1) = 1 - exp(-1e-12) = 1e-12: one word with an upper tail just below it, one with
    # an upper tail just above it
    step = int(1e-12 * 2.0**64)
    assert_array_equal(noise.poisson(np.full(2, 1e-12), np.array([step - 2, step + 2])), [1, 0])
    assert_array_equal(noise.poisson(np.zeros(N), WORDS), 0)
    assert noise.poisson(np.array([0.0]), np.array([0]))[0] == 0  # the extreme word


def test_monotone_in_the_mean():
    mean = np.geomspace(1e-3, 1e13, 20_000)
    for word in WORDS[:20]:
        assert np.all(np.diff(noise.poisson(mean, np.full(mean.size, word))) >= 0)


@pytest.mark.parametrize("mean", [1e9, 1e15, 1e18])
def test_large_means_follow_the_normal_limit(mean):
    word = WORDS[:20_000]
    count = noise.poisson(np.full(word.size, mean), word)
    z = (count - mean) / np.sqrt(mean)
    # next term of the Cornish-Fisher expansion, (z^2 + 2) / 6 / sqrt(mean), plus one float64 step
    # of the mean
    p, upper = tail(word)
    exact = np.where(upper, -ndtri(p), ndtri(p))
    assert_allclose(z, exact, atol=(20 / 6 + 1) / np.sqrt(mean) + np.spacing(mean) / np.sqrt(mean))


def test_any_cut_or_order_gives_the_same_counts():
    # mixed levels of all branches: the result in a pixel must not depend on the other pixels of its
    # block
    mean = np.geomspace(1e-3, 1e12, N).reshape(400, 500)[
        :, np.random.default_rng(0).permutation(500)
    ]
    whole = noise.poisson_image(mean, ("s",))
    assert_array_equal(
        noise.poisson_image(mean[33:77, 51:202], ("s",), 33, 51), whole[33:77, 51:202]
    )
    order = np.random.default_rng(1).permutation(N)
    assert_array_equal(
        noise.poisson(mean.ravel()[order], WORDS[order]), noise.poisson(mean.ravel(), WORDS)[order]
    )
    parts = [noise.poisson(mean.ravel()[i : i + 777], WORDS[i : i + 777]) for i in range(0, N, 777)]
    assert_array_equal(np.concatenate(parts), noise.poisson(mean.ravel(), WORDS))


def test_a_pixel_does_not_depend_on_its_neighbours_light():
    mean = np.full((50, 50), 20.0)
    before = noise.poisson_image(mean, ("s",))
    mean[10, 10] = 1e7
    changed = noise.poisson_image(mean, ("s",)) != before
    assert changed.sum() == 1 and changed[10, 10]


def test_neighbours_and_streams_are_independent():
    a = noise.normal(words(("a",), 0, 400, 0, 500))
    b = noise.normal(words(("b",), 0, 400, 0, 500))
    for x, y in ((a[:, 1:], a[:, :-1]), (a[1:], a[:-1]), (a, b)):
        assert abs(np.mean(x * y)) < 5 / np.sqrt(x.size)  # 5 standard errors


@pytest.mark.parametrize("bad", [-1.0, np.nan, np.inf, 2e18])
def test_impossible_means_are_refused(bad):
    with pytest.raises(ValueError, match="0 to 1e18"):
        noise.poisson(np.array([1.0, bad]), np.array([1, 2]))
