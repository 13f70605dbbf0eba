"""Fog of a scene: a medium that is the same everywhere, with its extinction and phase function.

Visibility is the meteorological optical range: the distance at which the contrast of a black target
against the horizon sky has fallen to 0.05 (Koschmieder 1924). Extinction is therefore ln(20) = 3.0
over the visibility.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import ConfigError

CONTRAST = 0.05  # threshold of the meteorological optical range (CIE, WMO)
REFERENCE_NM = 550.0
SHARES_SUM_TO = 1e-6  # largest deviation from 1 of the sum of the shares of all lobes


@dataclass(frozen=True)
class PhaseLobe:
    """One lobe of Henyey and Greenstein (1941) of a phase function."""

    share: float  # share of the scattered light
    asymmetry: float  # g, the mean cosine: 1 forward, -1 backward

    def phase(self, cosine: npt.ArrayLike) -> np.ndarray:
        """Return the lobe's phase function, 1/sr, at the cosine between the directions of light
        before and after; its integral over all directions is 1.
        """
        g = self.asymmetry
        root = 1 + g * g - 2 * g * np.asarray(cosine, float)
        return (1 - g * g) / (4 * math.pi * root**1.5)


# Fitted to Mie theory of fog droplets. docs/explanation/fog.md describes the fit and its errors.
FOG_DROPLETS = (PhaseLobe(0.516, 0.9915), PhaseLobe(0.46, 0.79), PhaseLobe(0.024, -0.64))


@dataclass(frozen=True)
class Fog:
    """A homogeneous medium that fills the scene up to a height above the camera.

    Raises
    ------
    ConfigError : a number is impossible for a medium.
    """

    extinction_per_m: float  # extinction coefficient at 550 nm: scattering plus absorption
    spectral_slope: float = 0.0  # extinction goes with the power -slope of the wavelength
    albedo: float = 1.0  # share of the lost light that is scattered, not absorbed
    lobes: tuple[PhaseLobe, ...] = FOG_DROPLETS
    # height above the camera at which the fog ends and the sky begins; the fog ends at the same
    # distance below the camera
    above_camera_m: float = 50.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.extinction_per_m) and self.extinction_per_m > 0):
            raise ConfigError(
                f"the fog has an extinction of {self.extinction_per_m} per m; expected a number"
                " above 0, for example fog_of(visibility_m=100); None stands for clear air"
            )
        if not (math.isfinite(self.spectral_slope) and abs(self.spectral_slope) <= 4):
            raise ConfigError(
                f"the fog has a spectral slope of {self.spectral_slope}; expected -4 to 4,"
                " 0 for grey"
            )
        if not 0 <= self.albedo <= 1:
            raise ConfigError(f"the fog has an albedo of {self.albedo}; expected 0 to 1")
        if not (math.isfinite(self.above_camera_m) and self.above_camera_m > 0):
            raise ConfigError(
                f"the fog ends {self.above_camera_m} m above the camera; expected a number above 0"
            )
        shares = sum(lobe.share for lobe in self.lobes)
        if not (
            abs(shares - 1) <= SHARES_SUM_TO
            and all(lobe.share >= 0 and abs(lobe.asymmetry) < 1 for lobe in self.lobes)
        ):
            raise ConfigError(
                f"the fog has phase lobes {self.lobes}; expected shares of 0 or more that sum to 1,"
                " and asymmetries between -1 and 1"
            )

    @property
    def visibility_m(self) -> float:
        """Meteorological optical range at 550 nm."""
        return -math.log(CONTRAST) / self.extinction_per_m

    def extinction_at(self, wavelength_nm: npt.ArrayLike) -> np.ndarray:
        """Return the extinction, 1/m, at wavelengths in nm."""
        ratio = np.asarray(wavelength_nm, float) / REFERENCE_NM
        return self.extinction_per_m * ratio**-self.spectral_slope

    def transmission(
        self, distance_m: npt.ArrayLike, wavelength_nm: npt.ArrayLike = REFERENCE_NM
    ) -> np.ndarray:
        """Return the share of light left after a distance (Bouguer, Lambert, Beer)."""
        return np.exp(-self.extinction_at(wavelength_nm) * np.asarray(distance_m, float))

    def phase(self, cosine: npt.ArrayLike) -> np.ndarray:
        """Return the phase function, 1/sr, at the cosine of the scattering angle."""
        return sum(
            (lobe.share * lobe.phase(cosine) for lobe in self.lobes),
            np.zeros(np.shape(cosine)),
        )

    def mean_cosine(self) -> float:
        """Return the asymmetry of all lobes together."""
        return sum(lobe.share * lobe.asymmetry for lobe in self.lobes)


def fog_of(visibility_m: float | None) -> Fog | None:
    """Return fog of a visibility, m; None for clear air.

    Raises
    ------
    ConfigError : the visibility is not a finite number above 0.

    References
    ----------
    Koschmieder 1924 (visibility). Kim, McArthur and Korevaar 2001, Proc. SPIE 4214, p. 26
    (spectral slope by visibility: 0 below 500 m, 1.3 from 6 km on, 1.6 from 50 km on).
    """
    if visibility_m is None:
        return None
    if not (math.isfinite(visibility_m) and visibility_m > 0):
        raise ConfigError(
            f"visibility_m is {visibility_m}; expected a number of metres above 0; type for"
            " example visibility_m=100, or null for clear air"
        )
    return Fog(-math.log(CONTRAST) / visibility_m, spectral_slope_of(visibility_m))


def spectral_slope_of(visibility_m: float) -> float:
    """Return the power of the wavelength with which extinction falls (Kim, McArthur and Korevaar
    2001).
    """
    km = visibility_m / 1000
    if km > 50:
        return 1.6
    if km > 6:
        return 1.3
    if km > 1:
        return 0.16 * km + 0.34
    return max(km - 0.5, 0.0)
