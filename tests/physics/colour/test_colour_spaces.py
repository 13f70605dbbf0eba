"""Colour: Sharma's pairs, colour-science, ISETCam's numbers, round trips, and the colour matrix."""

import os
import time
from pathlib import Path

import numpy as np
import pytest

from isethdr_core.physics.colour import colour_spaces

# Columns: Lab 1, Lab 2, CIEDE2000. Rows of Sharma, Wu, Dalal 2005, table 1, that are difficult:
# mean hues across 0 and 180 degrees, greys, large differences.
SHARMA = np.array(
    [
        [50, 2.6772, -79.7751, 50, 0, -82.7485, 2.0425],
        [50, 3.1571, -77.2803, 50, 0, -82.7485, 2.8615],
        [50, -1.3802, -84.2814, 50, 0, -82.7485, 1.0000],
        [50, 0, 0, 50, -1, 2, 2.3669],
        [50, 2.49, -0.001, 50, -2.49, 0.0009, 7.1792],
        [50, 2.49, -0.001, 50, -2.49, 0.0010, 7.1792],
        [50, 2.49, -0.001, 50, -2.49, 0.0011, 7.2195],
        [50, 2.49, -0.001, 50, -2.49, 0.0012, 7.2195],
        [50, -0.001, 2.49, 50, 0.0009, -2.49, 4.8045],
        [50, -0.001, 2.49, 50, 0.0010, -2.49, 4.8045],
        [50, -0.001, 2.49, 50, 0.0011, -2.49, 4.7461],
        [50, 2.5, 0, 50, 0, -2.5, 4.3065],
        [50, 2.5, 0, 73, 25, -18, 27.1492],
        [50, 2.5, 0, 61, -5, 29, 22.8977],
        [50, 2.5, 0, 58, 24, 15, 19.4535],
        [60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644],
        [2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082],
    ]
)


@pytest.fixture(scope="module")
def isetcam():
    folder = os.environ.get("ISETHDR_REFERENCE")
    if not folder:
        pytest.skip("ISETHDR_REFERENCE is not set: no reference numbers to compare with")
    return np.load(Path(folder) / "isetcam" / "h_isp.npz")


def test_ciede2000_gives_sharmas_pairs():
    # the table has four digits
    np.testing.assert_allclose(
        colour_spaces.de2000(SHARMA[:, :3], SHARMA[:, 3:6]), SHARMA[:, 6], atol=5.1e-5
    )
    np.testing.assert_allclose(
        colour_spaces.de2000(SHARMA[:, 3:6], SHARMA[:, :3]), SHARMA[:, 6], atol=5.1e-5
    )


def test_a_mean_hue_of_0_is_not_taken_for_360():
    """Take the mean of hues of 315 and 45 degrees as 0 degrees also with rounded components.

    At 360 degrees instead of 0, the rotation term for blue would add a step of 1e-5.
    """
    a = np.array([[50.0, 3, -3]])
    b = np.array([[50.0, 2, 2]])
    for k in (1.0, 1 / 3, 0.7, np.pi):  # scales that leave rounding of 4e-14 in the mean hue
        turned = [
            colour_spaces.de2000(k * a * [1 / k, 1, 1], b * [1, s, s])
            for s in np.linspace(0.5, 4, 200)
        ]
        # a mean hue just above 0 degrees
        near = [
            colour_spaces.de2000(k * a * [1 / k, 1, 1 - 1e-9], b * [1, s, s])
            for s in np.linspace(0.5, 4, 200)
        ]
        np.testing.assert_allclose(turned, near, rtol=1e-8)


def test_large_pictures_are_as_small_ones():
    """Large pictures, computed in pieces, give the same values as small ones.

    This includes arguments that are broadcast and a short last piece.
    """
    lab = np.random.default_rng(7).uniform(
        [0, -50, -50], [100, 50, 50], (3, colour_spaces.PIECE - 5, 3)
    )
    white = np.array([95.0, 100, 108])
    rows = [colour_spaces.de2000(one[:9000], lab[0, :9000]) for one in lab]
    np.testing.assert_array_equal(colour_spaces.de2000(lab, lab[0])[:, :9000], rows)
    np.testing.assert_array_equal(
        colour_spaces.lab(lab, white)[:, :9000],
        [colour_spaces.lab(one[:9000], white) for one in lab],
    )


def test_differences_equal_colour_science():
    science = pytest.importorskip("colour")
    rng = np.random.default_rng(0)
    a, b = rng.uniform([0, -120, -120], [100, 120, 120], (2, 5000, 3))
    # 1e-11: rounding, since the same operations are done in another order
    np.testing.assert_allclose(
        colour_spaces.de2000(a, b), science.difference.delta_E_CIE2000(a, b), rtol=1e-11
    )
    # pairs for which the mean of two hues passes 0 degrees
    opposite = a * [1, -0.5, -0.5] + rng.normal(size=a.shape)
    np.testing.assert_allclose(
        colour_spaces.de2000(a, opposite),
        science.difference.delta_E_CIE2000(a, opposite),
        rtol=1e-11,
    )
    np.testing.assert_allclose(
        colour_spaces.de94(a, b), science.difference.delta_E_CIE1994(a, b), rtol=1e-11
    )
    np.testing.assert_allclose(
        colour_spaces.de76(a, b), science.difference.delta_E_CIE1976(a, b), rtol=1e-12
    )


def test_own_ciede2000_is_worth_its_lines():
    """The project's own formula takes less than half the time of colour-science on a picture.

    Otherwise colour-science should replace it.
    """
    science = pytest.importorskip("colour")
    rng = np.random.default_rng(2)
    picture = rng.uniform([0, -60, -60], [100, 60, 60], (200, 500, 3))
    other = picture + rng.normal(0, 3, picture.shape)
    functions = colour_spaces.de2000, science.difference.delta_E_CIE2000
    seconds = []
    for _ in range(5):  # alternate, and keep the best: other processes share the machine
        for function in functions:
            start = time.process_time()
            function(picture, other)
            seconds.append(time.process_time() - start)
    assert min(seconds[0::2]) < 0.5 * min(seconds[1::2])


def test_lab_and_srgb_equal_colour_science():
    science = pytest.importorskip("colour")
    xyz = np.random.default_rng(1).uniform(0, 1.1, (200, 3))
    white = np.array([0.3127, 0.3290])
    np.testing.assert_allclose(
        colour_spaces.lab(xyz, science.xy_to_XYZ(white)),
        science.XYZ_to_Lab(xyz, white),
        rtol=1e-9,
        atol=1e-9,
    )
    code = science.models.eotf_inverse_sRGB(np.clip(xyz, 0, 1))
    np.testing.assert_allclose(colour_spaces.srgb_encode(xyz), code, atol=1e-12)
    # colour-science computes the matrix from primaries, and the standard rounds it to four digits;
    # 1e-3 is a quarter of an 8-bit code
    np.testing.assert_allclose(
        colour_spaces.linear_srgb(xyz),
        science.XYZ_to_sRGB(xyz, apply_cctf_encoding=False),
        atol=1e-3,
    )


def test_agrees_with_isetcam(isetcam, largest_difference):
    a, b = (
        colour_spaces.lab(isetcam[k], isetcam["white_xyz"])
        for k in ("patch_xyz", "patch_xyz_perturbed")
    )
    np.testing.assert_allclose(a, isetcam["lab"], atol=1e-12 * 100)  # rounding at values near 100
    np.testing.assert_allclose(b, isetcam["lab_perturbed"], atol=1e-12 * 100)
    for year, difference in (
        ("1976", colour_spaces.de76),
        ("1994", colour_spaces.de94),
        ("2000", colour_spaces.de2000),
    ):
        found = difference(a, b)
        np.testing.assert_allclose(found, isetcam[f"deltaE_{year}"], atol=1e-11)
        largest_difference("Lab; colour difference", found, isetcam[f"deltaE_{year}"])
    largest_difference("Lab; colour difference", a, isetcam["lab"])
    ramp = colour_spaces.srgb_encode(isetcam["lrgb_ramp"])
    np.testing.assert_allclose(ramp, isetcam["srgb_ramp"], atol=1e-14)
    largest_difference("sRGB curve", ramp, isetcam["srgb_ramp"])
    # ISETCam keeps the matrix of the 1996 draft, which differs from the 1999 standard in the fourth
    # digit
    np.testing.assert_allclose(
        colour_spaces.linear_srgb(isetcam["xyz2srgb_in"]), isetcam["xyz2lrgb_out"], atol=2e-4
    )


def test_round_trips_and_white():
    values = np.linspace(0, 1, 1001)
    # the two pieces of the standard's curve differ by 1e-7 at the knee, so a value next to the knee
    # may be decoded with the other piece
    np.testing.assert_allclose(
        colour_spaces.srgb_decode(colour_spaces.srgb_encode(values)), values, atol=1e-7
    )
    xyz = np.random.default_rng(2).uniform(-1, 1e6, (20, 3))
    np.testing.assert_allclose(
        colour_spaces.xyz_from_linear_srgb(colour_spaces.linear_srgb(xyz)), xyz, rtol=1e-9
    )
    np.testing.assert_allclose(colour_spaces.linear_srgb(colour_spaces.D65_XYZ), 1, atol=1e-3)
    np.testing.assert_allclose(
        colour_spaces.lab(colour_spaces.D65_XYZ, colour_spaces.D65_XYZ), [100, 0, 0], atol=1e-12
    )


def test_lab_is_continuous_and_symmetric_around_black():
    white = np.ones(3)
    edge = (6 / 29) ** 3
    below, above = (colour_spaces.lab(np.full(3, edge * k), white) for k in (1 - 1e-9, 1 + 1e-9))
    np.testing.assert_allclose(below, above, atol=1e-6)
    black = np.array([[0.001] * 3, [-0.001] * 3])
    # noise around black has mean L* = 0
    np.testing.assert_allclose(colour_spaces.lab(black, white).sum(0), 0, atol=1e-12)


def test_matrix_is_exact_for_the_white_and_for_a_sensor_that_spans_xyz():
    rng = np.random.default_rng(3)
    mix = rng.uniform(0.1, 1, (3, 3))
    target = rng.uniform(0, 1, (50, 3))
    response = target @ mix.T
    white = np.array([0.95, 1.0, 1.09])
    found = colour_spaces.colour_matrix(response, target, white @ mix.T, white)
    np.testing.assert_allclose(found, np.linalg.inv(mix), rtol=1e-8)
    noisy = colour_spaces.colour_matrix(
        response[:, :3] ** 1.1, target, white @ mix.T, white, np.eye(3)
    )
    # the white is exact with any noise term
    np.testing.assert_allclose(noisy @ (white @ mix.T), white, rtol=1e-12)


def test_matrix_is_the_least_squares_one_under_its_constraint():
    rng = np.random.default_rng(4)
    response = rng.uniform(0, 1, (60, 4))
    target = rng.uniform(0, 1, (60, 3))
    u = np.array([1.0, 2, 0.5, 3])
    v = np.array([0.9, 1, 1.1])
    noise = np.diag([0.1, 0.2, 0.3, 0.4])
    best = colour_spaces.colour_matrix(response, target, u, v, noise)

    def cost(m):
        return np.sum((response @ m.T - target) ** 2) + np.trace(m @ noise @ m.T)

    for _ in range(50):  # every step along the constraint raises the cost
        step = rng.normal(size=(3, 4))
        step -= np.outer(step @ u, u) / (u @ u)
        assert cost(best + 1e-3 * step) > cost(best)


def test_matrix_of_one_channel_scales_the_white():
    np.testing.assert_allclose(
        colour_spaces.colour_matrix(np.ones((5, 1)), np.ones((5, 3)), [4.0], [1.0, 2.0, 3.0])[:, 0],
        [0.25, 0.5, 0.75],
    )


def test_codes_from_the_table_are_rounded_encoded_values_next_to_every_step():
    entries = np.linspace(0.0, 1.0, colour_spaces.CODE_BINS + 1)
    # linear values at which the code changes, and the neighbours of these and of all entries
    steps = colour_spaces.srgb_decode((np.arange(255) + 0.5) / 255)
    near = np.concatenate([entries, steps, np.random.default_rng(0).uniform(-0.1, 1.1, 3000)])
    values = np.concatenate([near, np.nextafter(near, -1), np.nextafter(near, 2)])
    values = np.stack([values, values[::-1], np.roll(values, 1)], axis=-1)
    codes = colour_spaces.srgb_codes(values)
    assert codes.dtype == np.uint8
    np.testing.assert_array_equal(codes, np.rint(255 * colour_spaces.srgb_encode(values)))
    single = [int(colour_spaces.srgb_codes(value)) for value in steps[:20]]
    assert single == colour_spaces.srgb_codes(steps[:20]).tolist()
