"""Full well: the largest charge of a photodiode. Further charge is drained, or flows along the
column (`blooming`).
"""

from __future__ import annotations

import numpy as np

from isethdr_core.physics.detector.noise import LARGEST_MEAN_E


def limit_charge(charge_e: np.ndarray, full_well_e: float) -> np.ndarray:
    """Return the charge that stays, electrons. The limit applies after the shot noise, because
    electrons spill and not their mean.
    """
    return np.minimum(charge_e, full_well_e)


def limit_mean(mean_e: np.ndarray, full_well_e: float) -> np.ndarray:
    """Return the mean charge cut where every draw of 64 bits fills the well anyway, so that no
    light is too strong.

    A draw is never more than 9.2 standard deviations low; 12 sqrt(well) + 100 above the well, all
    of them spill.
    """
    return np.minimum(
        mean_e, min(full_well_e + 12.0 * np.sqrt(full_well_e) + 100.0, LARGEST_MEAN_E)
    )


def full(charge_e: np.ndarray, full_well_e: float) -> np.ndarray:
    """Return where the charge is only a lower limit: a full well, or more electrons than can be
    counted.

    Means beyond 1e18 e are drawn as 1e18, with an error of at most 1e10 e. No converter of a real
    sensor reaches this range.
    """
    return charge_e >= min(full_well_e, LARGEST_MEAN_E - 1e10)
