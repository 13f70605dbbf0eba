"""HDR white: a view that leaves what is not saturated alone."""

import numpy as np
import pytest
from isethdr_isp.hdr_white import hdr_white

from isethdr_core.errors import ConfigError


def test_nothing_near_the_top_is_left_as_it_is():
    shown = np.random.default_rng(1).uniform(0, 1, (12, 15, 3))
    np.testing.assert_array_equal(hdr_white(shown, np.full((12, 15), 0.95)), shown)


def test_what_is_full_is_white_up_to_the_border():
    np.testing.assert_allclose(hdr_white(np.full((9, 9, 3), 0.2), np.ones((9, 9))), 1.0, rtol=1e-12)


def test_one_full_pixel_spreads_as_the_smoothed_weight():
    filled, shown = np.zeros((11, 11)), np.full((11, 11, 3), 0.5)
    filled[5, 5] = 0.975  # half of the way from 0.95 to 1
    gauss = np.exp(-0.5 * np.arange(-2, 3) ** 2)
    weight = np.zeros((11, 11))
    weight[3:8, 3:8] = 0.5 * np.outer(gauss, gauss) / gauss.sum() ** 2
    np.testing.assert_allclose(hdr_white(shown, filled)[..., 0], 0.5 + 0.5 * weight, rtol=1e-12)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [({"start": 1.0}, "start is 1.0"), ({"filled": np.zeros((4, 5))}, "one mosaic")],
)
def test_bad_input(wrong, said):
    with pytest.raises(ConfigError, match=said):
        hdr_white(**{"displayed": np.zeros((4, 4, 3)), "filled": np.zeros((4, 4)), **wrong})
