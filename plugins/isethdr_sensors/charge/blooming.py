"""Blooming: charge beyond the full well runs along the column into wells that still have room."""

from __future__ import annotations

import numpy as np


def bloom(charge_e: np.ndarray, full_well_e: float, percent: float) -> np.ndarray:
    """Return the charge (y, x), electrons, after `percent` of the excess of each pixel has flowed
    along its column. The rest of the excess is drained.

    Half of the excess flows down and half flows up. Each stream fills the wells that it meets, and
    the remainder flows on; at the border it is lost. The result is the mean of both orders, down
    first and up first, so that no direction is preferred.

    Parameters
    ----------
    charge_e : collected charge (y, x), electrons; charge flows along y.
    full_well_e : largest charge that a photodiode holds, electrons.
    percent : share of the excess that flows along the column, 0 to 100.
    """
    excess = np.maximum(charge_e - full_well_e, 0.0) * (percent / 100 / 2)
    capped_e = np.minimum(charge_e, full_well_e)
    if not excess.any():
        return capped_e
    down_first = _run(_run(capped_e, excess, full_well_e)[::-1], excess[::-1], full_well_e)[::-1]
    up_first = _run(_run(capped_e[::-1], excess[::-1], full_well_e)[::-1], excess, full_well_e)
    return (down_first + up_first) / 2


def _run(capped_e: np.ndarray, excess: np.ndarray, full_well_e: float) -> np.ndarray:
    """Return the charge after the excess of each row has flowed to the rows below it."""
    charge_e = capped_e.copy()
    carry = np.zeros(capped_e.shape[1])
    for y in range(len(charge_e)):
        accepted = np.minimum(carry, full_well_e - charge_e[y])
        charge_e[y] += accepted
        carry = carry - accepted + excess[y]
    return charge_e
