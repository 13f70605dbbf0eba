"""The night sky without and with a moon: luminance by direction, cd/m2.

- Natural zenith: 1.74e-4 cd/m2, 22.0 mag per square arcsecond (Falchi et al. 2016, Science Advances
  2): airglow, zodiacal light and stars.
- Its increase towards the horizon: Krisciunas and Schaefer (1991), PASP 103, equations 2 and 3.
- Moonlight scattered by the air: the same paper, equations 9 and 15 to 21.
- Zenith by class of site: classes of Bortle (2001), Sky and Telescope 101, with the magnitudes that
  are usually assigned to them, near the middle of each class.
- The glow of a city is 1 mag brighter at 70 degrees from the zenith. This is a model, close to the
  results of Garstang (1989), PASP 101, inside cities.

Luminance = 10.8e4 cd/m2 x 10^(-0.4 m), m in magnitudes per square arcsecond.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

NATURAL_CD_M2 = 1.74e-4
EXTINCTION_MAG = 0.172  # per air mass, in V (Krisciunas and Schaefer 1991)
ZERO_CD_M2 = 10.8e4  # luminance of magnitude 0 per square arcsecond
NANOLAMBERT_CD_M2 = 1e-5 / np.pi
# magnitudes per square arcsecond at the zenith, by Bortle's class
BORTLE_MAG = {1: 22.0, 2: 21.94, 3: 21.79, 4: 21.1, 5: 20.0, 6: 19.2, 7: 18.65, 8: 18.1, 9: 17.0}


def path_length(elevation_deg: npt.ArrayLike) -> np.ndarray:
    """Return the optical path length X relative to that at the zenith; 5 at the horizon.

    X = 1 / sqrt(1 - 0.96 sin^2 Z), with the angle Z from the zenith (Krisciunas and Schaefer 1991,
    equation 3).
    """
    z = np.cos(np.radians(np.maximum(elevation_deg, 0.0)))
    return 1 / np.sqrt(1 - 0.96 * z**2)


def natural_cd_m2(elevation_deg: npt.ArrayLike) -> np.ndarray:
    """Return the luminance of airglow, zodiacal light and stars, cd/m2."""
    air_masses = path_length(elevation_deg)
    return NATURAL_CD_M2 * 10 ** (-0.4 * EXTINCTION_MAG * (air_masses - 1)) * air_masses


def zenith_cd_m2(bortle: int) -> float:
    """Return the luminance of the zenith, cd/m2, at a site of class `bortle`, 1 to 9."""
    return ZERO_CD_M2 * 10 ** (-0.4 * BORTLE_MAG[bortle])


def artificial_cd_m2(elevation_deg: npt.ArrayLike, bortle: int) -> np.ndarray:
    """Return the luminance of air that is lit by the lamps of towns, cd/m2."""
    zenith = max(zenith_cd_m2(bortle) - NATURAL_CD_M2, 0.0)
    return zenith * path_length(elevation_deg)


def moonlit_cd_m2(
    elevation_deg: npt.ArrayLike, from_moon_deg: npt.ArrayLike, moon_deg: float, phase_deg: float
) -> np.ndarray:
    """Return the luminance of the air in moonlight, cd/m2.

    Parameters
    ----------
    elevation_deg : elevation of the direction, degrees.
    from_moon_deg : angle of the direction from the moon, degrees.
    moon_deg : altitude of the moon, degrees.
    phase_deg : phase angle of the moon, degrees; 0 full, 180 new.
    """
    angle_deg = np.asarray(from_moon_deg, float)
    moon_illuminance = 10 ** (-0.4 * (3.84 + 0.026 * phase_deg + 4e-9 * phase_deg**4))
    by_molecules = 10**5.36 * (1.06 + np.cos(np.radians(angle_deg)) ** 2)
    by_haze = np.where(
        angle_deg < 10, 6.2e7 / np.maximum(angle_deg, 2.0) ** 2, 10 ** (6.15 - angle_deg / 40)
    )
    transmitted = 10 ** (-0.4 * EXTINCTION_MAG * path_length(moon_deg))
    scattered_share = 1 - 10 ** (-0.4 * EXTINCTION_MAG * path_length(elevation_deg))
    return (
        NANOLAMBERT_CD_M2
        * (by_molecules + by_haze)
        * moon_illuminance
        * transmitted
        * scattered_share
    )
