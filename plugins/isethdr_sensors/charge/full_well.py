"""Full well: the largest charge of a photodiode. Further charge is drained, or flows along the
column (`blooming`).
"""

from __future__ import annotations

import numpy as np

from isethdr_core.physics.detector.noise import LARGEST_MEAN_E


def limit_charge(charge_e: np.ndarray, full_well_e: float) -> np.ndarray:
    """Return the charge that stays, electrons. The limit applies to the charge with shot noise, not
    to its mean, because actual electrons spill.
    """
    return np.minimum(charge_e, full_well_e)


def limit_mean(mean_e: np.ndarray, full_well_e: float) -> np.ndarray:
    """Return the mean charge, limited to a value at which every Poisson draw fills the well. This
    keeps strong light within the range of the random number generator.

    A draw from 64 random bits is never more than 9.2 standard deviations below its mean. For a mean
    of 12 sqrt(well) + 100 electrons above the well, all draws therefore fill it.
    """
    return np.minimum(
        mean_e, min(full_well_e + 12.0 * np.sqrt(full_well_e) + 100.0, LARGEST_MEAN_E)
    )


def full(charge_e: np.ndarray, full_well_e: float) -> np.ndarray:
    """Return where the charge is only a lower limit, because the well is full or there are more
    electrons than can be counted.

    Means beyond 1e18 e are drawn as 1e18, with an error of at most 1e10 e. No converter of a real
    sensor reaches this range.
    """
    return charge_e >= min(full_well_e, LARGEST_MEAN_E - 1e10)
