"""Amplitude over the exit pupil of a prescription for a uniform incoming beam, as Zernike
coefficients.

The point spread is the Fourier transform of the amplitude over direction cosines at the image. The
power per area of direction cosines is the product of three factors: the power per area of the
incoming beam, the area of that beam per area of direction cosines (a Jacobian), and the
transmittance of surfaces and coatings along the ray. The amplitude is the square root of this
product. A lens that obeys the sine condition also off the axis, which means a lens without coma,
has a uniform amplitude here (Abbe; Born and Wolf 1999, section 4.5), even if the beam does not fill
its stop uniformly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.physics.optics.ray_trace import follow, sequential
from isethdr_core.physics.optics.zernike import order, polynomial, zernike_basis

from .coatings import Powers
from .exit_pupil import pupil_rays
from .rays import HIGHEST, entering, fitted

if TYPE_CHECKING:
    from .prescription import Prescription

# numbers of radii and azimuths in the exit pupil at which the amplitude is evaluated
RADII = 24
AZIMUTHS = 48
STEP = 1e-4  # step of numerical derivatives, radii of the exit pupil
LEAST = 1e-7  # least coefficient that is kept; smaller ones are rounding errors


@lru_cache(maxsize=256)
def amplitude(
    lens: Prescription, tangent: float, wavelength_nm: float
) -> tuple[tuple[tuple[int, float], ...], float]:
    """Return the amplitude over the exit pupil, ((OSA index, value), ...), and its rms variation.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped. Vignetting is not included.
    tangent : tangent of the field angle, along +x.
    wavelength_nm : wavelength, nm.

    Raises
    ------
    ConfigError : too few rays of that direction reach the sensor.

    Notes
    -----
    The mean square over the exit pupil is 1. Terms odd in y, which a rotationally symmetric lens
    cannot have, are not fitted. Light is unpolarised.
    """
    (_, _, within), pupil, *_ = pupil_rays(lens, tangent, wavelength_nm)
    start = entering(lens, wavelength_nm, tangent)
    passed = follow(
        lens.surfaces,
        lens.indices(wavelength_nm),
        sequential(len(lens.surfaces)),
        start,
        _power(lens, wavelength_nm),
    )
    places = [s[within] for s in pupil]
    even, odd = (
        [j for j in range((HIGHEST + 1) * (HIGHEST + 2) // 2) if (order(j)[1] >= 0) == kind]
        for kind in (True, False)
    )
    enters_x = _fit(even, places, start.position_mm[0][within])
    enters_y = _fit(odd, places, start.position_mm[1][within])
    transmits = _fit(even, places, passed.weight[within])
    # points that represent equal areas
    radius, turn = np.meshgrid(
        np.sqrt((np.arange(RADII) + 0.5) / RADII), 2 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    )
    x = (radius * np.cos(turn)).ravel()
    y = (radius * np.sin(turn)).ravel()
    power = _area(enters_x, enters_y, x, y) * _at(transmits, x, y)
    relative_amplitude = np.sqrt(power / power.mean())
    fit = _fit(even, (x, y), relative_amplitude)
    return tuple((j, c) for j, c in fit.items() if abs(c) > LEAST), float(
        np.std(relative_amplitude)
    )


def _power(lens: Prescription, wavelength_nm: float) -> Callable[..., Any]:
    powers = Powers(lens, wavelength_nm)

    def transmitted(
        k: int, reflects: bool, forward: bool, cosine: np.ndarray
    ) -> float | np.ndarray:
        passed = powers(k, reflects, forward, cosine[None])
        return passed if np.isscalar(passed) else passed[0]

    return transmitted


def _fit(
    terms: Sequence[int], places: Sequence[np.ndarray], values: np.ndarray
) -> dict[int, float]:
    return dict(zip(terms, map(float, fitted(zernike_basis(terms, *places), values))))


def _at(terms: dict[int, float], x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.polynomial.polynomial.polyval2d(x, y, polynomial(terms))


def _area(
    first: dict[int, float], second: dict[int, float], x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """Return the Jacobian of two functions of the position in the exit pupil."""
    (xx, xy), (yx, yy) = (_slopes(terms, x, y) for terms in (first, second))
    return np.abs(xx * yy - xy * yx)


def _slopes(terms: dict[int, float], x: np.ndarray, y: np.ndarray) -> Iterator[Any]:
    return (
        (_at(terms, x + a, y + b) - _at(terms, x - a, y - b)) / (2 * STEP)
        for a, b in ((STEP, 0.0), (0.0, STEP))
    )
