"""Zernike: wavefronts from OSA/ANSI coefficients (ANSI Z80.28-2017; Thibos et al. 2002, J. Refract.
Surg. 18, S652).

The single index is j = (n (n + 2) + m) / 2, from 0. The polynomials are orthonormal over the unit
disk, so that a coefficient in micrometres is its contribution to the rms of the wavefront. Low
orders are computed from powers of x and y; a grid then costs one small matrix product. At high
orders these powers cancel (the error is 1e-8 at order 20, and no digit is left at order 50), so
that these orders are computed by recurrence.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache, lru_cache
from math import comb, factorial, isqrt, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

HIGHEST_ORDER = 40  # highest radial degree for which the mean phase of pupil cells was tested
LAST_INDEX = HIGHEST_ORDER * (HIGHEST_ORDER + 3) // 2
# highest order that is computed from powers of x and y; the largest error over the disk is 3e-12
POWERS_ORDER = 12
# least numbers of radii and angles of the disk in a search for the largest slope
RADII = 65
ANGLES = 180


def order(j: int) -> tuple[int, int]:
    """Return (n, m), radial degree and signed angular frequency, of the OSA index `j`.

    Raises
    ------
    ValueError : `j` is not a whole number from 0 to `LAST_INDEX`.
    """
    if not 0 <= j <= LAST_INDEX or j != int(j):
        raise ValueError(
            f"Zernike index {j!r}; expected an OSA/ANSI index 0, 1, 2, ... (4 is defocus) up to"
            f" {LAST_INDEX}, the last of radial order {HIGHEST_ORDER}"
        )
    n = (isqrt(8 * int(j) + 1) - 1) // 2
    return n, 2 * int(j) - n * (n + 2)


@cache
def _powers(j: int) -> np.ndarray:
    """Return the coefficients c[k, l] of Z_j = sum c[k, l] x^k y^l. Terms with m < 0 are the sine
    terms.
    """
    n, m = order(j)
    out = np.zeros((n + 1, n + 1))
    norm = sqrt(n + 1) if m == 0 else sqrt(2 * (n + 1))
    a = abs(m)
    angular = {}  # of (x + i y)^|m|: the real part rho^|m| cos, or the imaginary part rho^|m| sin
    for t in range(a + 1):
        if t % 2 == (1 if m < 0 else 0):
            angular[(a - t, t)] = comb(a, t) * (-1) ** (t // 2)
    for s in range((n - a) // 2 + 1):
        radial = (
            (-1) ** s
            * factorial(n - s)
            // (factorial(s) * factorial((n + a) // 2 - s) * factorial((n - a) // 2 - s))
        )
        h = (n - a) // 2 - s  # rho^(n - 2s) = rho^|m| (x^2 + y^2)^h
        for q in range(h + 1):
            for (px, py), c in angular.items():
                out[px + 2 * (h - q), py + 2 * q] += norm * radial * comb(h, q) * c
    return out


class Terms(NamedTuple):
    """Coefficients of all terms with the same |m|: W = rho^|m| sum over k of P_k(2 rho^2 - 1)
    (cosine[k] cos m theta + sine[k] sin m theta).
    """

    cosine: np.ndarray
    sine: np.ndarray


def zernike(j: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return Z_j at points of the pupil plane.

    Parameters
    ----------
    j : OSA/ANSI index, from 0.
    x, y : positions in pupil radii; any shapes that broadcast.
    """
    return wavefront_at({j: 1.0}, x, y)


def wavefront_at(zernike_um: dict[int, float], x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the optical path difference at points, in micrometres.

    Parameters
    ----------
    zernike_um : {OSA index: coefficient in micrometres}.
    x, y : positions in pupil radii (broadcast); the polynomials continue beyond the disk.

    Notes
    -----
    R_n^m(rho) = rho^m P_k(2 rho^2 - 1), k = (n - m) / 2, with the Jacobi polynomials P_k of
    parameters (0, m) (Born and Wolf 1999, section 9.2.1). Their three-term recurrence (see
    `jacobi`) is stable, as are those of Kintner (1976, Opt. Acta 23, 679) and of Prata and Rusch
    (1989, Appl. Opt. 28, 749).
    """
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    t = 2 * (x * x + y * y) - 1
    # real and imaginary part of (x + i y)^m
    real = np.ones(x.shape)
    imaginary = np.zeros(x.shape)
    out = np.zeros(x.shape)
    by_frequency = _by_frequency(zernike_um)
    for m in range(max(by_frequency, default=-1) + 1):
        if m:
            real, imaginary = real * x - imaginary * y, real * y + imaginary * x
        if m in by_frequency:
            cosine, sine = by_frequency[m]
            for k, radial in enumerate(jacobi(len(cosine), 0, m, t)):
                if cosine[k]:
                    out += cosine[k] * (radial * real)
                if sine[k]:
                    out += sine[k] * (radial * imaginary)
    return out


def jacobi(count: int, a: int, b: int, t: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the values of Jacobi polynomials from degree 0 on, by the recurrence of DLMF 18.9.2
    (Szego 1975, eq. 4.5.1).

    Parameters
    ----------
    count : number of polynomials; the last has the degree count - 1.
    a, b : parameters of the polynomials.
    t : arguments, any shape; the polynomials are orthogonal from -1 to 1.
    """
    before = np.zeros(np.shape(t))
    now = np.ones(np.shape(t))
    for k in range(count):
        yield now
        if k == 0:
            before = now
            now = (a + 1) + (a + b + 2) / 2 * (t - 1)
            continue
        n = k + 1
        c = 2 * (k + 1) + a + b
        scale = 2 * n * (n + a + b) * (c - 2)
        along = (c - 1) * c * (c - 2) / scale * t + (c - 1) * (a * a - b * b) / scale
        before, now = now, along * now - 2 * (n + a - 1) * (n + b - 1) * c / scale * before


def _by_frequency(zernike_um: dict[int, float]) -> dict[int, Terms]:
    """Return {|m|: normalised coefficients, ordered by k = (n - |m|) / 2} of the terms that are not
    0.
    """
    terms = [(*order(j), value) for j, value in zernike_um.items() if value != 0]
    out = {}
    for m in sorted({abs(m) for _, m, _ in terms}):
        count = 1 + max((n - m) // 2 for n, own, _ in terms if abs(own) == m)
        out[m] = Terms(np.zeros(count), np.zeros(count))
    for n, m, value in terms:
        norm = sqrt(n + 1) if m == 0 else sqrt(2 * (n + 1))
        part = out[abs(m)].cosine if m >= 0 else out[abs(m)].sine
        part[(n - abs(m)) // 2] += norm * value
    return out


def zernike_basis(terms: Sequence[int], x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the values (point, term) of several terms at points of the pupil plane.

    Parameters
    ----------
    terms : OSA/ANSI indices of the terms.
    x, y : (point,) positions in pupil radii.
    """
    terms = tuple(int(j) for j in terms)
    degree = max(order(j)[0] for j in terms)
    powers_x, powers_y = (
        np.vander(np.asarray(a, float), degree + 1, increasing=True) for a in (x, y)
    )
    products = np.stack(
        [powers_x[:, k] * powers_y[:, n - k] for n in range(degree + 1) for k in range(n + 1)],
        axis=1,
    )
    return products @ _coefficients(terms, degree)


@lru_cache(maxsize=64)
def _coefficients(terms: tuple[int, ...], degree: int) -> np.ndarray:
    """Return the coefficients (product of powers, term) of terms. The products have the order of
    `zernike_basis`.
    """
    out = np.zeros((_terms_to(degree), len(terms)))
    for column, j in enumerate(terms):
        powers = _powers(j)
        row = 0
        for n in range(degree + 1):
            for k in range(n + 1):
                if n < len(powers):
                    out[row, column] = powers[k, n - k]
                row += 1
    return out


def wavefront_um(zernike_um: dict[int, float], x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the optical path difference on a grid.

    Parameters
    ----------
    zernike_um : {OSA index: coefficient in micrometres}.
    x, y : the grid's axes in pupil radii, (nx,) and (ny,); the polynomials continue beyond the
        disk.

    Returns
    -------
    (ny, nx) float64, micrometres. Positive tilt along x moves the image to larger x (see
    `diffraction`).
    """
    x = np.asarray(x, float)
    y = np.asarray(y, float)
    low = {j: value for j, value in zernike_um.items() if order(j)[0] <= POWERS_ORDER}
    high = {j: value for j, value in zernike_um.items() if j not in low}
    c = polynomial(low)
    powers_x = np.vander(x, len(c), increasing=True).T
    powers_y = np.vander(y, len(c), increasing=True)
    out = (powers_y @ c.T) @ powers_x
    return out + wavefront_at(high, x, y[:, None]) if high else out


def steepest_slope_um(zernike_um: dict[int, float]) -> float:
    """Return the largest gradient of the wavefront over the unit disk, micrometres per pupil
    radius.

    The disk is sampled so densely that the result is at most 8 % too small for a maximum between
    samples. A maximum at the rim is found exactly.
    """
    return float(slopes_um(zernike_um).largest.max())


class Slopes(NamedTuple):
    """The largest gradient of a wavefront at each distance from the axis."""

    rho: np.ndarray  # distance from the axis, pupil radii
    largest: np.ndarray  # largest gradient, micrometres per pupil radius


def slopes_um(zernike_um: dict[int, float]) -> Slopes:
    """Return the largest gradient of the wavefront at distances from the axis, from 0 to the
    rim.
    """
    sampled = _on_the_disk(zernike_um)
    return Slopes(sampled.rho, np.hypot(sampled.along, sampled.across).max(axis=1))


def largest_um(zernike_um: dict[int, float]) -> float:
    """Return the largest magnitude of the wavefront over the unit disk, micrometres, with the
    sampling of `steepest_slope_um`.
    """
    return float(np.abs(_on_the_disk(zernike_um).values).max())


class _Sampled(NamedTuple):
    """A wavefront sampled over the disk."""

    rho: np.ndarray  # (radius,) pupil radii
    values: np.ndarray  # (radius, angle) micrometres
    along: np.ndarray  # (radius, angle) slope along the radius, micrometres per pupil radius
    across: np.ndarray  # (radius, angle) slope across the radius, micrometres per pupil radius


def _on_the_disk(zernike_um: dict[int, float]) -> _Sampled:
    """Sample a wavefront at least eight times per oscillation. Radii are denser towards the rim,
    where oscillations are shorter.
    """
    by_frequency = _by_frequency(zernike_um)
    highest = max((2 * len(terms.cosine) + m for m, terms in by_frequency.items()), default=0)
    rho = np.cos(np.linspace(np.pi / 2, 0, max(RADII, 4 * highest + 1)))[:, None]
    theta = np.linspace(0, 2 * np.pi, max(ANGLES, 8 * highest), endpoint=False)
    t = 2 * rho * rho - 1
    values, along, across = np.zeros((3, len(rho), len(theta)))
    for m, (cosine, sine) in by_frequency.items():
        radial, slope = np.zeros((2, len(rho), 2))
        pairs = np.stack([cosine, sine], axis=1)
        for pair, polynomial_k in zip(pairs, jacobi(len(pairs), 0, m, t)):
            radial += pair * polynomial_k
        for k, (pair, derived) in enumerate(zip(pairs[1:], jacobi(len(pairs) - 1, 1, m + 1, t)), 1):
            slope += pair * ((k + m + 1) / 2) * derived  # DLMF 18.9.15
        angular = np.stack([np.cos(m * theta), np.sin(m * theta)])
        turned = np.stack([-np.sin(m * theta), np.cos(m * theta)])
        over_rho = m * rho ** max(m - 1, 0) * radial
        values += rho**m * radial @ angular
        along += (over_rho + 4 * rho ** (m + 1) * slope) @ angular
        across += over_rho @ turned
    return _Sampled(rho[:, 0], values, along, across)


def rotated(zernike_um: dict[int, float], angle_rad: float) -> dict[int, float]:
    """Return the coefficients of a wavefront that is rotated by `angle_rad` counter-clockwise, y
    up: W(rho, theta - angle).
    """
    out: dict[int, float] = {}
    for j, value in zernike_um.items():
        n, m = order(int(j))
        a = abs(m)
        cosine = value * np.cos(a * angle_rad)
        sine = value * np.sin(a * angle_rad)
        for k, part in ((a, cosine), (-a, sine)) if m >= 0 else ((-a, cosine), (a, -sine)):
            if part != 0 and (k or m == 0):
                i = (n * (n + 2) + k) // 2
                out[i] = out.get(i, 0.0) + float(part)
    return out


def mapped(zernike_um: dict[int, float], matrix: ArrayLike) -> dict[int, float]:
    """Return the coefficients of a wavefront after a linear map of its coordinates.

    The value of the result at `matrix` (x, y) is the value of the given wavefront at (x, y).

    Parameters
    ----------
    zernike_um : {OSA index: um}, of order `POWERS_ORDER` at most.
    matrix : ((xx, xy), (yx, yy)), invertible, y up. Polynomials continue beyond the unit disk.
    """
    if not zernike_um:
        return {}
    count = _terms_to(max(order(int(j))[0] for j in zernike_um))
    coefficients = np.array([zernike_um.get(j, 0.0) for j in range(count)])
    return dict(
        enumerate((_substitution(tuple(map(tuple, matrix)), count) @ coefficients).tolist())
    )


def _terms_to(degree: int) -> int:
    return (degree + 1) * (degree + 2) // 2


@lru_cache(maxsize=256)
def _substitution(
    matrix: tuple[tuple[float, float], tuple[float, float]], count: int
) -> np.ndarray:
    """Return the matrix (new, old) of coefficients after replacing (x, y) by `matrix`^-1 (x, y).

    The degree of a polynomial does not change. It is determined by least squares from its values at
    more points than there are terms.
    """
    radius = np.sqrt((np.arange(count) + 0.5) / count)
    # sunflower pattern, in which no two points have the same azimuth
    turn = np.pi * (3 - 5**0.5) * np.arange(count)
    radius = np.concatenate([radius, radius])
    turn = np.concatenate([turn, turn + 1.0])
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn)])
    mapped_points = np.linalg.inv(np.array(matrix, float)) @ points
    new, basis_values = (zernike_basis(range(count), *at) for at in (points, mapped_points))
    return np.linalg.lstsq(new, basis_values, rcond=None)[0]


def polynomial(zernike_um: dict[int, float]) -> np.ndarray:
    """Return the coefficients c[k, l], micrometres, of a wavefront {OSA index: um} as the sum of
    c x^k y^l, with x and y in pupil radii.
    """
    size = 1 + max((order(j)[0] for j in zernike_um), default=0)
    c = np.zeros((size, size))
    for j, value in zernike_um.items():
        p = _powers(int(j))
        c[: len(p), : len(p)] += value * p
    return c
