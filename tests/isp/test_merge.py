"""The merge has no bias at any level, states its variance, and counts a shared charge once; limits;
ISETCam's rule.
"""

import numpy as np
import pytest
from isethdr_isp import LinearIsp, MergeIsp
from isethdr_isp.merge import charges
from isethdr_isp.readout.combine import Charge, fold
from isethdr_isp.readout.electrons import Readout
from isethdr_isp.readout.merge_rules import RULES
from isethdr_isp.spectra import light

from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.uncertainty import ledger

MONO = np.array([[0]])
SIDE = 500  # side of a frame, pixels: 250 000 noise realisations


def merged(  # noqa: PLR0913 - a helper of tests
    bench, level, rng, specs=None, dark=0.0, step_e=0.0, side=SIDE
):
    """Return (signal, variance, valid) of `side`^2 pixels at `level` electrons, as the merge alone
    gives them.
    """
    captures = bench.make(
        np.full((side, side), float(level)),
        specs or bench.SPLIT,
        MONO,
        bench.QE[:1],
        rng,
        dark=dark,
        step_e=step_e,
    )
    out = RULES["inverse_variance"](*charges(captures, "daylight"))
    return out.signal_e, out.variance_e2, out.valid


@pytest.mark.parametrize("level", [1, 3, 10, 100, 1e4, 21300, 21700, 22000, 1e5, 7e5])
def test_no_bias_and_right_variance_across_the_whole_range(bench, level):
    x, variance, valid = merged(bench, level, np.random.default_rng(int(level)))
    standard_error = x.std() / SIDE
    # bias: 0.1 % or 4 standard errors, whichever is larger (at 1 e one standard error is 0.26 %)
    assert abs(x.mean() - level) < max(1e-3 * level, 4 * standard_error)
    # 5 %: the largest deviations are -4.1 % in the ramp below saturation, and +2.6 % at 1 e, from
    # the floor that keeps the variance positive
    assert variance.mean() / x.var() == pytest.approx(1, abs=0.05)
    assert valid.all()


@pytest.mark.parametrize(
    "mean, dark, top", [(3.0, 0.0, 1e4), (3.0, 20.0, 1e4), (60.0, 0.0, 70.0), (60.0, 15.0, 70.0)]
)
def test_expected_value_is_exact_by_quadrature(mean, dark, top):
    """Without random numbers: the expected value over Poisson counts and normal read noise is the
    signal, for two different captures of similar light.
    """
    # the long capture has twice the light and much read noise, so that every term of the rule
    # matters
    read = 5.0
    ratio = 2.0
    count = np.arange(0, 260)
    poisson = np.exp(
        count * np.log(mean + dark) - (mean + dark) - np.cumsum(np.log(np.maximum(count, 1)))
    )
    nodes = np.linspace(-8, 8, 4001)
    normal = np.exp(-(nodes**2) / 2)
    normal /= normal.sum()
    t = count[:, None] + read * nodes
    ones = np.ones_like(t)
    short = Charge(ones * (mean / ratio + 7.0), ones * 4.0, 7.0, 1e4, ones > 0, ones, ones)
    long = Charge(t, ones * read**2, dark, top, ones > 0, ones * ratio, ones)
    x = fold([short, long]).signal_e
    # 1e-5: the quadrature by 4001 nodes across the kink of max(t, 0) has an error of 2e-6; a
    # missing term would change the value far more
    assert poisson @ x @ normal == pytest.approx(mean, rel=1e-5)


def test_weighting_by_inverse_variance_without_correction_is_biased(bench):
    """The correction is necessary: without it, the mean is more than 10 % too low."""
    rng = np.random.default_rng(9)
    n = rng.poisson(1.0, 400_000)
    read = 0.6
    t = n + read * rng.standard_normal(n.size)
    z = (rng.poisson(0.01, n.size) + 0.83 * rng.standard_normal(n.size)) / 0.01
    weights = 1 / (np.maximum(t, 0) + read**2), 1 / (np.maximum(z, 0) / 0.01 + (0.83 / 0.01) ** 2)
    assert (weights[0] * t + weights[1] * z).mean() / sum(weights).mean() < 0.9


def test_dark_charge_and_quantisation_leave_no_bias(bench):
    for level in (2.0, 21700.0):
        x, variance, _ = merged(bench, level, np.random.default_rng(4), dark=20.0, step_e=1.3)
        assert abs(x.mean() - level) < max(1e-3 * level, 4 * x.std() / SIDE)
        assert variance.mean() / x.var() == pytest.approx(1, abs=0.05)


def test_reads_of_one_charge_share_their_shot_noise(bench):
    """Two gains of one charge of N = 2000 e have an SNR of sqrt(N), not the sqrt(2 N) of two
    charges.
    """
    x, variance, _ = merged(bench, 2000, np.random.default_rng(5))
    # 2 %: one standard error of 250 000 pixels is 0.3 %; read noise adds 0.64 e2, and the small
    # photodiode lowers the variance by 1 %
    assert x.var() == pytest.approx(2000, rel=0.02)
    assert variance.mean() == pytest.approx(2000, rel=0.02)
    apart = [dict(s, charge=k) for k, s in enumerate(bench.SPLIT)]
    x, variance, _ = merged(bench, 2000, np.random.default_rng(6), apart)
    assert x.var() == pytest.approx(1000, rel=0.02) and variance.mean() == pytest.approx(
        1000, rel=0.02
    )


def test_four_captures_fold(bench):
    specs = [
        *bench.SPLIT,
        {"name": "TINY", "charge": 2, "top_e": 7900.0, "read": 0.83, "area": 1e-4},
    ]
    for level in (50, 21800, 7.5e5, 3e6, 5e7):
        x, variance, valid = merged(bench, level, np.random.default_rng(7), specs, side=300)
        assert abs(x.mean() - level) < max(1e-3 * level, 4 * x.std() / 300) and valid.all()
        # 8 %: one standard error of 90 000 pixels is 0.5 %; the second ramp is at 780 000 e
        assert variance.mean() / x.var() == pytest.approx(1, abs=0.08)


def test_one_capture_is_exactly_linear(bench):
    captures = bench.make(
        np.random.default_rng(8).uniform(0, 2e4, (12, 14)),
        bench.SPLIT[:1],
        rng=np.random.default_rng(1),
        step_e=5.0,
    )
    one = LinearIsp()(captures)
    same = MergeIsp()(captures)
    for name in ("xyz", "variance", "valid"):
        np.testing.assert_array_equal(one[name].values, same[name].values)


@pytest.mark.parametrize("rule", RULES)
def test_one_charge_is_not_compared_so_a_filter_without_light_is_no_mistake(bench, rule):
    """A picture of one charge is the same as without the merge; two charges are refused."""
    dark = bench.QE * np.array([[0], [1], [1]])
    mean_e = np.random.default_rng(8).uniform(0, 2e4, (12, 14))
    captures = bench.make(mean_e, [{**bench.ONE[0], "qe": dark}])
    one = LinearIsp()(captures)
    same = MergeIsp(rule=rule)(captures)
    assert np.isfinite(one.xyz.values).all()
    for name in ("xyz", "variance", "valid"):
        np.testing.assert_array_equal(one[name].values, same[name].values)
    specs = [{**spec, "qe": dark} for spec in bench.SPLIT]
    merged_of_one = MergeIsp(rule=rule)(bench.make(mean_e, specs[:2]))
    assert np.isfinite(merged_of_one.xyz.values).all()
    with pytest.raises(UnitError, match="filter R transmits no light .*cannot be compared"):
        MergeIsp(rule=rule)(bench.make(mean_e, specs))


def test_order_of_captures_does_not_matter(bench):
    captures = bench.make(
        np.random.default_rng(8).uniform(0, 1e5, (12, 14)),
        bench.SPLIT,
        rng=np.random.default_rng(1),
    )
    a = MergeIsp()(captures)
    b = MergeIsp()(captures.isel(capture=[2, 0, 1]))
    np.testing.assert_allclose(a.xyz.values, b.xyz.values, rtol=1e-12)


@pytest.mark.parametrize("rule", RULES)
def test_all_saturated_is_not_valid_and_the_rest_is_absolute(bench, rule):
    grey = light("daylight", bench.WAVELENGTH)
    per_cd = bench.mosaic_of(grey, (12, 24)).max()
    # electrons of the large photodiode: within the range on the left; on the right, beyond the
    # range of the small photodiode
    level = np.where(np.arange(24) < 12, 2e5, 5e6) / per_cd
    picture = MergeIsp(rule=rule)(bench.make(bench.mosaic_of(grey, (12, 24)) * level, bench.SPLIT))
    valid = picture.valid.values
    assert valid[:, :11].all() and not valid[:, 12:].any()
    # 1e-5: the step of one electron in G(t + 1) changes a noise-free mean at 1e4 e
    np.testing.assert_allclose(picture.xyz.values[:, :10, 1], level[0], rtol=1e-5)
    assert np.isfinite(picture.xyz.values).all()


def test_captures_with_unlike_filters_agree_on_the_balance_light_and_say_how_far_they_differ(bench):
    qe = np.stack(
        [0.9 * bench.QE[0], bench.QE[1] * np.linspace(1.3, 0.7, len(bench.WAVELENGTH)), bench.QE[2]]
    )
    specs = [*bench.SPLIT[:2], dict(bench.SPLIT[2], qe=qe)]
    grey = 20000 * light("daylight", bench.WAVELENGTH)  # within the large diode's range and beyond
    captures = bench.make(bench.mosaic_of(grey, (8, 8)), specs)
    small = (bench.electrons_per_radiance(specs[2]) @ grey)[captures["filter"].values]
    captures["raw"][2] = captures["black_dn"].values[2] + 0.5 * small
    book = ledger.Ledger()
    with ledger.stage(book, "isp") as row:
        picture = MergeIsp()(captures)
    np.testing.assert_allclose(picture.xyz.values[..., 1], 20000, rtol=1e-5)
    assert any("unlike filter curves" in e.label and 0.001 < e.value < 0.2 for e in row.errors)


def test_isetcams_rule_agrees_with_its_own_numbers(reference, largest_difference):
    data = reference("f_splitpixel_combine_noise0")
    areas = data["pd_area_m2"]
    tops = data["voltage_swing"] * data["analog_gain"] / data["conversion_gain"]
    reads = [
        Readout(
            data["electrons"][..., k],
            data["saturated_mask"][..., k] > 0,
            1.0,
            0.0,
            tops[k],
            tops[k],
            None,
            None,
        )
        for k in range(3)
    ]
    per_light = [np.full(reads[0].charge_e.shape, areas[k]) for k in (2, 0)]
    signal = RULES["isetcam"]([[reads[2]], reads[:2]], per_light).signal_e
    density = signal / (areas[0] * 1e12)
    np.testing.assert_allclose(density, data["combined_saturated_density"], rtol=1e-12)
    largest_difference("rule `saturated`", density, data["combined_saturated_density"])


def test_wide_or_noiseless_sensors_stay_finite(bench):
    specs = [
        {"name": "A", "charge": 0, "top_e": np.inf, "read": 0.0},
        {"name": "B", "charge": 1, "top_e": 1e18, "read": 0.0, "area": 0.01},
    ]
    captures = bench.make(np.array([[0.0, 1e-6, 1.0, 1e12]] * 4), specs, MONO, bench.QE[:1])
    picture = MergeIsp()(captures)
    assert (
        np.isfinite(picture.xyz.values).all()
        and np.isfinite(picture.variance.values).all()
        and picture.valid.values.all()
    )
    assert (picture.xyz.values[:, 0] == 0).all()


def test_unknown_rule_is_named(bench):
    with pytest.raises(ConfigError, match="rule is 'isetcma'; expected .*'isetcam'"):
        MergeIsp(rule="isetcma")(bench.make(np.ones((8, 8))))


def test_captures_of_different_colours_are_refused(bench):
    specs = [
        {"name": c, "charge": k, "top_e": 1e9, "read": 1.0, "qe": bench.QE[k : k + 1]}
        for k, c in enumerate("RGB")
    ]
    with pytest.raises(UnitError, match="different spectral responses.*isp=ideal"):
        MergeIsp()(bench.make(np.ones((8, 8)), specs, MONO, bench.QE[:1]))
