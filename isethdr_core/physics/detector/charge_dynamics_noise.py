"""Noise of a charge with soft overflow: mean, variance and covariance with the spilled charge in
closed form, and random charges.

Electrons arrive and leave one by one, so that to second order (van Kampen's linear noise
approximation)

    dV/dt = 2 f'(Q) V + current + overflow(Q),   f(Q) = current - overflow(Q),

along the exact mean Q(t). Under constant light the integral has a closed form. P, R = 1 - P and h
are those of `charge_dynamics.shares`. With the N electrons that arrive, their effective share
k = P + R h that stays, and rho = thermal R (1 - R h), an interval of light adds

    variance of the charge          N k^2 + rho
    variance of the spilled charge  N (1 - k)^2 + rho
    covariance                      N k (1 - k) - rho

Of a deviation of the charge at the start, the share P remains as charge and R as spill. For a given
number of arrived electrons, the mean charge is thus `flow` of that number, and rho is the thermal
noise of the electrons that left. Without spill the charge is Poisson distributed. In a full well
its variance is `thermal_e` for any strength of light. The sum of charge and spill is always Poisson
distributed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .charge_dynamics import Well, flow, shares
from .noise import LARGEST_MEAN_E, poisson


class Moments(NamedTuple):
    """Means (e) and second moments (e^2) of the charge in the well and of all spilled charge."""

    charge_e: np.ndarray
    spilled_e: np.ndarray
    charge_var_e2: np.ndarray
    spilled_var_e2: np.ndarray
    covariance_e2: np.ndarray


EMPTY = Moments(0.0, 0.0, 0.0, 0.0, 0.0)


def flow_moments(
    before: Moments, current_e_per_s: float | np.ndarray, duration_s: float, well: Well
) -> Moments:
    """Return the moments after `duration_s` of constant current. For several pieces of light, call
    this function once per piece.

    Parameters
    ----------
    before : moments of charge and spilled charge at the start.
    current_e_per_s : constant current, electrons per second, 0 or more.
    duration_s : duration, s, above 0.
    well : knee, thermal electrons and overflow current of the photodiode.
    """
    arrived = np.asarray(current_e_per_s * duration_s, float)
    stays, spills, h = shares(before.charge_e, arrived, duration_s, well)
    variance_kept = stays + spills * h
    variance_lost = spills * (1 - h)
    thermal = well.thermal_e * spills * (1 - spills * h)
    charge, spilled = flow(before.charge_e, current_e_per_s, duration_s, well)
    v = before.charge_var_e2
    w = before.spilled_var_e2
    c = before.covariance_e2
    return Moments(
        charge,
        before.spilled_e + spilled,
        stays**2 * v + arrived * variance_kept**2 + thermal,
        w + 2 * spills * c + spills**2 * v + arrived * variance_lost**2 + thermal,
        stays * c + stays * spills * v + arrived * variance_kept * variance_lost - thermal,
    )


def draw_charge(
    arrived_e: np.ndarray, word: np.ndarray, duration_s: float, well: Well
) -> np.ndarray:
    """Return a random charge that is left in the well, for the given number of electrons that
    arrived in `duration_s` of constant light.

    Parameters
    ----------
    arrived_e : Poisson counts, 0 or more.
    word : int64 random words of the same shape (`physics.random_words`), from a separate stream.
    duration_s : duration of the light, s.
    well : knee, thermal electrons and overflow current of the photodiode.

    Notes
    -----
    The spill is its mean plus a centred Poisson count of variance rho. If little spills, rho equals
    the mean, so that the spill is Poisson distributed. rho never exceeds the mean, so that the
    spill is never negative. Charge and spill add up to `arrived_e`.
    """
    arrived = np.minimum(np.asarray(arrived_e, float), LARGEST_MEAN_E)
    charge, _ = flow(0.0, arrived / duration_s, duration_s, well)
    _, spills, h = shares(0.0, arrived, duration_s, well)
    thermal = well.thermal_e * spills * (1 - spills * h)
    return charge + thermal - poisson(thermal, word)
