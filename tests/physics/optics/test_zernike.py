"""Zernike: orthonormal, indexed as OSA/ANSI, signs and sizes of the common terms."""

from fractions import Fraction
from math import factorial

import numpy as np
import pytest

from isethdr_core.physics.optics.zernike import (
    HIGHEST_ORDER,
    LAST_INDEX,
    POWERS_ORDER,
    largest_um,
    mapped,
    order,
    polynomial,
    steepest_slope_um,
    wavefront_um,
    zernike,
    zernike_basis,
)

RATIONAL = (
    (Fraction(1), Fraction(0)),
    (Fraction(3, 5), Fraction(-4, 5)),
    (Fraction(-12, 25), Fraction(9, 25)),
    (Fraction(1, 50), Fraction(1, 70)),
)


def disk(rings=24, spokes=64):
    """Return quadrature points and weights over the unit disk, exact for the polynomials used.

    The rule is Gauss-Legendre in rho^2 and uniform in angle.
    """
    node, weight = np.polynomial.legendre.leggauss(rings)
    rho = np.sqrt((node + 1) / 2)
    angle = 2 * np.pi * np.arange(spokes) / spokes
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
    assert [order(j) for j in (0, 1, 2, 3, 4, 5, 8, 12)] == [
        (0, 0),
        (1, -1),
        (1, 1),
        (2, -2),
        (2, 0),
        (2, 2),
        (3, 1),
        (4, 0),
    ]
    with pytest.raises(ValueError, match="OSA"):
        order(-1)


def test_closed_forms():
    r = 0.7
    t = 0.4
    x = r * np.cos(t)
    y = r * np.sin(t)
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
    x = np.linspace(-1, 1, 7)
    y = np.linspace(-0.9, 0.8, 5)
    c = {2: 0.3, 4: -0.2, 13: 0.05}
    want = sum(v * zernike(j, x[None, :], y[:, None]) for j, v in c.items())
    np.testing.assert_allclose(wavefront_um(c, x, y), want, atol=1e-14)
    # d/dr sqrt3 (2 r^2 - 1) at the rim; 1e-3 since the slope is sampled
    assert steepest_slope_um({4: 0.1}) == pytest.approx(0.1 * 4 * 3**0.5, rel=1e-3)
    assert np.all(wavefront_um({}, x, y) == 0)


def exact(j: int, x: Fraction, y: Fraction) -> float:
    """Return Z_j by its sum of factorials (Born and Wolf 1999, eq. 9.2.5).

    The sum is in rational numbers, so only the result is rounded.
    """
    n, m = order(j)
    a = abs(m)
    squared = x * x + y * y
    radial = sum(
        (-1) ** s
        * factorial(n - s)
        * squared ** ((n - a) // 2 - s)
        / Fraction(factorial(s) * factorial((n + a) // 2 - s) * factorial((n - a) // 2 - s))
        for s in range((n - a) // 2 + 1)
    )
    real = Fraction(1)
    imaginary = Fraction(0)
    for _ in range(a):
        real, imaginary = real * x - imaginary * y, real * y + imaginary * x
    return (
        float(radial * (real if m >= 0 else imaginary)) * (n + 1 if m == 0 else 2 * (n + 1)) ** 0.5
    )


@pytest.mark.parametrize("j", [0, 13, 60, 71, 84, 100, 230, 600, 745, 820, 838, 840, 860])
def test_every_order_is_exact(j):
    x, y = np.array(RATIONAL, float).T
    want = [exact(j, *place) for place in RATIONAL]
    # values reach 9; the recurrence is accurate to 5e-13 at order 40
    np.testing.assert_allclose(zernike(j, x, y), want, rtol=0, atol=2e-12)


@pytest.mark.slow
def test_every_index_is_exact():
    x, y = np.array(RATIONAL, float).T
    want = np.array([[exact(j, *place) for place in RATIONAL] for j in range(LAST_INDEX + 1)])
    np.testing.assert_allclose(
        [zernike(j, x, y) for j in range(LAST_INDEX + 1)], want, rtol=0, atol=2e-12
    )


def test_grid_of_low_and_high_orders_is_their_sum():
    x = np.linspace(-0.7, 0.7, 6)
    y = np.linspace(-0.6, 0.7, 5)
    c = {4: 0.2, (POWERS_ORDER + 1) * (POWERS_ORDER + 2) // 2 - 1: 0.1, 700: -0.3}
    want = sum(v * zernike(j, x[None, :], y[:, None]) for j, v in c.items())
    # sums of powers at order 12 are accurate to 3e-12
    np.testing.assert_allclose(wavefront_um(c, x, y), want, rtol=0, atol=1e-11)


@pytest.mark.parametrize("j", [12, 71, 820, 840, 860])
def test_largest_slope_and_value_of_any_order(j):
    n, m = order(j)
    norm = (n + 1 if m == 0 else 2 * (n + 1)) ** 0.5
    # Slope and value are largest at the rim, where R = 1 and dR / d rho = (n (n + 2) - m^2) / 2.
    # Eight samples per oscillation miss at most 1 - cos(pi / 8).
    assert steepest_slope_um({j: 1.0}) == pytest.approx(
        norm * max((n * (n + 2) - m * m) / 2, abs(m)), rel=0.08
    )
    assert largest_um({j: 1.0}) == pytest.approx(norm, rel=0.08)


@pytest.mark.parametrize("j", [LAST_INDEX + 1, 10**6, 10**400, -1, 4.5, float("nan"), float("inf")])
def test_indices_beyond_the_last_are_refused(j):
    with pytest.raises(ValueError, match=f"{LAST_INDEX}.*{HIGHEST_ORDER}"):
        order(j)


def test_many_terms_at_once_are_the_single_terms():
    x, y = np.random.default_rng(0).uniform(-0.7, 0.7, (2, 40))
    terms = [44, 0, 5, 17, 3]
    wanted = np.stack([zernike(j, x, y) for j in terms], axis=1)
    # rounding of powers to the eighth
    np.testing.assert_allclose(zernike_basis(terms, x, y), wanted, atol=1e-12)


def test_a_mapped_wavefront_has_its_values_at_the_images_of_points():
    rng = np.random.default_rng(1)
    given = {j: float(rng.normal()) for j in range(1, 45)}
    matrix = np.array([[0.9, 0.05], [-0.04, 0.97]])
    points = rng.uniform(-0.7, 0.7, (2, 50))

    def at(terms, x, y):
        return np.polynomial.polynomial.polyval2d(x, y, polynomial(terms))

    # rounding of a least-squares solution for 45 terms
    np.testing.assert_allclose(
        at(mapped(given, matrix), *(matrix @ points)), at(given, *points), atol=1e-9
    )
    assert mapped({}, matrix) == {}
