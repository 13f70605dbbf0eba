"""Photocurrent: from mixed radiance to electrons per area and time in each channel of one sensor.

A few weighted sums of the spectrum (functionals) are convolved instead of every band
(`physics.convolution.spectral`). Functionals are added until their error, computed exactly at a
sample of the scene's tiles, is far below the sensor's noise. The light of bright tiles must be more
accurate than that of all others: the part of it that the functionals miss is added by direct sums.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isethdr_core.physics.convolution.spectral import channels, matrix_product
from isethdr_core.physics.convolution.transform import error
from isethdr_core.physics.radiometry import photons_per_energy
from isethdr_core.uncertainty.error_terms import ErrorTerm, Quantity

from ..psf.error_parts import term
from . import bright_tiles, spectral_fit
from .accuracy_shares import TRANSFORMS
from .field_optics import FieldOptics
from .threads import threads

if TYPE_CHECKING:
    from isethdr_core.pipeline.demand import Response

    from ..psf.kernel_spectra import Part
    from .spectral_fit import Basis, Fit

FUNCTIONALS = "functionals"  # key of the error of the functionals of the spectrum


class Photocurrent(NamedTuple):
    """Photocurrent on the field's own tiles."""

    values: np.ndarray  # (channel, y, x) electrons per m2 and second
    channels: list[str]  # names of the distinct channels
    efficiency: np.ndarray  # (channel, band) electrons per photon
    terms: tuple[ErrorTerm, ...]  # errors of the functionals and of the transforms


def photocurrent(cube: np.ndarray, optics: FieldOptics, response: Response) -> Photocurrent | None:
    """Return photocurrent of mixed radiance; None if irradiance is as fast or more accurate.

    In every tile and channel that is not saturated, the error in electrons stays below
    `noise_fraction_allowed` of the sensor's noise. The field `terms` of the result states the
    largest error of the sampled tiles.

    Parameters
    ----------
    cube : mixed radiance (band, y, x), W m-2 sr-1 nm-1.
    optics : optics of its field.
    response : `isethdr_core.demand.Response` of the sensor.
    """
    if (
        optics.kernels is None
        or optics.field is not None
        or optics.sensor.scales is not None
        or optics.kernels.divided is None
    ):
        return None
    efficiency, names = _distinct_channels(
        response.efficiency(optics.wavelength_nm), response.channels
    )
    if 3 * len(efficiency) > len(cube):
        return None
    weights = efficiency * photons_per_energy(optics.wavelength_nm) * optics.gains
    out = np.zeros((len(weights), *cube.shape[1:]), np.float32)
    with threads() as apply:
        fit = spectral_fit.fit(cube, optics, weights, response, apply)
        if fit is None:
            return None
        parts = zip(
            (fit.near, fit.far),
            _planes(cube, optics.relative, fit),
            (optics.kernels.divided.near, optics.kernels.divided.far),
        )
        rounding_e = response.area_exposure_m2_s * sum(
            _convolve(out, weights, *part, apply) for part in parts if part[0]
        )
        # rounding may use the part of the allowed error that the functionals leave
        allowed = response.noise_fraction_allowed
        left = max(TRANSFORMS * allowed, allowed - fit.noise_share)
        if rounding_e > left * max(response.read_noise_e, 1.0):
            return None
        bright_tiles.correct(out, cube, weights, fit, optics, apply)
    lowest = float(out.min())
    np.maximum(out, 0.0, out=out)
    functionals = term(
        fit.noise_share,
        "standard deviations of the sensor's noise",
        "measured",
        f"{_functional_count(fit)} functionals of the spectrum in place of {len(cube)} bands,"
        f" largest of {fit.sample_count} sampled values",
        key=FUNCTIONALS,
        acts_on=Quantity.PHOTOCURRENT,
    )
    rounding = term(
        max(rounding_e, -lowest * response.area_exposure_m2_s),
        "electrons",
        "bound",
        "rounding of the transforms, and negative values set to zero",
        key="transforms",
        acts_on=Quantity.ELECTRONS,
    )
    return Photocurrent(out, names, efficiency, (functionals, rounding))


def _planes(
    cube: np.ndarray, relative: np.ndarray, fit: Fit
) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Return two functions of rows that give the functionals for the near and for the far part of
    the kernels.

    The bands are read once. The first function must be called for all rows before the second,
    because it also computes the functionals of the far part.
    """
    count = len(fit.near.project)
    project = np.concatenate(
        [fit.near.project, fit.far.project] if fit.far else [fit.near.project]
    ).astype(cube.dtype)
    far_planes = np.empty((len(project) - count, *cube.shape[1:]), cube.dtype)
    relative = None if relative is None else relative.astype(cube.dtype)

    def near_planes(rows: slice) -> np.ndarray:
        planes = matrix_product(project, cube[:, rows])
        if relative is not None:
            planes *= relative[rows]
        far_planes[:, rows] = planes[count:]
        return planes[:count]

    return near_planes, lambda rows: far_planes[:, rows]


def _convolve(
    out: np.ndarray,
    weights: np.ndarray,
    basis: Basis,
    planes: Callable[..., Any],
    part: Part,
    apply: Callable[..., Any],
) -> float:
    """Add a part's convolutions to `out`; return a bound on the rounding error of any tile.

    Parameters
    ----------
    out : (channel, y, x) photocurrent.
    weights : (channel, band) photocurrent per radiance and kernel.
    basis : functionals of the part.
    planes : function(rows) -> functionals (functional, y, x) of these rows.
    part : transforms of the part of the kernels.
    apply : the `map` of a pool of threads.
    """
    combine = weights[:, None, :] * basis.predict.T * part.peaks
    norm, largest = channels(out, planes, combine, part.blocks, part.size, apply)
    gain = float(max(np.abs(c).max() * k for c, k in zip(np.moveaxis(combine, 2, 0), part.norms)))
    return error(norm * gain, largest, part.size, part.single)


def _functional_count(fit: Fit) -> str:
    return (
        f"{len(fit.near.project)} (and {len(fit.far.project)} far from a lamp)"
        if fit.far
        else f"{len(fit.near.project)}"
    )


def _distinct_channels(
    efficiency: np.ndarray, names: tuple[str, str, str]
) -> tuple[np.ndarray, list[str]]:
    """Return the distinct rows (channel, band) of `efficiency`, and for each row the name of the
    first channel that has it.
    """
    _, first = np.unique(efficiency, axis=0, return_index=True)
    first.sort()
    return efficiency[first], [names[i] for i in first]
