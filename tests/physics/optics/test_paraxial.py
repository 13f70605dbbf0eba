"""Paraxial matrices against hand values of a singlet, its pupils, and the ghost of a thin lens."""

import numpy as np
import pytest

from isethdr_core.physics.optics.paraxial import (
    back_focus_mm,
    entrance_pupil,
    focal_length_mm,
    matrices,
)
from isethdr_core.physics.optics.ray_trace import ghost_path
from isethdr_core.physics.optics.surfaces import Surface


def test_singlet_by_hand():
    r1 = 50.0
    r2 = -80.0
    t = 6.0
    n = 1.5
    surfaces = [Surface(0.0, 1 / r1), Surface(t, 1 / r2)]
    indices = [1.0, n, 1.0]
    power = (n - 1) * (1 / r1 - 1 / r2 + (n - 1) * t / (n * r1 * r2))  # the lens maker's equation
    assert focal_length_mm(surfaces, indices) == pytest.approx(1 / power, rel=1e-12)
    assert back_focus_mm(surfaces, indices) == pytest.approx(
        (1 - (n - 1) * t / (n * r1)) / power, rel=1e-12
    )
    assert focal_length_mm([Surface(0.0), Surface(2.0)], indices) == float("inf")  # a plane plate


def test_determinant_is_the_ratio_of_indices_forwards_and_back():
    surfaces = [Surface(0.0, 0.03), Surface(4.0, -0.02), Surface(9.0, 0.01)]
    indices = [1.0, 1.6, 1.2, 1.4]
    for path in ([(0, False), (1, False), (2, False)], ghost_path(3, 2, 0), ghost_path(3, 1, 0)):
        assert np.linalg.det(matrices(surfaces, indices, path, -3.0)[-1]) == pytest.approx(
            1 / 1.4, rel=1e-12
        )


@pytest.mark.parametrize("n", [1.5, 1.8])
def test_the_ghost_of_a_thin_lens_by_hand(n):
    """Compare with the closed form: the ghost by two reflections inside a thin lens has
    (3 n - 1) / (n - 1) times the power of the lens, 7 times for n = 1.5.
    """
    surfaces = [Surface(0.0, 0.02), Surface(1e-9, -0.01)]
    indices = [1.0, n, 1.0]
    ghost = -matrices(surfaces, indices, ghost_path(2, 1, 0), 0.0)[-1][1, 0]
    assert ghost * focal_length_mm(surfaces, indices) == pytest.approx(
        (3 * n - 1) / (n - 1), rel=1e-8
    )


def test_entrance_pupil_of_a_stop_behind_a_thin_lens():
    f = 50.0
    d = 10.0
    surfaces = [
        Surface(0.0, 1 / f),
        Surface(1e-12, -1 / f),
        Surface(d, semi_diameter_mm=4.0, is_stop=True),
    ]
    z, radius = entrance_pupil(surfaces, [1.0, 1.5, 1.0, 1.0])  # a lens of focal length f
    assert z == pytest.approx(d / (1 - d / f), rel=1e-9)
    assert radius == pytest.approx(4.0 / (1 - d / f), rel=1e-9)
