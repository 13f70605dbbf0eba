"""Haze: a broad veil with the scatter function of Harvey-Shack or ABg.

With b = sin(angle) at normal incidence, the scatter function (BTDF, 1/sr) is proportional to

    harvey_shack   (1 + (b / shoulder)^2)^(-slope / 2)
    abg            1 / (1 + (b / shoulder)^slope)

Sources: Harvey 1976; Harvey, Schroder, Choi and Duparre 2012, eq. 3. The ABg function is
A / (B + b^g) with g = slope, B = shoulder^g and A = peak B.

Light per steradian is the scatter function times cos(angle). It is scaled so that the integral over
the hemisphere is exactly the stated share.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Literal

import numpy as np

from isethdr_core.plugins.ranges import check_ranges

from ..lenses.limits import Exponent, Scattered, Shoulder, Slope

REFERENCE_NM = 550.0  # wavelength of `scattered` and `shoulder_deg`


@dataclass(frozen=True)
class HazeFlare:
    """Scatter in the windscreen or lens, by the Harvey-Shack or ABg law; default values are
    assumptions.
    """

    THREAD_SAFE: ClassVar[bool] = True

    form: Literal["harvey_shack", "abg"] = "harvey_shack"  # form of the scatter function
    scattered: Scattered = 0.01  # total integrated scatter at 550 nm, as a share of the light
    # angle at which the scatter function leaves its plateau, at 550 nm
    shoulder_deg: Shoulder = 1.0
    slope: Slope = 2.0  # slope of the scatter function beyond the shoulder, on logarithmic axes
    # scatter is proportional to wavelength^-exponent: 2 for surface roughness, 0 for particles
    # larger than a wavelength
    wavelength_exponent: Exponent = 2.0
    # the shoulder is proportional to wavelength^exponent: 1 for surface roughness
    shoulder_exponent: Exponent = 1.0

    def __post_init__(self) -> None:
        """Raise ConfigError for values out of range."""
        check_ranges(self)

    def total(self, wavelength_nm: float) -> float:
        """Return the scattered share, 1 - (1 - scattered)^((550 nm / wavelength)^exponent); it is
        never above 1.

        For weak scatter it is a power of the wavelength. With the exponent 2 it is exact for a
        rough surface, 1 - exp(-(2 pi dn rms / wavelength)^2).
        """
        power = (REFERENCE_NM / wavelength_nm) ** self.wavelength_exponent
        return float(-np.expm1(np.log1p(-self.scattered) * power))

    def scatter(self, wavelength_nm: float, angle_rad: float | np.ndarray) -> float | np.ndarray:
        """Return scattered light per steradian at `angle_rad` from the straight ray, as a fraction
        of all light.
        """
        sine = np.sin(np.asarray(angle_rad, float))
        if self.scattered == 0:
            return 0.0 * sine
        shoulder = (
            np.sin(np.radians(self.shoulder_deg))
            * (wavelength_nm / REFERENCE_NM) ** self.shoulder_exponent
        )
        peak = self.total(wavelength_nm) / _hemisphere(self.form, float(shoulder), self.slope)
        # the cosine at 90 degrees rounds to 6e-17; beyond 90 degrees no light passes
        return (
            peak
            * _relative(self.form, sine / shoulder, self.slope)
            * np.maximum(np.cos(angle_rad), 0.0)
        )


def _relative(form: str, ratio: float | np.ndarray, slope: float) -> float | np.ndarray:
    """Return the scatter function over its peak, at `ratio` = sin(angle) / shoulder."""
    return (1 + ratio**2) ** (-slope / 2) if form == "harvey_shack" else 1 / (1 + ratio**slope)


@lru_cache(maxsize=256)
def _hemisphere(form: str, shoulder: float, slope: float) -> float:
    """Return 2 pi times the integral of f(b) b db for b from 0 to 1, where f is the scatter
    function over its peak.
    """
    # logarithmic steps, because the function falls as a power of b
    edges = np.concatenate([[0.0], np.geomspace(1e-6 * shoulder, 1.0, 200)])
    node, weight = np.polynomial.legendre.leggauss(8)
    half = np.diff(edges)[:, None] / 2
    sine = edges[:-1, None] + half * (1 + node)
    return float(2 * np.pi * np.sum(half * weight * sine * _relative(form, sine / shoulder, slope)))
