"""Sub-frames of a shot: windows without gaps, and lamps that pulse within them."""

import numpy as np
import pytest

from isethdr_core.motion.moments import Window, sub_frames, within
from isethdr_core.physics.detector.temporal_modulation import Modulation, light_s

SHOT_S = 0.0217
RNG = np.random.default_rng(5)
STARTS_S = RNG.uniform(0, 0.9 * SHOT_S, 200)
EXPOSURES_S = RNG.uniform(0.01, 1.0, 200) * (SHOT_S - STARTS_S)


def collected_s(modulation: Modulation, count: int) -> np.ndarray:
    """Return the relative light of all sub-frames, integrated over each exposure, s."""
    timed = [
        light
        for sub_frame in sub_frames(SHOT_S, count)
        for light in within(sub_frame.window, SHOT_S, modulation)
    ]
    return sum(t.factor * light_s(t.modulation, STARTS_S, EXPOSURES_S) for t in timed)


@pytest.mark.parametrize("count", [2, 3, 12])
def test_the_windows_of_a_shot_meet_and_hold_its_moments(count):
    frames = sub_frames(SHOT_S, count)
    assert [f.window.start_s for f in frames] == [0.0, *(f.window.end_s for f in frames[:-1])]
    assert frames[-1].window.end_s == SHOT_S
    assert all(f.window.start_s <= f.moment_s <= f.window.end_s + 1e-18 for f in frames)
    # rounding of k T / (K - 1)
    assert frames[-1].moment_s == pytest.approx(SHOT_S, rel=1e-15)


@pytest.mark.parametrize("count", [2, 3, 12])
def test_sub_frames_of_a_still_scene_expose_as_its_light_does(count):
    # each of `count` terms is rounded
    np.testing.assert_allclose(collected_s(Modulation(), count), EXPOSURES_S, rtol=1e-14 * count)


@pytest.mark.parametrize("lamp", [Modulation(90.0, 0.1, 0.0, 0.3), Modulation(377.0, 0.7)])
def test_a_lamp_that_pulses_keeps_its_pulses_within_sub_frames(lamp):
    exact_s = light_s(lamp, STARTS_S, EXPOSURES_S)
    # rounding: edges of pulses are products and sums of numbers near 0.02 s; the level of a pulse
    # is 1 / duty
    tolerance_s = 1e-16 / lamp.duty * 30
    np.testing.assert_allclose(collected_s(lamp, 7), exact_s, rtol=1e-12, atol=tolerance_s)


def test_a_ripple_is_cut_into_pieces_of_an_eighth_of_its_period():
    lamp = Modulation(100.0, 1.0, 0.3, 0.2)
    exact_s = light_s(lamp, STARTS_S, EXPOSURES_S)
    # an exposure cuts two pieces. Each errs by less than the change of light within a piece,
    # 0.3 x 2 pi / 8, over half of the piece
    piece_s = 1 / 100 / 8
    assert np.abs(collected_s(lamp, 4) - exact_s).max() < 2 * 0.3 * 2 * np.pi / 8 * piece_s / 2


def test_the_mean_over_the_shot_is_the_sum_of_the_factors():
    timed = [within(f.window, SHOT_S, Modulation()) for f in sub_frames(SHOT_S, 5)]
    factors = [t.factor for [t] in timed]
    assert factors == pytest.approx([1 / 8, 1 / 4, 1 / 4, 1 / 4, 1 / 8], rel=1e-14)


def test_a_pulse_outside_of_a_window_leaves_no_light():
    assert within(Window(0.002, 0.009), SHOT_S, Modulation(50.0, 0.05)) == []
