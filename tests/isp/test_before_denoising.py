"""A denoised picture carries the picture before denoising, bit for bit. Scores of noise use the
picture before denoising.
"""

import numpy as np
import pytest
from isethdr_isp import MergeIsp

import isethdr_core as hdr
from isethdr_core.data.reference_picture import before_denoising, total_variance, truth
from isethdr_core.storage.picture_rounding import rounded_picture


@pytest.fixture(scope="module")
def shot():
    """Return the captures and the radiance of a luminance ramp of five decades."""
    fields = {"width": 128, "height": 72, "horizontal_field_deg": 20.0}
    mixed = hdr.build("lighting", "ideal")(hdr.build("scene", "luminance_ramp", **fields)())
    light = hdr.build("lens", "ideal")(mixed)
    return hdr.build("sensor", "dual_gain", pitch_um=10.0)(light, hdr.generator(seed=2)), mixed


def test_it_holds_the_picture_before(shot):
    captures, _ = shot
    plain = MergeIsp()(captures)
    smooth = MergeIsp(denoise="nl_means")(captures)
    assert not np.array_equal(smooth["xyz"], plain["xyz"])
    assert np.isnan(smooth["variance"].values).all()
    assert before_denoising(smooth).identical(plain.drop_vars("source").assign(source=plain.source))


@pytest.mark.parametrize("demosaic", ["guided", "automatic"])
def test_a_demosaic_without_variance_keeps_the_bilinear_picture_before(shot, demosaic):
    captures, _ = shot
    smooth = MergeIsp(denoise="nl_means", demosaic=demosaic)(captures)
    assert before_denoising(smooth).identical(MergeIsp()(captures))


def test_a_picture_that_is_not_denoised_is_itself(shot):
    plain = MergeIsp()(shot[0])
    assert before_denoising(plain) is plain


@pytest.mark.parametrize("name", ["snr_curve", "dynamic_range"])
def test_scores_of_noise_do_not_change(shot, name):
    captures, mixed = shot
    plain = MergeIsp()(captures)
    smooth = MergeIsp(denoise="nl_means")(captures)
    metric = hdr.build("metric", name)
    reference = truth(mixed, plain)
    found = metric(smooth, reference)
    assert found and found == metric(plain, reference)


def test_it_is_stored_with_the_rounding_of_pictures(shot):
    """Rounding changes it by at most a twentieth of a standard deviation, like the picture."""
    plain = MergeIsp()(shot[0])
    smooth = MergeIsp(denoise="nl_means")(shot[0])
    rounded = rounded_picture(smooth)
    assert {"xyz", "undenoised_xyz", "undenoised_variance"} <= rounded.keys()
    apart = np.abs(rounded["undenoised_xyz"].values - plain["xyz"].values)
    assert np.all(apart <= 0.051 * np.sqrt(plain["variance"].values))
    stored = before_denoising(smooth.assign(rounded))
    want = total_variance(plain).values[..., 1]
    np.testing.assert_allclose(total_variance(stored).values[..., 1], want, rtol=2**-6)
