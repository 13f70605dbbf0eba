"""The smoothest spectra of RGB colours: reflectances of the three primaries times an illuminant.

The method is that of Mallett, Yuksel (2019), "Spectral primary decomposition for rendering with
sRGB reflectance", Eurographics Symposium on Rendering, section 3. Three reflectances are never
negative, sum to 1 at every wavelength, have the colours of the primaries, and are as smooth as
these conditions allow. So spectra are linear in RGB, white has the spectrum of the illuminant, and
no light is negative. This module minimises the sum of squared differences between adjacent bands.
It computes colours from the bands of the scene, so that a sum over its bands gives the same RGB.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.optimize import nnls

from isethdr_core.errors import ConfigError
from isethdr_core.physics.colour.colour_spaces import XYZ_TO_SRGB
from isethdr_core.physics.photometry import luminance, xyz_weights

EXACT_WEIGHT = 1e4  # weight of colours and sums relative to smoothness; their error is 1e-7
# Largest error of a primary's XYZ and of the sums. Bands with a larger error cannot represent the
# colours.
REACHED = 1e-6


def primary_reflectances(bands_nm: np.ndarray, daylight: np.ndarray) -> np.ndarray:
    """Return the reflectances (3, wavelength) of red, green and blue of sRGB.

    Parameters
    ----------
    bands_nm : (wavelength,) centres of the bands, nm.
    daylight : (wavelength,) D65 at the bands, of any scale.

    Raises
    ------
    ConfigError : the bands are too few or too narrow a range for such reflectances.
    """
    return _reflectances(tuple(map(float, bands_nm)), tuple(map(float, daylight)))


@lru_cache(maxsize=8)
def _reflectances(bands_nm: tuple[float, ...], daylight: tuple[float, ...]) -> np.ndarray:
    count = len(bands_nm)
    light = np.asarray(daylight) / luminance(daylight, bands_nm)
    weights = xyz_weights(bands_nm) * light  # weights that give XYZ from a reflectance
    # The white of the bands replaces that of the standard, so that the reflectances can sum to 1.
    standard = np.linalg.inv(XYZ_TO_SRGB)
    standard = standard / standard.sum(1)[1]
    target_white = standard * (weights.sum(1) / standard.sum(1))[:, None]
    steps = np.sqrt(count) * np.diff(np.eye(count), axis=0) / 10
    unit_colours = np.eye(3)
    equations = np.vstack(
        [
            np.kron(unit_colours, steps),
            EXACT_WEIGHT * np.kron(unit_colours, weights),
            EXACT_WEIGHT * np.tile(np.eye(count), (1, 3)),
        ]
    )
    results = np.concatenate(
        [
            np.zeros(3 * (count - 1)),
            EXACT_WEIGHT * target_white.T.ravel(),
            np.full(count, EXACT_WEIGHT),
        ]
    )
    solution = nnls(equations, results, maxiter=100 * equations.shape[1])[0].reshape(3, count)
    missed = np.abs(solution @ weights.T - target_white.T).max()
    if not max(missed, np.abs(solution.sum(0) - 1).max()) <= REACHED:
        raise ConfigError(
            f"{count} bands from {bands_nm[0]:g} to {bands_nm[-1]:g} nm cannot hold the colours of"
            f" RGB (XYZ misses by {missed:.1g}); expected 400 to 700 nm in steps of at most 20 nm;"
            " type scene.first_nm=400 scene.last_nm=700 scene.step_nm=10"
        )
    return solution


def spectra(
    rgb: np.ndarray, luminance_cd_m2: np.ndarray, of_primaries: np.ndarray, bands_nm: np.ndarray
) -> np.ndarray:
    """Return spectral radiance (wavelength, y, x) float32 of linear sRGB, W m-2 sr-1 nm-1.

    Parameters
    ----------
    rgb : (3, y, x) linear sRGB, 0 or more, of any scale.
    luminance_cd_m2 : (y, x) luminance that the spectra get, cd/m2.
    of_primaries : (3, wavelength) reflectances of the primaries times the illuminant.
    bands_nm : (wavelength,) middles of the bands, nm.
    """
    spectra_of_rgb = np.tensordot(luminance(of_primaries, bands_nm, axis=1), rgb, 1)
    scale = np.divide(
        luminance_cd_m2, spectra_of_rgb, out=np.zeros_like(spectra_of_rgb), where=spectra_of_rgb > 0
    )
    scaled = rgb * scale
    out = np.empty((len(bands_nm), *spectra_of_rgb.shape), np.float32)
    for band, weights in enumerate(of_primaries.T):
        out[band] = np.tensordot(weights, scaled, 1)
    return out
