"""Pixels that overflow: 18 decades of current and 10 decades of time, against the closed form in 80
decimal digits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from decimal import Decimal, localcontext
from typing import Any

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.detector.charge_dynamics import Well, arrived_from_charge, flow, slope
from isethdr_core.plugins.registry import build

from .verdict import Measured

CURRENTS = 10.0 ** np.arange(-3, 16)
TIMES = (1e-6, 1e-3, 0.016, 1.0, 60.0, 3600.0)
# relative error of an exact formula in float64: some ten roundings of 1e-16, and one of the
# argument of the logarithm, which is up to 1e2
EXACT = 1e-13


def cases() -> Iterator[tuple[Any, ...]]:
    """Yield (case, measure), with the error class where it is refused."""
    for knee, thermal, rate in (
        (7000.0, 240.0, 4.4e5),
        (7000.0, 1.0, 4.4e5),
        (1e6, 1e4, 1.0),
        (1e-3, 1e-3, 1e3),
        (1e38, 1e30, 1e3),
    ):
        title = f"knee {knee:g} e, thermal {thermal:g} e"
        yield f"{title}: charge", lambda w=(knee, thermal, rate): charge(*w)
        yield f"{title}: spilled charge", lambda w=(knee, thermal, rate): spill(*w)
    yield "arrived charge read back", read_back
    yield "no light", dark
    yield "thermal charge of 0", lambda: build("sensor", "lofic", thermal_e=0.0), ConfigError


def _grid() -> tuple[np.ndarray, np.ndarray]:
    return np.meshgrid(CURRENTS, TIMES, indexing="ij")


def _flow(knee: float, thermal: float, rate: float) -> tuple[np.ndarray, np.ndarray]:
    current, time = _grid()
    return flow(0.0, current, time, Well(knee, thermal, rate))


def charge(knee: float, thermal: float, rate: float) -> Measured:
    """Compare the charge that is left in the well, relative to itself.

    Parameters
    ----------
    knee : charge at which the overflow sets in, electrons.
    thermal : charge over which the overflow rises by a factor of e, electrons.
    rate : overflow at the knee, electrons/s.
    """
    charge_e, _ = _flow(knee, thermal, rate)
    truth = [[exact(float(i), t, knee, thermal, rate)[0] for t in TIMES] for i in CURRENTS]
    return Measured(_worst(charge_e, truth, knee), EXACT, "closed form in 80 digits, relative")


def spill(knee: float, thermal: float, rate: float) -> Measured:
    """Compare the charge that spilled, relative to itself where it is above 1e-300 e, and per unit
    of its logarithm.

    Parameters
    ----------
    knee : charge at which the overflow sets in, electrons.
    thermal : charge over which the overflow rises by a factor of e, electrons.
    rate : overflow at the knee, electrons/s.
    """
    _, spilled_e = _flow(knee, thermal, rate)
    truth = [[exact(float(i), t, knee, thermal, rate)[1] for t in TIMES] for i in CURRENTS]
    worst = 0.0
    for row, line in zip(spilled_e, truth):
        for value, true in zip(row, line):
            if float(true) > 1e-300:
                # its logarithm is about knee / thermal, with a relative rounding error of 1e-16
                worst = max(
                    worst,
                    abs(float((Decimal(float(value)) - true) / true)) / max(1.0, knee / thermal),
                )
    return Measured(worst, EXACT, "closed form in 80 digits, relative, per unit of log(spill)")


def _worst(values: np.ndarray, truth: Sequence[list[Decimal]], knee: float) -> float:
    return max(
        abs(float((Decimal(float(v)) - t) / t))
        for row, line in zip(values, truth)
        for v, t in zip(row, line)
        if t
    )


def exact(
    current: float, time: float, knee: float, thermal: float, rate: float
) -> tuple[Decimal, Decimal]:
    """Return (charge left, charge spilled), electrons, for constant light on an empty well.

    The charge Q follows from u = exp(-(Q - knee) / thermal), which solves u' = b - a u.

    Parameters
    ----------
    current : photocurrent, electrons/s.
    time : exposure time, s.
    knee : charge at which the overflow sets in, electrons.
    thermal : charge over which the overflow rises by a factor of e, electrons.
    rate : overflow at the knee, electrons/s.
    """
    with localcontext() as context:
        context.prec = 80
        context.Emax = 10**15
        context.Emin = -(10**15)
        t, k, th, r = (Decimal(v) for v in (time, knee, thermal, rate))
        # the function under test multiplies these in float64; that rounding is not judged here
        arrived = Decimal(current * time)
        x = arrived / th
        memory = t * (1 - (-x).exp()) / x
        log_keep = k / th - x  # log of u(0) exp(-a T)
        log_source = (r / th * memory).ln()
        high = max(log_keep, log_source)
        low = min(log_keep, log_source)
        tail = (low - high).exp()
        more = tail - tail**2 / 2 if tail < Decimal("1e-60") else (1 + tail).ln()
        charge = k - th * (high + more)
        if high == log_keep:  # spilled = thermal log(1 + tail): no difference of large numbers
            return charge, th * more
        return charge, arrived - charge


def read_back() -> Measured:
    """Compare the arrived charge with the one computed back from the charge that is left.

    The error is divided by the condition number, because the charge of a full well hardly depends
    on the arrived charge.
    """
    well = Well(7000.0, 240.0, 4.4e5)
    arrived = np.geomspace(1e-3, 1e12, 200)
    charge_left, _ = flow(0.0, arrived / 0.016, 0.016, well)
    back = arrived_from_charge(charge_left, 0.016, well)
    # one float64 step of the charge changes the arrived charge by 1e-16 charge / slope
    condition = np.maximum(1.0, charge_left / (arrived * slope(arrived, 0.016, well)))
    return Measured(
        float(np.max(np.abs(back / arrived - 1) / condition)),
        1e-14,
        "its own inverse, relative, per condition number",
    )


def dark() -> Measured:
    """Check that an empty well in the dark loses exactly the overflow at a charge of 0."""
    charge_left, lost = flow(0.0, 0.0, 3600.0, Well(7000.0, 240.0, 4.4e5))
    true = -240.0 * np.log1p(3600.0 * 4.4e5 / 240.0 * np.exp(-7000.0 / 240.0))
    return Measured(
        max(abs(charge_left / true - 1), abs(lost / -true - 1)),
        1e-12,
        "thermal log(1 + source), relative",
    )
