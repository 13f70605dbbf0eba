"""Rims: vignetting of a prescription, as the part of the exit pupil that light off the axis fills.

Seen from the stop, the rim of another surface is nearly a circle. It is so too in the units of the
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

# of the places in the stop that are looked at
RADII = 48
AZIMUTHS = 180
BEYOND = 1.1  # stop radii: rays that a crossing is looked for among
HALVINGS = 30
LEAST = 0.01  # of the stop's area
TOUCHED = 1e-6  # of a rim's radius: how far beyond it a beam of the same size comes out


@lru_cache(maxsize=256)
def rims(lens: Prescription, tangent: float) -> tuple[tuple[tuple[float, float], ...], float]:
    """Return the discs (x, radius), centred on the meridional plane, that cut the stop for light
    from a field tangent along +x.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    tangent : of the field angle, 0 or above.

    Returns
    -------
    Discs in radii of the stop; and the largest distance of a grazing ray from its disc's border, in
    the same unit. No discs where only the stop itself limits the beam, nor where rims leave less
    than `LEAST` of it: next to no light has no point spread worth knowing.
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
    """Return which of the masks (radius, azimuth) cut a place that none of the others does; one of
    those that are the same.
    """
    needed = list(range(len(cuts)))
    for n in sorted(needed, key=lambda n: cuts[n].sum()):
        others = [cuts[m] for m in needed if m != n]
        if others and not np.any(cuts[n] & ~np.any(others, axis=0)):
            needed.remove(n)
    return needed


def _heights(basis: np.ndarray, hits: Sequence[list[np.ndarray]]) -> list:
    """Return a function of places (x, y) in the stop for every surface: how far out rays cross it
    there, 1 on its rim.

    `hits` : per surface (x, y) of the rays that the basis was taken at.
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
    """Return the places (x, y) in the stop, on straight lines from (x0, y0), where `height` passes
    1.
    """
    turn = (np.arange(AZIMUTHS) + 0.5) * 2 * np.pi / AZIMUTHS
    dx = np.cos(turn)
    dy = np.sin(turn)
    along = x0 * dx + y0 * dy
    reach = -along + np.sqrt(along**2 + 1 - x0**2 - y0**2)  # to the border of the stop
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
    """Return the centre on the x axis and the radius of the circle nearest to points, and the
    distance of the farthest from it.
    """
    # a sliver between two lines from the start: narrower than some degrees of the stop's border
    if len(x) < 3:
        return 0.0, 1.0, 0.0
    (twice, constant), *_ = np.linalg.lstsq(
        np.stack([2 * x, np.ones_like(x)], axis=1), x**2 + y**2, rcond=None
    )
    radius = float(np.sqrt(constant + twice**2))
    return float(twice), radius, float(np.abs(np.hypot(x - twice, y) - radius).max())
