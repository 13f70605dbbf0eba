"""Variance stabilisation: a function of mean electrons that has a noise of 1, from the figures that
a camera's captures state.

A pixel collects s electrons of light in its most sensitive capture. Capture k then holds
r_k s + d_k electrons, with the noise variance r_k s + d_k + read noise^2 + step^2 / 12 +
(prnu r_k s)^2, up to its top. Captures of one charge share the shot noise, so their read variances
are joined first. Charges are independent, so the inverses of their variances of s add up to I(s).
The stabilised value is the integral of sqrt(I) from 0 to s, and its noise is 1 (Bartlett 1947).
Above all tops I is 0, because a saturated pixel shows no difference.

If codes are companded, or captures are combined on the chip, the variance beyond the shot noise
depends on the electrons, because steps are wider, or another reading is used, in bright light.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from isethdr_isp.readout.electrons import linear_dn
from isethdr_isp.readout.nonlinear_response import bent_response
from scipy.integrate import cumulative_trapezoid
from scipy.special import ndtr

from isethdr_core.errors import ConfigError, did_you_mean

LEAST_E = 1e-4
PER_DECADE = 60
Table = tuple[np.ndarray, np.ndarray]  # (entry,) rising electrons, and their variance


@dataclass(frozen=True, eq=False)
class Reading:
    """The figures that one capture states about each of its pixels.

    Parameters
    ----------
    charge : number of the charge that it reads.
    dark_e : mean dark charge, electrons.
    read_variance_e2 : variance of read noise and quantisation, electrons squared.
    top_e : largest electrons that it can show.
    prnu : photo response non-uniformity, relative.
    sensitivity : (channel,) electrons of white light, relative to other captures.
    variances : variance beyond the shot noise by electrons, which include the dark charge; None:
        it is `read_variance_e2` everywhere.
    """

    charge: int
    dark_e: float
    read_variance_e2: float
    top_e: float
    prnu: float
    sensitivity: np.ndarray
    variances: Table | None = None

    def variance_beyond_shot(self, own_e: np.ndarray) -> np.ndarray | float:
        """Return the variance, e^2, beyond the shot noise of `own_e` electrons."""
        if self.variances is None:
            return self.read_variance_e2
        return np.interp(own_e, *self.variances)


@dataclass(frozen=True, eq=False)
class Readings:
    """The captures that an observer uses. All are of one camera at one exposure."""

    captures: tuple[Reading, ...]

    def reference(self) -> np.ndarray:
        """Return the sensitivity (channel,) of the most sensitive capture."""
        return np.max([reading.sensitivity for reading in self.captures], axis=0)


def readings(captures: xr.Dataset, only: tuple[str, ...] = ()) -> Readings:
    """Return the figures that captures state.

    Parameters
    ----------
    captures : captures of a sensor.
    only : names of the captures that are used; empty: all.

    Raises
    ------
    ConfigError : a name is not one of the captures.
    """
    names = [str(name) for name in captures["capture"].values]
    for name in only:
        if name not in names:
            raise ConfigError(
                f"the camera has no capture {name!r}{did_you_mean(name, names)}; expected some of"
                f" {', '.join(names)}; type for example cameras=split_pixel:{names[0]}"
            )
    return Readings(
        tuple(_reading(captures, k) for k, name in enumerate(names) if not only or name in only)
    )


def _reading(captures: xr.Dataset, k: int) -> Reading:
    def value(name: str) -> float:
        return float(captures[name].values[k])

    gain = value("gain_dn_per_e")
    white = captures["quantum_efficiency"].values[k].sum(-1)
    noise_e2 = value("read_noise_e") ** 2
    return Reading(
        charge=int(captures["charge"].values[k]),
        dark_e=value("dark_e"),
        read_variance_e2=noise_e2 + value("quantisation_e") ** 2 / 12,
        top_e=(value("top_dn") - value("black_dn")) / gain,
        prnu=value("prnu") if "prnu" in captures else 0.0,
        sensitivity=white * value("exposure_s") * value("area_m2"),
        variances=variances(captures, k, noise_e2),
    )


def variances(captures: xr.Dataset, k: int, noise_e2: float) -> Table | None:
    """Return the variance beyond the shot noise by electrons, which include the dark charge; None
    if it does not depend on the electrons.

    Parameters
    ----------
    captures : captures of a sensor.
    k : number of the capture.
    noise_e2 : variance of its read noise, electrons squared.
    """
    bent = bent_response(captures, k)
    if bent is not None:
        poisson = np.maximum(bent.electrons, 0.0)
        return bent.electrons, np.maximum(bent.variance_e2 - poisson, 0.0)
    if "companding_dn" not in captures:
        return None
    codes = captures["companding_dn"].values[k].astype(float)
    codes = codes[np.isfinite(codes)]
    # both ends of each segment of the table, because steps change from one segment to the next
    ends = np.stack([codes[:-1], np.nextafter(codes[1:], 0.0)], 1).ravel()
    linear, steps, _ = linear_dn(captures, k, ends)
    gain = float(captures["gain_dn_per_e"].values[k])
    electrons = (linear - float(captures["black_dn"].values[k])) / gain
    step_e = float(captures["quantisation_e"].values[k]) * steps
    return electrons, noise_e2 + step_e**2 / 12


def information(captures: Readings, channel: int, light_e: np.ndarray) -> np.ndarray:
    """Return the inverse variance of s at mean electrons of light, 1/e^2.

    Parameters
    ----------
    captures : captures that the observer uses.
    channel : number of the channel of the filter array.
    light_e : mean electrons of light in the most sensitive capture, any shape.
    """
    reference = captures.reference()[channel]
    total = np.zeros(np.shape(light_e))
    for charge in sorted({reading.charge for reading in captures.captures}):
        reads = [reading for reading in captures.captures if reading.charge == charge]
        share = reads[0].sensitivity[channel] / reference
        own_e = share * light_e + reads[0].dark_e
        inverse = np.zeros(np.shape(light_e))
        for read in reads:
            beyond_shot = read.variance_beyond_shot(own_e)
            variance = own_e + beyond_shot
            below_top = ndtr((read.top_e - own_e) / np.sqrt(np.maximum(variance, 1e-12)))
            inverse += below_top / np.maximum(beyond_shot, 1e-6)
        shot = own_e + (reads[0].prnu * share * light_e) ** 2
        # 1 / (shot + 1 / inverse), which is 0 where no read is below its top
        total += share**2 * inverse / (1 + shot * inverse)
    return total


class Stabiliser:
    """Stabilised values of mean electrons, from one table for each channel."""

    def __init__(self, captures: Readings, most_e: float) -> None:
        """Tabulate the function.

        Parameters
        ----------
        captures : captures of the camera at its exposure.
        most_e : largest mean electrons for which values will be needed.
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
        """Return the stabilised values of mean electrons of pixels of one channel.

        Parameters
        ----------
        light_e : mean electrons of light in the most sensitive capture, any shape.
        channel : number of the channel of the filter array.
        """
        return np.interp(light_e, self.light_e, self.values[channel])
