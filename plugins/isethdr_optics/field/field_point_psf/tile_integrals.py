"""Tile integrals: the light from one tile to another, from fine samples of a pattern."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array

if TYPE_CHECKING:
    from numpy.polynomial.polynomial import Polynomial

    from .pattern_samples import Pattern


def tiles(
    pattern: Pattern, scale: float, pitch_um: tuple[float, float], half: tuple[int, int]
) -> np.ndarray:
    """Return the light from one tile to another, (y, x).

    Parameters
    ----------
    pattern : samples of a pattern.
    scale : factor on the pitch of the tiles, in place of scaling the pattern by 1 / `scale`.
    pitch_um : (y, x) pitch of the tiles, um.
    half : (y, x) tiles from the axis to the border of the kernel.
    """
    size = pattern.samples.shape[0]
    if pitch_um[0] == pitch_um[1]:
        most = max(half)
        weights = triangles(most, scale * pitch_um[0], pattern.step_um, size)
        down, across = (weights[most - h : most + h + 1] for h in half)
    else:
        down, across = (
            triangles(h, scale * p, pattern.step_um, size) for h, p in zip(half, pitch_um)
        )
    # the cubic's overshoot could give negative light, though none was found
    return np.maximum((across @ (down @ pattern.samples).T).T, 0.0)


def triangles(half: int, pitch_um: float, step_um: float, size: int) -> csr_array:
    """Return sparse weights (tile, sample) that integrate a sampled function over a triangle, two
    tiles wide, about every tile.

    The function is interpolated between samples by the cubic of Keys (1981, IEEE Trans. ASSP 29,
    1153). A triangle is a sum of three ramps, so that its integral is the sum of three integrals of
    ramps. They are exact, also at the kinks.

    Parameters
    ----------
    half : number of tiles from the axis to the border.
    pitch_um : pitch of the tiles, um.
    step_um : distance between samples, um.
    size : number of samples, with the axis at index size // 2.
    """
    wide = pitch_um / step_um
    at = np.arange(-half, half + 1) * wide + size // 2
    taps = int(2 * wide) + 5
    point = np.ceil(at - wide - 2).astype(np.intp)[:, None] + np.arange(taps)
    distance = point - at[:, None]
    inside = (point >= 0) & (point < size)
    second_difference = ramp(distance + wide) - 2 * ramp(distance) + ramp(distance - wide)
    weight = second_difference / wide * inside
    return csr_array(
        (
            weight.ravel().astype(np.float32),
            point.clip(0, size - 1).ravel(),
            np.arange(len(at) + 1) * taps,
        ),
        (len(at), size),
    )


def ramp(at: np.ndarray) -> np.ndarray:
    """Return the integral over t of max(at - t, 0) times Keys's cubic at t. It differs from a ramp
    only within two samples on either side of the kink.
    """
    t = np.minimum(np.abs(at), 2.0)
    return np.maximum(at, 0.0) + np.where(t < 1, INNER(t), OUTER(t))


def _ramps() -> tuple[Polynomial, Polynomial]:
    """Return the polynomials that Keys's cubic adds to a ramp within one sample of its kink, and
    from one to two samples: second integrals of the cubic, taken from the outside to the kink.
    """
    inner = np.polynomial.Polynomial([1, 0, -2.5, 1.5])
    outer = np.polynomial.Polynomial([2, -4, 2.5, -0.5])
    outer_integral = outer.integ(2, lbnd=2)
    slope = outer_integral.deriv()(1)
    value = outer_integral(1)
    inner_integral = inner.integ(lbnd=1) + slope
    return inner_integral.integ(lbnd=1) + value, outer_integral


INNER, OUTER = _ramps()
