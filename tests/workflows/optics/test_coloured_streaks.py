"""Coloured streaks: whole bands beat single wavelengths wherever kernels are not exact, within the
error they state.
"""

import pytest
from isethdr_measured.coloured_streaks import coloured_streaks


@pytest.mark.slow
def test_whole_bands_are_right_and_single_wavelengths_are_not(tmp_path):
    rows = coloured_streaks(tiles=70)
    far = rows[-1]
    assert far["radius_tiles"] == "64-70"
    # within 70 tiles the usual kernels are those of the finest setting: they differ by nothing
    assert far["integrated"] <= far["stated"] <= 0.03 < far["one_wavelength"]
    # speckles are drawn out more, farther out
    assert [r["one_wavelength"] for r in rows] == sorted(r["one_wavelength"] for r in rows)
