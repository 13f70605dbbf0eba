"""Spectra for which a colour matrix is solved: lights of a driving scene and smooth reflectances,
all from formulas.

| light    | formula                                                                         |
|----------|---------------------------------------------------------------------------------|
| daylight | black body of 6504 K, for daylight without its absorption lines                 |
| halogen  | black body of 3200 K, a headlamp                                                |
| led      | blue peak at 450 nm (sigma 10) and phosphor at 560 nm (sigma 55), a white headlamp |
| sodium   | lines at 498, 569, 589, 616 nm (sigma 6) on 5 %, a high-pressure street lamp    |

Automatic white balance knows one more light, `incandescent`: a black body of 2856 K (CIE illuminant
A), a tungsten lamp.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from isethdr_core.errors import UnitError
from isethdr_core.physics.photometry import xyz_weights
from isethdr_core.physics.radiometry import planck_radiance

Light = Literal["daylight", "halogen", "led", "sodium", "incandescent"]
LIGHTS: tuple[Light, ...] = ("daylight", "halogen", "led", "sodium")
BLACK_BODY_K = {"daylight": 6504.0, "halogen": 3200.0, "incandescent": 2856.0}


class Mixture(NamedTuple):
    """Light of two sources together."""

    first: Light
    second: Light
    share: float  # share of `second` in the luminance

    def __str__(self) -> str:
        if self.share in (0.0, 1.0):
            return self.second if self.share else self.first
        return f"{1 - self.share:.0%} {self.first} and {self.share:.0%} {self.second}"


Illuminant = str | Mixture


def light(name: Illuminant, wavelength_nm: np.ndarray) -> np.ndarray:
    """Return the spectral radiance (wavelength,) of a perfect white in this light,
    W m-2 sr-1 nm-1, scaled to 1 cd/m2.

    Raises
    ------
    UnitError : all bands are beyond the visible range.
    """
    w = np.asarray(wavelength_nm, float)
    if isinstance(name, Mixture):
        first = light(name.first, w)
        second = light(name.second, w)
        return (1 - name.share) * first + name.share * second
    if name in BLACK_BODY_K:
        shape = planck_radiance(w, BLACK_BODY_K[name])
    elif name == "led":
        shape = _bell(w, 450, 10) + 0.55 * _bell(w, 560, 55)
    else:
        lines = ((498, 0.12), (569, 0.55), (589, 1.0), (616, 0.45))
        shape = 0.05 + sum(height * _bell(w, centre, 6) for centre, height in lines)
    luminance = float(xyz_weights(w)[1] @ shape)
    if not luminance > 0:
        raise UnitError(
            f"the bands from {w.min():g} to {w.max():g} nm hold no visible light, so a picture of"
            " them has no luminance; expected bands within 380 to 780 nm; use a sensor that"
            " responds there"
        )
    return shape / luminance


def reflectances(wavelength_nm: np.ndarray) -> np.ndarray:
    """Return smooth reflectances (surface, wavelength), 0..1: a grey, rising and falling edges,
    peaks and dips.

    Edges are logistic with a width of 20 nm, at 440 to 640 nm, like those of foliage, bricks and
    paints. Peaks and dips are Gaussian with a sigma of 30 nm. Each shape exists twice: saturated (3
    to 80 %), and less saturated (20 to 60 %).
    """
    w = np.asarray(wavelength_nm, float)
    out = [np.full(len(w), 0.5)]
    for centre_nm in range(440, 641, 25):
        edge = 1 / (1 + np.exp(-(w - centre_nm) / 20))
        band = _bell(w, centre_nm, 30)
        for shape in (edge, 1 - edge, band, 1 - band):
            out += [0.03 + 0.77 * shape, 0.2 + 0.4 * shape]
    return np.array(out)


def radiances(wavelength_nm: np.ndarray, lights: Sequence[Illuminant] = LIGHTS) -> np.ndarray:
    """Return the radiance (sample, wavelength) of every reflectance in every light. Each is scaled
    to 1 cd/m2, so that all have the same weight.
    """
    w = np.asarray(wavelength_nm, float)
    lit = np.concatenate([reflectances(w) * light(name, w) for name in lights])
    return lit / (lit @ xyz_weights(w)[1])[:, None]


def _bell(w: np.ndarray, centre: int, sigma: int) -> np.ndarray:
    return np.exp(-(((w - centre) / sigma) ** 2) / 2)
