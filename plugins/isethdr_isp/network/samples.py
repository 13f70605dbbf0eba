"""Samples: the captures of a shot as the input planes of a network."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter, uniform_filter

from isethdr_core import ledger
from isethdr_core.errors import UnitError
from isethdr_core.physics.radiometry import photons_per_energy
from isethdr_core.pipeline.early_checks import ShotForm

from ..demosaic.interpolation import array_period
from ..merge import LARGEST_MISMATCH, charges, state_spectral_mismatch
from ..readout.combine import Merged, fold, read_charge
from ..readout.defects import MAP, corrected
from ..readout.electrons import Readout
from ..readout.interleaved import is_interleaved
from ..readout.merge_rules import RULES
from ..readout.shading import shading
from ..spectra import light, radiances
from .contract import Contract
from .fields import NetworkFields

if TYPE_CHECKING:
    import xarray as xr

# light in which a grey has the same number of electrons in `xyz` as in the unit's channel
UNIT_LIGHT = "daylight"
# side of the window in which variances of samples are averaged, pixels; it contains every filter
NEAR_PX = 9
TWO_EXPOSURES = (
    "the filter array holds two exposures, as upper and lower case filters; isp=network takes one"
    " exposure per capture; type isp=merge, without isp.model"
)
LEAST_NOISE_E = 0.01  # smallest noise, because a network may divide by it


class Planes(NamedTuple):
    """Measured samples at every pixel, for each plane of a model's input."""

    # (plane, y, x) electrons of light, without dark charge, in electrons of the most sensitive
    # capture, corrected for the relative illumination of the lens
    signal_e: np.ndarray
    variance_e2: np.ndarray  # (plane, y, x) temporal variance
    valid: np.ndarray  # (plane, y, x) bool
    fixed_e2: np.ndarray  # (plane, y, x) variance of the fixed pattern, from device to device


@dataclass(frozen=True, eq=False)
class Shot:
    """The planes of a shot, and the response of the most sensitive capture."""

    planes: Planes
    filters: np.ndarray  # (y, x) number of each pixel's channel
    channels: tuple[str, ...]  # names of the channels
    captures: tuple[str, ...]  # names of the captures
    read: Readout  # reading of the most sensitive charge
    dark_var_e2: float  # variance, in the dark, of the best reading of that charge

    def letters(self) -> np.ndarray:
        """Return the letters (row, column) of the filter array, from the first pixel on."""
        rows, columns = array_period(self.filters)
        return np.array(self.channels)[self.filters[:rows, :columns]]

    def form(self) -> ShotForm:
        """Return the names of the captures and the filter array."""
        return ShotForm(self.captures, tuple("".join(row) for row in self.letters()))

    def invalid(self) -> np.ndarray:
        """Return the pixels (y, x) that are valid in no plane."""
        return ~self.planes.valid.any(axis=0)


def shot(captures: xr.Dataset, how: NetworkFields, apart: bool) -> Shot:
    """Return the planes of a captures Dataset.

    Parameters
    ----------
    captures : captures Dataset with a known black level.
    how : the fields of the isp.
    apart : if True, there is one plane per capture, in the order of the shot, each in electrons of
        the most sensitive capture. If False, all captures are merged to one plane.

    Raises
    ------
    UnitError : the filter array has two exposures, or captures of several charges have a filter
        that transmits no light.
    """
    if is_interleaved(captures):
        raise UnitError(TWO_EXPOSURES)
    groups, per_light = charges(captures, UNIT_LIGHT)
    state_spectral_mismatch(groups, captures.wavelength.values)
    if apart:
        mosaics = _apart(groups, per_light)
    else:
        mosaics = [RULES[how.rule](groups, per_light)]
    if how.defects == "interpolated" and MAP in captures:
        cell = array_period(captures["filter"].values)
        mosaics = [corrected(mosaic, captures[MAP].values, cell) for mosaic in mosaics]
    level = shading(captures, how.shading_csv)
    lit = level > 0  # other pixels get no light through the lens
    level = np.where(lit, level, 1.0)
    return Shot(
        Planes(
            np.stack([mosaic.signal_e / level for mosaic in mosaics]),
            np.stack([mosaic.variance_e2 / level**2 for mosaic in mosaics]),
            np.stack([mosaic.valid & lit for mosaic in mosaics]),
            np.stack([mosaic.fixed.total_e2() / level**2 for mosaic in mosaics]),
        ),
        captures["filter"].values,
        tuple(str(name) for name in captures["channel"].values),
        tuple(str(name) for name in captures["capture"].values),
        groups[-1][0],
        min(read.dark_e + float(np.median(read.read_var_e2)) for read in groups[-1]),
    )


def _apart(groups: list[list[Readout]], per_light: list[np.ndarray]) -> list[Merged]:
    """Return each reading as a mosaic in electrons of the most sensitive charge."""
    mosaics: dict[int, Merged] = {}
    for reads, own in zip(groups, per_light, strict=True):
        scale = per_light[-1] / own
        for read in reads:
            mosaic = fold([read_charge([read], own)])
            mosaics[read.capture] = Merged(
                mosaic.signal_e * scale,
                mosaic.variance_e2 * scale**2,
                mosaic.valid,
                mosaic.source,
                mosaic.fixed.scaled(scale),
            )
    return [mosaics[capture] for capture in sorted(mosaics)]


def inputs(taken: Shot, contract: Contract) -> dict[str, np.ndarray]:
    """Return all possible inputs of a model with the contract: float32 (plane, y, x) by name."""
    number = {letter: k for k, letter in enumerate(contract.channels)}
    mask_of = np.array([number[name] for name in taken.channels])[taken.filters]
    signal, variance, valid, _ = taken.planes
    noise = np.sqrt(np.maximum(variance - signal, LEAST_NOISE_E**2))
    return {
        "raw": signal.astype(np.float32),
        "noise": noise.astype(np.float32),
        "masks": (mask_of == np.arange(len(number))[:, None, None]).astype(np.float32),
        "valid": valid.astype(np.float32),
    }


def fixed_share(planes: Planes) -> np.ndarray:
    """Return the share (y, x) of the fixed pattern in the variance of the samples nearby."""
    shape = (0, NEAR_PX, NEAR_PX)
    measured = planes.valid.astype(float)
    fixed = uniform_filter(measured * planes.fixed_e2, shape).sum(0)
    temporal = uniform_filter(measured * np.maximum(planes.variance_e2, 0.0), shape).sum(0)
    total = fixed + temporal
    return np.divide(fixed, total, out=np.zeros_like(total), where=total > 0)


def unit_e_per_cd_m2(contract: Contract, taken: Shot) -> float:
    """Return the electrons of `xyz` per cd/m2: those of the unit's channel on the axis, for a grey
    in daylight.

    Raises
    ------
    UnitError : the channel transmits no daylight.
    """
    unit = float(taken.read.sensitivity[taken.channels.index(contract.unit_channel)])
    if not unit > 0:
        raise UnitError(
            f"filter {contract.unit_channel} transmits no daylight, and the model's unit is"
            " electrons behind it; expected a quantum efficiency above 0; use a sensor like the one"
            " that the model is for"
        )
    return unit


def state_unlike_filters(contract: Contract, taken: Shot, wavelength_nm: np.ndarray) -> None:
    """State in the ledger how much the sensor's electrons in coloured light differ from those of
    the sensor for which a model was made. Nothing is stated if the model does not state its
    filters.

    Parameters
    ----------
    contract : contract of the model.
    taken : the planes of a shot, with the sensor's response.
    wavelength_nm : centres of the bands (wavelength,), nm.

    Raises
    ------
    UnitError : they differ by more than 50 % (rms), so that colours would be wrong.
    """
    if not contract.quantum_efficiency:
        return
    samples = radiances(wavelength_nm)
    white = light(UNIT_LIGHT, wavelength_nm)
    unit = contract.channels.index(contract.unit_channel)
    order = [taken.channels.index(channel) for channel in contract.channels]
    own = taken.read.response[order]
    curves = np.array([contract.quantum_efficiency[name] for name in contract.channels])
    # electrons per energy, up to a factor that cancels in the ratio to the unit's channel
    trained = photons_per_energy(wavelength_nm) * np.array(
        [np.interp(wavelength_nm, contract.wavelength_nm, curve) for curve in curves]
    )
    seen = samples @ own.T / (own[unit] @ white)
    expected = samples @ trained.T / (trained[unit] @ white)
    worst = float(np.max(np.sqrt(np.mean((seen / expected - 1) ** 2, axis=0))))
    if worst > LARGEST_MISMATCH:
        raise UnitError(
            f"the sensor's filters are not those that the model is for: electrons of coloured light"
            f" differ by {worst:.0%} (rms); expected at most {LARGEST_MISMATCH:.0%}; train a model"
            " for this sensor, or use isp=merge"
        )
    ledger.error(
        worst,
        "relative",
        "measured",
        "electrons of coloured light against the sensor that the model is for, rms",
        key="filters",
    )


def near_invalid(invalid: np.ndarray, cell: tuple[int, int]) -> np.ndarray:
    """Return the pixels (y, x) with an invalid sample at a distance of less than one cell."""
    size = [2 * side - 1 for side in cell]
    return maximum_filter(invalid, size, mode="constant") if invalid.any() else invalid
