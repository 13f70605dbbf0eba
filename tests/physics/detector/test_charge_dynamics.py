"""Charge of a well with soft overflow: against high-precision closed forms, limits and other
solvers.
"""

import mpmath as mp
import numpy as np
import pytest

from isethdr_core.physics.detector import charge_dynamics as cd
from isethdr_core.physics.detector import charge_dynamics_steps as steps
from isethdr_core.physics.detector import temporal_modulation

WELL = cd.Well(knee_e=20000.0, thermal_e=530.0)
T = 0.016


def reference(q0, rates, times, well):
    """Return charge and spilled charge, electrons, after pieces of constant light, with 60 digits.

    They follow from the linear differential equation of u = exp(-(charge - knee) / thermal).
    """
    knee = mp.mpf(well.knee_e)
    thermal = mp.mpf(well.thermal_e)
    source = mp.mpf(well.knee_e_per_s)
    q = mp.mpf(float(q0))
    spilled = mp.mpf(0)
    for rate, t in zip(rates, times):
        a = mp.mpf(float(rate)) / thermal
        t = mp.mpf(float(t))
        memory = source / thermal * (-mp.expm1(-a * t) / a if a else t)
        gone = mp.log1p(memory * mp.exp((q - knee) / thermal + a * t))
        u = mp.exp(-(q - knee) / thermal - a * t) + memory
        q = knee - thermal * mp.log(u)
        spilled = spilled + thermal * gone
    return q, spilled


@pytest.fixture(autouse=True)
def sixty_digits():
    with mp.workdps(60):
        yield


@pytest.mark.parametrize("thermal_e", [5.0, 53.0, 530.0])
def test_constant_light_agrees_with_sixty_digits(thermal_e):
    well = cd.Well(20000.0, thermal_e)
    for q0 in (0.0, 1.0, 15000.0, 21000.0):
        for t in (1e-9, T):
            rates = np.concatenate([[0.0], np.logspace(-6, 14, 21)])
            charge, spilled = cd.flow(q0, rates, t, well)
            for rate, q, s in zip(rates, charge, spilled):
                want_q, want_s = reference(q0, [rate], [t], well)
                # 1e-50: rounding of the knee with 60 digits
                assert abs(q - want_q) <= 1e-12 * abs(want_q) + mp.mpf("1e-50")
                if want_s > 1e-290:  # smaller numbers are not representable with full precision
                    assert abs(s - want_s) <= 1e-12 * want_s


@pytest.mark.parametrize("level", [1e4, 1e6, 2e7, 1e9, 1e12])
def test_pulsed_light_agrees_with_sixty_digits(level):
    rates = [40.0, level, 40.0, 2 * level, 40.0]
    times = [0.002, 0.001, 0.010, 0.001, 0.002]
    charge, spilled = cd.flow_pieces(0.0, rates, times, WELL)
    want_q, want_s = reference(0.0, rates, times, WELL)
    assert abs(charge - want_q) <= 1e-12 * want_q
    assert abs(spilled - want_s) <= 1e-12 * want_s


def test_charge_is_conserved_at_any_light():
    rate = np.logspace(-3, 14, 200)
    charge, spilled = cd.flow(3.0, rate, T, WELL)
    # 8e-15 allows 8 roundings of the largest of the three numbers
    np.testing.assert_allclose(charge + spilled, 3.0 + rate * T, rtol=1e-15 * 8)


def test_below_the_knee_nothing_is_lost():
    charge, spilled = cd.flow(0.0, np.array([0.0, 1.0, 1e4, 5e5]), T, WELL)
    # at 8000 e the overflow is exp(-22) of that at the knee
    np.testing.assert_allclose(charge, np.array([0.0, 1.0, 1e4, 5e5]) * T, rtol=0, atol=1e-9)
    assert 0 < spilled.max() < 1e-9


def test_one_piece_is_the_same_as_many():
    whole = cd.flow(0.0, 3e6, T, WELL)
    cut = cd.flow_pieces(0.0, [3e6] * 7, [T / 7] * 7, WELL)
    np.testing.assert_allclose(cut, whole, rtol=1e-12)  # rounding of 7 pieces
    np.testing.assert_array_equal(cd.flow(123.0, 1e9, 0.0, WELL)[0], 123.0)


def test_steady_states():
    for current in (1e3, 1e6, 1e12):
        long, _ = cd.flow(0.0, current, 1e4, WELL)
        assert long == pytest.approx(float(cd.steady_charge(current, WELL)), rel=1e-13)
        for leak in (1e-3, 1.0, 1e3, 1e8):
            q = mp.mpf(float(cd.steady_charge(current, WELL, leak)))
            balance = (
                mp.mpf(current)
                - mp.mpf(leak) * q
                - mp.mpf(WELL.knee_e_per_s) * mp.exp((q - WELL.knee_e) / WELL.thermal_e)
            )
            slope = mp.mpf(leak) + mp.mpf(WELL.knee_e_per_s) / WELL.thermal_e * mp.exp(
                (q - WELL.knee_e) / WELL.thermal_e
            )
            assert abs(balance / slope) < 1e-13 * abs(q) + 1e-12  # error of the root, electrons


def test_inverse_gives_back_what_arrived():
    arrived = np.concatenate([[0.0, 1.0], np.logspace(2, 14, 61)])
    charge, _ = cd.flow(0.0, arrived / T, T, WELL)
    # one rounding of 30 000 e changes the arrived electrons by a share of 4e-12 / 530; an empty
    # well leaks 1e-15 e
    np.testing.assert_allclose(
        cd.arrived_from_charge(charge, T, WELL), arrived, rtol=1e-13, atol=1e-14
    )
    assert cd.arrived_from_charge(-4.0, T, WELL) == -4.0


def test_slope_is_the_derivative():
    for n in (10.0, 1e3, 18000.0, 19500.0, 21000.0, 1e5, 1e9):
        assert float(cd.slope(n, T, WELL)) == pytest.approx(
            float(mp.diff(_exact, mp.mpf(n))), rel=1e-12
        )


def _exact(arrived):
    x = arrived / WELL.thermal_e
    u = mp.exp(mp.mpf(WELL.knee_e) / WELL.thermal_e - x) + mp.mpf(
        WELL.knee_e_per_s
    ) / WELL.thermal_e * T * (-mp.expm1(-x) / x)
    return WELL.knee_e - WELL.thermal_e * mp.log(u)


def test_linear_limit_loses_what_is_allowed():
    limit = cd.linear_limit_e(0.5, T, WELL)
    assert cd.flow(0.0, limit / T, T, WELL)[1] == pytest.approx(0.5, rel=1e-9)
    assert cd.linear_limit_e(0.05, T, WELL) < limit < cd.linear_limit_e(5.0, T, WELL)
    shallow = cd.Well(knee_e=150.0, thermal_e=400.0, knee_e_per_s=1e6)
    assert cd.linear_limit_e(1e-6, T, shallow) == 0.0  # even an empty well loses more


def rippled(levels):
    return lambda start, duration: (
        levels * temporal_modulation.ripple_s(start, duration, 100.0, 0.5, 0.75)
    )


@pytest.mark.parametrize("times_saturation", [0.01, 1.0, 1.5, 10.0, 1e3, 1e6])
def test_varying_light_agrees_with_high_precision_quadrature(times_saturation):
    level = times_saturation * WELL.knee_e / T
    charge, spilled = cd.flow_varying(0.0, rippled(np.array([level])), 0.0, T, WELL)
    a = mp.mpf(level) / WELL.thermal_e
    f = 2 * mp.pi * 100

    def to_come(
        left,
    ):  # a times the integral of 1 + cos(2 pi (100 t + 3/4)) / 2 over the last `left` seconds
        end = mp.mpf(T)
        return a * (
            left
            + (mp.sin(f * end + 3 * mp.pi / 2) - mp.sin(f * (end - left) + 3 * mp.pi / 2)) / (2 * f)
        )

    cuts = [0] + [mp.mpf(T) * mp.mpf(2) ** -k for k in range(40, -1, -1)]
    with mp.workdps(25):
        memory = mp.quad(lambda left: mp.exp(-to_come(left)), cuts)
        total = to_come(mp.mpf(T))
        gone = (
            mp.mpf(WELL.knee_e_per_s)
            / WELL.thermal_e
            * memory
            * mp.exp(total - mp.mpf(WELL.knee_e) / WELL.thermal_e)
        )
        want_s = WELL.thermal_e * mp.log1p(gone)
        want_q = WELL.thermal_e * total - want_s
    assert abs(charge[0] - want_q) <= 1e-12 * want_q
    assert abs(spilled[0] - want_s) <= 1e-12 * want_s


def test_varying_light_reduces_to_constant_light_and_serves_a_rolling_shutter():
    rates = np.array([[1e3, 1e6, 1e9, 1e12]])
    np.testing.assert_allclose(
        cd.flow_varying(0.0, lambda s, d: rates * d, 0.0, T, WELL),
        cd.flow(0.0, rates, T, WELL),
        rtol=1e-13,
    )
    starts = temporal_modulation.row_starts_s(5, 1e-3)
    rows, _ = cd.flow_varying(0.0, rippled(rates), starts, T, WELL)
    for i, start in enumerate(starts[:, 0]):
        one, _ = cd.flow_varying(0.0, rippled(rates), float(start), T, WELL)
        np.testing.assert_allclose(rows[i], one[0], rtol=1e-15)


def test_pulse_width_modulation_through_pieces_is_exact_per_row():
    starts = temporal_modulation.row_starts_s(6, 1.3e-3)
    durations, on = temporal_modulation.square_wave_pieces(starts, T, 90.0, 0.1)
    charge, spilled = cd.flow_pieces(0.0, 40.0 + 5e7 * on, durations, WELL)
    arrived = 40.0 * T + 5e7 * temporal_modulation.square_wave_s(starts, T, 90.0, 0.1)
    np.testing.assert_allclose(charge + spilled, arrived, rtol=1e-13)
    for i in range(6):
        want_q, want_s = reference(0.0, 40.0 + 5e7 * on[:, i, 0], durations[:, i, 0], WELL)
        assert (
            abs(charge[i, 0] - want_q) <= 1e-12 * want_q
            and abs(spilled[i, 0] - want_s) <= 1e-12 * want_s
        )


def test_steps_converge_to_the_exact_charge():
    levels = WELL.knee_e / T * np.array([0.01, 1.0, 10.0, 1e6])
    exact, _ = cd.flow_varying(0.0, rippled(levels), 0.0, T, WELL)

    def light(t):
        return levels * (1 + 0.5 * np.cos(2 * np.pi * (100 * t + 0.75)))

    # measured: 4.5e-7 to 6e-6 with 1024 graded steps; the tolerance is twice that
    got = steps.exponential_steps(0.0, light, steps.graded(T, 1024), WELL)
    np.testing.assert_allclose(got, exact, rtol=1.2e-5)
    coarse, fine = (
        np.abs(steps.implicit_steps(0.0, light, np.linspace(0, T, n + 1), WELL) / exact - 1).max()
        for n in (64, 512)
    )
    assert fine < coarse / 6  # first order: 8 times the steps have an eighth of the error


def test_implicit_steps_with_a_leak_reach_the_steady_state_at_any_step():
    current = np.array([1e2, 1e6, 1e12, 1e14])
    for leak in (0.0, 10.0):
        got = steps.implicit_steps(0.0, lambda t: current, np.linspace(0.0, 1e6, 4), WELL, leak)
        np.testing.assert_allclose(
            got, cd.steady_charge(current, WELL, leak), rtol=1e-3 if leak == 0 else 1e-9
        )


def test_explicit_steps_would_fail_where_ours_do_not():
    """Show that the problem is stiff: explicit steps of a microsecond at 1e12 e/s overshoot the
    well by orders of magnitude, while implicit steps agree with the closed form.
    """
    q = 0.0
    h = 1e-6
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(3):
            q = q + h * (1e12 - WELL.overflow_e_per_s(q))
    assert not abs(q) < 1e6
    assert steps.implicit_steps(0.0, lambda t: 1e12, np.arange(4) * h, WELL) == pytest.approx(
        cd.flow(0.0, 1e12, 3 * h, WELL)[0], rel=1e-3
    )


def test_a_well_without_a_slope_is_refused():
    with pytest.raises(ValueError, match="thermal_e"):
        cd.Well(1e4, 0.0)
