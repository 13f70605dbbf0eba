"""Integrators of a pixel that overflows, against a closed form in 60 digits."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_workflows.accuracy.point import Point, Work, timed

from isethdr_core.extras import needed
from isethdr_core.physics.detector.charge_dynamics import Well, flow
from isethdr_core.physics.detector.charge_dynamics_steps import (
    exponential_steps,
    graded,
    implicit_steps,
)

if TYPE_CHECKING:
    import xarray as xr

T_S = 0.016
KNEE_E = 20000.0
THERMAL_E = 530.0
TIMES_SATURATION = np.array([0.01, 0.1, 1.0, 10.0, 100.0])
PIXELS = 45000


def measured() -> list[Work]:
    """Return one diagram: largest relative error of the charge from 0.01 to 100 times saturation.
    Seconds and memory are those of a frame of 45 000 pixels.
    """
    well = Well(KNEE_E, THERMAL_E)
    levels = KNEE_E / T_S * TIMES_SATURATION
    closed_form = np.array([charge_e(level, well) for level in levels])
    frame = np.repeat(levels, PIXELS // len(levels))

    def point(name: str, integrate: Callable[..., Any], mark: str = "") -> Point:
        error = np.max(np.abs(integrate(levels) / closed_form - 1))
        _, cpu_s, peak_mb = timed(lambda: integrate(frame), repeat=3)
        return Point(name, float(error) if np.isfinite(error) else np.inf, cpu_s, peak_mb, mark)

    points = [
        point(
            "closed form", lambda light: flow(np.zeros(light.size), light, T_S, well)[0], "default"
        )
    ]
    for steps in (16, 128, 1024):
        even = np.linspace(0, T_S, steps + 1)
        finer = graded(T_S, steps)
        with np.errstate(all="ignore"):
            points.append(
                point(
                    f"Runge-Kutta 4, {steps}",
                    lambda light, times=even: runge_kutta_steps(light, times, well),
                    "peer",
                )
            )
        points.append(
            point(
                f"implicit Euler, {steps}",
                lambda light, times=even: implicit_steps(
                    np.zeros(light.size), lambda t: light, times, well
                ),
            )
        )
        points.append(
            point(
                f"exponential, {steps}",
                lambda light, times=finer: exponential_steps(
                    np.zeros(light.size), lambda t: light, times, well
                ),
            )
        )
    return [
        Work(
            "pixel dynamics",
            "largest relative error of the charge",
            "closed form in 60 digits (mpmath)",
            1e-16,
            points,
        )
    ]


def charge_e(level_e_per_s: float, well: Well) -> float:
    """Return the charge after `T_S` of constant light on an empty well, in electrons.

    The equation is linear in exp(-charge / thermal), so it has a closed form. It is computed in 60
    digits.

    Parameters
    ----------
    level_e_per_s : photocurrent, electrons/s.
    well : full well with its overflow.
    """
    with needed("the exact charge", extra="test"):
        import mpmath as mp

    with mp.workdps(60):
        a = mp.mpf(level_e_per_s) / well.thermal_e
        end = mp.mpf(T_S)
        decayed = (
            mp.mpf(well.knee_e_per_s)
            / well.thermal_e
            * (-mp.expm1(-a * end) / a)
            * mp.exp(a * end - mp.mpf(well.knee_e) / well.thermal_e)
        )
        return float(well.thermal_e * (a * end - mp.log1p(decayed)))


def runge_kutta_steps(light: xr.DataArray, times: np.ndarray, well: Well) -> np.ndarray:
    """Return the charge after all steps, in electrons, by the classical Runge-Kutta method of order
    4. It is explicit, so it must follow the fastest overflow step by step.

    Parameters
    ----------
    light : (pixel,) photocurrent, electrons/s.
    times : times of the steps, the first and the last included, s.
    well : full well with its overflow.
    """
    charge = np.zeros(light.size)
    for start, end in pairwise(times):
        h = end - start
        k1 = light - well.overflow_e_per_s(charge)
        k2 = light - well.overflow_e_per_s(charge + h / 2 * k1)
        k3 = light - well.overflow_e_per_s(charge + h / 2 * k2)
        k4 = light - well.overflow_e_per_s(charge + h * k3)
        charge = charge + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return charge
