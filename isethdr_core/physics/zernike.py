"""Zernike: wavefronts from OSA/ANSI coefficients (ANSI Z80.28-2017; Thibos et al. 2002, J. Refract. Surg. 18, S652).

Single index j = (n (n + 2) + m) / 2 from 0; orthonormal over the unit disk, so a coefficient in micrometres is the
rms it adds to the wavefront. Polynomials are kept in powers of x and y: a grid then costs one small matrix product.
"""

from __future__ import annotations

from functools import cache
from math import comb, factorial, isqrt, sqrt

import numpy as np


def order(j: int) -> tuple[int, int]:
    """Return (n, m), radial degree and signed angular frequency, of the OSA index `j`."""
    if j != int(j) or j < 0:
        raise ValueError(f"Zernike index {j!r}; expected an OSA/ANSI index 0, 1, 2, ... (4 is defocus)")
    n = (isqrt(8 * int(j) + 1) - 1) // 2
    return n, 2 * int(j) - n * (n + 2)


@cache
def _powers(j: int) -> np.ndarray:
    """Return c[k, l] such that Z_j = sum c[k, l] x^k y^l; m < 0 are the sine terms."""
    n, m = order(j)
    out = np.zeros((n + 1, n + 1))
    norm = sqrt(n + 1) if m == 0 else sqrt(2 * (n + 1))
    a = abs(m)
    angular = {}  # (x + i y)^|m|: real part is rho^m cos, imaginary part rho^m sin
    for t in range(a + 1):
        if t % 2 == (1 if m < 0 else 0):
            angular[(a - t, t)] = comb(a, t) * (-1) ** (t // 2)
    for s in range((n - a) // 2 + 1):
        radial = (-1) ** s * factorial(n - s) // (factorial(s) * factorial((n + a) // 2 - s) * factorial((n - a) // 2 - s))
        h = (n - a) // 2 - s  # rho^(n - 2s) = rho^|m| (x^2 + y^2)^h
        for q in range(h + 1):
            for (px, py), c in angular.items():
                out[px + 2 * (h - q), py + 2 * q] += norm * radial * comb(h, q) * c
    return out


def zernike(j: int, x, y) -> np.ndarray:
    """Return Z_j at points of the pupil plane, `x` and `y` in pupil radii (broadcast)."""
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    return np.polynomial.polynomial.polyval2d(x, y, _powers(j))


def wavefront_um(zernike_um, x, y) -> np.ndarray:
    """Return the optical path difference on a grid.

    Parameters
    ----------
    zernike_um : {OSA index: coefficient in micrometres}.
    x, y : the grid's axes in pupil radii, (nx,) and (ny,); the polynomials continue beyond the disk.

    Returns
    -------
    (ny, nx) float64, micrometres. Positive tilt along x moves the image to larger x (see `diffraction`).
    """
    c = polynomial(zernike_um)
    powers_x = np.vander(np.asarray(x, float), len(c), increasing=True).T
    powers_y = np.vander(np.asarray(y, float), len(c), increasing=True)
    return (powers_y @ c.T) @ powers_x


def steepest_slope_um(zernike_um) -> float:
    """Return the largest gradient of the wavefront over the unit disk, micrometres per pupil radius."""
    from numpy.polynomial.polynomial import polyder, polyval2d

    c = polynomial(zernike_um)
    if len(c) < 2:
        return 0.0
    radius, angle = np.meshgrid(np.linspace(0, 1, 65), np.linspace(0, 2 * np.pi, 181))
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    return float(np.hypot(polyval2d(x, y, polyder(c, axis=0)), polyval2d(x, y, polyder(c, axis=1))).max())


def rotated(zernike_um, angle_rad: float) -> dict[int, float]:
    """Return the coefficients of a wavefront turned by `angle_rad` counter-clockwise, y up: W(rho, theta - angle)."""
    out: dict[int, float] = {}
    for j, value in zernike_um.items():
        n, m = order(int(j))
        a = abs(m)
        cosine, sine = value * np.cos(a * angle_rad), value * np.sin(a * angle_rad)
        for k, part in ((a, cosine), (-a, sine)) if m >= 0 else ((-a, cosine), (a, -sine)):
            if part != 0 and (k or m == 0):
                i = (n * (n + 2) + k) // 2
                out[i] = out.get(i, 0.0) + float(part)
    return out


def polynomial(zernike_um) -> np.ndarray:
    """Return c[k, l] such that the wavefront of {OSA index: um} is the sum of c x^k y^l, micrometres, x and y in pupil radii."""
    size = 1 + max((order(j)[0] for j in zernike_um), default=0)
    c = np.zeros((size, size))
    for j, value in zernike_um.items():
        p = _powers(int(j))
        c[: len(p), : len(p)] += value * p
    return c
