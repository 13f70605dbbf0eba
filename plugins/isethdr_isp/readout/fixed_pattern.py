"""Fixed pattern: the differences between the samples of devices of the same model.

PRNU scales the signal, the dark spread scales the dark charge, offsets add to a reading. PRNU and
dark spread belong to the silicon of a photodiode. All readings of one photodiode have the same
deviation, so their weights are added before they are squared.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.errors import UnitError

from .noise_propagation import Alike, NoisePart, SampleNoise

if TYPE_CHECKING:
    import xarray as xr

TERMS = ("prnu", "dark_spread_e", "dsnu_e", "column_e", "row_e")  # optional variables of captures
SILICON = "silicon"
# For each cause (pixel, column, row), the samples that share one deviation: (rows, columns)
CAUSES: tuple[tuple[Alike, Alike], ...] = (("same", "same"), ("any", "same"), ("same", "any"))


@dataclass(frozen=True, eq=False)
class DeviceSpread:
    """The differences between devices that the captures state, for one capture."""

    prnu: float = 0.0  # rms over pixels of the response / mean
    dark_spread_e: float = 0.0  # rms over pixels of the dark charge of the exposure
    dsnu_e: float = 0.0  # rms over pixels of the offset of the reading
    column_e: float = 0.0  # rms over columns of the offset
    row_e: float = 0.0  # rms over rows of the offset
    silicon: int = 0  # readings with the same number share the silicon of a photodiode
    # arriving electrons that correspond to one electron of offset; 1 for a linear pixel
    offset_gain: np.ndarray | float = 1.0

    def of_silicon(self) -> DeviceSpread:
        """Return the terms that all readings of a charge share."""
        return replace(self, dsnu_e=0.0, column_e=0.0, row_e=0.0)

    def of_offsets(self) -> DeviceSpread:
        """Return the terms that belong to one reading."""
        return replace(self, prnu=0.0, dark_spread_e=0.0)

    def any(self) -> bool:
        """Return whether anything differs between devices."""
        return max(self.prnu, self.dark_spread_e, self.dsnu_e, self.column_e, self.row_e) > 0


class WeightedRead(NamedTuple):
    """One reading as part of a merged mosaic."""

    spread: DeviceSpread
    weight: np.ndarray | float  # (y, x) electrons of the mosaic per electron of this reading
    # (y, x) electrons of this reading per electron of the mosaic, in the same light
    sensitivity: np.ndarray | float = 1.0


def device_spread(
    captures: xr.Dataset, i: int, offset_gain: np.ndarray | float = 1.0
) -> DeviceSpread:
    """Return the spread between devices that one capture states.

    A term that the captures lack is 0. Without `silicon`, `charge` is used in its place.

    Parameters
    ----------
    captures : the captures Dataset.
    i : number of the capture.
    offset_gain : electrons of the result per electron of an offset, a number or (y, x).
    """
    terms = {name: float(captures[name].values[i]) for name in TERMS if name in captures}
    silicon = captures[SILICON if SILICON in captures else "charge"].values[i]
    return DeviceSpread(**terms, silicon=int(silicon), offset_gain=offset_gain)


def check_device_spread(captures: xr.Dataset) -> None:
    """Raise UnitError unless the optional terms are finite, 0 or above, one per capture."""
    for name in (*TERMS, SILICON):
        if name not in captures:
            continue
        if tuple(captures[name].dims) != ("capture",):
            raise UnitError(
                f"captures have {name} with dims {tuple(captures[name].dims)}; expected"
                " ('capture',)"
            )
        if not np.all((captures[name].values >= 0) & np.isfinite(captures[name].values)):
            unit = {"prnu": "a share of the mean", SILICON: "a whole number"}.get(name, "electrons")
            raise UnitError(
                f"captures have {name} = {captures[name].values}; expected {unit}, 0 or above"
            )


def fixed_pattern(
    reads: list[WeightedRead], signal_e: np.ndarray, variance_e2: np.ndarray
) -> SampleNoise:
    """Return the fixed-pattern variance of a merged mosaic over an ensemble of devices.

    Parameters
    ----------
    reads : every reading with its weight in the mosaic.
    signal_e, variance_e2 : (y, x) the mosaic without dark charge, electrons, and its temporal
        variance, e^2.

    Notes
    -----
    The variance by PRNU is proportional to the square of the mean signal, which is estimated
    without bias as signal^2 - variance. It may therefore be negative for a pixel in the dark. The
    sum with the temporal variance is positive.
    """
    reads = [read for read in reads if read.spread.any()]
    if not reads:
        return SampleNoise()
    shape = np.shape(signal_e)
    light = {}
    dark = {}
    pixel, column, row = np.zeros((3, *shape))
    for spread, weight, sensitivity in reads:
        key = spread.silicon
        if spread.prnu:
            light[key] = light.get(key, 0.0) + weight * (sensitivity * spread.prnu)
        if spread.dark_spread_e:
            dark[key] = dark.get(key, 0.0) + weight * spread.dark_spread_e
        for total, offset_e in (
            (pixel, spread.dsnu_e),
            (column, spread.column_e),
            (row, spread.row_e),
        ):
            if offset_e:
                total += np.square(weight * (spread.offset_gain * offset_e))
    if light:
        pixel += sum(np.square(share) for share in light.values()) * (
            np.square(signal_e) - variance_e2
        )
    for share in dark.values():
        pixel += np.square(share)
    parts = (NoisePart(values, *cause) for values, cause in zip((pixel, column, row), CAUSES))
    return SampleNoise(tuple(part for part in parts if np.any(part.variance_e2)))
