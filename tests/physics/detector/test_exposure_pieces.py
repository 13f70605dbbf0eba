"""Light relative to its mean over time, and exposures divided where lamps switch."""

import numpy as np
import pytest

from isethdr_core.physics.detector.exposure_pieces import count, pieces, relative_in_pieces
from isethdr_core.physics.detector.temporal_modulation import (
    Modulation,
    light_s,
    relative_light,
    row_starts_s,
)

PULSES = Modulation(90.0, duty=0.1, phase=0.6)
OTHER = Modulation(217.0, duty=0.35, phase=0.1)
RIPPLE = Modulation(100.0, depth=0.8, phase=0.2)
EACH = pytest.mark.parametrize("light", [PULSES, OTHER, RIPPLE], ids=["pulses", "other", "ripple"])


@EACH
def test_the_mean_over_all_phases_is_the_mean_over_time(light):
    found = [
        relative_light(light._replace(phase=p), 0.0123, 0.0041)
        for p in (np.arange(1000) + 0.5) / 1000
    ]
    # the midpoint rule errs by 1/8 of a step squared at each of four kinks of slope 1 / (duty f T);
    # it sums a sine exactly
    assert np.mean(found) == pytest.approx(
        1.0, abs=0.5e-6 / light.duty / (light.frequency_hz * 0.0041) if light.duty < 1 else 1e-13
    )


@EACH
def test_whole_periods_see_the_mean(light):
    for periods in (1, 3, 1000):
        # the exposure is rounded: 1e-16 of an exposure is 1e-16 / duty of a pulse
        np.testing.assert_allclose(
            relative_light(light, np.linspace(0, 1, 17), periods / light.frequency_hz),
            1.0,
            atol=3e-15 * periods,
        )


@EACH
def test_the_integral_is_that_of_many_samples(light):
    start = 0.0173
    duration = 0.0077
    samples = 400_000
    t = start + (np.arange(samples) + 0.5) * (duration / samples)
    turns = light.frequency_hz * t + light.phase
    wave = (
        1 + light.depth * np.cos(2 * np.pi * turns)
        if light.depth
        else (turns % 1 < light.duty) / light.duty
    )
    # each of the few edges is resolved to half a sample; a sine is summed to 1e-10
    assert light_s(light, start, duration) == pytest.approx(
        wave.mean() * duration, abs=4 * duration / samples / light.duty
    )


def test_constant_light_is_one_bit_for_bit():
    starts = row_starts_s(50, 2.2e-5, 0.3)
    for light in (Modulation(), Modulation(90.0), Modulation(90.0, 1.0, 0.0, 0.7)):
        assert np.all(relative_light(light, starts, 0.0123456789) == 1.0)
        assert np.all(light_s(light, starts, 0.0123456789) == 0.0123456789)


@pytest.mark.parametrize(
    "lights", [[PULSES], [PULSES, OTHER], [RIPPLE], [RIPPLE, OTHER, Modulation()], [Modulation()]]
)
def test_pieces_make_up_the_exposure_and_hold_no_edge(lights):
    starts = row_starts_s(23, 7.7e-4, 12.3)
    begin, duration = pieces(lights, starts, 0.016)
    np.testing.assert_allclose(duration.sum(axis=0), 0.016, rtol=1e-14)
    assert duration.min() >= 0
    np.testing.assert_allclose(begin, starts + np.cumsum(duration, axis=0) - duration, rtol=1e-15)
    assert len(begin) <= count(lights, 0.016) + 4 * len(lights)
    for light in lights:
        inside = relative_in_pieces(light, begin, duration)
        np.testing.assert_allclose(
            (inside * duration).sum(axis=0), light_s(light, starts, 0.016), rtol=1e-12
        )
        if light.duty < 1:  # on or off in every piece that is longer than the rounding of an edge
            state = inside[duration > 1e-9] * light.duty
            assert np.all((state < 1e-5) | (state > 1 - 1e-5))
