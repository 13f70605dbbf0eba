"""Noise of a well with soft overflow: against its differential equation, the master equation and
simulated electrons.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import solve_banded

from isethdr_core.physics.detector import charge_dynamics as cd
from isethdr_core.physics.detector import charge_dynamics_noise as noise
from isethdr_core.physics.detector.noise import poisson
from isethdr_core.physics.detector.random_words import words

T = 0.016
WELL = cd.Well(knee_e=20000.0, thermal_e=530.0)
# a well small enough to simulate each electron
SMALL = cd.Well(knee_e=600.0, thermal_e=25.0, knee_e_per_s=2e4)


def master_equation(rates, times, well, states=1100):
    """Return mean and variance of the charge from the master equation.

    It gives the probability of every count of electrons, where single electrons enter and leave.
    """
    count = np.arange(states, dtype=float)
    leaves = well.overflow_e_per_s(count)
    leaves[0] = 0.0
    p = np.zeros(states)
    p[0] = 1.0
    for rate, t in zip(rates, times):
        enters = np.full(states, float(rate))
        enters[-1] = 0.0
        # implicit Euler steps, extrapolated to second order
        p = 2 * _backward(p, enters, leaves, t, 1600) - _backward(p, enters, leaves, t, 800)
    mean = p @ count
    return mean, p @ (count - mean) ** 2


def _backward(p, enters, leaves, t, steps):
    h = t / steps
    bands = np.zeros((3, p.size))
    bands[1] = 1 + h * (enters + leaves)
    bands[0, 1:] = -h * leaves[1:]
    bands[2, :-1] = -h * enters[:-1]
    for _ in range(steps):
        p = solve_banded((1, 1), bands, p)
    return p


@pytest.mark.parametrize(
    "rates",
    [
        pytest.param((1e6,), marks=pytest.mark.slow),
        (1.2e6, 40.0, 3e6),
        pytest.param((5e8, 1e5), marks=pytest.mark.slow),
        pytest.param((40.0, 1e8), marks=pytest.mark.slow),
    ],
)
def test_closed_moments_solve_their_differential_equations(rates):
    def slopes(t, y, current):
        q, v, _, _, c = y
        out = WELL.overflow_e_per_s(q)
        pull = out / WELL.thermal_e
        return [
            current - out,
            -2 * pull * v + current + out,
            out,
            out + 2 * pull * c,
            pull * v - pull * c - out,
        ]

    got = noise.EMPTY
    y = [0.0] * 5
    for rate in rates:
        got = noise.flow_moments(got, rate, T / len(rates), WELL)
        # the solver tries steps that leave the well, and rejects them
        with np.errstate(over="ignore", invalid="ignore"):
            y = solve_ivp(
                slopes, (0, T / len(rates)), y, args=(rate,), method="Radau", rtol=1e-10, atol=1e-7
            ).y[:, -1]
    # 1e-6: the solver's own error, in differences of large numbers; 1e-7: its atol
    np.testing.assert_allclose(
        [got.charge_e, got.charge_var_e2, got.spilled_e, got.spilled_var_e2],
        y[:4],
        rtol=1e-6,
        atol=1e-7,
    )
    assert float(got.covariance_e2) == pytest.approx(y[4], rel=1e-6, abs=1e-6 * y[1])


def test_charge_plus_spill_is_poisson_and_the_well_forgets():
    got = noise.flow_moments(noise.EMPTY, np.logspace(2, 13, 45), T, WELL)
    arrived = np.logspace(2, 13, 45) * T
    np.testing.assert_allclose(
        got.charge_var_e2 + got.spilled_var_e2 + 2 * got.covariance_e2, arrived, rtol=1e-12
    )
    # without spill, the charge is Poisson distributed
    np.testing.assert_allclose(got.charge_var_e2[:10], arrived[:10], rtol=1e-12)
    # a full well has kTC noise
    assert float(got.charge_var_e2[-1]) == pytest.approx(WELL.thermal_e, rel=1e-6)
    assert np.all(got.charge_var_e2 >= 0) and np.all(got.spilled_var_e2 >= 0)


@pytest.mark.parametrize(
    "rates",
    [
        (1.2e4,),
        pytest.param((3e4,), marks=pytest.mark.slow),
        pytest.param((5e4,), marks=pytest.mark.slow),
        (2e5,),
        pytest.param((1e5, 100.0, 6e4), marks=pytest.mark.slow),
    ],
)
def test_moments_agree_with_the_master_equation(rates):
    times = [T / len(rates)] * len(rates)
    got = noise.EMPTY
    for rate, t in zip(rates, times):
        got = noise.flow_moments(got, rate, t, SMALL)
    mean, variance = master_equation(rates, times, SMALL)
    # error of the linearisation: of the order of one electron in the mean and 1 / thermal in the
    # variance (here 4 %)
    assert float(got.charge_e) == pytest.approx(mean, abs=0.75)
    assert float(got.charge_var_e2) == pytest.approx(variance, rel=0.04)


def test_moments_agree_with_electrons_followed_one_by_one():
    """Compare with a simulation of each electron by Gillespie's direct method (1977).

    It draws the exact time of every arrival and every loss.
    """
    rng = np.random.default_rng(5)
    pixels = 3000
    rate = 6e4
    q = np.zeros(pixels)
    spilled = np.zeros(pixels)
    clock = np.zeros(pixels)
    while True:
        out = np.where(q > 0, SMALL.overflow_e_per_s(q), 0.0)
        clock = clock + rng.exponential(1.0, pixels) / (rate + out)
        alive = clock < T
        if not alive.any():
            break
        lost = alive & (rng.random(pixels) * (rate + out) > rate)
        q = q + np.where(alive, 1 - 2 * lost, 0)
        spilled = spilled + lost
    got = noise.flow_moments(noise.EMPTY, rate, T, SMALL)
    # 5 standard errors, and the error of the linearisation as for the master equation
    assert q.mean() == pytest.approx(float(got.charge_e), abs=5 * np.sqrt(q.var() / pixels) + 0.75)
    for found, want in ((q.var(), got.charge_var_e2), (spilled.var(), got.spilled_var_e2)):
        assert found == pytest.approx(float(want), rel=5 * np.sqrt(2 / pixels) + 0.04)
    covariance = np.cov(q, spilled)[0, 1]
    scale = np.sqrt(q.var() * spilled.var())
    assert covariance == pytest.approx(
        float(got.covariance_e2), abs=(5 / np.sqrt(pixels) + 0.04) * scale
    )
    assert q.var() < 0.1 * (q + spilled).mean()  # far from Poisson


@pytest.mark.parametrize("rate", [1e5, 1.15e6, 1e8, 1e12])
def test_draws_have_these_moments(rate):
    size = (100, 1000)
    arrived = poisson(np.full(size, rate * T), words(("test", "arrive"), 0, size[0], 0, size[1]))
    charge = noise.draw_charge(arrived, words(("test", "spill"), 0, size[0], 0, size[1]), T, WELL)
    want = noise.flow_moments(noise.EMPTY, rate, T, WELL)
    n = charge.size
    # 5 standard errors; 0.01 e: the curvature of the knee, which the closed-form moments neglect
    assert charge.mean() == pytest.approx(
        float(want.charge_e), abs=5 * np.sqrt(charge.var() / n) + 0.01
    )
    assert charge.var() == pytest.approx(float(want.charge_var_e2), rel=5 * np.sqrt(2 / n))
    assert np.all(arrived - charge >= 0)


@pytest.mark.parametrize(
    "rate",
    [1.2e4, 4e4, 1e9, *(pytest.param(r, marks=pytest.mark.slow) for r in (3.5e4, 4.5e4, 2e5))],
)
def test_draws_agree_with_the_master_equation_even_at_the_knee(rate):
    """Compare drawn charge with the master equation, also near the knee.

    The closed-form moments are linearised and err there by up to 2.9 e (0.5 %) in the mean and 17 %
    in the variance.
    """
    size = (100, 1000)
    arrived = poisson(np.full(size, rate * T), words(("test", "arrive"), 0, size[0], 0, size[1]))
    charge = noise.draw_charge(arrived, words(("test", "spill"), 0, size[0], 0, size[1]), T, SMALL)
    mean, variance = master_equation([rate], [T], SMALL, 1200)
    # half an electron: the master equation counts whole electrons, while the overflow is smooth; 8
    # %: variance at a sharp knee
    assert charge.mean() == pytest.approx(mean, abs=5 * np.sqrt(variance / charge.size) + 0.55)
    assert charge.var() == pytest.approx(variance, rel=5 * np.sqrt(2 / charge.size) + 0.08)


def test_draws_without_spill_are_the_arrived_electrons():
    arrived = np.arange(0.0, 12000.0, 100.0)[None, :]
    word = words(("test", "spill"), 0, 1, 0, arrived.size)
    # at 12 000 e the overflow is exp(-15) of that at the knee
    np.testing.assert_allclose(
        noise.draw_charge(arrived, word, T, WELL), arrived, rtol=0, atol=1e-6
    )
