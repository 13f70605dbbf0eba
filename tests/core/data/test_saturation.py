"""A pixel is saturated if no capture measured it."""

import numpy as np
import xarray as xr

from isethdr_core.data.saturation import with_saturation


def test_a_pixel_that_the_isp_measured_is_not_saturated():
    first = np.array([[True, True, False]])
    captures = xr.Dataset({"saturated": (("capture", "y", "x"), np.stack([first, [[True] * 3]]))})
    picture = xr.Dataset({"valid": (("y", "x"), np.array([[False, True, True]]))})
    np.testing.assert_array_equal(
        with_saturation(picture, captures)["saturated"], [[True, False, False]]
    )
