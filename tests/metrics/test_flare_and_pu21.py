"""Normalised flare of a known veil, PU21 compared with its published fit, and definitions of
dynamic range in closed form.
"""

import numpy as np
import pytest
from isethdr_metrics.luminance.dynamic_range import DynamicRange
from isethdr_metrics.luminance.normalized_flare import NormalizedFlare
from isethdr_metrics.similarity.ssim_pu21 import SsimPu21, pu21

from isethdr_core.physics.colour.colour_spaces import D65_XYZ
from isethdr_core.quantities import centres
from isethdr_core.truth import make_picture
from isethdr_core.uncertainty import ledger


def picture(y, variance=0.0, valid=True):
    xyz = np.asarray(y, float)[..., None] * D65_XYZ
    ny, nx = np.shape(y)
    return make_picture(
        xyz,
        np.broadcast_to(variance, (ny, nx))[..., None] * np.ones(3),
        np.broadcast_to(valid, (ny, nx)),
        centres(nx, nx * 3e-6),
        centres(ny, ny * 3e-6),
        focal_length_mm=4.0,
        pitch_um=3.0,
    )


def lamp():
    y = np.full((60, 90), 0.1)
    y[30, 45] = 1e4
    return y


def by_name(scores):
    return {s.metric: s for s in scores}


def test_a_uniform_veil_is_its_share_of_the_source():
    y = lamp()
    found = by_name(NormalizedFlare()(picture(y + 1e-3 * 1e4), picture(y)))
    assert found["normalized_flare"].value == pytest.approx(1e-3, rel=1e-9)
    assert found["normalized_flare_99"].value == pytest.approx(1e-3, rel=1e-9)
    assert found["normalized_flare_source"].value == 1e4
    assert by_name(NormalizedFlare()(picture(y), picture(y)))["normalized_flare"].value == 0


def test_blur_of_the_source_itself_is_not_flare_and_noise_is_no_bias():
    y = lamp()
    blurred = y.copy()
    blurred[28:33, 43:48] += 300.0
    assert by_name(NormalizedFlare()(picture(blurred), picture(y)))["normalized_flare"].value == 0
    noisy = y + 0.5 * np.random.default_rng(0).standard_normal(y.shape)
    s = by_name(NormalizedFlare()(picture(noisy), picture(y)))["normalized_flare"]
    assert s.low < 0 < s.high and abs(s.value) < 4 * 0.5 / np.sqrt(y.size) / 1e4


def test_a_dark_scene_has_no_flare():
    book = ledger.Ledger()
    with ledger.stage(book, "metric") as row:
        assert NormalizedFlare()(picture(np.zeros((20, 30))), picture(np.zeros((20, 30)))) == []
    assert "no light" in row.left_out[0].why


def test_pu21_is_the_published_curve():
    """The authors of PU21 scale it so that a display of 100 cd/m2 spans 0..256. It is 0 at 0.005
    cd/m2 and rises throughout.
    """
    assert pu21(100.0) == pytest.approx(256, abs=0.5) and pu21(0.005) == pytest.approx(0, abs=0.05)
    assert (np.diff(pu21(np.geomspace(0.005, 1e4, 500))) > 0).all()
    assert pu21(1e6) == pu21(1e4) and pu21(-3.0) == pu21(0.0)
    # PU21 is nearly logarithmic for bright surfaces (Weber): equal ratios are nearly equal steps
    steps = np.diff(pu21(np.geomspace(100, 1600, 5)))
    assert np.ptp(steps) / steps.mean() < 0.15


def test_ssim_on_pu21_sees_absolute_level_and_states_what_it_clamps():
    rng = np.random.default_rng(1)
    y = 10 * np.exp(0.3 * rng.standard_normal((48, 60)))
    same = by_name(SsimPu21()(picture(y), picture(y)))
    assert same["ssim_pu21"].value == pytest.approx(1) and same["ssim_pu21_clamped"].value == 0
    noise = 0.5 * rng.standard_normal(y.shape)
    bright, dim = (
        by_name(SsimPu21()(picture(k * (y + noise)), picture(k * y)))["ssim_pu21"].value
        for k in (1, 1e-2)
    )
    assert bright < dim < 1  # the same relative noise is less visible at a hundredth of the light
    y[0, :30] = 1e5
    assert by_name(SsimPu21()(picture(y), picture(y)))["ssim_pu21_clamped"].value == pytest.approx(
        30 / y.size
    )


def test_three_definitions_of_dynamic_range_in_closed_form():
    a = 4e-4
    b = 2e-3
    true = np.repeat(np.geomspace(1e-2, 1e4, 300)[:, None], 20, axis=1)
    valid = true < 5e3
    found = by_name(DynamicRange()(picture(true, a + b * true, valid), picture(true)))
    top = true[valid].max()
    for name, snr2 in (("", 1.0), ("_snr_10db", 10.0)):
        bottom = found[f"dynamic_range{name}_bottom"].value
        assert bottom**2 / (a + b * bottom) == pytest.approx(snr2, rel=1e-6)
        assert found[f"dynamic_range{name}"].value == pytest.approx(
            20 * np.log10(top / bottom), rel=1e-9
        )
    assert found["dynamic_range_dark_noise"].value == pytest.approx(
        20 * np.log10(top / np.sqrt(a)), abs=1e-4
    )
    assert (
        found["dynamic_range_dark_noise"].value
        > found["dynamic_range"].value
        > found["dynamic_range_snr_10db"].value
    )


def test_the_noise_line_is_read_between_points_and_not_beyond_the_dark():
    """Most pixels are so dark that shot noise does not show, and variances are uncertain by 20 %. A
    line fitted to these pixels alone would have almost no slope.
    """
    rng = np.random.default_rng(0)
    true = np.concatenate(
        [rng.uniform(1e-4, 1e-2, 40_000), np.geomspace(1e-2, 50, 10_000)]
    ).reshape(200, 250)
    a = 0.17
    b = 0.064
    seen = (a + b * true) * np.exp(0.2 * rng.standard_normal(true.shape))
    found = by_name(DynamicRange()(picture(true, seen, true < 40), picture(true)))
    for name, s in (("", 1.0), ("_snr_10db", np.sqrt(10))):
        # luminance where SNR = s; 2 %: medians of hundreds of variances are known to 1 or 2 %, and
        # their square roots to half of that
        assert found[f"dynamic_range{name}_bottom"].value == pytest.approx(
            (s**2 * b + np.sqrt(s**4 * b**2 + 4 * s**2 * a)) / 2, rel=0.02
        )
