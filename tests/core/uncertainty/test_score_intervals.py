"""Coverage of score intervals, counted over simulated scores with known true values."""

from __future__ import annotations

import math

import numpy as np
import pytest

from isethdr_core.uncertainty.score_intervals import (
    NOT_MEASURED,
    RendererError,
    degrees_of_freedom,
    interval,
    student_factor,
)

SHOTS = 4
CHANGES = 6
TRIALS = 2000


def share_inside(noise: float, renderer: float, bias: float = 0.0, smoothed: float = 0.0) -> float:
    """Return the share of intervals that hold a score of 3.

    `noise` and `renderer` are the standard deviations of one shot and of one rendering. `smoothed`
    is the share of `bias` that vanishes when the scene is smoothed.
    """
    rng = np.random.default_rng(11)
    inside = 0
    for _ in range(TRIALS):
        rendering = 3.0 + bias + rng.normal(0.0, renderer)
        shots = rng.normal(rendering, noise, SHOTS)
        scatter = rng.normal(0.0, renderer, CHANGES).std(ddof=1)
        error = RendererError(scatter, CHANGES - 1, less_noise=-smoothed * bias)
        low, high = interval(list(map(float, shots)), error)
        inside += low <= 3.0 <= high
    return inside / TRIALS


# four standard errors of a share of 0.95 in 2000 trials
CHANCE = 4 * math.sqrt(0.95 * 0.05 / TRIALS)


@pytest.mark.parametrize(("noise", "renderer"), [(1.0, 0.01), (1.0, 0.5), (1.0, 2.0), (0.01, 1.0)])
def test_an_interval_holds_the_score_whichever_noise_is_larger(noise, renderer):
    # Satterthwaite's degrees of freedom are those of the mean share: off by up to a hundredth
    assert abs(share_inside(noise, renderer) - 0.95) < CHANCE + 0.01


def test_noise_realisations_alone_do_not_hold_a_score_with_renderer_noise():
    rng = np.random.default_rng(3)
    shots = rng.normal(rng.normal(3.0, 2.0, (TRIALS, 1)), 1.0, (TRIALS, SHOTS))
    ends = np.array([interval(list(map(float, s))) for s in shots])
    assert np.mean((ends[:, 0] <= 3.0) & (ends[:, 1] >= 3.0)) < 0.6


@pytest.mark.parametrize("bias", [-5.0, 5.0])
def test_a_shift_that_is_known_to_a_factor_widens_the_interval(bias):
    assert share_inside(0.5, 1.0, bias) < 0.4
    assert share_inside(0.5, 1.0, bias, smoothed=0.7) > 0.95
    # both shifts count as normal errors: 1.96 times the root of the sum of their squares
    low, high = interval(
        [1.0, 1.0], RendererError(0.0, CHANGES - 1, more_noise=bias, less_noise=-bias)
    )
    assert (low, high) == pytest.approx(
        (1 - 1.96 * 5 * math.sqrt(2), 1 + 1.96 * 5 * math.sqrt(2)), rel=1e-4
    )


def test_degrees_of_freedom_lie_between_those_of_the_larger_part_and_of_all():
    assert degrees_of_freedom((1.0, 0.0), (3, 5)) == 3
    assert degrees_of_freedom((1e-200, 1.0), (3, 5)) == pytest.approx(5)
    # equal parts: (1 + 1)^2 / (1 / 3 + 1 / 5)
    assert degrees_of_freedom((2.0, 2.0), (3, 5)) == pytest.approx(7.5)
    assert degrees_of_freedom((0.0, 0.0), (3, 5)) == math.inf
    assert degrees_of_freedom((0.0, 1.0), (3, math.inf)) == math.inf


def test_a_renderer_error_that_is_known_exactly_is_a_normal_error():
    low, high = interval([1.0, 1.0], RendererError(0.1, math.inf))
    assert (low, high) == pytest.approx((1 - 0.196, 1 + 0.196), rel=1e-4)


def test_student_factors_are_those_of_tables():
    assert student_factor(3) == pytest.approx(3.182, abs=5e-4)
    assert student_factor(math.inf) == pytest.approx(1.960, abs=5e-4)


def test_a_score_that_never_changes_is_exact():
    assert interval([2.5] * SHOTS, RendererError(0.0, CHANGES - 1)) == (2.5, 2.5)


@pytest.mark.parametrize(
    ("values", "renderer"),
    [
        ([1.0], RendererError(1.0, 5)),
        ([1.0, math.inf], None),
        ([1.0, math.nan], RendererError(1.0, 5)),
        ([1.0, 2.0], NOT_MEASURED),
    ],
)
def test_without_enough_values_there_is_no_interval(values, renderer):
    assert all(map(math.isnan, interval(values, renderer)))
