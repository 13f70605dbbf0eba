"""Error against run time of integrators of an overflowing pixel, from sub-threshold light to 1e6
times saturation.

The equation is dQ/dt = light(t) - overflow(Q) over 16 ms from an empty well, with a knee at
20 000 e and a factor e of overflow per 530 e. The light is constant, or has a ripple of 100 Hz
(1 +- 0.5). The reference is the closed form with 60 digits for constant light, and mpmath's
quadrature with 25 digits for ripple. Times are CPU nanoseconds per pixel in a frame of 45 000
pixels with one thread. Step methods are timed per step, and the time is multiplied by the number of
steps. The baseline of all ratios is the classical Runge-Kutta method of order 4 with the fewest
steps that reach a relative error of 1e-6. If it needs more steps than are run here, its number of
steps is taken from its limit of stability: current T / (2.8 thermal). Run:

    python benchmarks/charge_dynamics.py
"""

from __future__ import annotations

import time
import warnings
from itertools import pairwise

import mpmath as mp
import numpy as np
from scipy.integrate import solve_ivp

from isethdr_core.physics.detector.charge_dynamics import Well, flow, flow_varying, log_memory
from isethdr_core.physics.detector.charge_dynamics_steps import (
    exponential_steps,
    graded,
    implicit_steps,
)
from isethdr_core.physics.detector.temporal_modulation import ripple_s

T = 0.016
WELL = Well(20000.0, 530.0)
WANTED = 1e-6
TIMES_SATURATION = np.array([0.01, 0.1, 1.0, 10.0, 100.0, 1e3, 1e4, 1e6])
LEVELS = WELL.knee_e / T * TIMES_SATURATION
STEPS = [2**k for k in range(2, 15)]


def rosenbrock_steps(charge, light, times, well):
    """Exponential Rosenbrock-Euler: the overflow is linearised at the start of each step."""
    for start, end in pairwise(times):
        h = end - start
        out = well.overflow_e_per_s(charge)
        charge = charge + np.exp(log_memory(h * out / well.thermal_e, h)) * (
            light(0.5 * (start + end)) - out
        )
    return charge


def euler_steps(charge, light, times, well):
    """Explicit Euler."""
    for start, end in pairwise(times):
        charge = charge + (end - start) * (light(start) - well.overflow_e_per_s(charge))
    return charge


def runge_kutta_steps(charge, light, times, well):
    """Classical Runge-Kutta of order 4."""
    for start, end in pairwise(times):
        h = end - start
        middle = 0.5 * (start + end)
        k1 = light(start) - well.overflow_e_per_s(charge)
        k2 = light(middle) - well.overflow_e_per_s(charge + h / 2 * k1)
        k3 = light(middle) - well.overflow_e_per_s(charge + h / 2 * k2)
        k4 = light(end) - well.overflow_e_per_s(charge + h * k3)
        charge = charge + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return charge


METHODS = {
    "explicit Euler": (euler_steps, lambda n: np.linspace(0, T, n + 1)),
    "Runge-Kutta 4": (runge_kutta_steps, lambda n: np.linspace(0, T, n + 1)),
    "exponential Rosenbrock": (rosenbrock_steps, lambda n: np.linspace(0, T, n + 1)),
    "implicit Euler, omega": (implicit_steps, lambda n: np.linspace(0, T, n + 1)),
    "exponential, uniform": (exponential_steps, lambda n: np.linspace(0, T, n + 1)),
    "exponential, graded": (exponential_steps, lambda n: graded(T, n)),
}


def light_of(levels, depth):
    return lambda t: levels * (1 + depth * np.cos(2 * np.pi * (100 * t - 0.25)))


def reference(level, depth):
    """Return the charge computed with mpmath: the closed form for constant light, else with a
    quadrature of the memory integral.
    """
    a = mp.mpf(level) / WELL.thermal_e
    f = 200 * mp.pi
    with mp.workdps(60 if depth == 0 else 25):
        end = mp.mpf(T)

        def to_come(remaining_s):
            return a * (
                remaining_s
                + depth
                * (mp.sin(f * end - mp.pi / 2) - mp.sin(f * (end - remaining_s) - mp.pi / 2))
                / f
            )

        if depth == 0:
            memory = -mp.expm1(-a * end) / a
        else:
            memory = mp.quad(
                lambda left: mp.exp(-to_come(left)),
                [0] + [end * mp.mpf(2) ** -k for k in range(45, -1, -1)],
            )
        gone = (
            mp.mpf(WELL.knee_e_per_s)
            / WELL.thermal_e
            * memory
            * mp.exp(to_come(end) - mp.mpf(WELL.knee_e) / WELL.thermal_e)
        )
        return WELL.thermal_e * (to_come(end) - mp.log1p(gone))


def seconds(call, *arguments, repeat=3):
    best = np.inf
    for _ in range(repeat):
        start = time.process_time()
        call(*arguments)
        best = min(best, time.process_time() - start)
    return best


def step_costs():
    frame = np.repeat(LEVELS, 45000 // LEVELS.size)
    return {
        name: (
            seconds(method, np.zeros(frame.size), light_of(frame, 0.5), np.linspace(0, T, 9), WELL)
            / 8
            / frame.size
            * 1e9
        )
        for name, (method, _) in METHODS.items()
    }


def relative(charge, wanted):
    error = np.abs([float(q - w) / float(w) for q, w in zip(charge, wanted, strict=True)])
    return np.where(np.isfinite(error), error, np.inf)


def shown(error):
    return " ".join("  fails" if not e < 1 else f"{e:7.0e}" for e in error)


def fewest(errors):
    """Return for each level the fewest steps from which on all tried numbers of steps have an error
    within `WANTED`; infinite if there is none.
    """
    good = np.array([errors[n] <= WANTED for n in STEPS])
    held = np.logical_and.accumulate(good[::-1])[::-1]
    return np.where(held.any(axis=0), np.array(STEPS, float)[held.argmax(axis=0)], np.inf)


def main():
    warnings.simplefilter("ignore")
    costs = step_costs()
    frame = np.repeat(LEVELS, 45000 // LEVELS.size)
    for depth, kind in ((0.0, "constant light"), (0.5, "100 Hz ripple")):
        wanted = [reference(level, depth) for level in LEVELS]
        print(f"\n{kind}: largest relative error of the charge; light / saturation")
        print(
            f"{'method':22s} {'steps':>5s} "
            + " ".join(f"{x:7.0e}" for x in TIMES_SATURATION)
            + "  ns/px"
        )
        needed = {}
        for name, (method, times) in METHODS.items():
            errors = {
                n: relative(
                    method(np.zeros(LEVELS.size), light_of(LEVELS, depth), times(n), WELL), wanted
                )
                for n in STEPS
            }
            needed[name] = fewest(errors)
            for n in (16, 256, 4096):
                print(f"{name:22s} {n:5d} {shown(errors[n])} {n * costs[name]:6.0f}")
        exact = flow if depth == 0 else flow_varying
        arguments = (
            (lambda v: (0.0, v, T, WELL))
            if depth == 0
            else (
                lambda v, depth=depth: (
                    0.0,
                    lambda s, d: v * ripple_s(s, d, 100.0, depth, -0.25),
                    0.0,
                    T,
                    WELL,
                )
            )
        )
        ours = [seconds(exact, *arguments(np.full(45000, level))) / 45000 * 1e9 for level in LEVELS]
        whole = seconds(exact, *arguments(frame)) / frame.size * 1e9
        print(
            f"{exact.__name__:22s} {'':5s} {shown(relative(exact(*arguments(LEVELS))[0], wanted))} "
            f"{whole:6.0f}"
        )
        base = np.where(
            np.isfinite(needed["Runge-Kutta 4"]),
            needed["Runge-Kutta 4"],
            LEVELS * T / 2.8 / WELL.thermal_e,
        )
        print(
            f"\n{kind}: time to a relative error of {WANTED:g}, times that of Runge-Kutta 4\n"
            "(the baseline; its line is in ns per pixel)"
        )
        print(
            f"{'Runge-Kutta 4':22s} {'':5s} "
            + " ".join(f"{x:7.1e}" for x in base * costs["Runge-Kutta 4"])
        )
        for name, steps in needed.items():
            if name != "Runge-Kutta 4":
                print(
                    f"{name:22s} {'':5s} "
                    + " ".join(
                        "  never" if np.isinf(x) else f"{x:7.1e}"
                        for x in steps * costs[name] / (base * costs["Runge-Kutta 4"])
                    )
                )
        print(
            f"{exact.__name__:22s} {'':5s} "
            + " ".join(f"{x:7.1e}" for x in np.array(ours) / (base * costs["Runge-Kutta 4"]))
        )
    print("\nscipy's Radau, tolerance 1e-6, 100 Hz ripple, one pixel at a time:")
    for factor, level, want in zip(TIMES_SATURATION, LEVELS, wanted, strict=True):
        start = time.process_time()
        try:
            solution = solve_ivp(
                lambda t, q, v=level: light_of(v, 0.5)(t) - WELL.overflow_e_per_s(q),
                (0, T),
                [0.0],
                method="Radau",
                rtol=1e-6,
                atol=1e-3,
            )
            error = f"error {abs(float(solution.y[0, -1] - want) / float(want)):.0e}"
        except ValueError as problem:
            error = f"fails: {problem}"
        print(
            f"{factor:8.0e} x saturation: {(time.process_time() - start) * 1e9:10.0f} ns, {error}"
        )
    print(
        "\nns per pixel and step:\n"
        + "\n".join(f"{name:22s} {cost:5.0f}" for name, cost in costs.items())
    )
    print(
        f"stable explicit Euler steps per second at 1e12 e/s:\n"
        f"{1e12 / 2 / 530:.1e} at 530 e, {1e12 / 2 / 5:.1e} at 5 e"
    )


if __name__ == "__main__":
    main()
