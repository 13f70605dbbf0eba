"""The table that converts codes of a lin-log pixel to electrons: linear DN, the electrons that have
to arrive for it, and their variance.

The inverse of the response is convex. With noise, its mean is therefore too bright: by 0.16 % on
the logarithmic part, by 0.9 % at the knee. The table is therefore not the inverse of the response,
but a function that gives, in the mean over the noise, the electrons that arrived.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.detector.charge_dynamics import arrived_from_charge, flow, shares, slope
from isethdr_core.physics.detector.charge_dynamics_noise import EMPTY, flow_moments
from isethdr_core.physics.detector.noise import LARGEST_MEAN_E

from ..charge.soft_knee_shot import linear_top_dn
from ..noise.lin_log_variance import ReadBack, scatter_of_readings
from . import companding, converter

if TYPE_CHECKING:
    from isethdr_core.physics.detector.charge_dynamics import Well

    from ..sensor_model import Reading

ENTRIES = 1024  # number of entries of the nonlinear part for a sensor without a converter
STRAIGHT_E = 1e-6  # spilled electrons up to which the table is a straight line
# nodes and weights of the quadrature over noise, in standard deviations
NODES, SHARE = np.polynomial.hermite_e.hermegauss(21)
SHARE = SHARE / SHARE.sum()
ROUNDS = 12  # largest number of corrections of the table; each leaves about a hundredth of the bias
RATIOS = 3  # number of corrections of the variance by ratios
REACH = 10.0  # standard deviations of noise by which the table is extended while it is computed
FINITE_E = 1e60  # end of the table while it is computed; the square of this number is still finite


@lru_cache(maxsize=8)  # each shot of a camera uses the same table, which takes 50 ms
def response(
    reading: Reading, exposure_s: float, soft: Well, noise: bool = True
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the table (DN, electrons, variance in e^2), each (entry,). It has one entry per code
    beyond the linear part, so that no interpolation is needed there.

    Light is constant over the exposure. The dark charge is part of the electrons, as below the
    knee. The variance is that of one reading: charge, read noise and rounding, divided by the
    square of the slope of the response. Below the knee the variance of the charge is that of a
    Poisson count. The last entry is the top code, or the code of the largest light of a shot. It
    measures no light, because all brighter light gives the same code. If the codes are companded,
    the variance contains their steps, and the last entry is the linear code of the companded top.

    Parameters
    ----------
    reading : the reading of the photodiode.
    exposure_s : exposure time, s.
    soft : `charge_dynamics.Well` of the photodiode.
    noise : whether the sensor has noise; without noise the table is the inverse of the response.

    Notes
    -----
    The charge left by `n` arriving electrons is `flow(n)` plus thermal noise of variance rho(n)
    that is independent of n. If the mean of the table over this noise, read noise and rounding is n
    for every n, the table has no bias for any light and any pixel.
    """
    knee = linear_top_dn(reading, exposure_s, soft, STRAIGHT_E)
    top = converter.top_code(reading)
    step = 1.0 if reading.bits else (top - knee) / (ENTRIES - 1)
    widest_e2 = _read_variance_e2(reading, _corners_dn(reading)).max()
    reach = REACH * np.sqrt(widest_e2 + soft.thermal_e) * reading.gain_dn_per_e
    bent = (
        np.arange(knee, top + reach + step, step)
        if reading.bits
        else knee + step * np.arange(ENTRIES + np.ceil(reach / step))
    )
    electrons = arrived_from_charge(
        (bent - reading.black_dn) / reading.gain_dn_per_e, exposure_s, soft
    )
    # the straight line extends below black
    start = _straight_dn(reading, knee)
    line = (start - reading.black_dn) / reading.gain_dn_per_e
    usable = (electrons < FINITE_E) & (bent > start[-1])
    bent = bent[usable]
    electrons = electrons[usable]
    inside = (bent <= top + step / 2) & (electrons <= LARGEST_MEAN_E)
    read_var_e2 = _read_variance_e2(reading, bent)
    charge_var_e2 = flow_moments(EMPTY, electrons / exposure_s, exposure_s, soft).charge_var_e2
    variance = (charge_var_e2 + read_var_e2) / slope(electrons, exposure_s, soft) ** 2
    if noise:
        _, spills, h = shares(0.0, electrons, exposure_s, soft)
        width_dn = (
            np.sqrt(soft.thermal_e * spills * (1 - spills * h) + read_var_e2)
            * reading.gain_dn_per_e
        )
        slopes = slope(electrons, exposure_s, soft)
        electrons, scatter_e2 = without_bias(bent, electrons, width_dn, line[-1])
        # the mean of the electrons read back is the count that arrived, so the variance of the
        # count and the scatter of the readings around it add up
        off_bend_e2 = np.maximum(as_mean(bent, scatter_e2, width_dn), read_var_e2)

        def response_dn(count: np.ndarray) -> np.ndarray:
            charge_e, _ = flow(0.0, count / exposure_s, exposure_s, soft)
            return reading.black_dn + reading.gain_dn_per_e * charge_e

        read_back = ReadBack(bent, electrons, width_dn, response_dn, reading.bits > 0)
        variance = electrons + scatter_of_readings(read_back, slopes, scatter_e2, off_bend_e2)
    table = _up_to_last_code(
        reading,
        np.append(start, bent[inside]),
        np.append(line, electrons[inside]),
        np.append(_read_variance_e2(reading, start) + np.maximum(line, 0.0), variance[inside]),
    )
    for values in table:
        values.flags.writeable = False
    return table


def companding_error(reading: Reading, soft: Well) -> float:
    """Return the largest relative error of the electrons of light beyond the knee that the rounding
    to companded codes causes; 0 without companding.

    Parameters
    ----------
    reading : the reading of the photodiode.
    soft : `charge_dynamics.Well` of the photodiode.
    """
    if not reading.companding:
        return 0.0
    widest_dn = converter.code_steps(reading, _corners_dn(reading)).max()
    return float(np.expm1(widest_dn / 2 / reading.gain_dn_per_e / soft.thermal_e))


def _read_variance_e2(reading: Reading, dn: np.ndarray) -> np.ndarray:
    """Return the variance of read noise and rounding at linear `dn`, e^2 of charge."""
    step_e = converter.quantisation_e(reading) * converter.code_steps(reading, dn)
    return reading.read_noise_e**2 + reading.row_noise_e**2 + step_e**2 / 12


def _corners_dn(reading: Reading) -> np.ndarray:
    """Return the linear DN at which segments of the companding begin; 0 without companding."""
    if not reading.companding:
        return np.zeros(1)
    return companding.table(reading.companding, converter.top_code(reading))[0][:-1]


def _straight_dn(reading: Reading, knee_dn: float) -> np.ndarray:
    """Return the entries of the straight part of the table, below `knee_dn`, linear DN: two from
    which the line is extended below black, and those between which the step of the codes changes.
    """
    black_dn = reading.black_dn
    corners = _corners_dn(reading)[1:]
    before = corners - converter.code_steps(reading, corners - 0.5)
    steps = np.union1d(before, corners)
    steps = steps[(steps > black_dn) & (steps < knee_dn)]
    return np.append([0.0, black_dn] if black_dn > 0 else [-1000.0, 0.0], steps)


def _up_to_last_code(
    reading: Reading, dn: np.ndarray, electrons: np.ndarray, variance: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a table (entry,) that ends at the linear code to which its last entry is decoded."""
    if not reading.companding:
        return dn, electrons, variance
    knees = reading.companding, converter.top_code(reading)
    end_dn = float(companding.decompand(companding.compand(dn[-1], *knees), *knees))
    if end_dn >= dn[-1]:
        return dn, electrons, variance
    below = dn < end_dn
    end_e, end_e2 = (np.interp(end_dn, dn, values) for values in (electrons, variance))
    return (
        np.append(dn[below], end_dn),
        np.append(electrons[below], end_e),
        np.append(variance[below], end_e2),
    )


def without_bias(
    dn: np.ndarray, mean_wanted: np.ndarray, width_dn: np.ndarray, lowest: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the increasing table (entry,) with the mean `mean_wanted` over the noise at each
    entry, and its variance (entry,) over the noise.

    Parameters
    ----------
    dn : readings (entry,) of the table, increasing, DN.
    mean_wanted : wanted mean of the table over the noise (entry,), electrons.
    width_dn : standard deviation of the noise at each entry (entry,), DN.
    lowest : electrons that the first entry must exceed.
    """
    out = mean_wanted.copy()
    for rounds_left in reversed(range(ROUNDS)):
        values = over_noise(dn, out, width_dn)
        mean = values @ SHARE
        better = out + mean_wanted - mean
        # where noise is wider than the bend, the corrections begin to oscillate; a table that does
        # not increase cannot be used
        if not rounds_left or np.any(np.diff(better, prepend=lowest) <= 0):
            break
        out = better
    return out, (values - mean[:, None]) ** 2 @ SHARE


def as_mean(dn: np.ndarray, mean_wanted: np.ndarray, width_dn: np.ndarray) -> np.ndarray:
    """Return the positive table (entry,) with the mean `mean_wanted` over the noise, wherever
    `mean_wanted` is linear or exponential within the width of the noise.

    The table is corrected by ratios (Gold 1964); an exponential is exact after one round.

    Parameters
    ----------
    dn : readings (entry,) of the table, increasing, DN.
    mean_wanted : wanted mean of the table over the noise (entry,), above 0.
    width_dn : standard deviation of the noise at each entry (entry,), DN.
    """
    out = mean_wanted.copy()
    for _ in range(RATIOS):
        out = out * (mean_wanted / (np.maximum(over_noise(dn, out, width_dn), 0.0) @ SHARE))
    return out


def over_noise(dn: np.ndarray, table: np.ndarray, width_dn: np.ndarray) -> np.ndarray:
    """Return the values (entry, node) of the table at the nodes of a normal distribution around
    each entry.

    Parameters
    ----------
    dn : readings (entry,) of the table, increasing, DN.
    table : values at these readings (entry,), the last two above 0. The table is extended linearly
        below them and exponentially above them.
    width_dn : standard deviation of the noise at each entry (entry,), DN.
    """
    noisy_dn = dn[:, None] + width_dn[:, None] * NODES
    below_table = np.minimum(noisy_dn - dn[0], 0.0)
    above_table = np.maximum(noisy_dn - dn[-1], 0.0)
    slope_before = (table[1] - table[0]) / (dn[1] - dn[0])
    growth = np.log(table[-1] / table[-2]) / (dn[-1] - dn[-2])
    return (np.interp(noisy_dn, dn, table) + slope_before * below_table) * np.exp(
        growth * above_table
    )
