"""Materials of a stated colour: the smoothest reflectance of an sRGB colour, under a finish.

The name of such a material, `colour_rrggbb_finish`, states its colour and finish. So a part can
name it like any other material.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from isethdr_core.physics.colour.colour_spaces import srgb_decode
from isethdr_core.scene import Material, Spectrum

from .lamp_spectra import spectrum_of
from .pictures.rgb_to_spectra import primary_reflectances

PREFIX = "colour_"
NM = np.arange(400.0, 701.0, 20.0)
DARKEST = 0.01  # least reflectance of a surface
BRIGHTEST = 0.90  # greatest reflectance of a surface
# roughness of the coat
COATS = {"gloss": 0.06, "satin": 0.30}
METAL_ROUGHNESS = 0.25
FINISHES = ("matt", *COATS, "metal", "glass")


def name_of(colour: str, finish: str) -> str:
    """Return the name of the material of a colour `#rrggbb` under one of `FINISHES`."""
    return f"{PREFIX}{colour.lstrip('#').lower()}_{finish}"


def finish_of(name: str) -> str:
    """Return the finish, one of `FINISHES`, of a name made by `name_of`."""
    return name.rpartition("_")[2]


@lru_cache(maxsize=4096)
def material_of(name: str) -> Material:
    """Return the material of a name made by `name_of`.

    The reflectance is that of Mallett and Yuksel (2019), `pictures.rgb_to_spectra`; for `glass` it
    is the transmittance of the pane.
    """
    code, _, finish = name.removeprefix(PREFIX).partition("_")
    srgb = np.array([int(code[k : k + 2], 16) for k in (0, 2, 4)]) / 255.0
    linear = srgb_decode(srgb)
    value = linear @ primary_reflectances(NM, spectrum_of("daylight").at(NM))
    spectrum = Spectrum(tuple(NM.tolist()), tuple(np.clip(value, DARKEST, BRIGHTEST).tolist()))
    if finish == "matt":
        return Material(name, "diffuse", spectrum)
    if finish == "metal":
        return Material(name, "conductor", spectrum, METAL_ROUGHNESS)
    if finish == "glass":
        return Material(name, "thin_glass", spectrum)
    return Material(name, "plastic", spectrum, COATS[finish])
