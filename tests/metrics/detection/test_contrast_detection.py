"""Contrast detection: the closed form agrees with counting; limits; objects next to a lamp."""

import numpy as np
import pytest
import xarray as xr
from isethdr_metrics.detection.contrast_detection import ContrastDetection
from isethdr_metrics.detection.pair_probability import pair_probability
from isethdr_metrics.detection.pixel_pairs import draw_pairs
from isethdr_metrics.detection.wedge import both_positive

from isethdr_core.errors import ConfigError
from isethdr_core.physics.colour.colour_spaces import D65_XYZ
from isethdr_core.quantities import centres
from isethdr_core.truth import make_picture


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


def counted(  # noqa: PLR0913 - a helper of tests
    bright, vb, dark, vd, contrast, seed, n=1500
):
    """Return the share of the n x n pairs of draws that show the contrast, counted as the standard
    counts over the pixels of two patches.
    """
    rng = np.random.default_rng(seed)
    b = bright + np.sqrt(vb) * rng.standard_normal((n, 1))
    d = dark + np.sqrt(vd) * rng.standard_normal((1, n))
    with np.errstate(divide="ignore", invalid="ignore"):
        k = (b - d) / (b + d)
    return np.mean((b + d > 0) & (k >= contrast / 2) & (k <= 1.5 * contrast))


@pytest.mark.parametrize("electrons", [0.05, 2.0, 30.0, 1000.0])
@pytest.mark.parametrize("contrast", [0.06, 0.2, 0.9])
def test_normal_noise_agrees_with_counting(electrons, contrast):
    """Both agree even where most estimates are negative. 400 000 pairs have a standard error below
    0.0008.
    """
    rng = np.random.default_rng(2)
    means = electrons * (1 + contrast), electrons * (1 - contrast)
    b, d = (m + np.sqrt(m + 0.64) * rng.standard_normal(400_000) for m in means)
    k = (b - d) / (b + d)
    seen = np.mean((b + d > 0) & (k >= contrast / 2) & (k <= 1.5 * contrast))
    found = pair_probability(
        means[0], means[0] + 0.64, means[1], means[1] + 0.64, contrast, step=0.0
    )
    assert found == pytest.approx(seen, abs=0.0035)


def test_counting_over_all_pairs_of_two_patches_as_the_standard_does():
    values = 12.0, 12.6, 8.0, 8.6
    found = pair_probability(*values, 0.2, step=0.0)
    many = np.mean([counted(*values, 0.2, seed) for seed in range(8)])
    # 0.01: the standard error of 8 times 1500 x 1500 crossed pairs is 0.003
    assert found == pytest.approx(many, abs=0.01)


def test_quadrant_of_correlated_normals_at_the_origin_is_the_arcsine_law():
    rho = np.array([-0.999, -0.5, 0.0, 0.7])
    np.testing.assert_allclose(
        both_positive(np.zeros(4), np.zeros(4), rho), 0.25 + np.arcsin(rho) / (2 * np.pi), atol=1e-9
    )


def test_without_noise_a_contrast_is_seen_or_not():
    one = np.ones(1)
    assert pair_probability(2 * one, 0 * one, one, 0 * one, one / 3)[0] == 1
    # a veil of glare ten times as bright as the scene
    assert pair_probability(2 * one + 10, 0 * one, one + 10, 0 * one, one / 3)[0] == 0
    assert pair_probability(one, 0 * one, 2 * one, 0 * one, one / 3)[0] == 0  # the order is wrong


def scene():
    """Return luminance and labels of two pedestrians of 2 cd/m2 on 1 cd/m2, one next to the lamp
    and one far from it.
    """
    y = np.ones((60, 90))
    instance = np.zeros((60, 90), np.uint32)
    instance[20:40, 20:28] = 1
    instance[20:40, 70:78] = 2
    y[instance > 0] = 2.0
    objects = [{"instance": 1, "name": "beside the lamp"}, {"instance": 2, "name": "far"}]
    return y, xr.Dataset({"instance": (("y", "x"), instance)}, attrs={"objects": objects})


def test_a_veil_takes_the_pedestrian_beside_the_headlight_away():
    y, labels = scene()
    # glare of a lamp to the left of the first pedestrian
    veil = 20 * np.exp(-(((np.arange(90) - 15) / 12.0) ** 2))[None]
    noise = 0.05**2
    rng = np.random.default_rng(3)
    noisy = y + veil + 0.05 * rng.standard_normal(y.shape)
    clean = {s.object: s.value for s in ContrastDetection()(picture(y, noise), picture(y), labels)}
    glare = {
        s.object: s.value for s in ContrastDetection()(picture(noisy, noise), picture(y), labels)
    }
    assert clean["beside the lamp"] > 0.98 and clean["far"] > 0.98
    assert glare["beside the lamp"] < 0.05 and glare["far"] > 0.98


def test_noise_lowers_the_number_as_the_closed_form_says():
    y, labels = scene()
    for sd in (0.1, 0.3, 1.0):
        noisy = y + sd * np.random.default_rng(4).standard_normal(y.shape)
        [found] = [
            s.value
            for s in ContrastDetection()(picture(noisy, sd**2), picture(y), labels)
            if s.object == "far"
        ]
        one = np.ones(1)
        # 0.03: the mean of 7 x 7 pixels still carries a seventh of the noise
        assert found == pytest.approx(
            pair_probability(2 * one, sd**2 * one, one, sd**2 * one, one / 3)[0], abs=0.03
        )


def test_pixels_that_are_not_valid_show_nothing():
    y, labels = scene()
    valid = np.ones_like(y, bool)
    valid[:, :45] = False
    found = {
        s.object: s.value for s in ContrastDetection()(picture(y, 1e-4, valid), picture(y), labels)
    }
    assert found["beside the lamp"] == 0 and found["far"] > 0.98


def test_map_is_nan_without_contrast_and_high_beside_edges():
    y, _ = scene()
    seen = ContrastDetection().map(picture(y, 1e-4), picture(y))
    assert np.isnan(seen[5, 45]) and seen[30, 24] > 0.99 and seen.shape == y.shape


@pytest.mark.parametrize("shape", [(30, 7), (7, 30), (7, 7)])
def test_pictures_narrower_than_the_reach_have_the_pairs_that_fit(shape):
    y = np.ones(shape)
    y[:15, :4] = 10.0
    seen = ContrastDetection().map(picture(y, 1e-6), picture(y))
    assert seen.shape == shape
    across = [n > 10 for n in shape]  # directions in which pixels 10 apart fit
    want = np.zeros(shape, bool)
    for dy, dx in ((10, 0), (0, 10)):
        if across[0 if dy else 1]:
            differ = y[dy:, dx:] != y[: shape[0] - dy, : shape[1] - dx]
            want[dy:, dx:] |= differ
            want[: shape[0] - dy, : shape[1] - dx] |= differ
    np.testing.assert_array_equal(np.isfinite(seen), want)
    assert (seen[want] > 0.999).all()  # almost no noise, so every contrast is kept


def test_pairs_cross_the_objects_border_within_reach():
    mask = np.zeros((40, 50), bool)
    mask[5:35, 0:20] = True
    first, second = draw_pairs(mask, 10)
    assert mask[first].all() and not mask[second].any() and len(first[0]) == 4000
    assert np.hypot(first[0] - second[0], first[1] - second[1]).max() <= 10


def test_bad_settings_are_named():
    y, labels = scene()
    with pytest.raises(ConfigError, match="interval_percent is 120"):
        ContrastDetection(interval_percent=120.0)(picture(y), picture(y), labels)
    with pytest.raises(ConfigError, match="reach is 0"):
        ContrastDetection(reach=0)(picture(y), picture(y), labels)
