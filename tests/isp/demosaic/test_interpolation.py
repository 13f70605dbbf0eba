"""Demosaic by interpolation is exact on constants and ramps, states the exact variance, and equals
ISETCam's bilinear rule on a Bayer array.
"""

import numpy as np
import pytest
from isethdr_isp.demosaic.interpolation import demosaic

from isethdr_core.errors import UnitError

PATTERNS = {
    "mono": [[0]],
    "bayer": [[0, 1], [1, 2]],
    "rccb": [[0, 1], [1, 2]],
    "rgbw": [[0, 1], [3, 2]],
    "rccc": [[0, 1], [1, 1]],
    "quad": [[0, 0, 1, 1], [0, 0, 1, 1], [1, 1, 2, 2], [1, 1, 2, 2]],
    "rgbw 4x4": [[3, 1, 3, 0], [1, 3, 0, 3], [3, 2, 3, 1], [2, 3, 1, 3]],
    "one row of two": [[0, 1]],
}


def tiled(pattern, shape=(20, 26)):
    p = np.array(pattern)
    return np.tile(p, (shape[0] // p.shape[0] + 1, shape[1] // p.shape[1] + 1))[
        : shape[0], : shape[1]
    ]


@pytest.mark.parametrize("name", PATTERNS)
def test_constant_and_linear_ramp_come_back_exactly(name):
    filters = tiled(PATTERNS[name])
    channels = filters.max() + 1
    y, x = np.mgrid[:20, :26]
    ramp = 5 + 0.7 * x - 0.3 * y
    planes, _, _ = demosaic(ramp, filters, channels)
    # from 8 pixels inside the border on, no mirrored sample enters; 1e-12: rounding of values
    # around 20
    np.testing.assert_allclose(
        planes[:, 8:-8, 8:-8],
        np.broadcast_to(ramp, planes.shape)[:, 8:-8, 8:-8],
        rtol=0,
        atol=1e-12,
    )
    # negative electrons stay
    flat, _, _ = demosaic(np.full(filters.shape, -3.5), filters, channels)
    np.testing.assert_allclose(flat, -3.5, rtol=1e-12)


@pytest.mark.parametrize("name", ["bayer", "rgbw 4x4"])
def test_own_samples_stay_untouched(name):
    filters = tiled(PATTERNS[name])
    mosaic = np.random.default_rng(0).normal(size=filters.shape)
    planes, _, _ = demosaic(mosaic, filters, filters.max() + 1)
    np.testing.assert_array_equal(np.take_along_axis(planes, filters[None], 0)[0], mosaic)


def test_variance_is_that_of_the_linear_map():
    filters = tiled(PATTERNS["bayer"], (12, 12))
    rng = np.random.default_rng(1)
    variance = rng.uniform(1, 5, filters.shape)
    _, reported, _ = demosaic(np.zeros(filters.shape), filters, 3, variance)
    # the linear map is measured column by column, as the answer to one sample of 1; then the
    # variances of independent samples add with the squares of its entries
    impulses = np.eye(filters.size).reshape(-1, *filters.shape)
    answer = np.stack([demosaic(i, filters, 3)[0] for i in impulses], -1)
    expected = answer**2 @ variance.ravel()
    # compared inside the border only: at the border a mirrored sample counts twice, and the
    # reported variance treats its copies as independent
    np.testing.assert_allclose(expected[:, 2:-2, 2:-2], reported[:, 2:-2, 2:-2], rtol=1e-12)


def test_a_bad_sample_marks_exactly_the_pixels_that_use_it():
    filters = tiled(PATTERNS["bayer"], (12, 12))
    bad = np.zeros(filters.shape, bool)
    bad[6, 6] = True  # a red pixel: only the 3 x 3 pixels around it use it
    expected = np.zeros_like(bad)
    expected[5:8, 5:8] = True
    _, _, touched = demosaic(np.ones(filters.shape), filters, 3, bad=bad)
    np.testing.assert_array_equal(touched, expected)


def test_bayer_equals_isetcams_bilinear(reference, largest_difference):
    data = reference("h_isp")
    filters = np.tile(data["cfa_pattern"].astype(int) - 1, (36, 54))
    planes, _, _ = demosaic(data["volts"], filters, 3)
    theirs = data["sensorspace_bilinear_none"]
    # stored as float32
    assert largest_difference("bilinear demosaic", np.moveaxis(planes, 0, -1), theirs) < 1e-7


def test_refuses_arrays_it_cannot_serve():
    with pytest.raises(UnitError, match="does not repeat"):
        demosaic(np.zeros((40, 40)), np.random.default_rng(0).integers(0, 3, (40, 40)), 3)
    with pytest.raises(UnitError, match="is not sampled"):
        demosaic(np.zeros((8, 8)), tiled(PATTERNS["bayer"], (8, 8)), 4)
    with pytest.raises(UnitError, match="smaller than its filter array"):
        demosaic(np.zeros((2, 2)), tiled(PATTERNS["bayer"], (2, 2)), 3)
