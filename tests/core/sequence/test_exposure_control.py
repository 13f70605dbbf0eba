"""Exposure control: geometric approach, delay, limits; a constant scene keeps its exposure."""

from math import inf

import numpy as np
import pytest

from isethdr_core.errors import ConfigError
from isethdr_core.sequence.exposure import Exposure, ExposureLimits, SettledExposure
from isethdr_core.sequence.exposure_control import ExposureControl

WIDE = ExposureLimits(1e-9, 1e3)


def settled(exposure_s, gain=1.0, limits=WIDE, ratios=()) -> SettledExposure:
    return SettledExposure(Exposure(exposure_s, gain, ratios), limits)


def followed(control, frames) -> list[Exposure]:
    """Return the exposures of a sequence; `frames` are the settled exposures of its frames."""
    taken = [frames[0].exposure]
    return taken + [control.next_exposure(frames[:n]) for n in range(1, len(frames))]


@pytest.mark.parametrize("share", [0.05, 0.2, 0.7, 1.0])
@pytest.mark.parametrize("delay", [1, 2, 5])
@pytest.mark.parametrize("to_s", [0.0003, 0.03])
def test_a_step_of_light_leaves_a_geometric_rest_after_the_delay(share, delay, to_s):
    step = 3  # first frame of the other light
    frames = [settled(0.003)] * step + [settled(to_s)] * 20
    taken = followed(ExposureControl(share, delay), frames)
    rest = [np.log(one.product_s / to_s) / np.log(0.003 / to_s) for one in taken]
    moves = np.maximum(np.arange(len(frames)) - (step + delay - 1), 0)
    # tolerance: logarithms to base 2 and back, some roundings of 2e-16 for each of 20 moves
    np.testing.assert_allclose(rest, (1 - share) ** moves, rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize("share", [0.1, 1 / 3, 1.0])
def test_constant_light_keeps_the_settled_exposure_bit_for_bit(share):
    one = settled(0.033 / 7, 3.3, ExposureLimits(1e-5, 0.033 / 7, 8.0), (1.0, 0.1, 0.003))
    assert set(followed(ExposureControl(share, 3), [one] * 40)) == {one.exposure}


def test_an_exposure_that_has_settled_is_that_of_a_single_shot_bit_for_bit():
    goal = settled(0.033, 5.7, ExposureLimits(1e-5, 0.033, 8.0), (1.0, 0.07, 0.005))
    before = settled(0.001, 1.0, goal.limits, (1.0, 0.5, 0.25))
    taken = followed(ExposureControl(0.5, 1), [before] + [goal] * 60)
    assert taken[-1] == goal.exposure != taken[5]


def test_the_gain_falls_before_the_exposure_and_rises_after_it():
    limits = ExposureLimits(1e-5, 0.02, 8.0)
    dark = settled(0.02, 8.0, limits)
    bright = settled(0.0001, 1.0, limits)
    for ends in ([dark] + [bright] * 30, [bright] + [dark] * 30):
        taken = followed(ExposureControl(0.2, 1), ends)
        assert all(one.gain == 1.0 or one.exposure_s == 0.02 for one in taken)
        gains = {one.gain for one in taken}
        assert min(gains) == 1.0 and max(gains) > 4
        assert len({one.exposure_s for one in taken}) > 3


def test_exposures_take_whole_periods_of_flickering_lamps_on_the_way():
    limits = ExposureLimits(0.01, 0.05, 8.0, period_s=0.01)
    frames = [settled(0.05, 2.0, limits)] + [settled(0.01, 1.0, limits)] * 30
    taken = followed(ExposureControl(0.1, 1), frames)
    periods = np.array([one.exposure_s for one in taken]) / 0.01
    np.testing.assert_allclose(periods, np.round(periods), rtol=1e-12)
    # the gain makes up for the exposure that is lost by rounding to whole periods
    plain = followed(ExposureControl(0.1, 1), [settled(0.1)] + [settled(0.01)] * 30)
    products = [[one.product_s for one in run] for run in (taken, plain)]
    np.testing.assert_allclose(*products, rtol=1e-12)


def test_no_frame_changes_by_more_stops_than_the_limit():
    frames = [settled(1e-5)] + [settled(0.01)] * 40
    taken = followed(ExposureControl(0.5, 1, most_stops_per_frame=0.5), frames)
    stops = np.diff(np.log2([one.product_s for one in taken]))
    assert stops.max() == pytest.approx(0.5, rel=1e-9) and stops.min() >= 0
    assert taken[-1].product_s == pytest.approx(0.01, rel=1e-3)


def test_ratios_of_captures_move_by_the_same_share():
    frames = [settled(0.01, ratios=(1.0, 0.5))] + [settled(0.01, ratios=(1.0, 0.005))] * 3
    taken = followed(ExposureControl(0.25, 1), frames)
    shares = [one.ratios[1] for one in taken]
    np.testing.assert_allclose(shares, 0.005 * 100 ** (0.75 ** np.array([0, 0, 1, 2])), rtol=1e-12)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("share_per_frame", 0.0),
        ("share_per_frame", 1.1),
        ("share_per_frame", float("nan")),
        ("delay_frames", 0),
        ("delay_frames", 1.5),
        ("most_stops_per_frame", 0.0),
    ],
)
def test_a_control_that_cannot_be_is_refused(field, value):
    with pytest.raises(ConfigError, match=rf"exposure\.{field} is .*type for example"):
        ExposureControl(**{field: value})
    assert ExposureControl().most_stops_per_frame == inf
