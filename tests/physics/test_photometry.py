"""Photometry: the colour matching table, the lumen, ISETCam's numbers."""

import os
from pathlib import Path

import numpy as np
import pytest

from isethdr_core.physics import photometry, radiometry

# last wavelength of ISETCam's 5 nm table, nm; it holds zeros beyond, while the table here continues
# to 830 nm
LAST_NM_OF_ISETCAM = 730


@pytest.fixture(scope="module")
def isetcam():
    folder = os.environ.get("ISETHDR_REFERENCE")
    if not folder:
        pytest.skip("ISETHDR_REFERENCE is not set: no reference numbers to compare with")
    return np.load(Path(folder) / "isetcam" / "a_photometry.npz")


def test_table_equals_colour_science():
    science = pytest.importorskip("colour")
    table = science.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    w = np.arange(360, 831, 5)
    np.testing.assert_allclose(photometry.xyz_bar(w).T, [table[float(x)] for x in w], atol=1e-14)


def test_one_watt_at_555_nm_is_683_lumen():
    w = np.arange(550.0, 561.0, 1.0)
    line = np.where(w == 555, 1.0, 0.0)  # 1 W/nm over a band of 1 nm
    # y-bar is 1.0000 at 555 nm in four digits
    assert photometry.luminance(line, w) == pytest.approx(683.0, rel=1e-4)


def test_luminance_is_y_and_linear_and_axis_is_free():
    w = np.arange(400.0, 701.0, 10.0)
    cube = np.random.default_rng(0).uniform(0, 1, (len(w), 3, 4))
    y = photometry.luminance(cube, w)
    np.testing.assert_allclose(photometry.xyz(cube, w)[..., 1], y, rtol=1e-14)
    np.testing.assert_allclose(
        photometry.luminance(np.moveaxis(cube, 0, -1), w, axis=-1), y, rtol=1e-14
    )
    np.testing.assert_allclose(photometry.luminance(3 * cube, w), 3 * y, rtol=1e-14)


def test_equal_energy_is_white_to_the_table_accuracy():
    w = np.arange(360.0, 831.0, 5.0)
    x, y, z = photometry.xyz(np.ones(len(w)), w)
    # the observer is normalised so that equal energy has x = y = z; the rounded table holds that to
    # 4e-4
    assert x / y == pytest.approx(1, abs=4e-4) and z / y == pytest.approx(1, abs=4e-4)


@pytest.mark.parametrize(
    "centres_nm",
    [
        [300, 380, 500, 560, 620, 780, 900, 1000],
        [400, 450, 470, 480, 500, 520, 560, 600, 680, 700],
        [355, 370, 400, 440, 835],
        np.arange(400, 701, 60),
    ],
)
def test_wide_and_unequal_bands_have_the_integral_over_each_band(centres_nm):
    w = np.array(centres_nm, float)
    widths = radiometry.band_widths_nm(w)
    step = 0.01
    lowest = w[0] - widths[0] / 2
    fine = lowest + step * (np.arange(round(widths.sum() / step)) + 0.5)
    band = np.searchsorted(lowest + np.cumsum(widths), fine)
    radiance = np.random.default_rng(3).uniform(0.1, 1, len(w))
    want = photometry.LM_PER_W * step * photometry.xyz_bar(fine) @ radiance[band]
    # 2e-5: the sum in steps of 0.01 nm, where the table ends inside a band
    np.testing.assert_allclose(photometry.xyz(radiance, w), want, rtol=2e-5)


def test_a_band_keeps_its_weight_if_farther_bands_are_dropped():
    w = np.array([*np.arange(360.0, 831, 10), 940.0])
    weights = photometry.xyz_weights(w)
    # 820 nm is the last band with equal neighbours; 830 and 940 nm are dropped
    np.testing.assert_array_equal(photometry.xyz_weights(w[:-2]), weights[:, :-2])
    centres = photometry.LM_PER_W * photometry.xyz_bar(w[:-2]) * 10
    np.testing.assert_allclose(weights[:, :-2], centres, rtol=1e-14)


def test_the_integral_goes_over_into_the_value_at_the_centre():
    # the rules differ by the curvature of the function, 1.4e-4 with bands of 10.1 nm
    for step, allowed in ((10.1, 2e-4), (15.0, 1e-3)):
        w = np.arange(380.0, 781, step)
        light = 1 + 0.5 * np.sin(w / 60)
        centre = photometry.LM_PER_W * step * photometry.v_lambda(w) @ light
        assert photometry.luminance(light, w) == pytest.approx(centre, rel=allowed)


def test_nothing_is_seen_outside_the_visible():
    assert not photometry.xyz_bar([300.0, 359.0, 831.0, 1000.0]).any()


def test_agrees_with_isetcam(isetcam, largest_difference):
    w = isetcam["wave"]
    w5 = isetcam["wave5"]
    seen = w5 <= LAST_NM_OF_ISETCAM
    np.testing.assert_allclose(photometry.xyz_bar(w).T, isetcam["xyz_cmf"], atol=1e-14)
    np.testing.assert_allclose(
        photometry.xyz_bar(w5[seen]).T, isetcam["xyz_cmf5"][seen], atol=1e-14
    )
    d65 = photometry.xyz(isetcam["d65"], w)
    np.testing.assert_allclose(d65, isetcam["xyz_d65"], rtol=1e-14)
    largest_difference("luminance and XYZ of lights", d65, isetcam["xyz_d65"])
    # 5e-5: the end of ISETCam's table at 730 nm changes it by 3.7e-5
    np.testing.assert_allclose(
        photometry.luminance(isetcam["d65_w5"], w5), isetcam["lum_d65_w5"], rtol=5e-5
    )
    black_bodies = photometry.xyz(isetcam["bb_energy"], w)
    np.testing.assert_allclose(black_bodies, isetcam["xyz_bb"], rtol=1e-14)
    largest_difference("luminance and XYZ of lights", black_bodies, isetcam["xyz_bb"])
    # stored as float32: 2e-7 in luminance, a little more where X or Z is small
    np.testing.assert_allclose(
        photometry.xyz(isetcam["patch_energy"], w, axis=2), isetcam["patch_xyz"], rtol=1e-6
    )
    patches = photometry.luminance(isetcam["patch_energy"], w, axis=2)
    np.testing.assert_allclose(patches, isetcam["patch_lum"], rtol=5e-7)
    largest_difference("luminance of chart patches", patches, isetcam["patch_lum"])
    # ISETCam's Planck constant is 1.6e-5 above CODATA
    np.testing.assert_allclose(
        radiometry.photons_from_energy(isetcam["d65"], w), isetcam["d65_photons"], rtol=2e-5
    )
