"""Denoising keeps the mean of flat fields, lowers the variance as stated and keeps edges.
Variance-stabilised values have a standard deviation of 1.
"""

from dataclasses import replace

import numpy as np
import pytest
from isethdr_isp import LinearIsp, MergeIsp
from isethdr_isp.demosaic import denoise
from isethdr_isp.demosaic.denoise import denoised, pair, shifts, stabilised
from isethdr_isp.develop import plain_development
from isethdr_isp.readout.combine import Merged
from isethdr_isp.spectra import light

from isethdr_core.errors import ConfigError
from isethdr_core.truth import before_denoising, total_variance, variance_known
from isethdr_core.uncertainty import ledger

READ = 2.0
SHAPE = (128, 128)


def noisy(mean, rng):
    x = rng.poisson(mean) + READ * rng.standard_normal(mean.shape)
    return Merged(
        x,
        np.maximum(x + READ**2, 0.1 * READ**2),
        np.ones(x.shape, bool),
        np.zeros(x.shape, np.uint8),
    )


@pytest.mark.parametrize(
    "level, cell, gain",
    [
        (1.0, (2, 2), 60),
        pytest.param(10.0, (2, 2), 60, marks=pytest.mark.slow),
        pytest.param(1e4, (2, 2), 60, marks=pytest.mark.slow),
        pytest.param(1.0, (4, 4), 15, marks=pytest.mark.slow),
        (10.0, (4, 4), 15),
        (1e4, (4, 4), 15),
    ],
)
def test_a_flat_field_keeps_its_mean_and_loses_its_noise(level, cell, gain):
    rng = np.random.default_rng(4)
    before = [noisy(np.full((64, 64), level), rng) for _ in range(20)]
    after = [denoised(one, cell) for one in before]
    # the mean before denoising has the same noise, so the difference is the bias alone
    change = np.mean([a.signal_e for a in after]) - np.mean([b.signal_e for b in before])
    assert abs(change) < (0.01 if level == 1.0 else 0.003) * level
    variance = np.var([a.signal_e for a in after], axis=0).mean()
    assert variance < (level + READ**2) / gain
    # 17 %: the variance of 20 fields of about 40 (2 x 2) or 160 independent pixels scatters by 5 %,
    # and weights that follow the noise add up to 10 %
    assert np.mean([a.variance_e2 for a in after]) / variance == pytest.approx(1, abs=0.17)


def test_edges_stay_where_they_are():
    mean = np.where(np.arange(128) < 61, 40.0, 400.0) * np.ones(SHAPE)
    one = noisy(mean, np.random.default_rng(5))
    out = denoised(one, (2, 2))
    raw, left = (np.sqrt(np.mean((v.signal_e - mean) ** 2, 0)) for v in (one, out))
    assert np.all(left < raw)
    # in the columns next to the edge the variance is 400 e2 of shot noise and 4 e2 of read noise
    assert left[60:62].max() < 0.9 * np.sqrt(404)
    steepest = np.argmax(np.diff(out.signal_e.mean(0)))
    assert steepest == 60 and np.diff(out.signal_e.mean(0))[60] > 0.95 * 360


def test_a_line_of_one_pixel_is_not_taken_for_noise():
    mean = np.full(SHAPE, 100.0)
    mean[:, 64] = 300.0
    out = denoised(noisy(mean, np.random.default_rng(6)), (2, 2))
    assert out.signal_e[:, 64].mean() == pytest.approx(300, rel=0.03)


def test_pixels_that_differ_are_not_changed():
    rng = np.random.default_rng(7)
    x = rng.uniform(1e5, 2e5, SHAPE)  # differences far above 300 e of noise
    out = denoised(Merged(x, x, np.ones(SHAPE, bool), np.zeros(SHAPE, np.uint8)), (2, 2))
    np.testing.assert_allclose(out.signal_e, x, rtol=1e-9)


def test_a_strength_is_that_of_noise_stated_so_many_times_larger():
    """Strength 2 averages as if the noise had twice its standard deviation. This holds for bright
    samples, where the 3/8 of an electron and the curvature of the square root do not matter. A
    larger strength averages more.
    """
    rng = np.random.default_rng(11)
    one = noisy(np.full((48, 48), 5000.0) + 150 * rng.standard_normal((48, 48)), rng)
    twice = denoised(one, (2, 2), strength=2.0)
    stated = denoised(replace(one, variance_e2=4 * one.variance_e2), (2, 2))
    np.testing.assert_allclose(twice.signal_e, stated.signal_e, rtol=1e-3)
    spread = [denoised(one, (2, 2), strength=s).signal_e.std() for s in (0.5, 1.0, 2.0)]
    assert spread[0] > 1.02 * spread[1] > 1.05 * spread[2]


def test_strips_and_no_variance_change_nothing(monkeypatch):
    """Rows are averaged in strips; the strips change only the order of the float32 sums."""
    one = noisy(np.linspace(5.0, 50.0, 90)[:, None] * np.ones((90, 40)), np.random.default_rng(3))
    one.valid[30:33, 5:9] = False
    whole = denoised(one, (2, 2))
    monkeypatch.setattr(denoise, "STRIP", 17)
    parts = denoised(one, (2, 2))
    plain = denoised(one, (2, 2), with_variance=False)
    np.testing.assert_allclose(parts.signal_e, whole.signal_e, rtol=1e-6)
    np.testing.assert_allclose(parts.variance_e2, whole.variance_e2, rtol=1e-4)
    np.testing.assert_array_equal(plain.signal_e, parts.signal_e)
    assert np.isnan(plain.variance_e2[one.valid]).all()


def test_stabilised_values_are_anscombes_for_one_capture_and_have_a_noise_of_one():
    x = np.linspace(1.0, 5000.0, 40000).reshape(200, 200)
    good = np.ones(x.shape, bool)
    ours = stabilised(x, x + READ**2, good)
    anscombe = 2 * np.sqrt(x + 0.375 + READ**2)
    # 0.5: of the 512 bins of 10 e, the first is too wide for the curve, which bends within 4 e
    np.testing.assert_allclose(ours - ours[50, 0], anscombe - anscombe[50, 0], atol=0.5)
    rng = np.random.default_rng(8)
    for level in (3.0, 30.0, 3000.0):
        one = noisy(np.full(SHAPE, level), rng)
        # 16 384 pixels give 1 %; at 3 e the transform stabilises the variance only approximately
        assert stabilised(one.signal_e, one.variance_e2, one.valid).std() == pytest.approx(
            1, abs=0.12 if level < 10 else 0.04
        )


def test_the_table_of_stabilised_values_may_come_from_a_sample_of_all_filters(monkeypatch):
    """Columns under the second filter have three times the light. A sample of every second column
    would miss them.
    """
    x = np.tile(np.geomspace(1.0, 1000.0, 200)[:, None], (1, 200))
    x[:, 1::2] *= 3
    valid = np.ones(x.shape, bool)
    whole = stabilised(x, x + READ**2, valid)
    monkeypatch.setattr(denoise, "SAMPLED", 5000)
    some = stabilised(x, x + READ**2, valid)
    # 0.02 of the noise of one pixel: the bins hold 78 values or 9
    np.testing.assert_allclose(some - some[0, 0], whole - whole[0, 0], atol=0.02)


def test_saturated_samples_neither_give_nor_take():
    rng = np.random.default_rng(9)
    one = noisy(np.full(SHAPE, 50.0), rng)
    one.valid[:, 60:70] = False
    one.signal_e[:, 60:70] = 1e9
    out = denoised(one, (2, 2))
    np.testing.assert_array_equal(out.signal_e[:, 60:70], 1e9)
    assert np.abs(out.signal_e[:, 40:58] - 50).max() < 15
    dead = Merged(one.signal_e, one.variance_e2, np.zeros(SHAPE, bool), one.source)
    np.testing.assert_array_equal(denoised(dead, (2, 2)).signal_e, one.signal_e)


def test_shifts_keep_the_array_and_come_with_their_opposites_once():
    for cell in ((1, 1), (2, 2), (4, 2)):
        some = shifts(cell, (50, 50))
        assert all(dy % cell[0] == 0 and dx % cell[1] == 0 for dy, dx in some)
        assert not {(-dy, -dx) for dy, dx in some} & set(some) and (0, 0) not in some
    a = np.arange(10)
    for shift in (3, -3):
        here, there = pair(10, shift)
        assert np.all(a[there] - a[here] == shift) and len(a[here]) == 7


@pytest.mark.parametrize("read", [0.5, 9.0])
@pytest.mark.parametrize("level", [0.5, 1.0, 3.0])
def test_the_darkest_flat_fields_keep_their_mean(level, read):
    """The mean changes by less than 0.005 of the noise of one pixel. Averages of stabilised values
    with the exact inverse would change it by up to 0.07.
    """
    rng = np.random.default_rng(14)
    change = []
    for _ in range(8):
        x = rng.poisson(level, (64, 64)) + read * rng.standard_normal((64, 64))
        one = Merged(
            x,
            np.maximum(x + read**2, 0.1 * read**2),
            np.ones(x.shape, bool),
            np.zeros(x.shape, np.uint8),
        )
        change.append(denoised(one, (4, 4)).signal_e.mean() - x.mean())
    # the change scatters by 0.002 of the noise from field to field
    assert abs(np.mean(change)) < 0.005 * np.sqrt(level + read**2)


@pytest.mark.parametrize("isp", [LinearIsp, MergeIsp])
def test_through_the_isp_the_level_stays_and_no_variance_is_stated(bench, isp):
    grey = 20 * light("daylight", bench.WAVELENGTH)
    rng = np.random.default_rng(10)
    captures = bench.make(bench.mosaic_of(grey, (96, 96)), bench.SPLIT, rng=rng)
    rows = ledger.Ledger()
    with ledger.stage(rows, "isp") as row:
        plain, out = (isp(denoise=d)(captures) for d in ("none", "nl_means"))
    y, rough = (p.xyz.values[6:-6, 6:-6, 1] for p in (out, plain))
    assert y.mean() == pytest.approx(rough.mean(), rel=0.003) and y.var() < 0.05 * rough.var()
    assert (
        variance_known(plain)
        and not variance_known(out)
        and np.isnan(total_variance(out).values).all()
    )
    assert any("variance of the denoised picture" in left.what for left in row.left_out)


@pytest.mark.parametrize("demosaic", ["bilinear", "automatic"])
def test_the_plain_development_makes_the_picture_before_denoising(bench, demosaic):
    """The plain development states its variance, even if the demosaic states none."""
    isp = MergeIsp(denoise="nl_means", demosaic=demosaic)
    grey = 20 * light("daylight", bench.WAVELENGTH)
    mosaic = bench.mosaic_of(grey, (24, 24))
    captures = bench.make(mosaic, bench.SPLIT, rng=np.random.default_rng(11))
    plain = plain_development(isp)(captures)
    assert variance_known(plain)
    before = before_denoising(isp(captures))
    np.testing.assert_array_equal(plain["xyz"].values, before["xyz"].values)


def test_unknown_denoisers_are_named(bench):
    with pytest.raises(ConfigError, match="denoise is 'nlmeans'.*did you mean 'nl_means'"):
        LinearIsp(denoise="nlmeans")(bench.make(np.full((24, 32), 50.0)))


def test_variance_is_that_of_the_weights(monkeypatch):
    """With all weights set to 0.5 the variance has a closed form, both for samples that scatter as
    stated and for samples that scatter more.
    """

    def half(one, other, beside):
        return np.full((len(one) - sum(beside), one.shape[1]), 0.5)

    monkeypatch.setattr(denoise, "likeness", half)
    others = 11 * 11 - 1
    share = (1 + others * 0.25) / (1 + others * 0.5) ** 2
    level = np.full((40, 40), 100.0)
    good = np.ones((40, 40), bool)
    source = np.zeros((40, 40), np.uint8)
    out = denoised(Merged(level, level + 4.0, good, source), (2, 2))
    assert out.variance_e2[20, 20] == pytest.approx(104 * share)
    # every second of the shifted samples is 60 e brighter, so all lie 30 e from the mean: their
    # variance is 900 e2 instead of 104
    level = level + 30.0 * (-1.0) ** (np.arange(40)[:, None] // 2 + np.arange(40) // 2)
    out = denoised(Merged(level, np.full((40, 40), 104.0), good, source), (2, 2))
    assert out.variance_e2[20, 20] == pytest.approx(900 * share, rel=0.01)


def test_a_square_at_the_border_is_mirrored():
    values = np.random.default_rng(3).random((9, 11)).astype(np.float32)
    padded = np.pad(values, denoise.PATCH // 2, mode="reflect")
    side = (denoise.PATCH, denoise.PATCH)
    expected = np.lib.stride_tricks.sliding_window_view(padded, side).sum(axis=(2, 3))
    whole = denoise._box_sums(values)
    np.testing.assert_allclose(whole, expected, rtol=1e-6)  # float32
    np.testing.assert_allclose(denoise._box_sums(values[1:9], (2, 1)), expected[3:8], rtol=1e-6)
