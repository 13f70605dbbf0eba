"""Soft-knee pixels under flashing light agree with the differential equation and with a simulation
electron by electron.
"""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_sensors.charge import soft_knee_in_time as in_time
from scipy.integrate import solve_ivp

from isethdr_core.conformance.inputs import in_components
from isethdr_core.errors import ConfigError
from isethdr_core.physics.detector.charge_dynamics import Well, flow
from isethdr_core.physics.detector.charge_dynamics_noise import EMPTY, flow_moments
from isethdr_core.physics.detector.exposure_pieces import pieces, relative_in_pieces
from isethdr_core.physics.detector.temporal_modulation import (
    Modulation,
    light_s,
    relative_light,
    row_starts_s,
)
from isethdr_core.plugins.registry import build
from isethdr_core.seeds import generator

WELL = Well(7000.0, 240.0, 440000.0)
T = 0.016
LIMIT = in_time.untouched_e(1e-6, T, WELL)
STEADY = Modulation()
PULSES = Modulation(90.0, duty=0.1, phase=0.6)
OTHER = Modulation(217.0, duty=0.3, phase=0.1)
RIPPLE = Modulation(100.0, depth=0.8)
LIGHTS = [
    [(STEADY, 1e3), (PULSES, 2e4)],
    [(PULSES, 2e4), (OTHER, 9e3)],
    [(RIPPLE, 3e4)],
    [(RIPPLE, 1e4), (PULSES, 3e4)],
    [(PULSES, 1e7)],
]


def frames(lights, starts, columns):
    """Return the parts of the light as frames, and the mean electrons that arrive in each pixel."""
    parts = [(m, np.full((len(starts), columns), v)) for m, v in lights]
    return parts, sum(v * (light_s(m, starts, T) / T) for m, v in parts)


def integrated(lights, start):
    """Return the charge from an implicit solver that restarts wherever a lamp switches."""
    begins, durations = pieces([m for m, _ in lights], np.array([start]), T)
    charge = np.zeros(1)
    for begin, duration in zip(begins[:, 0], durations[:, 0]):
        if duration <= 0:
            continue
        held = sum(
            v / T * float(relative_light(m, begin, duration)) for m, v in lights if not m.depth
        )

        def change(t, q, held=held):
            waves = sum(
                v / T * (1 + m.depth * np.cos(2 * np.pi * (m.frequency_hz * t + m.phase)))
                for m, v in lights
                if m.depth
            )
            return held + waves - WELL.overflow_e_per_s(np.minimum(q, 20000.0))

        charge = solve_ivp(
            change, (begin, begin + duration), charge, method="Radau", rtol=1e-8, atol=1e-6
        ).y[:, -1]
    return charge[0]


# the quick tests run one light only: the solver takes half a second for each
@pytest.mark.parametrize(
    "lights",
    [pytest.param(one, marks=[pytest.mark.slow] * (k != 1)) for k, one in enumerate(LIGHTS)],
)
def test_charge_agrees_with_the_differential_equation(lights):
    starts = row_starts_s(2, 5.1e-3)
    parts, arrived = frames(lights, starts, 1)
    found = in_time.stays(arrived, parts, starts, in_time.Exposure(T, WELL, LIMIT), None, 0)[:, 0]
    # 1e-3 e: error of the solver at 7000 e, with its relative tolerance of 1e-8
    np.testing.assert_allclose(found, [integrated(lights, s) for s in starts[:, 0]], atol=1e-3)


def test_constant_parts_are_constant_light_and_little_light_is_untouched():
    arrived = np.geomspace(1.0, 1e9, 40)[None]
    found = in_time.stays(
        arrived,
        [(STEADY, 0.7 * arrived), (STEADY, 0.3 * arrived)],
        np.zeros((1, 1)),
        in_time.Exposure(T, WELL, LIMIT),
        None,
        0,
    )
    # below LIMIT, a spill of up to 1e-6 e is neglected
    np.testing.assert_allclose(found, flow(0.0, arrived / T, T, WELL)[0], rtol=1e-12, atol=2e-6)
    small = arrived[arrived < LIMIT]
    assert len(small) > 5 and np.array_equal(found[0, : len(small)], small)


def test_fast_pulses_are_even_light():
    # 800 pulses of 25 e, a tenth of thermal_e
    lights = [(Modulation(50e3, duty=0.5, phase=0.2), 2e4)]
    parts, arrived = frames(lights, np.zeros((1, 1)), 1)
    even = flow(0.0, arrived / T, T, WELL)[0]
    # 12.5 e: half the charge of one pulse
    assert in_time.stays(
        arrived, parts, np.zeros((1, 1)), in_time.Exposure(T, WELL, LIMIT), None, 0
    ) == pytest.approx(even, abs=12.5)


@pytest.mark.slow
def test_noise_agrees_with_pixels_followed_in_small_steps():
    lights = [(STEADY, 1e3), (PULSES, 8e3)]
    count = 6000
    steps = 2500
    rng = np.random.default_rng(5)
    charge = np.zeros(count)
    total = np.zeros(count)
    for k in range(steps):
        came = rng.poisson(
            sum(v / T * float(light_s(m, k * T / steps, T / steps)) for m, v in lights), count
        )
        charge += came - rng.poisson(WELL.overflow_e_per_s(charge) * T / steps)
        total += came
    parts, mean = frames(lights, np.zeros((100, 1)), 100)
    arrived = rng.poisson(mean).astype(float)
    found = in_time.stays(
        arrived, parts, np.zeros((100, 1)), in_time.Exposure(T, WELL, LIMIT), generator(3), 0
    )
    # mean: 0.5 e for the curvature of the response, and 5 standard errors of a difference of means
    # (standard deviation 16 e; 6000 and 10 000 pixels). 12 % of the variance and covariance: 5
    # standard errors, the time steps, and the curvature
    assert found.mean() == pytest.approx(
        charge.mean(), abs=0.5 + 5 * 16 * np.sqrt(1 / 6000 + 1 / 10_000)
    )
    assert found.var() == pytest.approx(charge.var(), rel=0.12)
    assert np.cov(found.ravel(), arrived.ravel())[0, 1] == pytest.approx(
        np.cov(charge, total)[0, 1], rel=0.12
    )
    assert found.var() < 0.1 * mean[0, 0]  # far from Poisson noise, so the tests above can fail


def test_the_noise_that_the_count_explains_is_not_drawn_twice():
    # just beyond the knee, where most of the variance comes from the number of photoelectrons
    lights = [
        (STEADY, 1e3),
        (PULSES, 7e3),
    ]
    begins, durations = pieces([m for m, _ in lights], np.zeros(1), T)
    moments = EMPTY
    for begin, duration in zip(begins, durations):
        moments = flow_moments(
            moments,
            sum(v / T * relative_in_pieces(m, begin, duration) for m, v in lights),
            duration,
            WELL,
        )
    parts, mean = frames(lights, np.zeros((100, 1)), 100)
    arrived = np.random.default_rng(6).poisson(mean).astype(float)
    found = in_time.stays(
        arrived, parts, np.zeros((100, 1)), in_time.Exposure(T, WELL, LIMIT), generator(3), 0
    )
    # 12 %: 5 standard errors of a variance from 10 000 pixels are 7 %, curvature at the knee adds
    # 4 %; noise drawn twice would add 19 %
    assert found.var() == pytest.approx(float(moments.charge_var_e2[0]), rel=0.12)


def test_a_lofic_pixel_keeps_all_charge_in_its_capacitor_whenever_it_comes(flat):
    sensor = build("sensor", "lofic", noise=False, bits=0, line_time_s=2e-4, swing_v=[1.0, 4.0])
    light = in_components(flat(3e-4, 16, 16, 5.6), **PULSES._asdict())
    shot = sensor(light, None)
    mean = sensor.expected(light)
    assert mean.values.min() > 2 * sensor.knee_e
    np.testing.assert_allclose(shot.raw.sel(capture="LCG"), mean.sel(capture="LCG"), rtol=1e-6)
    alone = shot.raw.sel(capture="HCG").values
    assert np.ptp(alone, axis=0).min() > 0.1 * alone.mean()  # rows have other pulses
    assert shot.saturated.sel(capture="HCG").values.mean() > 0.3


def test_blocks_of_rows_give_the_same_bits(flat):
    from isethdr_sensors.charge import soft_knee_shot

    sensor = build("sensor", "lofic")
    light_e = np.full((13, 9), 2e4)
    parts = [(PULSES, np.full((13, 9), 2e4))]
    one, other = (
        soft_knee_shot.readings(
            soft_knee_shot.SoftKneePixel(sensor.model(), sensor.well(), (True, False)),
            light_e,
            generator(4),
            rows,
            in_time=parts,
        )
        for rows in (13, 4)
    )
    assert np.array_equal(one[0], other[0]) and np.array_equal(one[1], other[1])


def test_lamps_too_fast_to_follow_are_refused(flat):
    with pytest.raises(ConfigError, match="switches too often"):
        build("sensor", "lin_log")(
            in_components(flat(1e-3), frequency_hz=1e6, duty=0.5), generator(1)
        )


def test_what_may_have_spilled_is_a_bound_for_any_course():
    for charge in (3000.0, 5000.0, 6000.0):
        flash = [(Modulation(1 / T, duty=1e-3, phase=0.0), charge)]  # all light at the start
        parts, arrived = frames(flash, np.zeros((1, 1)), 1)
        left = in_time.stays(
            arrived, parts, np.zeros((1, 1)), in_time.Exposure(T, WELL, 0.0), None, 0
        )
        assert (
            0.3 * in_time.worst_spill(charge, T, WELL)
            < 1 - left / arrived
            <= in_time.worst_spill(charge, T, WELL)
        )
