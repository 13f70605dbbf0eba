"""The function of mean electrons whose noise is 1, from what a camera's captures state.

A pixel collects s electrons of light in its most sensitive capture. Capture k then holds
r_k s + d_k electrons, with the noise variance r_k s + d_k + read noise^2 + step^2 / 12 +
(prnu r_k s)^2, up to its top. Captures of one charge share the shot noise, so their read variances
are joined first; charges are independent, and the inverses of their variances of s add up to I(s).
The stabilised value is the integral of sqrt(I) from 0 to s: its noise is 1 (Bartlett 1947). Beyond
all tops I is 0: a saturated pixel tells no difference.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from isethdr_isp.demosaic.interpolation import array_period
from scipy.integrate import cumulative_trapezoid
from scipy.special import ndtr

from isethdr_core.errors import ConfigError, did_you_mean

LEAST_E = 1e-4
PER_DECADE = 60
NONLINEAR = ("response_dn", "companding_dn")  # variables of captures with a table of their own


@dataclass(frozen=True, eq=False)
class Reading:
    """What one capture states of each of its pixels."""

    charge: int  # number of the charge that it reads
    dark_e: float
    read_variance_e2: float  # read noise and steps
    top_e: float
    prnu: float
    sensitivity: np.ndarray  # (channel,) electrons of white light, relative to other captures


@dataclass(frozen=True, eq=False)
class Readings:
    """The captures that an observer uses, all of one camera at one exposure."""

    captures: tuple[Reading, ...]

    def reference(self) -> np.ndarray:
        """Return the sensitivity (channel,) of the most sensitive capture."""
        return np.max([reading.sensitivity for reading in self.captures], axis=0)


def readings(captures: xr.Dataset, only: tuple[str, ...] = ()) -> Readings:
    """Return what captures state.

    Parameters
    ----------
    captures : captures of a sensor.
    only : names of the captures that are used; none: all.

    Raises
    ------
    ConfigError : a name that is none of the captures; captures with a nonlinear code.
    """
    names = [str(name) for name in captures["capture"].values]
    for name in only:
        if name not in names:
            raise ConfigError(
                f"the camera has no capture {name!r}{did_you_mean(name, names)}; expected some of"
                f" {', '.join(names)}; type for example cameras=split_pixel:{names[0]}"
            )
    if nonlinear := [name for name in NONLINEAR if name in captures]:
        raise ConfigError(
            f"the captures have a nonlinear code ({nonlinear[0]}); expected linear captures that"
            " leave the chip one by one; type for example cameras=split_pixel"
        )
    return Readings(
        tuple(_reading(captures, k) for k, name in enumerate(names) if not only or name in only)
    )


def _reading(captures: xr.Dataset, k: int) -> Reading:
    def value(name: str) -> float:
        return float(captures[name].values[k])

    gain = value("gain_dn_per_e")
    white = captures["quantum_efficiency"].values[k].sum(-1)
    return Reading(
        charge=int(captures["charge"].values[k]),
        dark_e=value("dark_e"),
        read_variance_e2=value("read_noise_e") ** 2 + value("quantisation_e") ** 2 / 12,
        top_e=(value("top_dn") - value("black_dn")) / gain,
        prnu=value("prnu") if "prnu" in captures else 0.0,
        sensitivity=white * value("exposure_s") * value("area_m2"),
    )


def information(captures: Readings, channel: int, light_e: np.ndarray) -> np.ndarray:
    """Return the inverse variance of s at mean electrons of light, 1/e^2.

    Parameters
    ----------
    captures : captures that the observer uses.
    channel : number of the channel of the filter array.
    light_e : any shape, electrons of the most sensitive capture, without dark charge.
    """
    reference = captures.reference()[channel]
    total = np.zeros(np.shape(light_e))
    for charge in sorted({reading.charge for reading in captures.captures}):
        reads = [reading for reading in captures.captures if reading.charge == charge]
        share = reads[0].sensitivity[channel] / reference
        own_e = share * light_e + reads[0].dark_e
        inverse = np.zeros(np.shape(light_e))
        for read in reads:
            variance = own_e + read.read_variance_e2
            below_top = ndtr((read.top_e - own_e) / np.sqrt(np.maximum(variance, 1e-12)))
            inverse += below_top / max(read.read_variance_e2, 1e-6)
        shot = own_e + (reads[0].prnu * share * light_e) ** 2
        # 1 / (shot + 1 / inverse), which is 0 where no read is below its top
        total += share**2 * inverse / (1 + shot * inverse)
    return total


class Stabiliser:
    """Stabilised values of mean electrons, by a table for each channel."""

    def __init__(self, captures: Readings, most_e: float) -> None:
        """Tabulate the function.

        Parameters
        ----------
        captures : captures of the camera at its exposure.
        most_e : largest mean electrons that will be asked for.
        """
        decades = np.log10(max(most_e, 1.0) / LEAST_E)
        rising = np.geomspace(LEAST_E, max(most_e, 1.0), int(PER_DECADE * decades) + 2)
        self.light_e = np.concatenate([[0.0], rising])
        self.values = [
            cumulative_trapezoid(
                np.sqrt(information(captures, channel, self.light_e)), self.light_e, initial=0.0
            )
            for channel in range(len(captures.reference()))
        ]

    def __call__(self, light_e: np.ndarray, channel: int) -> np.ndarray:
        """Return the stabilised values of mean electrons of pixels of one channel."""
        return np.interp(light_e, self.light_e, self.values[channel])

    def mosaic(self, light_e: np.ndarray, filters: np.ndarray) -> np.ndarray:
        """Return the stabilised values (y, x) of mean electrons of a mosaic.

        Parameters
        ----------
        filters : (y, x) channel of each pixel.
        """
        rows, columns = array_period(filters)
        values = np.zeros(light_e.shape)
        for down in range(rows):
            for across in range(columns):
                own = slice(down, None, rows), slice(across, None, columns)
                values[own] = self(light_e[own], int(filters[down, across]))
        return values
