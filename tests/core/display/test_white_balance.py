"""White balance: greys in any light become neutral at their own luminance; no value is clipped."""

import numpy as np
import pytest

from isethdr_core.display import display_view
from isethdr_core.display.white_balance import balanced, grey_world
from isethdr_core.errors import UnitError
from isethdr_core.physics.colour.colour_spaces import D65_XYZ
from isethdr_core.quantities import centres
from isethdr_core.truth import make_picture

HALOGEN = np.array([1.09, 1.0, 0.36])  # near CIE illuminant A


def picture(xyz, valid=None):
    ny, nx = xyz.shape[:2]
    return make_picture(
        xyz,
        np.zeros_like(xyz),
        np.ones((ny, nx), bool) if valid is None else valid,
        centres(nx, 1e-4),
        centres(ny, 1e-4),
        focal_length_mm=4.0,
        pitch_um=3.0,
    )


def test_greys_of_a_light_become_neutral_and_keep_their_luminance():
    levels = np.array([-2.0, 0.0, 1e-6, 5.0, 1e6])[:, None]
    np.testing.assert_allclose(
        balanced(levels * HALOGEN, HALOGEN), levels * D65_XYZ, rtol=1e-9, atol=1e-12
    )
    np.testing.assert_allclose(
        balanced(levels * HALOGEN, 700 * HALOGEN), levels * D65_XYZ, rtol=1e-9, atol=1e-12
    )


def test_d65_changes_nothing_and_the_published_example_comes_out():
    rng = np.random.default_rng(0)
    xyz = rng.standard_normal((5, 6, 3))
    np.testing.assert_allclose(balanced(xyz, D65_XYZ), xyz, atol=1e-12)
    # Lindbloom's table of Bradford matrices, D50 to D65
    table = [
        [0.9555766, -0.0230393, 0.0631636],
        [-0.0282895, 1.0099416, 0.0210077],
        [0.0122982, -0.0204830, 1.3299098],
    ]
    # 2e-5: Lindbloom's whites have four digits
    np.testing.assert_allclose(balanced(np.eye(3), [0.96422, 1.0, 0.82521]).T, table, atol=2e-5)


def test_the_grey_world_finds_the_light_without_lamps_and_without_what_is_not_valid():
    rng = np.random.default_rng(1)
    # noise below 0 is not clipped
    xyz = rng.uniform(0.1, 1.0, (40, 50, 1)) * HALOGEN + 0.3 * rng.standard_normal((40, 50, 3))
    xyz[3, 4] = [1e4, 2e4, 9e4]
    valid = np.ones((40, 50), bool)
    xyz[30:, :10] = 0.9
    valid[30:, :10] = False
    # a noise of 0.3 on a mean of 0.55 leaves 1.3 % in the mean of 1900 pixels
    np.testing.assert_allclose(grey_world(picture(xyz, valid)), HALOGEN, atol=0.05)


def test_the_view_shows_a_grey_wall_in_yellow_light_as_grey():
    wall = np.full((4, 4, 1), 0.3) * HALOGEN
    shown = display_view.display(wall, 1.0, white_xyz=HALOGEN).astype(int)
    assert (
        np.ptp(shown, axis=-1).max() <= 1
        and np.ptp(display_view.display(wall, 1.0).astype(int), axis=-1).max() > 50
    )


def test_whites_without_light_are_refused():
    with pytest.raises(UnitError, match="expected XYZ of a white with Y above 0"):
        balanced(np.ones((2, 2, 3)), [0.9, 0.0, 1.0])
    with pytest.raises(UnitError, match="no colour of light"):
        balanced(np.ones((2, 2, 3)), [-5.0, 1.0, 0.0])
    with pytest.raises(UnitError, match="no pixel is left"):
        grey_world(picture(np.ones((3, 3, 3)), np.zeros((3, 3), bool)))
    with pytest.raises(UnitError, match="mean luminance"):
        grey_world(picture(-np.ones((3, 3, 3))))
