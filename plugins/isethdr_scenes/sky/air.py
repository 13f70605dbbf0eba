"""Effects of clear air on light: air mass, transmission, scattering.

| effect | source |
|---|---|
| air mass towards a light outside the air | Kasten and Young (1989), Applied Optics 28, eq. 3 |
| optical depth of molecules | Hansen and Travis (1974), Space Science Reviews 16, equation 2.30 |
| optical depth of haze, 0.1 at 550 nm, exponent 1.3 | Angstrom (1929); numbers of a clear day |
| absorption by ozone, 0.041 at 602 nm for 300 DU | Chappuis band; shape: one Gaussian, a model |
| refraction, 0.57 degrees at the horizon | Saemundsson (1986), Sky and Telescope 72, p. 70 |
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

HAZE = 0.1  # optical depth at 550 nm
HAZE_EXPONENT = 1.3  # exponent of the decrease of the optical depth with wavelength
OZONE = 0.041  # largest optical depth
OZONE_NM = 602.0  # wavelength of the largest optical depth
OZONE_WIDTH_NM = 110.0  # full width at half maximum


def air_mass(altitude_deg: float) -> float:
    """Return the air mass towards an apparent altitude of 0 degrees or more; 38 at the horizon."""
    up = max(altitude_deg, 0.0)
    return float(1 / (np.sin(np.radians(up)) + 0.50572 * (up + 6.07995) ** -1.6364))


def molecules(wavelength_nm: npt.ArrayLike) -> np.ndarray:
    """Return the vertical optical depth of the molecules above sea level."""
    um = np.asarray(wavelength_nm, float) / 1000
    return 0.008569 * um**-4 * (1 + 0.0113 * um**-2 + 0.00013 * um**-4)


def haze(wavelength_nm: npt.ArrayLike) -> np.ndarray:
    """Return the vertical optical depth of the haze of a clear day."""
    return HAZE * (np.asarray(wavelength_nm, float) / 550) ** -HAZE_EXPONENT


def ozone(wavelength_nm: npt.ArrayLike) -> np.ndarray:
    """Return the vertical optical depth of ozone."""
    distance = (np.asarray(wavelength_nm, float) - OZONE_NM) / OZONE_WIDTH_NM
    return OZONE * np.exp(-4 * np.log(2) * distance**2)


def transmission(wavelength_nm: npt.ArrayLike, mass: float) -> np.ndarray:
    """Return the transmitted share of a beam through `mass` air masses."""
    nm = np.asarray(wavelength_nm, float)
    return np.exp(-mass * (molecules(nm) + haze(nm) + ozone(nm)))


def apparent_altitude_deg(altitude_deg: float) -> float:
    """Return the apparent altitude of an object at `altitude_deg`, with refraction.

    Below -2 degrees, where no object is visible, the refraction at -2 degrees is used.
    """
    true = max(altitude_deg, -2.0)
    return altitude_deg + 1.02 / 60 / np.tan(np.radians(true + 10.3 / (true + 5.11)))
