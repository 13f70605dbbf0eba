"""Charge of a pixel with soft overflow: dQ/dt = current(t) - overflow(Q), exact for any light,
without time steps.

The overflow current grows by the factor e for every `thermal_e` electrons, because of thermionic
emission over the barrier of the overflow path. Miyauchi et al. 2023, "Light intensity and charge
holding time dependence of pinned photodiode full well capacity", measured the resulting logarithmic
law. With

    q = (Q - knee) / thermal,  a = current / thermal,  b = knee current / thermal,  u = exp(-q)

the equation is linear, u' = b - a u. For any light with known arrived electrons A(t), the solution
after an exposure of duration T is

    u(T) = u(0) exp(-A(T) / thermal) + b J,
    J = integral of exp(-(A(T) - A(t)) / thermal) dt over the exposure.

J is a time, the memory of the pixel. It is T in darkness and thermal / current in a full well.
Under constant light it is an elementary function; under any other light it is the integral of a
smooth function between 0 and 1. `settle` computes charges from A(T) and J without numerical
overflow. Constant light needs no Lambert W function; the steady state with a linear leak does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import wrightomega

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

ROUNDING = 4 * np.finfo(float).eps  # least relative tolerance that SciPy's root finders accept

# Gauss-Legendre nodes and weights of one panel. The error of 16 nodes is 1e-16 for exp(-x) on a
# panel with x up to 8.
NODES = 0.5 * np.polynomial.legendre.leggauss(16)[0] + 0.5
WEIGHTS = 0.5 * np.polynomial.legendre.leggauss(16)[1]


@dataclass(frozen=True)
class Well:
    """A charge well with an exponential overflow."""

    knee_e: float  # charge at which the overflow current is `knee_e_per_s`
    # electrons by which the overflow grows by the factor e: n k T / (e x volts per electron)
    thermal_e: float
    knee_e_per_s: float = 1e3  # overflow current at the knee

    def __post_init__(self) -> None:
        for name in ("thermal_e", "knee_e_per_s"):
            if not 0 < getattr(self, name) < np.inf:
                raise ValueError(
                    f"{name} is {getattr(self, name)!r}; expected a finite number above 0"
                )

    def overflow_e_per_s(self, charge_e: float) -> np.ndarray:
        """Return the overflow current at a charge, electrons per second."""
        return self.knee_e_per_s * np.exp((charge_e - self.knee_e) / self.thermal_e)


def log_memory(x: np.ndarray, duration_s: float) -> np.ndarray:
    """Return log(duration x (1 - exp(-x)) / x), the logarithm of J under constant light; -inf for a
    duration of 0.

    Parameters
    ----------
    x : arrived electrons over `thermal_e`, 0 or more, any shape.
    duration_s : exposure, s.
    """
    small = x < 1e-4
    safe = np.where(small, 1.0, x)
    with np.errstate(divide="ignore"):
        return np.log(duration_s) + np.where(
            small, x * (x / 24 - 0.5), np.log(-np.expm1(-safe) / safe)
        )


def settle(
    charge_e: float, arrived_e: np.ndarray, log_memory_s: np.ndarray, well: Well
) -> tuple[np.ndarray, np.ndarray]:
    """Return (charge, spilled charge), electrons, after `arrived_e` electrons; exact.

    Parameters
    ----------
    charge_e : charge at the start, electrons.
    arrived_e : electrons of light and dark current, 0 or more.
    log_memory_s : logarithm of J of the module's text, J in seconds.
    well : knee, thermal electrons and overflow current of the photodiode.

    Notes
    -----
    With s = log(spilling share / staying share), spilled = thermal log(1 + e^s). For s > 0 the
    charge is computed from the knee, so that two large numbers are never subtracted. e^s itself is
    never computed.
    """
    source, s = _odds(charge_e, arrived_e, log_memory_s, well)
    spilled = well.thermal_e * np.logaddexp(0.0, s)
    below = charge_e + arrived_e - well.thermal_e * np.log1p(np.exp(np.minimum(s, 0.0)))
    above = well.knee_e - well.thermal_e * (source + np.log1p(np.exp(-np.maximum(s, 0.0))))
    return np.where(s < 0, below, above), spilled


def flow(
    charge_e: float, current_e_per_s: np.ndarray, duration_s: float, well: Well
) -> tuple[np.ndarray, np.ndarray]:
    """Return (charge, spilled charge), electrons, after `duration_s` of constant current; exact, in
    closed form.

    Parameters
    ----------
    charge_e : charge at the start, electrons.
    current_e_per_s : constant current of light and dark current, electrons per second, 0 or more.
    duration_s : duration, s, above 0.
    well : knee, thermal electrons and overflow current of the photodiode.
    """
    arrived = current_e_per_s * duration_s
    return settle(charge_e, arrived, log_memory(arrived / well.thermal_e, duration_s), well)


def flow_pieces(
    charge_e: float, currents_e_per_s: ArrayLike, durations_s: ArrayLike, well: Well
) -> tuple[np.ndarray, np.ndarray]:
    """Return (charge, spilled charge), electrons, after pieces of constant current, one after the
    other; exact.

    Parameters
    ----------
    charge_e : charge at the start, electrons.
    currents_e_per_s : current of each piece, electrons per second, 0 or more.
    durations_s : duration of each piece, s.
    well : knee, thermal electrons and overflow current of the photodiode.
    """
    spilled = 0.0
    for current, duration in zip(currents_e_per_s, durations_s, strict=True):
        charge_e, more = flow(charge_e, current, duration, well)
        spilled = spilled + more
    return charge_e, spilled


def flow_varying(
    charge_e: float,
    arriving_e: Callable[..., Any],
    start_s: float | np.ndarray,
    duration_s: float,
    well: Well,
) -> tuple[np.ndarray, np.ndarray]:
    """Return (charge, spilled charge), electrons, after light of any strength that varies smoothly.

    Parameters
    ----------
    charge_e : charge at the start, electrons.
    arriving_e : function(start_s, duration_s) -> electrons that arrive in that interval, per pixel.
    start_s, duration_s : exposure, s; numbers, or arrays that broadcast with the frame (rows of a
        rolling shutter).
    well : knee, thermal electrons and overflow current of the photodiode.

    Notes
    -----
    J is computed by Gauss-Legendre quadrature. The panels halve towards the end, down to the time
    in which `thermal_e` electrons arrive, which is the memory of a full well. Every node costs one
    exponential, and there is no stability limit. The first panel is half the exposure, so that
    light must vary smoothly over it: for several periods, call `flow_varying` for each.
    """
    arrived = arriving_e(start_s, duration_s)
    halvings = int(np.ceil(np.log2(1.0 + np.max(arrived, initial=0.0) / well.thermal_e))) + 2
    memory = 0.0
    for k in range(halvings + 1):
        low = 0.0 if k == halvings else 2.0 ** -(k + 1)
        high = 2.0**-k
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            # time before the end, s; it is exact for any small value
            charge_left = (low + (high - low) * node) * duration_s
            memory = memory + weight * (high - low) * np.exp(
                -arriving_e(start_s + (duration_s - charge_left), charge_left) / well.thermal_e
            )
    with np.errstate(divide="ignore"):
        return settle(charge_e, arrived, np.log(memory) + np.log(duration_s), well)


def linear_limit_e(allowed_spill_e: float, duration_s: float, well: Well) -> float:
    """Return the number of electrons that may arrive at constant light until `allowed_spill_e` of
    them are lost; 0 if as many are lost in the dark.

    Parameters
    ----------
    allowed_spill_e : electrons that may be lost, above 0.
    duration_s : exposure, s.
    well : knee, thermal electrons and overflow current of the photodiode.
    """

    def excess_e(arrived_e: float) -> float:
        _, spilled_e = flow(0.0, arrived_e / duration_s, duration_s, well)
        return float(spilled_e) - allowed_spill_e

    if excess_e(0.0) >= 0:
        return 0.0
    highest_e = max(well.knee_e, 0.0) + 1e3 * well.thermal_e + allowed_spill_e
    from scipy.optimize import brentq  # slow to import

    return brentq(excess_e, 0.0, highest_e, xtol=1e-12, rtol=ROUNDING)


def arrived_from_charge(charge_e: float | np.ndarray, duration_s: float, well: Well) -> np.ndarray:
    """Return the number of electrons that arrived at constant light, from the charge: the inverse
    of `flow` for an empty well.

    Parameters
    ----------
    charge_e : electrons in the well after the exposure. Values of 0 or less are returned unchanged.
    duration_s : exposure, s.
    well : knee, thermal electrons and overflow current of the photodiode.

    Notes
    -----
    With x = arrived / thermal and c = knee_e_per_s duration / thermal, the charge obeys exp((knee -
    charge) / thermal) = exp(knee / thermal - x) + c (1 - e^-x) / x. Each term on the right is at
    most the left side, and one of them is at least half of it. The number of arrived electrons
    therefore lies between `charge` and the larger of charge + thermal log 2 and 2 c thermal
    exp((charge - knee) / thermal). The root is sought in log(arrived), because the charge of a full
    well is linear in it.
    """
    charge = np.asarray(charge_e, float)
    positive = np.maximum(charge, np.finfo(float).tiny)
    excess = (positive - well.knee_e) / well.thermal_e + np.log(
        well.knee_e_per_s * duration_s / well.thermal_e
    )
    # 600 avoids numerical overflow
    of_full_well = 2.0 * well.thermal_e * np.exp(np.minimum(excess, 600.0))
    highest = np.maximum(positive + np.log(2.0) * well.thermal_e, of_full_well)

    def miss_e(log_arrived: np.ndarray, wanted_e: np.ndarray) -> float | np.ndarray:
        return flow(0.0, np.exp(log_arrived) / duration_s, duration_s, well)[0] - wanted_e

    # 1e-6, so that rounding errors of `flow` do not move the root out of the bracket
    bracket = np.log(positive) - 1e-6, np.log(highest) + 1e-6
    from scipy.optimize.elementwise import find_root  # slow to import

    root = find_root(miss_e, bracket, args=(positive,))
    # there is no root for a charge of the size of rounding errors, or one that no light can cause
    beyond = np.where(excess >= 600.0, highest, positive)
    arrived = np.where(root.success, np.exp(root.x), beyond)
    return np.where(charge > 0, arrived, charge)


def slope(arrived_e: float, duration_s: float, well: Well) -> np.ndarray:
    """Return d charge / d arrived at constant light from an empty well. It is 1 below the knee, and
    falls as 1 / arrived beyond.

    Parameters
    ----------
    arrived_e : electrons that arrive in the exposure, any shape.
    duration_s : exposure, s.
    well : knee, thermal electrons and overflow current of the photodiode.
    """
    stays, spills, h = shares(0.0, arrived_e, duration_s, well)
    return stays + spills * h


def shares(
    charge_e: float | np.ndarray, arrived_e: float | np.ndarray, duration_s: float, well: Well
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (P, R, h) for constant light.

    If the charge at the start changes, the share P of the change stays in the well, and R = 1 - P
    spills. h = 1/x - 1/(e^x - 1), with x = arrived / thermal, falls from 1/2 to 0. Of a change of
    the arriving charge, the share P + R h stays.

    Parameters
    ----------
    charge_e : charge at the start, electrons.
    arrived_e : electrons that arrive, 0 or more.
    duration_s : duration, s.
    well : knee, thermal electrons and overflow current of the photodiode.
    """
    x = np.asarray(arrived_e / well.thermal_e, float)
    _, s = _odds(charge_e, arrived_e, log_memory(x, duration_s), well)
    small = x < 0.25
    xs = np.where(small, x, 0.0)
    xl = np.where(small, 1.0, x)
    series = 0.5 - xs / 12 * (1 - xs**2 / 60 * (1 - xs**2 / 42 * (1 - xs**2 / 40)))
    h = np.where(small, series, 1 / xl - np.exp(-xl) / -np.expm1(-xl))
    e = np.exp(-np.abs(s))
    return np.where(s > 0, e, 1.0) / (1 + e), np.where(s > 0, 1.0, e) / (1 + e), h


def steady_charge(current_e_per_s: float, well: Well, leak_per_s: float = 0.0) -> np.ndarray:
    """Return the charge, electrons, at which light balances overflow and a leak of `leak_per_s` x
    charge.

    With a leak alone it is current / leak, with an overflow alone a logarithm. With both it is the
    Lambert W function of an exponential, which Wright's omega function gives without numerical
    overflow (Corless and Jeffrey 2002, "The Wright omega function").

    Parameters
    ----------
    current_e_per_s : constant current, electrons per second, above 0.
    well : knee, thermal electrons and overflow current of the photodiode.
    leak_per_s : share of the charge that leaks per second, 0 or more.
    """
    current = np.asarray(current_e_per_s, float)
    if leak_per_s == 0.0:
        return well.knee_e + well.thermal_e * np.log(current / well.knee_e_per_s)
    scale = np.log(well.knee_e_per_s / (leak_per_s * well.thermal_e))
    z = scale + (current / leak_per_s - well.knee_e) / well.thermal_e
    omega = wrightomega(z)
    # omega + log(omega) = z; beyond the knee, the second form does not subtract two large numbers
    return np.where(
        z < 1,
        current / leak_per_s - well.thermal_e * omega,
        well.knee_e + well.thermal_e * (np.log(np.where(z < 1, 1.0, omega)) - scale),
    )


def _odds(
    charge_e: float, arrived_e: np.ndarray, log_memory_s: np.ndarray, well: Well
) -> tuple[float | np.ndarray, float | np.ndarray]:
    """Return (log(b J), s).

    s is the logarithm of R / P of `shares`: the share of the charge at the start that spills, over
    the share that stays.
    """
    source = np.log(well.knee_e_per_s / well.thermal_e) + log_memory_s
    return source, ((charge_e - well.knee_e) + arrived_e) / well.thermal_e + source
