"""Horizontal illuminance by sun and moon, as functions of their altitude.

The fits are those of Janiczek and DeYoung (1987), Computer programs for sun and moon illuminance,
U.S. Naval Observatory Circular 171; printed again in Seidelmann (1992), Explanatory Supplement to
the Astronomical Almanac, section 9.34. They hold for a clear sky and include the light of the sky.
The altitude is that of the middle of the disc, without refraction. The authors state errors of 0.02
to 0.03 in the logarithm.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

# Pieces of the fits: least altitude, degrees, and coefficients of a polynomial in altitude / 90.
# The polynomial is the logarithm to base 10 of the illuminance, lx.
SUN = (
    (20.0, (3.74, 3.97, -4.07, 1.47)),
    (5.0, (3.05, 13.28, -45.98, 64.33)),
    (-0.8, (2.88, 22.26, -207.64, 1034.30)),
    (-5.0, (2.88, 21.81, -258.11, -858.36)),
    (-12.0, (2.70, 12.17, -431.69, -1899.83)),
    (-18.0, (13.84, 262.72, 1447.42, 2797.93)),
)
MOON = (
    (20.0, (-1.95, 4.06, -4.24, 1.56)),
    (5.0, (-2.58, 12.58, -42.58, 59.06)),
    (-0.8, (-2.79, 24.27, -252.95, 1321.29)),
)
NIGHT_DEG = -18.0  # end of astronomical twilight; the fit's 6.5e-4 lx there are those of the night
SET_DEG = -0.8  # least altitude of the fit of the moon


def sun_illuminance_lx(altitude_deg: npt.ArrayLike) -> np.ndarray:
    """Return the illuminance by the sun and the sky that it lights, lx, without the night sky.

    The value of the fit at -18 degrees is the light of a night without moon. It is subtracted, so
    that the result is 0 there.
    """
    altitude = np.asarray(altitude_deg, float)
    return np.maximum(_fit(SUN, altitude) - _fit(SUN, np.array(NIGHT_DEG)), 0.0)


def moon_illuminance_lx(altitude_deg: npt.ArrayLike, phase_deg: float = 0.0) -> np.ndarray:
    """Return the illuminance by the moon and the sky that it lights, lx, at its mean distance.

    `phase_deg` is the angle sun - moon - earth: 0 is full, 180 new. The fit ends at -0.8 degrees.
    Below, the illuminance decreases as that of the sun does.
    """
    altitude = np.asarray(altitude_deg, float)
    full = _fit(MOON, np.maximum(altitude, SET_DEG))
    full = full * np.where(
        altitude < SET_DEG,
        sun_illuminance_lx(np.minimum(altitude, SET_DEG)) / sun_illuminance_lx(SET_DEG),
        1.0,
    )
    return full * moon_phase_factor(phase_deg)


def moon_phase_factor(phase_deg: float) -> float:
    """Return the light of the moon relative to full moon: 10^(-8.68e-3 f - 2.2e-9 f^4).

    f is `phase_deg`, degrees.
    """
    return float(10 ** (-8.68e-3 * phase_deg - 2.2e-9 * phase_deg**4))


def _fit(
    pieces: Sequence[tuple[float, tuple[Any, ...]]], altitude: float | np.ndarray
) -> np.ndarray:
    """Return 10 to the power of the polynomial for each altitude; constant below the last piece."""
    altitude = np.maximum(altitude, pieces[-1][0])
    out = np.zeros(np.shape(altitude))
    upper = np.inf
    for least, factors in pieces:
        x = np.clip(altitude, least, min(upper, 90.0)) / 90
        inside = (altitude >= least) & (altitude < upper)
        out = np.where(inside, 10 ** np.polynomial.polynomial.polyval(x, factors), out)
        upper = least
    return out
