"""Coloured streaks: kernels of whole bands are better than those of single wavelengths wherever
kernels are not exact, and keep the error that they state.
"""

import pytest
from isethdr_measured.coloured_streaks import coloured_streaks


@pytest.mark.slow
def test_whole_bands_are_right_and_single_wavelengths_are_not(tmp_path):
    rows = coloured_streaks(tiles=70)
    far = rows[-1]
    assert far["radius_tiles"] == "64-70"
    # up to 70 tiles the default kernels are those of the finest setting
    assert far["integrated"] <= far["stated"] <= 0.03 < far["one_wavelength"]
    # speckles are drawn out more at larger radii
    assert [r["one_wavelength"] for r in rows] == sorted(r["one_wavelength"] for r in rows)
