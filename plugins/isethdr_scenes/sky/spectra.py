"""Spectral power of the lights of the sky that are modelled here, per cd/m2.

- Twilight, blue part: sunlight scattered by molecules, whose colour further scattering pales (power
  0.6 instead of 1: assumed), through ozone on its slant way, which keeps twilight blue (Hulburt
  1953, J. Opt. Soc. Am. 43).
- Twilight, glow at the horizon: sunlight through 12 air masses, scattered by haze.
- Moonlight: sunlight; the moon's reflectance rises by 1.6 from 400 to 700 nm, after Kieffer and
  Stone (2005), Astron. J. 129. In the air: scattered by molecules and haze.
- Natural night: even continuum of airglow and zodiacal light, starlight of 5000 K, and lines at
  557.7, 589.3 and 630.0 nm with 12, 3 and 5 % of the continuum's luminance: assumed, in the range
  of usual nights (Leinert et al. 1998, A&A Suppl. 127).
- A city's glow: half high-pressure sodium, half white LED, as lamps are: assumed.

Sunlight is a black body of 5778 K. Only shapes count here: levels are those of `night_light` and
`illuminance`.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from isethdr_core.physics.photometry import LM_PER_W, v_lambda
from isethdr_core.physics.radiometry import planck_radiance

from ..lamp_spectra import spectrum_of
from . import air

NM = np.arange(360.0, 831.0, 5.0)
SUN_K = 5778.0
STARS_K = 5000.0
OZONE_AIR_MASSES = 10.0  # of light that grazes the earth at twilight, in the ozone layer
GLOW_AIR_MASSES = 12.0
PALE = 0.6  # power of the molecules' law that is left of their colour
MOON_EXPONENT = 0.85  # (700 / 400)^0.85 = 1.6
LINES = {557.7: 0.12, 589.3: 0.03, 630.0: 0.05}
LINE_WIDTH_NM = 10.0  # full width at half maximum: wider than true, narrower than a band


@cache
def sky_spectrum(light: str) -> np.ndarray:
    """Return the radiance (NM,), W m-2 sr-1 nm-1, of 1 cd/m2 of `twilight`, `glow`, `moonlight`,
    `moonlit_air`, `natural` or `city`.
    """
    shape = SHAPES[light]()
    return shape / luminance_of(shape)


def luminance_of(spectra: npt.ArrayLike, wavelength_nm: np.ndarray = NM) -> np.ndarray:
    """Return cd/m2 of spectra (..., wavelength) at the first wavelengths of NM."""
    return np.asarray(spectra) @ (LM_PER_W * v_lambda(wavelength_nm) * (NM[1] - NM[0]))


def _sun() -> np.ndarray:
    return planck_radiance(NM, SUN_K)


def _twilight() -> np.ndarray:
    return _sun() * air.molecules(NM) ** PALE * np.exp(-OZONE_AIR_MASSES * air.ozone(NM))


def _glow() -> np.ndarray:
    return _sun() * air.haze(NM) * air.transmission(NM, GLOW_AIR_MASSES)


def _moonlight() -> np.ndarray:
    return _sun() * (NM / 550) ** MOON_EXPONENT


def _moonlit_air() -> np.ndarray:
    return _moonlight() * (air.molecules(NM) + air.haze(NM)) * air.transmission(NM, 1.5)


def _natural() -> np.ndarray:
    stars = planck_radiance(NM, STARS_K)
    smooth = 0.6 + 0.4 * stars / stars.max()
    out = smooth.copy()
    for centre, share in LINES.items():
        line = np.exp(-4 * np.log(2) * ((NM - centre) / LINE_WIDTH_NM) ** 2)
        # share of the power of the continuum, weighted as the eye does
        out = out + share * line * luminance_of(smooth) / luminance_of(line)
    return out


def _city() -> np.ndarray:
    parts = [spectrum_of(name).at(NM) for name in ("sodium", "led_white")]
    # the tables end at 780 nm, where both have next to no light
    return sum(p / luminance_of(p) for p in parts) * (NM <= 780)


SHAPES = {
    "twilight": _twilight,
    "glow": _glow,
    "moonlight": _moonlight,
    "moonlit_air": _moonlit_air,
    "natural": _natural,
    "city": _city,
}
