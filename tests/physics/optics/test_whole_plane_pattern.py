"""Whole-plane patterns: a tilt shifts them, and a polynomial in the wavenumber interpolates between
them.
"""

import numpy as np
import pytest

from isethdr_core.physics.optics import half_plane_pattern as half
from isethdr_core.physics.optics import whole_plane_pattern as whole
from isethdr_core.physics.optics.pupil import Dust, Scratches, blades, dirt, opening

RADIUS = 0.5
DISTANCE = 4.0
BLUR_UM = 0.55 * DISTANCE / (2 * RADIUS)


def pupil():
    terms = opening(
        blades(RADIUS, 5, 11.0), dirt(RADIUS, Dust(60, 20), Scratches(8, 8, 300), seed=2)
    )
    return half.RealPupil(terms, RADIUS, DISTANCE, 0.5)


def drawn(extent_um=60.0, period=3.0):
    lattice = half.half_lattice((extent_um, extent_um), 0.5 * BLUR_UM, period)
    return whole.drawn_pupil(pupil(), 550.0, lattice)


def straight(samples_x, samples_y, of):
    """Return a phase, in turns, that shifts the image by this number of samples."""
    per_mm = of.lattice.step_um * 1e-3 / (550e-6 * DISTANCE)

    def turns(x_mm, y_mm):
        return per_mm * (samples_x * x_mm + samples_y * y_mm[:, None])

    return turns


def test_without_phase_they_are_the_half_plane_pattern_twice():
    of = drawn()
    known = half.half_pattern(pupil(), 550.0, of.lattice)
    made = whole.whole_pattern(of, straight(0, 0, of))
    for side in made:
        np.testing.assert_allclose(side.density, known.density, rtol=1e-3, atol=1e-12)


def test_a_tilt_moves_the_pattern(monkeypatch):
    """Compare a shifted pattern with one at rest.

    Cells are smoothed for light at rest; difference terms (`MOMENT`) correct this for a tilt.
    """
    of = drawn()
    far = of.lattice.samples_to_border[0]
    assert 2 / min(of.lattice.period) < whole.MOST_TURNS

    def wrong():
        at_rest = whole.whole_pattern(of, straight(0, 0, of)).right.density
        moved = whole.whole_pattern(of, straight(2, -1, of)).right.density
        expected = at_rest[30 : far - 2, 5 : 2 * far - 5]  # far from the axis
        found = moved[32:far, 4 : 2 * far - 6]
        return np.abs(found - expected).sum() / expected.sum()

    # 1 %: second order in the change of phase from cell to cell, 0.08 rad squared
    assert wrong() < 0.01
    monkeypatch.setattr(whole, "MOMENT", (0.0, 0.0, 0.0))
    assert wrong() > 0.1


@pytest.mark.parametrize(("change", "count"), [(0.1, 2), (0.7, 4), (2.8, 9)])
def test_a_polynomial_gives_the_patterns_between(change, count):
    """Interpolate a wave in k at the largest rate of phase between two points of the pupil.

    `FOLLOWED` is that rate over the rms change of phase.
    """
    first = 1.4e-3
    last = 2.5e-3
    numbers = whole.interpolation_wavenumbers(first, last, change, 0.005)
    assert len(numbers) == count and whole.left_by(count, change) <= 0.005
    at = np.linspace(first, last, 41)
    share = whole.shares(numbers, at)
    np.testing.assert_allclose(share.sum(axis=0), 1.0, rtol=1e-12)
    t = (at - (first + last) / 2) / (last - first) * 2
    own = (numbers - (first + last) / 2) / (last - first) * 2
    wave = np.exp(1j * whole.FOLLOWED * change * t)
    assert np.abs(np.exp(1j * whole.FOLLOWED * change * own) @ share - wave).max() < 0.01


def test_a_pupil_wider_than_its_period_is_refused():
    lattice = half.half_lattice((20.0, 20.0), 1.2 * BLUR_UM, 2.4)
    with pytest.raises(ValueError, match="wider than a period"):
        whole.drawn_pupil(pupil(), 550.0, lattice)
