"""Full well: a photodiode holds no more charge than this; what comes later is drained, or runs
along the column (`blooming`).
"""

from __future__ import annotations

import numpy as np

from isethdr_core.physics.detector.noise import LARGEST_MEAN_E


def limit_charge(charge_e, full_well_e: float) -> np.ndarray:
    """Return the charge that stays, electrons. Clipped after the shot noise: it is electrons that
    spill, not means.
    """
    return np.minimum(charge_e, full_well_e)


def limit_mean(mean_e, full_well_e: float) -> np.ndarray:
    """Return the mean charge cut where every draw of 64 bits fills the well anyway, so that no
    light is too strong.

    A draw is never more than 9.2 standard deviations low; 12 sqrt(well) + 100 above the well, all
    of them spill.
    """
    return np.minimum(
        mean_e, min(full_well_e + 12.0 * np.sqrt(full_well_e) + 100.0, LARGEST_MEAN_E)
    )


def full(charge_e, full_well_e: float) -> np.ndarray:
    """Return where the charge says no more than that there was at least so much: a full well, or
    more than can be counted.

    Means beyond 1e18 e are drawn as 1e18, at most 1e10 e low; no converter of a real sensor reaches
    that far.
    """
    return charge_e >= min(full_well_e, LARGEST_MEAN_E - 1e10)
