"""Develop: from a mosaic of electrons to a picture in cd/m2, with its variances.

The variances follow from the noise of the samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core import ledger
from isethdr_core.data import camera_geometry
from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.physics.colour.colour_spaces import colour_matrix
from isethdr_core.physics.photometry import xyz_weights
from isethdr_core.truth import VARIANCE_KNOWN, make_picture, with_undenoised

from .demosaic.denoise import denoised
from .demosaic.interpolation import array_period
from .demosaic.methods import FOLLOWS_VARIANCE, STATES_VARIANCE, chosen, interpolate
from .development_fields import Development
from .readout.defects import MAP, corrected
from .readout.noise_propagation import independent
from .readout.shading import shading
from .spectra import LIGHTS, Illuminant, Mixture, light, radiances

if TYPE_CHECKING:
    import xarray as xr

    from .readout.combine import Merged
    from .readout.electrons import Readout

DENOISERS = ("none", "nl_means")


def develop(
    merged: Merged,
    reads: Sequence[Readout],
    captures: xr.Dataset,
    how: Development,
    balance: Illuminant,
) -> xr.Dataset:
    """Return the picture of a mosaic.

    Parameters
    ----------
    merged : `combine.Merged`, electrons without dark charge, their variance, validity and source
        (y, x).
    reads : `electrons.Readout` of the charge to which the electrons of `merged` refer.
    captures : the captures Dataset, for the filter array, the grid and the lens.
    how : the fields of the isp. A denoised picture also contains the picture before denoising
        (`truth.before_denoising`); it is made by the bilinear demosaic if `how.demosaic` states no
        variance.
    balance : light in which grey is reproduced exactly.
    """
    if how.denoise not in DENOISERS:
        raise ConfigError(
            f"isp denoise {how.denoise!r} is unknown{did_you_mean(how.denoise, DENOISERS)}"
        )
    if how.defects == "interpolated" and MAP in captures:
        cell = array_period(captures["filter"].values)
        merged = corrected(merged, captures[MAP].values, cell)
    response = reads[0].response
    dark_var_e2 = floor_e2(reads)
    matrix = solve_matrix(
        response, captures.wavelength.values, balance, how.design_snr, dark_var_e2
    )
    attrs = picture_attrs(captures, response, how, balance, dark_var_e2)
    filters = captures["filter"].values
    names = [str(name) for name in captures["channel"].values]
    how = replace(how, demosaic=chosen(how.demosaic, filters, names))
    if how.denoise == "none":
        return _developed(merged, captures, how, matrix, attrs)
    plain = _developed(merged, captures, plain_development(how), matrix, attrs)
    smooth = denoised(
        merged,
        array_period(filters),
        how.demosaic in FOLLOWS_VARIANCE,
        strength=how.nl_means_strength,
    )
    attrs[VARIANCE_KNOWN] = False
    return with_undenoised(_developed(smooth, captures, how, matrix, attrs), plain)


def plain_development(how: Development) -> Development:
    """Return the fields for the picture before denoising, which states its variance.

    Parameters
    ----------
    how : the fields of the isp.
    """
    demosaic = how.demosaic if how.demosaic in STATES_VARIANCE else "bilinear"
    return replace(how, denoise="none", demosaic=demosaic)


def _developed(
    merged: Merged, captures: xr.Dataset, how: Development, matrix: np.ndarray, attrs: dict
) -> xr.Dataset:
    """Return the picture of one mosaic with the colour matrix (3, channel)."""
    filters = captures["filter"].values
    names = [str(name) for name in captures["channel"].values]
    # shading is corrected before the demosaic, so that a uniform scene is flat for the demosaic
    level = shading(captures, how.shading_csv)
    # pixels that get no light through the lens are not valid
    valid = merged.valid & (level > 0)
    level = np.where(level > 0, level, 1.0)
    variance = merged.variance_e2 / level**2
    planes, invalid, noise_map = interpolate(
        how.demosaic, merged.signal_e / level, filters, names, variance, ~valid
    )
    if noise_map is None or not attrs.get(VARIANCE_KNOWN, True):
        attrs = {**attrs, VARIANCE_KNOWN: False}
        # a single broadcast NaN reduces memory and storage by a third
        noise = PictureNoise(*np.broadcast_to(np.nan, (2, len(matrix), *valid.shape)))
    else:
        fixed = merged.fixed.scaled(1 / level)
        noise = PictureNoise(
            noise_map.variance(matrix, independent(variance)), noise_map.variance(matrix, fixed)
        )
    return finish(matrix, planes, noise, valid & ~invalid, captures, attrs)


class PictureNoise(NamedTuple):
    """Variances (xyz_channel, y, x) of a picture, (cd/m2)^2."""

    temporal: np.ndarray
    fixed: np.ndarray


def floor_e2(reads: Sequence[Readout]) -> float:
    """Return the variance, e^2, of the best reading of a charge in the dark: dark charge, read
    noise and quantisation.
    """
    return min(read.dark_e + float(np.median(read.read_var_e2)) for read in reads)


def finish(
    matrix: np.ndarray,
    planes: np.ndarray,
    noise: PictureNoise,
    valid: np.ndarray,
    captures: xr.Dataset,
    attrs: dict,
) -> xr.Dataset:
    """Return the picture of demosaiced electrons.

    Parameters
    ----------
    matrix : (xyz_channel, channel), from electrons to XYZ in cd/m2.
    planes : electrons (channel, y, x), divided by the relative illumination of the lens.
    noise : variances of the picture.
    valid : (y, x) bool, valid pixels.
    captures : the captures Dataset, for the grid.
    attrs : attributes of the picture.
    """
    xyz = np.tensordot(matrix, planes, axes=1)
    xyz, temporal, fixed = (np.moveaxis(values, 0, -1) for values in (xyz, *noise))
    return make_picture(xyz, temporal, valid, captures.x.values, captures.y.values, fixed, **attrs)


def picture_attrs(
    captures: xr.Dataset,
    response: np.ndarray,
    how: Development,
    balance: Illuminant,
    dark_var_e2: float = 0.0,
) -> dict:
    """Return the attributes of a picture: those of the lens, the white, the design luminance.

    Parameters
    ----------
    captures : the captures Dataset.
    response : (channel, wavelength) electrons per band mean radiance.
    how : the fields of the isp.
    balance : light; its white becomes `white_xyz`.
    dark_var_e2 : variance of the best reading in the dark, e^2.
    """
    attrs = {
        k: captures.attrs[k]
        for k in ("pitch_um", "focal_length_mm", "f_number", "cfa", *camera_geometry.PLACES)
        if k in captures.attrs
    }
    # XYZ of a white in the light `balance`, for views
    wavelength_nm = captures.wavelength.values
    attrs["white_xyz"] = [
        float(v) for v in xyz_weights(wavelength_nm) @ light(balance, wavelength_nm)
    ]
    if isinstance(balance, Mixture):
        attrs["scene_light"] = str(balance)
    # luminance for the noise of which the matrix is solved; absent if noise is ignored
    if np.isfinite(how.design_snr):
        samples = radiances(wavelength_nm)
        attrs["design_cd_m2"] = design_luminance(
            (samples @ response.T).mean(), how.design_snr, dark_var_e2
        )
    return attrs


def solve_matrix(
    response: np.ndarray,
    wavelength_nm: np.ndarray,
    balance: Illuminant,
    design_snr: float,
    dark_var_e2: float = 0.0,
) -> np.ndarray:
    """Return the matrix (3, channel) from electrons to XYZ in cd/m2, and state its residual in the
    ledger.

    The matrix is the least-squares solution over smooth reflectances in four lights, and exact for
    a grey in the light `balance`. If that light was estimated from the shot (`scene_light`), the
    reflectances are in that light alone. The covariance of the sensor noise at `design_luminance`
    is a penalty (Tikhonov). Without it, the white channel of an RGBW array, which is nearly the sum
    of the coloured channels, would be subtracted from them and raise the noise. An infinite
    `design_snr` gives plain least squares.

    Parameters
    ----------
    response : (channel, wavelength) electrons per band mean radiance.
    wavelength_nm : (wavelength,) centres of the bands, nm.
    balance : light in which grey is reproduced exactly.
    design_snr : signal-to-noise ratio at which the penalty is computed.
    dark_var_e2 : variance of the best reading in the dark, e^2.
    """
    weights = xyz_weights(wavelength_nm)
    samples = radiances(wavelength_nm, (balance,) if isinstance(balance, Mixture) else LIGHTS)
    white = light(balance, wavelength_nm)
    electrons = samples @ response.T
    target = samples @ weights.T
    mean = electrons.mean(0)
    level = design_luminance(mean.mean(), design_snr, dark_var_e2)
    # variance at this luminance, e^2, divided by the square of the luminance
    noise = np.diag(mean / level + dark_var_e2 / level**2)
    matrix = colour_matrix(
        electrons, target, response @ white, weights @ white, noise * len(samples)
    )
    residual = electrons @ matrix.T - target
    ledger.error(
        np.sqrt(np.mean(residual[:, 1] ** 2)),
        "relative",
        "measured",
        f"Y of {len(samples)} surfaces and lights, rms",
    )
    greys = np.array([light(name, wavelength_nm) for name in LIGHTS])
    worst = np.abs(greys @ (matrix @ response - weights)[1]).max()
    ledger.error(worst, "relative", "measured", f"Y of a grey in the worst of {', '.join(LIGHTS)}")
    return matrix


def design_luminance(electrons_per_cd_m2: float, design_snr: float, dark_var_e2: float) -> float:
    """Return the luminance, cd/m2, at which a channel has a given signal-to-noise ratio.

    The equation e / sqrt(e + v) = SNR is solved for the electrons e.

    Parameters
    ----------
    electrons_per_cd_m2 : mean response of the channels, electrons per cd/m2.
    design_snr : signal-to-noise ratio.
    dark_var_e2 : v, variance in the dark, e^2.
    """
    if not np.isfinite(design_snr):
        return np.inf
    electrons = design_snr * (design_snr + np.sqrt(design_snr**2 + 4 * dark_var_e2)) / 2
    return float(electrons / electrons_per_cd_m2)
