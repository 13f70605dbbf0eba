"""Spectra of the lights of the sky, per cd/m2.

- Twilight, blue part: sunlight scattered by molecules and absorbed by ozone along a slant path.
  Ozone keeps twilight blue (Hulburt 1953, J. Opt. Soc. Am. 43). Multiple scattering makes the
  colour paler; the power 0.6 instead of 1 for it is assumed.
- Twilight, glow at the horizon: sunlight through 12 air masses, scattered by haze.
- Moonlight: sunlight; the moon's reflectance increases by a factor of 1.6 from 400 to 700 nm, after
  Kieffer and Stone (2005), Astron. J. 129. Moonlit air: the same, scattered by molecules and haze.
- Natural night: a flat continuum of airglow and zodiacal light, starlight of 5000 K, and lines at
  557.7, 589.3 and 630.0 nm with 12, 3 and 5 % of the continuum's luminance. These values are
  assumed, in the range of usual nights (Leinert et al. 1998, A&A Suppl. 127).
- Glow of a city: half light of high-pressure sodium lamps, half of white LEDs; this is assumed.

Sunlight is that of a black body of 5778 K. This module gives only shapes of spectra. `night_light`
and `illuminance` give the levels.
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
OZONE_AIR_MASSES = 10.0  # air masses of ozone along the path of light at twilight
GLOW_AIR_MASSES = 12.0
PALE = 0.6  # power to which the optical depth of molecules is raised; less than 1 is paler
MOON_EXPONENT = 0.85  # (700 / 400)^0.85 = 1.6
LINES = {557.7: 0.12, 589.3: 0.03, 630.0: 0.05}
LINE_WIDTH_NM = 10.0  # full width at half maximum; wider than true lines, narrower than a band


@cache
def sky_spectrum(light: str) -> np.ndarray:
    """Return the radiance (NM,), W m-2 sr-1 nm-1, of a light of `SHAPES` with 1 cd/m2."""
    shape = SHAPES[light]()
    return shape / luminance_of(shape)


def luminance_of(spectra: npt.ArrayLike, wavelength_nm: np.ndarray = NM) -> np.ndarray:
    """Return the luminance (...), cd/m2, of spectra (..., wavelength), W m-2 sr-1 nm-1.

    `wavelength_nm` are the first wavelengths of NM, nm.
    """
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
        # the line gets this share of the continuum's luminance
        out = out + share * line * luminance_of(smooth) / luminance_of(line)
    return out


def _city() -> np.ndarray:
    parts = [spectrum_of(name).at(NM) for name in ("sodium", "led_white")]
    # the tables end at 780 nm, where both lamps have almost no light
    return sum(p / luminance_of(p) for p in parts) * (NM <= 780)


SHAPES = {
    "twilight": _twilight,
    "glow": _glow,
    "moonlight": _moonlight,
    "moonlit_air": _moonlit_air,
    "natural": _natural,
    "city": _city,
}
