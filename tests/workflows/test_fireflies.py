"""Which tiles count as fireflies."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_measured.fireflies import Rendered, standing_out


def test_a_tile_stands_out_by_eight_times_and_by_five_sigma():
    luminance = np.ones((9, 9))
    instance = np.zeros((9, 9), int)
    luminance[4, 4] = 8.5
    for sigma, expected in ((0.1, 1), (1.49, 1), (1.51, 0), (np.inf, 0)):
        one = Rendered(luminance, instance, np.full((9, 9), sigma))
        assert standing_out(one).sum() == expected
    luminance[4, 4] = 7.9
    assert not standing_out(Rendered(luminance, instance, np.full((9, 9), 0.1))).any()
