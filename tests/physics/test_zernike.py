"""Zernike: orthonormal, indexed as OSA/ANSI, signs and sizes of the common terms."""

import numpy as np
import pytest

from isethdr_core.physics.zernike import order, steepest_slope_um, wavefront_um, zernike


def disk(rings=24, spokes=64):
    """Quadrature points over the unit disk, exact for the polynomials used: Gauss-Legendre in rho^2, uniform in angle."""
    node, weight = np.polynomial.legendre.leggauss(rings)
    rho, angle = np.sqrt((node + 1) / 2), 2 * np.pi * np.arange(spokes) / spokes
    return (
        rho[:, None] * np.cos(angle),
        rho[:, None] * np.sin(angle),
        np.broadcast_to(weight[:, None] / 2 / spokes, (rings, spokes)),
    )


def test_orthonormal_over_the_disk():
    x, y, w = disk()
    z = np.array([zernike(j, x, y) for j in range(28)])
    gram = np.einsum("iab,jab,ab->ij", z, z, w)
    np.testing.assert_allclose(gram, np.eye(28), atol=1e-11)  # rounding of sums of 1536 products


def test_osa_index():
    assert [order(j) for j in (0, 1, 2, 3, 4, 5, 8, 12)] == [(0, 0), (1, -1), (1, 1), (2, -2), (2, 0), (2, 2), (3, 1), (4, 0)]
    with pytest.raises(ValueError, match="OSA"):
        order(-1)


def test_closed_forms():
    r, t = 0.7, 0.4
    x, y = r * np.cos(t), r * np.sin(t)
    want = {
        1: 2 * r * np.sin(t),
        2: 2 * r * np.cos(t),
        3: 6**0.5 * r**2 * np.sin(2 * t),
        4: 3**0.5 * (2 * r**2 - 1),
        5: 6**0.5 * r**2 * np.cos(2 * t),
        8: 8**0.5 * (3 * r**3 - 2 * r) * np.cos(t),
        12: 5**0.5 * (6 * r**4 - 6 * r**2 + 1),
    }
    for j, value in want.items():
        assert zernike(j, x, y) == pytest.approx(value, abs=1e-13)


def test_grid_equals_sum_of_terms_and_slope_is_that_of_defocus():
    x, y = np.linspace(-1, 1, 7), np.linspace(-0.9, 0.8, 5)
    c = {2: 0.3, 4: -0.2, 13: 0.05}
    want = sum(v * zernike(j, x[None, :], y[:, None]) for j, v in c.items())
    np.testing.assert_allclose(wavefront_um(c, x, y), want, atol=1e-14)
    assert steepest_slope_um({4: 0.1}) == pytest.approx(0.1 * 4 * 3**0.5, rel=1e-3)  # d/dr sqrt3 (2 r^2 - 1) at the rim; sampled
    assert np.all(wavefront_um({}, x, y) == 0)
