"""Two exposures or two sensitivities in one filter array: the merge has no bias over the whole
range, and states the right variance.
"""

import numpy as np
import pytest
from isethdr_isp import MergeIsp
from isethdr_isp.readout.interleaved import merge_interleaved
from isethdr_isp.spectra import light as white

import isethdr_core as hdr
from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.quantities import IRRADIANCE, centres, plane

W = np.arange(400.0, 701.0, 10.0)
THROUGHPUT = np.pi / 65
PITCH_M = 3e-6


def irradiance(luminance):
    """Return the irradiance of daylight greys of `luminance` (y, x), cd/m2, one tile per pixel."""
    ny, nx = luminance.shape
    return plane(
        THROUGHPUT * white("daylight", W)[:, None, None] * luminance,
        W,
        centres(nx, nx * PITCH_M),
        centres(ny, ny * PITCH_M),
        IRRADIANCE,
        f_number=4.0,
        focal_length_mm=4.0,
        throughput_sr=THROUGHPUT,
        falloff="none",
        field_width=nx * PITCH_M,
        field_height=ny * PITCH_M,
    )


def shot(luminance, seed=1, **fields):
    sensor = hdr.build(
        "sensor", "interleaved", pitch_um=3.0, prnu=0.0, dark_spread=0.0, column_e=0.0, **fields
    )
    return sensor(irradiance(luminance), hdr.generator(seed=seed))


@pytest.mark.parametrize(
    "varies, cfa",
    [
        pytest.param("exposure", "RGRG/GBGB/rgrg/gbgb", marks=pytest.mark.slow),
        ("sensitivity", "RGrg/GBgb"),
        ("exposure", "RGB/rgb"),
    ],
)
def test_a_ramp_over_the_whole_range_comes_back(varies, cfa):
    ramp = np.linspace(5.0, 23000.0, 240)
    picture = MergeIsp()(shot(np.broadcast_to(ramp, (40, 240)), varies=varies, cfa=cfa))
    y = picture.xyz.values[4:-4, 8:-8, 1]
    variance = picture.variance.values[4:-4, 8:-8, 1]
    assert picture.valid.values.all()
    # Bilinear interpolation leaves about 10 of 32 rows independent, which gives the standard error
    # of a column. Each of the 224 columns stays within 4.5 standard errors, and the mean over the
    # ramp within 3 of its own standard errors.
    error = (y.mean(0) - ramp[8:-8]) / np.sqrt(variance.mean(0) / 10)
    assert np.abs(error).max() < 4.5 and abs(error.mean()) < 3 / np.sqrt(224 / 3)


@pytest.mark.parametrize(
    "level",
    [
        pytest.param(2.0, marks=pytest.mark.slow),
        300.0,
        1450.0,
        pytest.param(1560.0, marks=pytest.mark.slow),
        20000.0,
    ],
)
def test_no_bias_and_right_variance_below_in_and_beyond_the_transition(level):
    picture = MergeIsp()(shot(np.full((224, 224), level), seed=int(level), cfa="RGrg/GBgb"))
    y, reported = (picture[name].values[6:-6, 6:-6, 1] for name in ("xyz", "variance"))
    # about one in 9 of the 212 x 212 pixels is independent: the standard error of the mean is
    # sd / 70, and that of the variance is 2 %
    assert abs(y.mean() - level) < 4 * y.std() / 70 + 1e-3 * level
    assert reported.mean() / y.var() == pytest.approx(1, abs=0.1)


def test_short_samples_are_worth_little_in_the_dark_and_all_in_the_light(bench):
    for level, share in ((100.0, 16 / 17), (20000.0, 0.0)):
        captures = shot(np.full((32, 32), level), cfa="RGrg/GBgb")
        merged = merge_interleaved(captures, "daylight")
        long = captures["filter"].values == 1  # upper case green
        assert merged.valid.all()
        electrons = merged.planes[1][long][100:].mean()
        # the variance is share^2 times the shot noise of the pixel's own sample, plus the variance
        # of the interpolated short samples
        if share:
            assert merged.variances[1][long][100:].mean() < 1.1 * electrons
        else:  # 1/16 of the light, interpolated from two or more samples
            assert merged.variances[1][long][100:].mean() > 3 * electrons


def test_beyond_the_short_pixels_nothing_is_valid_and_all_is_finite():
    picture = MergeIsp()(shot(np.full((16, 16), 1e7)))
    assert (
        not picture.valid.values.any()
        and np.isfinite(picture.xyz.values).all()
        and np.isfinite(picture.variance.values).all()
    )


def test_what_cannot_be_merged_is_said():
    one = shot(np.full((16, 16), 10.0))
    with pytest.raises(ConfigError, match="isp.demosaic=guided cannot merge upper and lower case"):
        MergeIsp(demosaic="guided")(one)
    with pytest.raises(ConfigError, match="isp.rule=average"):
        MergeIsp(rule="average")(one)
    with pytest.raises(ConfigError, match="expected none; type isp.denoise=none"):
        MergeIsp(denoise="nl_means").check_shot(hdr.build("sensor", "interleaved").shot_form())
    with pytest.raises(ConfigError, match="isp.defects=interpolated cannot correct an array"):
        MergeIsp(defects="interpolated")(
            shot(np.full((16, 16), 10.0), hot_percent=1.0, defect_e_per_s=10.0)
        )
    with pytest.raises(UnitError, match="2 captures has upper and lower case"):
        MergeIsp()(one.isel(capture=[0, 0]))
