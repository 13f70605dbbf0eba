"""Rims: vignetting of a prescription, as the part of the exit pupil that light off the axis fills.

Seen from the stop, the rim of another surface is nearly a circle. This also holds in units of the
exit pupil, in which the stop is a unit disc. A circle is fitted to points where rays graze the rim.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.physics.optics.zernike import order, polynomial, zernike_basis

from .exit_pupil import pupil_rays
from .rays import HIGHEST, fitted

if TYPE_CHECKING:
    from .prescription import Prescription

# numbers of radii and azimuths in the stop at which rims are tested
RADII = 48
AZIMUTHS = 180
BEYOND = 1.1  # radii of the stop within which rays are fitted
HALVINGS = 30  # number of bisections that find where a ray grazes a rim
LEAST = 0.01  # least open share of the stop's area
# Distance beyond a rim, in radii of the rim, that does not count as vignetting. The fit puts a beam
# of exactly the rim's size this far outside.
TOUCHED = 1e-6


@lru_cache(maxsize=256)
def rims(lens: Prescription, tangent: float) -> tuple[tuple[tuple[float, float], ...], float]:
    """Return the discs (x, radius), centred on the meridional plane, that limit the stop for light
    from a field point on +x.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    tangent : tangent of the field angle, 0 or more.

    Returns
    -------
    Discs in radii of the stop; and the largest distance of a grazing ray from its disc's border, in
    the same unit. There are no discs if only the stop itself limits the beam, or if rims leave less
    than `LEAST` of the stop open: the point spread of so little light does not matter.
    """
    (rays, _, within), places, *_ = pupil_rays(lens, tangent, lens.reference_nm, BEYOND)
    u, v = (s[within] for s in places)
    radius, turn = np.meshgrid(
        (np.arange(RADII) + 1) / RADII, np.arange(AZIMUTHS) * 2 * np.pi / AZIMUTHS
    )
    grid = radius * np.cos(turn), radius * np.sin(turn)
    basis = zernike_basis(range((HIGHEST + 1) * (HIGHEST + 2) // 2), u, v)
    rimmed = [
        k
        for k, surface in enumerate(lens.surfaces[:-1])
        if not surface.is_stop and np.isfinite(surface.semi_diameter_mm)
    ]
    cuts = []
    discs = []
    worst = 0.0
    for height in _heights(
        basis,
        [[h[within] / lens.surfaces[k].semi_diameter_mm for h in rays.hits_mm[k]] for k in rimmed],
    ):
        heights = height(*grid)
        if heights.max() > 1 + TOUCHED:
            start = np.unravel_index(heights.argmin(), heights.shape)
            if heights[start] >= 1:
                return (), 0.0
            *disc, off = _circle(*_crossings(height, *(g[start] for g in grid)))
            cuts.append(heights > 1)
            discs.append(tuple(disc))
            worst = max(worst, off)
    if cuts and np.average(~np.any(cuts, axis=0), weights=radius) < LEAST:
        return (), 0.0
    return tuple(discs[n] for n in _needed(cuts)), worst


def _needed(cuts: Sequence[Any]) -> list[int]:
    """Return the indices of the masks (radius, azimuth) that cover a point that no other mask
    covers. Of equal masks one is kept.
    """
    needed = list(range(len(cuts)))
    for n in sorted(needed, key=lambda n: cuts[n].sum()):
        others = [cuts[m] for m in needed if m != n]
        if others and not np.any(cuts[n] & ~np.any(others, axis=0)):
            needed.remove(n)
    return needed


def _heights(basis: np.ndarray, hits: Sequence[list[np.ndarray]]) -> list:
    """Return a function for every surface: the height at which the ray through the point (x, y) of
    the stop crosses the surface, 1 on its rim.

    Parameters
    ----------
    basis : (ray, term) Zernike terms at the rays.
    hits : per surface, (x, y) of the rays, in radii of the rim.
    """
    if not hits:
        return []
    even = np.array([order(j)[1] >= 0 for j in range(basis.shape[1])])
    # y is odd in y
    across = [
        (np.flatnonzero(used), fitted(basis[:, used], np.stack(hit, axis=1)))
        for hit, used in zip(zip(*hits), (even, ~even))
    ]

    def one(k: int) -> Callable[..., Any]:
        powers = [
            polynomial(dict(zip(terms, coefficients[:, k]))) for terms, coefficients in across
        ]
        return lambda x, y: np.hypot(*(np.polynomial.polynomial.polyval2d(x, y, c) for c in powers))

    return [one(k) for k in range(len(hits))]


def _crossings(height: Callable[..., Any], x0: float, y0: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the points (x, y) of the stop, on straight lines from (x0, y0), where `height` crosses
    1.
    """
    turn = (np.arange(AZIMUTHS) + 0.5) * 2 * np.pi / AZIMUTHS
    dx = np.cos(turn)
    dy = np.sin(turn)
    along = x0 * dx + y0 * dy
    reach = -along + np.sqrt(along**2 + 1 - x0**2 - y0**2)  # distance to the border of the stop
    low = np.zeros(AZIMUTHS)
    high = reach
    cut = height(x0 + reach * dx, y0 + reach * dy) > 1
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        outside = height(x0 + middle * dx, y0 + middle * dy) > 1
        low = np.where(outside, low, middle)
        high = np.where(outside, middle, high)
    return x0 + low[cut] * dx[cut], y0 + low[cut] * dy[cut]


def _circle(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Return (centre on the x axis, radius, distance of the farthest point) of the circle that fits
    points.
    """
    # fewer than three points: the rim covers only a few degrees of the stop's border
    if len(x) < 3:
        return 0.0, 1.0, 0.0
    (twice, constant), *_ = np.linalg.lstsq(
        np.stack([2 * x, np.ones_like(x)], axis=1), x**2 + y**2, rcond=None
    )
    radius = float(np.sqrt(constant + twice**2))
    return float(twice), radius, float(np.abs(np.hypot(x - twice, y) - radius).max())
