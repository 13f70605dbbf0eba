"""Temporal modulation of lamps: closed forms, limits, high precision, and phases without drift."""

from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest

from isethdr_core.physics.detector import temporal_modulation as m


def square_reference(start, duration, frequency, duty, phase):
    """Return the time, s, that a square wave is on, in exact fractions of the float64 inputs."""
    start, duration, frequency, duty, phase = (
        Fraction(v) for v in (start, duration, frequency, duty, phase)
    )

    def on(turns):
        whole = turns.__floor__()
        return whole * duty + min(turns - whole, duty)

    a = start * frequency + phase
    return (on(a + duration * frequency) - on(a)) / frequency


@pytest.mark.parametrize("frequency", [1e-6, 0.3, 90.0, 120.0, 1000.0, 62500.0, 6.25e7])
@pytest.mark.parametrize("start", [0.0, 0.0123, 86400.017])
def test_square_wave_agrees_with_exact_fractions(frequency, start):
    for duty in (0.0, 1e-3, 0.1, 0.5, 0.9, 1.0):
        for duration in (1e-9, 1e-4, 0.016):
            for phase in (0.0, 0.37, 0.95):
                want = square_reference(start, duration, frequency, duty, phase)
                got = float(m.square_wave_s(start, duration, frequency, duty, phase))
                # rounding of the exposure, and of the phase, which moves a switching edge by 2e-16
                # periods
                assert abs(got - want) <= 4e-16 * duration + min(2.5e-16 / frequency, duration), (
                    duty,
                    duration,
                    phase,
                )


@pytest.mark.parametrize("frequency", [0.0, 1e-6, 0.3, 100.0, 120.0, 6.25e7])
@pytest.mark.parametrize("start", [0.0, 0.0123, 86400.017])
def test_ripple_agrees_with_sixty_digits(frequency, start):
    with mp.workdps(60):
        for duration in (1e-9, 1e-4, 0.016):
            for depth in (0.0, 0.2, 1.0):
                w = 2 * mp.pi * mp.mpf(frequency)
                t0 = mp.mpf(start)
                d = mp.mpf(duration)
                swing = (
                    (
                        mp.sin(w * (t0 + d) + 2 * mp.pi * mp.mpf(0.37))
                        - mp.sin(w * t0 + 2 * mp.pi * mp.mpf(0.37))
                    )
                    / w
                    if frequency
                    else d * mp.cos(2 * mp.pi * mp.mpf(0.37))
                )
                # 2 pi times the rounding of a phase, at most 4e-15 of the mean light
                assert (
                    abs(
                        float(m.ripple_s(start, duration, frequency, depth, 0.37))
                        - (d + depth * swing)
                    )
                    <= 4e-15 * d
                )


def test_phase_is_exact_after_a_day():
    for t in (0.0, 1e-9, 86399.99, 123456.789, -3.7):
        for f in (0.1, 50.0, 119.88, 1e6, 7.3e8):
            want = Fraction(t) * Fraction(f) + Fraction(0.25)
            want -= want.__floor__()
            got = Fraction(float(m.phase_at(t, f, 0.25)))
            assert min(abs(got - want), 1 - abs(got - want)) <= Fraction(3e-16)
    # the plain product in float64 loses the phase, so the test is sensitive to it
    naive = (123456.789 * 7.3e8 + 0.25) % 1
    want = Fraction(123456.789) * Fraction(7.3e8) + Fraction(0.25)
    assert abs(Fraction(naive) - (want - want.__floor__())) > Fraction(1e-4)


def test_duty_and_frequency_limits():
    assert m.square_wave_s(0.3, 0.016, 90.0, 0.0) == 0.0
    assert m.square_wave_s(0.3, 0.016, 90.0, 1.0) == pytest.approx(0.016, rel=1e-15)
    assert (
        m.square_wave_s(5.0, 0.016, 0.0, 0.4, 0.39) == 0.016
        and m.square_wave_s(5.0, 0.016, 0.0, 0.4, 0.41) == 0.0
    )
    assert m.square_wave_s(5.0, 0.016, 1e-12, 0.4, 0.39) == 0.016
    assert m.ripple_s(5.0, 0.016, 0.0, 0.5, 0.5) == pytest.approx(0.008, rel=1e-15)
    # over a million periods the result is the mean, to within one period
    assert m.square_wave_s(0.3, 0.016, 6.25e7, 0.1) == pytest.approx(0.0016, rel=1e-5)
    assert m.square_wave_s(0.3, 0.016, 90.0, 0.1) == m.square_wave_s(0.3, 0.016, 90.0, 0.1, 1.0)


def test_exposures_add_up():
    starts = 0.3 + 0.001 * np.arange(16)
    for integral in (
        lambda s, d: m.square_wave_s(s, d, 93.7, 0.23, 0.1),
        lambda s, d: m.ripple_s(s, d, 93.7, 0.8, 0.1),
    ):
        # 2e-16 s per exposure: starts are rounded decimal numbers
        assert integral(starts, 0.001).sum() == pytest.approx(
            float(integral(0.3, 0.016)), abs=2e-16 * 16
        )


def test_rolling_shutter_rows_see_the_lamp_at_their_own_time():
    starts = m.row_starts_s(400, 2e-5, start_s=1000.0)
    assert starts.shape == (400, 1) and starts[1, 0] == 1000.0 + 2e-5
    on = m.square_wave_s(starts, 5e-4, 1000.0, 0.5)
    # 1e-13 s: rounding of times near 1000 s
    # the bands are fully dark and fully lit
    assert on.min() == pytest.approx(0.0, abs=1e-13) and on.max() == pytest.approx(5e-4, rel=1e-9)
    # 50 rows are one period; times such as 1000.00102 s are rounded to 1e-13 s
    np.testing.assert_allclose(on[50:], on[:-50], atol=2e-13)
    # exposures of whole periods show no bands
    assert np.ptp(m.square_wave_s(m.row_starts_s(400, 2e-5), 3e-3, 1000.0, 0.5)) < 1e-15
    assert np.ptp(m.row_starts_s(400, 0.0)) == 0.0


@pytest.mark.parametrize(
    ("frequency", "duty"),
    [(90.0, 0.1), (1000.0, 0.5), (10.0, 0.3), (0.0, 0.3), (90.0, 0.0), (90.0, 1.0), (500.0, 0.999)],
)
def test_pieces_make_up_the_exposure(frequency, duty):
    starts = m.row_starts_s(37, 7.7e-4, start_s=12.3)
    durations, on = m.square_wave_pieces(starts, 0.016, frequency, duty, 0.2)
    np.testing.assert_allclose(durations.sum(axis=0), 0.016, rtol=1e-14)
    np.testing.assert_allclose(
        (durations * on).sum(axis=0),
        m.square_wave_s(starts, 0.016, frequency, duty, 0.2),
        rtol=1e-12,
        atol=1e-17,
    )
    assert durations.min() >= 0 and set(np.unique(on)) <= {0.0, 1.0}
    # the pieces are in order: the lamp's state in the middle of a piece is that of the piece
    begin = starts + np.cumsum(durations, axis=0) - durations
    middle = m.phase_at(begin + durations / 2, frequency, 0.2) < duty
    np.testing.assert_array_equal(middle[durations > 1e-9], on[durations > 1e-9] == 1.0)
