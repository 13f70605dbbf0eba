"""Stored pictures are float32, rounded to a share of their own noise, and therefore small."""

import numpy as np
import pytest
import xarray as xr

import isethdr_core as hdr
from isethdr_core.pipeline.chain import chain
from isethdr_core.storage import picture_rounding, store
from isethdr_core.truth import FIXED_PATTERN, make_picture, with_undenoised

CHART = [
    "scene=macbeth",
    "scene.width=96",
    "scene.height=54",
    "~renderer",
    "~versions.day",
    "lighting=ideal",
    "lens=ideal",
    "~flare.dirt",
    "sensor=bayer",
    "report=false",
]


def noisy_picture(decades=8, rows=40, columns=60):
    """Return a noisy picture over `decades` decades around 1 cd/m2, with its fixed pattern.

    The darkest values scatter around 0.
    """
    random = np.random.default_rng(3)
    level = np.geomspace(10.0 ** (-decades / 2), 10.0 ** (decades / 2), columns)
    variance = 1e-3 * level[None, :, None] * random.uniform(0.5, 2, (rows, columns, 3)) + 1e-6
    xyz = level[None, :, None] + np.sqrt(variance) * random.normal(size=variance.shape)
    axes = np.arange(columns) * 1e-6, np.arange(rows) * 1e-6  # x, y
    return make_picture(
        xyz,
        variance,
        np.ones((rows, columns)),
        *axes,
        fixed_pattern_variance=1e-4 * xyz**2,
        focal_length_mm=4.0,
        pitch_um=1.0,
    )


def stored(tmp_path, picture, **options):
    return store.open_store(
        store.write_store(tmp_path, "a", {"picture/x": picture}, {}, **options), "picture/x"
    ).load()


def test_a_value_is_off_by_at_most_a_twentieth_of_its_standard_deviation(tmp_path):
    picture = noisy_picture()
    back = stored(tmp_path, picture)
    off = np.abs(back["xyz"].values.astype(float) - picture["xyz"].values)
    sigma = np.sqrt(picture["variance"].values)
    # the second term is what float32 cannot resolve: half a unit in the last place
    assert (off <= sigma / 20 + 2.0**-24 * np.abs(picture["xyz"].values)).all()
    assert (off / sigma).max() > 1 / 50  # no more bits are kept
    assert back["xyz"].dtype == np.float32
    assert back["xyz"].attrs[picture_rounding.ROUNDING]


def test_a_denoised_value_is_rounded_by_its_noise_before_denoising(tmp_path):
    noisy = noisy_picture()
    smooth = noisy["xyz"] + 0.1 * np.sqrt(noisy["variance"])
    unknown = noisy["variance"] * np.nan
    picture = with_undenoised(noisy.assign(xyz=smooth, variance=unknown), noisy)
    back = stored(tmp_path, picture)
    off = np.abs(back["xyz"].values.astype(float) - picture["xyz"].values)
    sigma = np.sqrt(noisy["variance"].values)
    # the second term is what float32 cannot resolve: half a unit in the last place
    assert (off <= sigma / 200 + 2.0**-24 * np.abs(smooth.values)).all()
    assert (off / sigma).max() > 1 / 500  # no more bits are kept
    before = np.abs(back["undenoised_xyz"].values.astype(float) - noisy["xyz"].values)
    assert (before / sigma).max() > 1 / 50


def test_variances_are_as_exact_as_they_say(tmp_path):
    picture = noisy_picture()
    back = stored(tmp_path, picture)
    variance = picture["variance"].values
    fixed = picture[FIXED_PATTERN].values
    for name, truth, whole, luminance in (
        ("variance", variance, variance, 2.0**-8),
        (FIXED_PATTERN, fixed, variance + fixed, 2.0**-7),
    ):
        off = np.abs(back[name].values - truth) / whole
        assert off[..., 1].max() <= luminance * (1 + 1e-6)
        assert off[..., ::2].max() <= 2.0**-3 * (1 + 1e-6)
        assert (back[name].values >= 0).all()


@pytest.mark.parametrize("variance", [0.0, np.nan])
def test_a_picture_without_variance_keeps_five_digits(tmp_path, variance):
    picture = noisy_picture()
    picture["variance"] = xr.full_like(picture["variance"], variance)
    back = stored(tmp_path, picture)
    np.testing.assert_allclose(back["xyz"], picture["xyz"], rtol=1e-5)
    np.testing.assert_array_equal(back["variance"], picture["variance"])


def test_a_fixed_pattern_beside_an_unknown_variance_is_rounded_by_itself(tmp_path):
    picture = noisy_picture()
    picture["variance"] = xr.full_like(picture["variance"], np.nan)
    back = stored(tmp_path, picture)
    fixed = picture[FIXED_PATTERN].values
    off = np.abs(back[FIXED_PATTERN].values - fixed) / fixed
    assert off[..., 1].max() <= 2.0**-7 * (1 + 1e-6) and off.max() <= 2.0**-3 * (1 + 1e-6)


def test_no_light_stays_no_light_and_what_is_not_finite_passes(tmp_path):
    picture = noisy_picture()
    picture["xyz"][:2, 0] = 0.0
    picture["xyz"][2, 0] = np.nan
    picture["xyz"][3, 0] = np.inf
    back = stored(tmp_path, picture)
    assert (back["xyz"][:2, 0] == 0).all()
    assert np.isnan(back["xyz"][2, 0]).all()
    assert np.isinf(back["xyz"][3, 0]).all()


def test_a_switch_keeps_all_bits(tmp_path):
    picture = noisy_picture()
    back = stored(tmp_path, picture, keepbits=None)
    assert back["xyz"].dtype == np.float64
    np.testing.assert_array_equal(back["xyz"], picture["xyz"])


def test_a_picture_of_odd_sides_takes_no_more_disk(tmp_path):
    """Chunks of an odd number of pixels would be compressed without a shuffle, to 1.5 times the
    size.
    """
    bytes_a_pixel = []
    for rows, columns in ((95, 233), (96, 232)):
        folder = tmp_path / str(rows)
        stored(folder, noisy_picture(decades=2, rows=rows, columns=columns))
        size = sum(file.stat().st_size for file in folder.rglob("c.*"))
        bytes_a_pixel.append(size / (rows * columns))
    # 3 %: each row is padded with 7 pixels of equal zeros, and coordinates take a few bytes
    assert bytes_a_pixel[0] < 1.03 * bytes_a_pixel[1]


def test_means_and_medians_of_many_pixels_have_no_bias(tmp_path):
    """If all rows were rounded to one grid, a median would lie on it, off by up to 1 / 256."""
    picture = noisy_picture(decades=0, rows=400, columns=300)
    back = stored(tmp_path, picture)
    for of in (np.mean, np.median):
        exact, found = (of(p["variance"].values[..., 1]) for p in (picture, back))
        # errors are uniform within 2^-8: those of 120,000 pixels leave 1e-5 in the mean, and less
        # than 1e-4 in the median
        assert found == pytest.approx(exact, rel=1e-4)


@pytest.mark.slow
def test_the_run_of_a_small_chart_takes_less_than_two_megabytes(tmp_path, monkeypatch):
    """A picture of 436 x 776 pixels, its truth, captures, scores and record."""
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    config = hdr.compose([*CHART, "isp=merge", "draws=1"])
    result = hdr.run(config)
    assert sum(f.stat().st_size for f in result.path.rglob("*") if f.is_file()) < 2e6
    picture, truth = (result.open(f"{what}/bayer").load() for what in ("picture", "truth"))
    assert picture["xyz"].shape == (436, 776, 3)
    again = [s for m in chain(config).metrics.values() for s in m(picture, truth)]
    before = {(s["metric"], s["object"]): s["value"] for s in result.scores}
    for score in again:
        off = abs(score.value - before[score.metric, score.object])
        half = (score.high - score.low) / 2  # interval from the pixels of one picture
        # 0.05 dB: the stated rounding of both variances, 2^-8 and 2^-7 of their sum
        rounding = 0.05 if score.unit == "dB" else 0.0
        if half > 0:
            assert off < max(half / 100, rounding), score
        else:  # no upper end because nothing saturates, or a single pixel
            assert off <= 5e-3 * score.value, score
