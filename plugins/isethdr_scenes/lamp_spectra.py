"""Relative spectral power of the lamps: measured tables of colour-science, and four stated models.

| name         | what                                  | source                                |
|--------------|---------------------------------------|---------------------------------------|
| halogen      | tungsten halogen (H7)                 | model: black body at 3200 K (Planck)  |
| led_white    | headlamp and street LED, about 5100 K | CIE 015:2018 illuminant LED-B4        |
| led_warm     | room light, about 2700 K              | CIE 015:2018 illuminant LED-B1        |
| sodium       | high pressure sodium street lamp      | "C100S54 (HPS)" of colour-science     |
| metal_halide | metal halide                          | "MHC100/U/MP/4K" of colour-science    |
| red          | tail and brake LED                    | model: Gaussian at 630 nm, FWHM 18 nm |
| amber        | indicator and marker LED              | model: Gaussian at 592 nm, FWHM 16 nm |
| green        | traffic signal LED                    | model: Gaussian at 503 nm, FWHM 30 nm |
| daylight     | CIE D65                               | colour-science                        |

Each spectrum is scaled to a maximum of 1: the intensity of a lamp in candela sets its level.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from isethdr_core.physics.photometry import luminance
from isethdr_core.physics.radiometry import planck_radiance
from isethdr_core.scene import Spectrum

from .measured_spectra import TABLES, WAVELENGTH_NM, measured

# centre nm, full width at half maximum nm
GAUSSIAN = {
    "red": (630.0, 18.0),
    "amber": (592.0, 16.0),
    "green": (503.0, 30.0),
}
HALOGEN_K = 3200.0
NAMES = (*TABLES, *GAUSSIAN, "halogen")


@cache
def spectrum_of(name: str) -> Spectrum:
    """Return the relative spectral power `name` of the table above, 380-780 nm in steps of 5 nm."""
    if name in TABLES:
        power = measured(name)
    elif name in GAUSSIAN:
        centre, width = GAUSSIAN[name]
        power = np.exp(-4 * np.log(2) * ((WAVELENGTH_NM - centre) / width) ** 2)
    elif name == "halogen":
        power = planck_radiance(WAVELENGTH_NM, HALOGEN_K)
    else:
        raise KeyError(f"no lamp spectrum {name!r}; expected one of {', '.join(NAMES)}")
    return Spectrum(tuple(WAVELENGTH_NM.tolist()), tuple((power / power.max()).tolist()))


def sky_of(luminance_cd_m2: float, name: str = "daylight") -> Spectrum:
    """Return a sky radiance, W m-2 sr-1 nm-1, with a luminance, cd/m2, and the spectral shape
    `name`.
    """
    shape = spectrum_of(name)
    fine = np.arange(360.0, 831.0)
    scale = luminance_cd_m2 / float(luminance(shape.at(fine), fine))
    return Spectrum(shape.wavelength_nm, tuple(scale * v for v in shape.value))
