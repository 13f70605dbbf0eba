"""The table that reads a lin-log pixel back: linear DN, the electrons that have to arrive for it, and their variance."""

from __future__ import annotations

import numpy as np

from isethdr_core.physics.charge_dynamics import arrived_from_charge, slope
from isethdr_core.physics.charge_dynamics_noise import EMPTY, flow_moments

from . import converter
from .soft_knee_shot import linear_top_dn

ENTRIES = 1024      # of the bent part, where no code says how fine it has to be
STRAIGHT_E = 1e-6   # electrons spilled up to which the table is a straight line


def response(reading, exposure_s: float, soft) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (DN, electrons, e^2): one entry per code beyond the linear part, so that nothing is interpolated there.

    Light is constant over the exposure. The dark charge is part of the electrons, as it is below the knee. The variance is that of
    one reading of so many electrons: charge, read noise and rounding, divided by the slope of the response squared; it is
    Poisson's below the knee. The last entry is the top code and measures no light: it stands for all that is brighter.
    """
    knee, top = linear_top_dn(reading, exposure_s, soft, STRAIGHT_E), converter.top_code(reading)
    bent = np.arange(knee, top + 1.0) if reading.bits else np.linspace(knee, top, ENTRIES)
    electrons = arrived_from_charge((bent - reading.black_dn) / reading.gain_dn_per_e, exposure_s, soft)
    start = np.array([0.0, reading.black_dn] if reading.black_dn > 0 else [-1000.0, 0.0])  # the straight line goes on below black
    read_var_e2 = reading.read_noise_e**2 + converter.quantisation_e(reading) ** 2 / 12
    charge_var_e2 = flow_moments(EMPTY, electrons / exposure_s, exposure_s, soft).charge_var_e2
    variance = (charge_var_e2 + read_var_e2) / slope(electrons, exposure_s, soft) ** 2
    return (np.concatenate([start, bent]), np.concatenate([(start - reading.black_dn) / reading.gain_dn_per_e, electrons]),
            np.concatenate([np.full(2, read_var_e2), variance]))
