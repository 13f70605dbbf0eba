"""Chord transforms against sums over single chords in double precision."""

import numpy as np
import pytest

from isethdr_core.physics.optics.chord_transforms import LEAST_PERIOD, _comb, chord_transforms
from isethdr_core.physics.optics.lattice import ORDER, spline_taps
from isethdr_core.physics.optics.pupil import Chords

RADIUS_MM = 1.8
STEP = 0.42 / (2 * RADIUS_MM)  # frequencies as close as those of images, cycles per mm


def chords(count=600, seed=3):
    """Return chords at random places of a pupil, in no order."""
    rng = np.random.default_rng(seed)
    left = rng.uniform(-RADIUS_MM, RADIUS_MM - 0.2, count)
    right = left + rng.uniform(0.005, 0.2, count)
    return Chords(left, right, rng.uniform(-1, 1, count), rng.uniform(4.0, 80.0, count))


def direct(lines, frequency):
    """Return (first row, transforms) with the integral of every chord in closed form."""
    row = np.floor(lines.level).astype(int)
    first = row.min() - ORDER // 2
    out = np.zeros((len(frequency), row.max() - row.min() + ORDER), complex)
    for k, f in enumerate(frequency):
        ends = (np.exp(-2j * np.pi * f * end) for end in (lines.left, lines.right))
        left, right = ends
        value = left - right if f else 2j * np.pi * (lines.right - lines.left)
        for tap, share in enumerate(spline_taps(lines.level - row, ORDER - 1)):
            np.add.at(out[k], row - ORDER // 2 - first + tap, value * share * lines.weight)
    return first, out


@pytest.mark.parametrize("first", [0, -30, 25, 400, 6113])
@pytest.mark.parametrize("count", [2, 61])
def test_transforms_equal_sums_over_single_chords(first, count):
    """Frequencies on the axis, on both sides of it, next to it and far from it."""
    frequency = (first + np.arange(count)) * STEP
    lines = chords()
    begin, found = chord_transforms(lines, frequency)
    wanted_begin, wanted = direct(lines, frequency)
    assert begin == wanted_begin and found.shape == wanted.shape
    # 8e-6 is the response to a frequency one period away; there is one on either side
    wrong = np.abs(found - wanted).max()
    assert wrong < 2 * 8e-6 * np.abs(wanted).max()


def test_the_frequency_0_is_the_length_of_the_chords():
    lines = chords()
    _, found = chord_transforms(lines, np.arange(3) * STEP)
    length = ((lines.right - lines.left) * lines.weight).sum()
    assert found[0].sum() == pytest.approx(2j * np.pi * length, rel=1e-6)


def test_the_result_does_not_depend_on_the_order_of_chords():
    lines = chords()
    frequency = (500 + np.arange(20)) * STEP
    turned = Chords(*(part[::-1] for part in lines))
    for one, other in zip(chord_transforms(lines, frequency), chord_transforms(turned, frequency)):
        # 2e-6: rounding of single precision in sums of 600 chords
        np.testing.assert_allclose(one, other, atol=2e-6 * np.abs(other).max())


@pytest.mark.parametrize("first", [0, 7, 90, 333, 5000])
def test_the_axis_is_no_period_away_from_the_frequencies(first):
    """On the axis, the field of a pupil is up to 1e5 times as strong as at these frequencies."""
    count = 24
    comb = _comb((first + np.arange(count)) * STEP)
    assert comb.points >= LEAST_PERIOD * count
    periods = (first + np.arange(count)) / comb.points
    away = np.abs(periods - np.rint(periods))[np.rint(periods) != 0]
    assert (away > 0.4 * count / comb.points).all()
