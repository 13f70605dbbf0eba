"""Photon counts: the pair probability agrees with counts of Poisson electrons; its limits; whole
pictures.
"""

import numpy as np
import pytest
import xarray as xr
from isethdr_metrics.detection.contrast_detection import ContrastDetection
from isethdr_metrics.detection.count_differences import Differences, above_zero
from isethdr_metrics.detection.count_sums import Counts, of_counts, sharp
from isethdr_metrics.detection.expected_picture import SMOOTH, expected
from isethdr_metrics.detection.pair_medians import probability
from isethdr_metrics.detection.pair_probability import pair_probability
from isethdr_metrics.detection.photon_counts import (
    Signal,
    _two_points,
    estimated,
    of_signals,
    representation,
)
from isethdr_metrics.detection.pixel_pairs import PairChoice
from isethdr_metrics.detection.wedge import both_positive, probability_between, wedges_between
from isethdr_metrics.luminance.noise_line import noise_line
from isethdr_metrics.regions import median_interval
from scipy.special import ndtr

from isethdr_core.data.derived_once import values_only
from isethdr_core.physics.colour.colour_spaces import D65_XYZ
from isethdr_core.quantities import centres
from isethdr_core.truth import make_picture

CONTRASTS = (0.06, 0.1, 0.2, 1 / 3, 0.5, 0.9, 1.0)


def picture(y, variance=0.0):
    y = np.asarray(y, float)
    xyz = y[..., None] * D65_XYZ
    ny, nx = y.shape
    variances = np.broadcast_to(variance, y.shape)[..., None] * D65_XYZ**2
    return make_picture(
        xyz,
        variances,
        np.ones(y.shape, bool),
        centres(nx, nx * 3e-6),
        centres(ny, ny * 3e-6),
        focal_length_mm=4.0,
        pitch_um=3.0,
    )


def poisson_law(mean):
    """Return all counts of noticeable probability and their probabilities, by the recurrence
    p(n) = p(n - 1) mean / n.
    """
    counts = np.arange(int(mean + 8 * np.sqrt(mean) + 15))
    logs = (
        np.cumsum(np.log(np.concatenate([[1.0], mean / np.maximum(counts[1:], 1)])))
        if mean
        else np.where(counts, -np.inf, 0.0)
    )
    p = np.exp(logs - mean)
    return counts, p


def summed(bright, dark, contrast):
    """Return the probability without read noise: the sum over all pairs of counts."""
    b, p = poisson_law(bright)
    d, q = poisson_law(dark)
    total = b[:, None] + d
    difference = b[:, None] - d
    low, high = (contrast * end * total for end in (0.5, 1.5))
    inside = (total > 0) & (difference >= low - 1e-9) & (difference <= high + 1e-9)
    return float(p @ inside @ q)


def drawn(bright, dark, read_noise_e, contrast, count=200_000):
    """Return the share of simulated pairs that show the contrast, with a standard error below
    0.0011.
    """
    rng = np.random.default_rng(5)
    b, d = (
        rng.poisson(m, count) + read_noise_e * rng.standard_normal(count) for m in (bright, dark)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        k = (b - d) / (b + d)
    return np.mean((b + d > 0) & (k >= 0.5 * contrast) & (k <= 1.5 * contrast))


@pytest.mark.parametrize("electrons", [0.0, 0.05, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 100.0])
@pytest.mark.parametrize("contrast", CONTRASTS)
def test_without_read_noise_it_is_the_sum_over_all_counts(electrons, contrast):
    bright = electrons * (1 + contrast)
    dark = electrons * (1 - contrast)
    found = pair_probability(bright, bright, dark, dark, contrast)
    # up to 300 electrons both are the same sum; 1e-5: distributions are cut off where 1e-6 of them
    # is left
    assert found == pytest.approx(summed(bright, dark, contrast), abs=1e-5)


@pytest.mark.parametrize(
    "electrons",
    # the numbers of electrons in between are slow tests
    [0.5, 2.0, 10.0, 100.0, *(pytest.param(e, marks=pytest.mark.slow) for e in (1.0, 5.0, 30.0))],
)
@pytest.mark.parametrize("read_noise_e", [0.2, 0.7, 1.6])
def test_with_read_noise_it_agrees_with_simulated_pairs(electrons, read_noise_e):
    for contrast in (0.1, 1 / 3, 0.9):
        bright = electrons * (1 + contrast)
        dark = electrons * (1 - contrast)
        found = pair_probability(
            bright, bright + read_noise_e**2, dark, dark + read_noise_e**2, contrast
        )
        # 0.007: the stated error of 0.005, and almost two standard errors of the simulation
        assert found == pytest.approx(drawn(bright, dark, read_noise_e, contrast), abs=0.007)


def test_normal_noise_would_be_wrong_where_electrons_are_few():
    """Normal noise gives 0.16 instead of 0.085 at 2 electrons and a contrast of 0.2. Counts of
    electrons are necessary for this reason.
    """
    exact = summed(2.4, 1.6, 0.2)
    assert pair_probability(2.4, 2.4, 1.6, 1.6, 0.2) == pytest.approx(exact, abs=1e-5)
    assert pair_probability(2.4, 2.4, 1.6, 1.6, 0.2, step=0.0) > exact + 0.05


def test_the_representations_agree_where_they_meet():
    """At each limit between two representations, the probability jumps by the error of the coarser
    one, at most 0.005.
    """
    for electrons, read_noise_e in (
        (5.0, 1.5),
        (19.99, 0.5),
        (100.0, 0.3),
        (299.0, 0.0),
        (40.0, 7.0),
    ):
        for contrast in CONTRASTS:
            ends = []
            for factor in (0.999, 1.001):
                e = electrons * factor
                r = read_noise_e * factor
                bright = e * (1 + contrast)
                dark = e * (1 - contrast)
                ends.append(pair_probability(bright, bright + r * r, dark, dark + r * r, contrast))
            assert abs(ends[0] - ends[1]) < 0.005, (electrons, read_noise_e, contrast)


def test_many_electrons_are_normal():
    bright = 1.2e5
    dark = 0.8e5
    normal = pair_probability(bright, bright, dark, dark, 0.004, step=0.0)
    assert pair_probability(bright, bright, dark, dark, 0.004) == pytest.approx(normal, abs=1e-12)


def test_two_points_have_the_third_and_fourth_cumulant_of_a_count():
    means = np.array([1e-3, 0.1, 1.0, 30.0, 1e3])
    weight, place, variance = _two_points(means)
    moment = {n: np.sum(weight * (place - means[:, None]) ** n, axis=1) for n in (1, 2, 3, 4)}
    np.testing.assert_allclose(moment[1], 0, atol=1e-9)
    np.testing.assert_allclose(moment[2], variance, rtol=1e-9)
    np.testing.assert_allclose(moment[3], means, rtol=1e-9)
    # 1e-6: the last mean loses a factor of 1e5 by cancellation
    np.testing.assert_allclose(moment[4] - 3 * variance**2, means, rtol=1e-6)
    assert (variance <= means).all()


def test_a_unit_does_not_matter_and_numbers_are_taken_like_arrays():
    step = 0.037  # cd/m2 of one electron
    for electrons in (1.0, 12.0, 200.0):
        bright = 1.2 * electrons
        dark = 0.8 * electrons
        plain = pair_probability(bright, bright + 0.25, dark, dark + 0.25, 0.2)
        scaled = pair_probability(
            step * bright, step**2 * (bright + 0.25), step * dark, step**2 * (dark + 0.25), 0.2
        )
        assert isinstance(plain, float) and scaled == pytest.approx(plain, abs=1e-9)
    several = pair_probability([2.0, 20.0], [2.0, 20.0], [1.0, 10.0], [1.0, 10.0], 1 / 3)
    assert several.shape == (2,)
    # 1e-5: the range of the summed counts depends on the other pairs of the array
    assert several[0] == pytest.approx(pair_probability(2.0, 2.0, 1.0, 1.0, 1 / 3), abs=1e-5)
    assert both_positive(0.0, 0.0, 0.0) == pytest.approx(0.25)


def test_nothing_measured_is_not_detected():
    assert pair_probability(0.0, 0.0, 0.0, 0.0, 0.2) == 0.0
    assert pair_probability(0.0, 0.0, 0.0, 0.0, 1.0) == 0.0


def test_the_noise_line_finds_read_noise_and_the_step_of_an_electron():
    y = np.geomspace(1e-3, 1e2, 40_000)
    line = noise_line(y, 4e-4 + 2e-3 * y)
    assert line.read == pytest.approx(4e-4, rel=1e-6) and line.step == pytest.approx(2e-3, rel=1e-6)
    assert noise_line(y, np.zeros_like(y)) == (0.0, 0.0)
    assert noise_line(y[:0], y[:0]) == (0.0, 0.0)
    assert noise_line(2.0, 0.5).step + noise_line(2.0, 0.5).read > 0  # one pixel has no slope


def test_a_representation_never_holds_more_shot_noise_than_the_variance():
    signal = Signal(np.array([5.0, 0.0, -1.0]), np.array([2.0, 1.0, 1.0]), np.ones(3))
    assert representation(signal).shape == (3,)


@pytest.mark.parametrize("electrons", [1.0, 4.0])
@pytest.mark.parametrize("read_noise_e", [0.5, 1.0])
def test_a_picture_of_few_electrons_scores_as_counting_does(electrons, read_noise_e):
    """The frame has two halves, at 0.05 cd/m2 per electron; it is compared with simulated pairs."""
    contrast = 0.4
    step = 0.05
    means = np.full((80, 80), electrons * (1 + contrast))
    means[:, 40:] = electrons * (1 - contrast)
    rng = np.random.default_rng(1)
    e = rng.poisson(means) + read_noise_e * rng.standard_normal(means.shape)
    # variance as an isp estimates it
    shot = picture(step * e, step**2 * (np.maximum(e, 0) + read_noise_e**2))
    [score] = ContrastDetection()(shot, picture(step * means))
    expected = drawn(electrons * (1 + contrast), electrons * (1 - contrast), read_noise_e, contrast)
    # 0.02: the local mean of 49 pixels still has a seventh of the noise
    assert score.value == pytest.approx(expected, abs=0.02)


def any_signals(count: int):
    """Return bright and dark signals of 0.03 to 1e4 electrons with flare, and true contrasts."""
    rng = np.random.default_rng(8)
    contrast = rng.uniform(0.05, 1, count)
    means = 10 ** rng.uniform(-1.5, 4, count)
    means = np.stack([means, means * (1 - contrast) / (1 + contrast)])
    means += np.where(rng.random(count) < 0.5, 0.0, 10 ** rng.uniform(-2, 3, count))
    read_e = 10 ** rng.uniform(-0.7, 1.7, count) * np.stack(
        [np.ones(count), rng.uniform(0.8, 1.2, count)]
    )
    read_e = np.maximum(read_e, 0.201)  # no error is stated for less than 0.2 e
    step = np.stack([np.ones(count), rng.choice([0.5, 1.0, 2.0], count)])
    signals = [Signal(*of) for of in zip(means * step, (means + read_e**2) * step**2, step)]
    return *signals, contrast


def test_sums_over_counts_are_those_over_all_pairs_of_counts():
    rng = np.random.default_rng(8)
    size = 30
    means = 10 ** rng.uniform(-1, 1.7, (2, size))
    step = rng.uniform(0.7, 1.4, (2, size))
    read_e = rng.uniform(0.25, 1.5, (2, size))
    contrast = rng.choice(CONTRASTS, size)
    wedges = wedges_between(*(read_e * step) ** 2, contrast, 0.5)
    bright, dark = (Counts(*of) for of in zip(means, step))
    assert not sharp(wedges, dark).any()
    found = of_counts(wedges, bright, dark)
    for k in range(size):
        (b, p), (d, q) = (poisson_law(mean) for mean in means[:, k])
        levels = (v.ravel() for v in np.meshgrid(b * step[0, k], d * step[1, k], indexing="ij"))
        inside = probability_between(wedges, *levels, np.full(p.size * q.size, k))
        expected = p @ inside.reshape(p.size, q.size) @ q
        # 2e-6: each of two distributions is cut off where 1e-6 of it is left
        assert found[k] == pytest.approx(expected, abs=2e-6)
    assert np.ptp(found) > 0.5


def test_a_difference_of_counts_is_above_0_as_often_as_its_law_says():
    rng = np.random.default_rng(4)
    size = 40
    means = 10 ** rng.uniform(-1.5, 1.8, (2, size))
    steps = rng.uniform(0.05, 2.0, (2, size))
    sd = rng.uniform(0.1, 3.0, size)
    found = above_zero(Differences(*means, *steps, sd))
    for k in range(size):
        (n, p), (m, q) = (poisson_law(mean) for mean in means[:, k])
        levels = steps[0, k] * n[:, None] - steps[1, k] * m
        # 1e-8: the stated error; distributions are cut off where less than that is left
        assert found[k] == pytest.approx(p @ ndtr(levels / sd[k]) @ q, abs=1e-8)
    assert np.ptp(found) > 0.9


def test_an_estimate_is_within_its_bound():
    bright, dark, contrast = any_signals(8_000)
    found = estimated(bright, dark, contrast, 0.5)
    off = np.abs(found.value - of_signals(bright, dark, contrast, 0.5))
    # 1e-12: rounding, where the estimate is the probability itself
    assert np.all(off <= 0.6 * found.bound + 1e-12)
    assert 0.3 < np.mean(found.bound == 0) < 0.9 and found.bound.max() < 1


@pytest.mark.parametrize("read_noise_e", [0.1, pytest.param(1.0, marks=pytest.mark.slow)])
def test_a_median_alone_is_that_of_all_pairs(read_noise_e):
    """For objects and frame alike, pairs that cannot be the median are only estimated."""
    rng = np.random.default_rng(3)
    step = 0.02
    means = 10 ** rng.uniform(-0.5, 0.9, (24, 32))
    e = rng.poisson(means) + read_noise_e * rng.standard_normal(means.shape)
    shot = picture(step * e, step**2 * (np.maximum(e, 0) + read_noise_e**2))
    instance = np.zeros(means.shape, np.uint32)
    instance[4:16, 4:14] = 1
    instance[18:21, 22:26] = 2
    labels = xr.Dataset({"instance": (("y", "x"), instance)})
    truth = picture(step * means)
    metric = ContrastDetection()
    scores = metric(shot, truth, labels)
    with values_only():
        medians = metric(shot, truth, labels)
    assert [score.object for score in medians] == ["", "1", "2"]
    model = expected(shot, truth)
    regions = PairChoice(0.05, metric.reach).of_regions(model.true, labels)
    for region, score, median in zip(regions, scores, medians):
        every = probability(model, region.pairs, 0.5)
        if region.member is not None:
            every = np.bincount(region.member, every) / np.bincount(region.member)
        direct = median_interval(every, min(every.size, region.pixels // SMOOTH**2))
        # the probability of a pair of counts depends by 1e-8 on the other pairs of the array
        assert (score.value, score.low, score.high) == pytest.approx(direct, abs=3e-7)
        assert median.value == pytest.approx(direct[0], abs=3e-7) and np.isnan(median.low)


def test_the_wedge_is_that_of_two_correlated_normals():
    rng = np.random.default_rng(2)
    bright = rng.uniform(0, 6, 5000)
    ratio = rng.uniform(0, 1, 5000)
    dark = bright * ratio
    contrast = (1 - ratio) / (1 + ratio)
    sd = rng.uniform(0.2, 3, (2, 5000))
    ends = 0.5 * contrast, 1.5 * contrast
    mean = [(1 - c) * bright - (1 + c) * dark for c in ends]
    spread = [np.hypot((1 - c) * sd[0], (1 + c) * sd[1]) for c in ends]
    cross = (1 - ends[0]) * (1 - ends[1]) * sd[0] ** 2 + (1 + ends[0]) * (1 + ends[1]) * sd[1] ** 2
    rho = -cross / (spread[0] * spread[1])
    exact = both_positive(mean[0] / spread[0], -mean[1] / spread[1], rho)
    found = probability_between(wedges_between(*sd**2, contrast, 0.5), bright, dark)
    # 2e-9: 1e-9 from the quadrature, and 1e-9 from sums of levels that are so far above 0 that
    # this closed form neglects pixels with a measured value below 0
    np.testing.assert_allclose(found, exact, rtol=0, atol=2e-9)
