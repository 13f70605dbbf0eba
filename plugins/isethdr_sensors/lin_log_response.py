"""The table that reads a lin-log pixel back: linear DN, the electrons that have to arrive for it, and their variance.

Noise on a curve that steepens reads too bright on average: 0.16 % on the logarithm, 0.9 % at its bend. So the table is not the inverse
of the response, but the function whose mean over the noise is the electrons that arrived.
"""

from __future__ import annotations

import numpy as np

from isethdr_core.physics.charge_dynamics import arrived_from_charge, shares, slope
from isethdr_core.physics.charge_dynamics_noise import EMPTY, flow_moments

from . import converter
from .soft_knee_shot import linear_top_dn

ENTRIES = 1024      # of the bent part, where no code says how fine it has to be
STRAIGHT_E = 1e-6   # electrons spilled up to which the table is a straight line
NODES, SHARE = np.polynomial.hermite_e.hermegauss(21)
SHARE = SHARE / SHARE.sum()
ROUNDS = 12          # each leaves about a hundredth of the bias
REACH = 10.0        # noise widths by which the table is continued while it is made


def response(reading, exposure_s: float, soft, noise: bool = True) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (DN, electrons, e^2): one entry per code beyond the linear part, so that nothing is interpolated there.

    Light is constant over the exposure. The dark charge is part of the electrons, as it is below the knee. The variance is that of
    one reading of so many electrons: charge, read noise and rounding, divided by the slope of the response squared; it is
    Poisson's below the knee. The last entry is the top code and measures no light: it stands for all that is brighter.

    Parameters
    ----------
    noise : of the sensor; without it the table is the plain inverse of the response.

    Notes
    -----
    The charge that `n` arriving electrons leave is `flow(n)` plus thermal noise of variance rho(n) that knows nothing of n. A table whose
    mean over rho, read noise and rounding is n for every n is therefore without bias for any light and any pixel.
    """
    knee, top = linear_top_dn(reading, exposure_s, soft, STRAIGHT_E), converter.top_code(reading)
    step = 1.0 if reading.bits else (top - knee) / (ENTRIES - 1)
    read_var_e2 = reading.read_noise_e**2 + reading.row_noise_e**2 + converter.quantisation_e(reading) ** 2 / 12
    reach = REACH * np.sqrt(read_var_e2 + soft.thermal_e) * reading.gain_dn_per_e
    bent = np.arange(knee, top + reach + step, step) if reading.bits else knee + step * np.arange(ENTRIES + np.ceil(reach / step))
    inside = bent <= top + step / 2
    electrons = arrived_from_charge((bent - reading.black_dn) / reading.gain_dn_per_e, exposure_s, soft)
    start = np.array([0.0, reading.black_dn] if reading.black_dn > 0 else [-1000.0, 0.0])  # the straight line goes on below black
    line = (start - reading.black_dn) / reading.gain_dn_per_e
    charge_var_e2 = flow_moments(EMPTY, electrons / exposure_s, exposure_s, soft).charge_var_e2
    variance = (charge_var_e2 + read_var_e2) / slope(electrons, exposure_s, soft) ** 2
    if noise:
        _, spills, h = shares(0.0, electrons, exposure_s, soft)
        width_dn = np.sqrt(soft.thermal_e * spills * (1 - spills * h) + read_var_e2) * reading.gain_dn_per_e
        electrons, scatter_e2 = without_bias(bent, electrons, width_dn, line[-1])
        # the mean reading is the count that arrived: its own variance and the scatter of readings about it add up
        variance = electrons + np.maximum(without_bias(bent, scatter_e2, width_dn)[0], read_var_e2)
    return (np.append(start, bent[inside]), np.append(line, electrons[inside]), np.append(np.full(2, read_var_e2), variance[inside]))


def without_bias(dn, wanted, width_dn, lowest: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return the table (entry,) whose mean over the noise is `wanted` at each entry, and its variance over the noise there.

    Parameters
    ----------
    dn, wanted : positive, straight before the first entry, exponential after the last.
    width_dn : rms of the normal noise at each entry.
    lowest : what a table that has to rise starts above; None lets it fall.

    Notes
    -----
    Van Cittert 1931: what the mean lacks is added, again and again. A shape finer than the noise does not come back.
    """
    seen = dn[:, None] + width_dn[:, None] * NODES
    before, after = np.minimum(seen - dn[0], 0.0), np.maximum(seen - dn[-1], 0.0)
    out = wanted.copy()
    for left in reversed(range(ROUNDS)):
        slope_before, growth = (out[1] - out[0]) / (dn[1] - dn[0]), np.log(out[-1] / out[-2]) / (dn[-1] - dn[-2])
        values = (np.interp(seen, dn, out) + slope_before * before) * np.exp(growth * after)
        mean = values @ SHARE
        better = out + wanted - mean
        # where noise is wider than the bend the corrections begin to swing: a table that does not rise cannot be read back
        if not left or lowest is not None and np.any(np.diff(better, prepend=lowest) <= 0):
            break
        out = better
    return out, (values - mean[:, None]) ** 2 @ SHARE
