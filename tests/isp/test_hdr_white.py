"""HDR white: a display view in which only nearly saturated pixels turn white."""

import numpy as np
import pytest
from isethdr_isp.hdr_white import hdr_white

from isethdr_core.errors import ConfigError


def test_pixels_below_the_start_do_not_change():
    displayed = np.random.default_rng(1).uniform(0, 1, (12, 15, 3))
    np.testing.assert_array_equal(hdr_white(displayed, np.full((12, 15), 0.95)), displayed)


def test_a_full_mosaic_is_white_up_to_the_border():
    np.testing.assert_allclose(hdr_white(np.full((9, 9, 3), 0.2), np.ones((9, 9))), 1.0, rtol=1e-12)


def test_one_full_pixel_blends_with_the_smoothed_weight():
    filled = np.zeros((11, 11))
    displayed = np.full((11, 11, 3), 0.5)
    filled[5, 5] = 0.975  # half of the way from 0.95 to 1
    gauss = np.exp(-0.5 * np.arange(-2, 3) ** 2)
    weight = np.zeros((11, 11))
    weight[3:8, 3:8] = 0.5 * np.outer(gauss, gauss) / gauss.sum() ** 2
    np.testing.assert_allclose(hdr_white(displayed, filled)[..., 0], 0.5 + 0.5 * weight, rtol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"start": 1.0}, "start is 1.0"),
        ({"blur_px": 0.0}, "blur_px is 0.0"),
        ({"filled": np.zeros((4, 5))}, "one mosaic"),
    ],
)
def test_bad_input(arguments, message):
    with pytest.raises(ConfigError, match=message):
        hdr_white(**{"displayed": np.zeros((4, 4, 3)), "filled": np.zeros((4, 4)), **arguments})
