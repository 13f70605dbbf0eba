"""Photocurrent: mixed radiance straight to electrons per area and time in each channel of one
sensor.

A few functionals of the spectrum are convolved instead of every band
(`physics.convolution.spectral`). Their number grows until the error that is left, computed exactly
at some tiles of the scene itself, is far below the sensor's noise. Bright tiles, whose own light
would have to be right to many more digits than noise allows elsewhere, get what is missing around
them by direct sums.
"""

from __future__ import annotations

from typing import NamedTuple

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

FUNCTIONALS = "functionals"  # key of the error of the functionals of the spectrum


class Photocurrent(NamedTuple):
    """Photocurrent on the field's own tiles."""

    values: np.ndarray  # (channel, y, x) electrons per m2 and second
    channels: list[str]  # those that differ
    efficiency: np.ndarray  # (channel, band) electrons per photon
    terms: tuple[ErrorTerm, ...]  # of the functionals and of the transforms


def photocurrent(cube, given: FieldOptics, response) -> Photocurrent | None:
    """Return photocurrent of mixed radiance (band, y, x), or None where irradiance is no slower or
    more exact.

    Parameters
    ----------
    response : `isethdr_core.demand.Response` of the sensor. The error in electrons, in every tile
        and channel, stays below `noise_fraction_allowed` of the sensor's noise where it is not
        saturated; `terms` say what it was at the tiles looked at.
    """
    if (
        given.made is None
        or given.field is not None
        or given.sensor.scales is not None
        or given.made.divided is None
    ):
        return None
    efficiency, names = _unlike(response.efficiency(given.wavelength_nm), response.channels)
    if 3 * len(efficiency) > len(cube):
        return None
    weights = efficiency * photons_per_energy(given.wavelength_nm) * given.gains
    out = np.zeros((len(weights), *cube.shape[1:]), np.float32)
    with threads() as apply:
        fit = spectral_fit.fit(cube, given, weights, response, apply)
        if fit is None:
            return None
        parts = zip(
            (fit.near, fit.far),
            _planes(cube, given.relative, fit),
            (given.made.divided.near, given.made.divided.far),
        )
        rounding_e = response.area_exposure_m2_s * sum(
            _convolve(out, weights, *part, apply) for part in parts if part[0]
        )
        if rounding_e > TRANSFORMS * response.noise_fraction_allowed * max(
            response.read_noise_e, 1.0
        ):
            return None
        bright_tiles.correct(out, cube, given.relative, weights, fit, given.made, apply)
    low = float(out.min())
    np.maximum(out, 0.0, out=out)
    functionals = term(
        fit.noise_share,
        "standard deviations of the sensor's noise",
        "measured",
        f"{_counted(fit)} functionals of the spectrum in place of {len(cube)} bands, largest of"
        f" {fit.looked_at} values",
        key=FUNCTIONALS,
        acts_on=Quantity.PHOTOCURRENT,
    )
    rounding = term(
        max(rounding_e, -low * response.area_exposure_m2_s),
        "electrons",
        "bound",
        "rounding of the transforms, and what was lifted to zero",
        key="transforms",
        acts_on=Quantity.ELECTRONS,
    )
    return Photocurrent(out, names, efficiency, (functionals, rounding))


def _planes(cube, relative, fit):
    """Return two functions of rows: the functionals of the light there that the near part of the
    kernels takes, and those of the far part.

    The bands are read once: the near part is asked for all rows first, and what the far part will
    take of them is kept.
    """
    count = len(fit.near.project)
    project = np.concatenate(
        [fit.near.project, fit.far.project] if fit.far else [fit.near.project]
    ).astype(cube.dtype)
    kept = np.empty((len(project) - count, *cube.shape[1:]), cube.dtype)
    relative = None if relative is None else relative.astype(cube.dtype)

    def near(rows):
        made = matrix_product(project, cube[:, rows])
        if relative is not None:
            made *= relative[rows]
        kept[:, rows] = made[count:]
        return made[:count]

    return near, lambda rows: kept[:, rows]


def _convolve(out, weights, basis, planes, part, apply) -> float:
    """Add a part's convolutions to `out`; return a bound on the rounding of any tile."""
    combine = weights[:, None, :] * basis.predict.T * part.peaks
    norm, seen = channels(out, planes, combine, part.blocks, part.size, apply)
    gain = float(max(np.abs(c).max() * k for c, k in zip(np.moveaxis(combine, 2, 0), part.norms)))
    return error(norm * gain, seen, part.size, part.single)


def _counted(fit) -> str:
    return (
        f"{len(fit.near.project)} (and {len(fit.far.project)} far from a lamp)"
        if fit.far
        else f"{len(fit.near.project)}"
    )


def _unlike(efficiency, names):
    """Return the rows (channel, wavelength) that differ, and the name of the first of each."""
    _, first = np.unique(efficiency, axis=0, return_index=True)
    first.sort()
    return efficiency[first], [names[i] for i in first]
