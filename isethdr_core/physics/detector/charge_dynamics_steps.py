"""Stepwise integration of dQ/dt = light(t) - leak Q - overflow(Q), for cases without a closed form
in `charge_dynamics`.

Without a leak, `charge_dynamics.flow_varying` is preferable. Both methods of this module allow any
step at any light without numerical overflow.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.special import wrightomega

from .charge_dynamics import Well, flow


def graded(duration_s: float, steps: int, smallest: float = 1e-12) -> np.ndarray:
    """Return steps + 1 times from 0 to `duration_s`, s. Half of the intervals are uniform; the
    others shrink towards the end.

    The memory of a full well is thermal / current seconds, so that only this time before the end
    needs fine steps.

    Parameters
    ----------
    duration_s : end of the last interval, s.
    steps : number of intervals.
    smallest : ratio of the smallest to the largest of the shrinking intervals, above 0 and below 1.
    """
    fine = steps // 2
    head = np.linspace(0.0, duration_s, steps - fine + 1)
    if fine < 2:
        return np.linspace(0.0, duration_s, steps + 1)
    return np.concatenate(
        [
            head[:-1],
            duration_s - (duration_s - head[-2]) * np.geomspace(1.0, smallest, fine + 1)[1:-1],
            [duration_s],
        ]
    )


def exponential_steps(
    charge_e: float, light_e_per_s: Callable[..., Any], times_s: np.ndarray, well: Well
) -> np.ndarray:
    """Return the charge, electrons, after steps of constant light, each exact for its mean light
    (Simpson's rule). The method is of second order.

    Parameters
    ----------
    charge_e : charge at the start, electrons.
    light_e_per_s : function(time in s) -> electrons per second and pixel, including dark current.
    times_s : rising times, s; the first is the start.
    well : knee, thermal electrons and overflow current of the photodiode.
    """
    for start, end in pairwise(times_s):
        mean = (
            light_e_per_s(start) + 4 * light_e_per_s(0.5 * (start + end)) + light_e_per_s(end)
        ) / 6
        charge_e, _ = flow(charge_e, mean, end - start, well)
    return charge_e


def implicit_steps(
    charge_e: float,
    light_e_per_s: Callable[..., Any],
    times_s: np.ndarray,
    well: Well,
    leak_per_s: float = 0.0,
) -> np.ndarray:
    """Return the charge, electrons, after implicit Euler steps, each solved exactly by Wright's
    omega function. The method is of first order.

    Parameters
    ----------
    charge_e : charge at the start, electrons.
    light_e_per_s : function(time in s) -> electrons per second and pixel, including dark current.
    times_s : rising times, s; the first is the start.
    well : knee, thermal electrons and overflow current of the photodiode.
    leak_per_s : share of the charge that leaks per second, 0 or more.
    """
    for start, end in pairwise(times_s):
        step = end - start
        weight = 1.0 + step * leak_per_s
        free = (charge_e + step * light_e_per_s(end)) / weight  # the charge without overflow
        log_source = np.log(step * well.knee_e_per_s / (weight * well.thermal_e))
        z = (free - well.knee_e) / well.thermal_e + log_source
        omega = wrightomega(z)
        # omega + log(omega) = z; beyond the knee, the second form does not subtract two large
        # numbers
        above = well.knee_e + well.thermal_e * (np.log(np.where(z < 1, 1.0, omega)) - log_source)
        charge_e = np.where(z < 1, free - well.thermal_e * omega, above)
    return charge_e
