"""Develop: from a mosaic of electrons to a picture in cd/m2. Every step is linear, so the variance goes along exactly."""

from __future__ import annotations

import numpy as np

from isethdr_core import ledger
from isethdr_core.physics.colour import colour_matrix
from isethdr_core.physics.photometry import xyz_weights
from isethdr_core.truth import make_picture

from .demosaic_methods import interpolate
from .readout import falloff
from .spectra import LIGHTS, light, radiances


def develop(merged, response, captures, balance: str, design_snr: float, method: str = "bilinear"):
    """Return the picture of a mosaic.

    Parameters
    ----------
    merged : `combine.Merged`, electrons without dark charge, their variance, validity and source (y, x).
    response : (channel, wavelength) electrons per band mean radiance on the axis.
    captures : the captures Dataset, for the filter array, the grid and the lens.
    balance : the light whose grey comes back exactly.
    design_snr : see `solve_matrix`.
    method : a way to demosaic, `demosaic_methods.METHODS`.
    """
    # the falloff goes first, while every sample still stands at its own place: a uniform scene is then flat to the demosaic
    level = falloff(captures)
    planes, variances, touched = interpolate(method, merged.signal_e / level, captures["filter"].values,
                                             [str(name) for name in captures["channel"].values],
                                             merged.variance_e2 / level**2, ~merged.valid)
    return finish(planes, variances, merged.valid & ~touched, response, captures, balance, design_snr)


def finish(planes, variances, valid, response, captures, balance: str, design_snr: float):
    """Return the picture of electrons (channel, y, x) that are known in every channel and freed of the lens's falloff."""
    matrix = solve_matrix(response, captures.wavelength.values, balance, design_snr)
    xyz = np.moveaxis(np.tensordot(matrix, planes, axes=1), 0, -1)
    variance = np.moveaxis(np.tensordot(matrix**2, variances, axes=1), 0, -1)
    attrs = {k: captures.attrs[k] for k in ("pitch_um", "focal_length_mm", "f_number", "cfa") if k in captures.attrs}
    return make_picture(xyz, variance, valid, captures.x.values, captures.y.values, **attrs)


def solve_matrix(response, wavelength_nm, balance: str, design_snr: float) -> np.ndarray:
    """Return the matrix (3, channel) from electrons to XYZ in cd/m2, and state its residual in the ledger.

    Least squares over smooth reflectances in four lights, exact for a grey in the light `balance`. Shot noise at
    `design_snr` (of the mean channel) enters as a penalty, so that a white pixel, which is nearly the sum of the
    coloured ones, lowers noise instead of being subtracted from them; infinity leaves it out.
    """
    weights, samples, white = xyz_weights(wavelength_nm), radiances(wavelength_nm), light(balance, wavelength_nm)
    electrons, target = samples @ response.T, samples @ weights.T
    mean = electrons.mean(0)
    shot = np.diag(mean * mean.mean()) * (len(samples) / design_snr**2)
    matrix = colour_matrix(electrons, target, response @ white, weights @ white, shot)
    residual = electrons @ matrix.T - target
    ledger.error(np.sqrt(np.mean(residual[:, 1] ** 2)), "relative", "measured", f"Y of {len(samples)} surfaces and lights, rms")
    greys = np.array([light(name, wavelength_nm) for name in LIGHTS])
    worst = np.abs(greys @ (matrix @ response - weights)[1]).max()
    ledger.error(worst, "relative", "measured", f"Y of a grey in the worst of {', '.join(LIGHTS)}")
    return matrix
