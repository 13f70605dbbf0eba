"""View: one white for picture and truth, a monotone tone curve, a labelled false-colour scale."""

import numpy as np
import pytest

from isethdr_core.display import display_view
from isethdr_core.errors import UnitError
from isethdr_core.physics.colour.colour_spaces import D65_XYZ


def night(lamp=1e6):
    """Return luminances of a road from 0.01 to 1 cd/m2 with a lamp on 1 % of the pixels."""
    y = np.geomspace(0.01, 1, 10_000).reshape(100, 100)
    y[0, :] = lamp
    return y


def test_white_is_the_99th_percentile_without_lamps():
    y = night()
    assert display_view.lamp_mask(y).sum() == 100 and display_view.lamp_mask(y)[0].all()
    assert display_view.white_cd_m2(y) == np.percentile(y[1:], 99)
    # a brighter lamp changes nothing
    assert display_view.white_cd_m2(night(1e9)) == display_view.white_cd_m2(y)
    everything = np.zeros(y.shape, bool)
    assert display_view.white_cd_m2(y, everything) == np.percentile(y, 99)


def test_white_of_a_dark_or_empty_scene_is_a_positive_number():
    assert display_view.white_cd_m2(np.zeros((4, 4))) == 1.0
    one = np.zeros((40, 40))
    one[3, 3] = 5.0
    assert display_view.white_cd_m2(one) == 5.0


def test_tone_is_monotone_fixed_at_both_ends_and_linear_in_the_limit():
    t = np.linspace(0, 1, 500)
    for compression in (1e-6, 1.0, 100.0, 1e4):
        shown = display_view.tone(t, compression)
        assert shown[0] == 0 and shown[-1] == pytest.approx(1) and (np.diff(shown) > 0).all()
    np.testing.assert_allclose(display_view.tone(t, 1e-6), display_view.tone(t, 0), atol=1e-6)
    assert display_view.tone(1e-9, 100) / 1e-9 == pytest.approx(100 / np.log(101), rel=1e-6)
    assert display_view.tone(5.0) == pytest.approx(1) and display_view.tone(-1.0) == 0


def test_white_shows_white_black_black_and_grey_neutral():
    levels = np.array([[-3.0, 0.0, 0.01, 1.0, 10.0, 1e6]])
    shown = display_view.display(levels[..., None] * D65_XYZ, 10.0).astype(int)
    np.testing.assert_array_equal(shown[0, [0, 1]], 0)
    np.testing.assert_allclose(shown[0, [4, 5]], 255, atol=1)
    assert np.ptp(shown, axis=-1).max() <= 1  # the standard's matrix has four digits: one code
    assert (np.diff(shown[0, 1:5, 1]) > 0).all()


def test_hue_is_kept_by_the_tone_map():
    red = np.array([0.4124, 0.2126, 0.0193])
    for level in (0.01, 0.3):
        shown = display_view.display((level * red)[None, None], 1.0)[0, 0]
        assert shown[0] > 50 and shown[1] == 0 and shown[2] == 0


def test_linear_view_is_the_srgb_curve():
    shown = display_view.display((0.18 * D65_XYZ)[None, None], 1.0, compression=0)
    assert abs(int(shown[0, 0, 1]) - 118) <= 1  # 18 % grey is code 118 in sRGB


def test_false_colour_is_logarithmic_and_says_its_range():
    y = np.array([[0.0, 0.01, 1.0, 100.0, 1e9]])
    rgb, (low, high) = display_view.false_colour(y, 0.01, 100.0)
    assert (low, high) == (0.01, 100.0) and rgb.dtype == np.uint8 and rgb.shape == (1, 5, 3)
    np.testing.assert_array_equal(rgb[0, 0], rgb[0, 1])
    np.testing.assert_array_equal(rgb[0, 3], rgb[0, 4])
    middle, _ = display_view.false_colour(np.array([[10.0]]), 0.1, 1000.0)
    np.testing.assert_array_equal(rgb[0, 2], middle[0, 0])  # halfway in decades on both scales
    assert display_view.false_colour(y)[1][1] == 1e9
    assert display_view.false_colour(np.zeros((2, 2)))[0].shape == (2, 2, 3)


def test_bad_input_is_named():
    with pytest.raises(UnitError, match="white_cd_m2 is 0"):
        display_view.display(np.ones((2, 2, 3)), 0)
    with pytest.raises(UnitError, match="low <= high"):
        display_view.false_colour(np.ones((2, 2)), 10.0, 1.0)
    with pytest.raises(UnitError, match="shape"):
        display_view.luminance(np.ones(4))


def test_colours_fade_by_the_slope_of_the_curve():
    t = np.array([1e-4, 0.01, 0.2, 0.9])
    step = 1e-6
    shown = display_view.tone(t)
    above = display_view.tone(t * (1 + step))
    slope = np.log(above / shown) / np.log1p(step)
    # equation 4 of Mantiuk et al. 2009; the difference quotient is right to about its step
    expected = 3.3892 * slope**0.8552 / (1 + 2.3892 * slope**0.8552)
    np.testing.assert_allclose(display_view.saturation(t), expected, rtol=1e-5)
    np.testing.assert_array_equal(display_view.saturation(t, 0.0), 1.0)


def test_natural_colour_keeps_greys_and_luminance():
    grey = np.geomspace(0.01, 3, 9)[None, :, None] * D65_XYZ
    plain, natural = (
        display_view.display(grey, 1.0, natural_colour=on).astype(int) for on in (False, True)
    )
    assert np.abs(plain - natural).max() <= 1  # the standard's matrix has four digits
    skin = 0.2 * np.array([[[1.1, 1.0, 0.7]]])
    plain, natural = (
        display_view.display(skin, 1.0, 10.0, natural_colour=on)[0, 0] / 255 for on in (False, True)
    )
    luminance = [
        (0.2126, 0.7152, 0.0722) @ np.where(c > 0.04045, ((c + 0.055) / 1.055) ** 2.4, c / 12.92)
        for c in (plain, natural)
    ]
    assert luminance[0] == pytest.approx(luminance[1], rel=0.01)  # rounding to 8 bits
    assert np.ptp(natural) < 0.95 * np.ptp(plain)


def test_a_bright_red_lamp_fades_to_pink_and_not_to_magenta():
    red = np.array([0.4124, 0.2126, 0.0193]) + 0.02 * D65_XYZ  # a primary with a little white
    levels = np.geomspace(0.05, 5, 7)[:, None, None]
    shown = display_view.display(levels * red, 1.0, 20.0, natural_colour=True).astype(int)[:, 0]
    assert (shown[:, 0] >= shown.max(axis=1)).all()
    assert np.abs(shown[:, 1] - shown[:, 2]).max() <= 2, "green and blue rise together"
    assert shown[-1].min() > 250, "far above white it is white"
