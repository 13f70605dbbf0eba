"""The table `motion` of a config."""

import pytest

from isethdr_core.errors import ConfigError
from isethdr_core.motion.settings import MotionSettings, motion_settings, without_motion


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"within_exposures": True}, "did you mean 'within_exposure'"),
        ({"within_exposure": 1}, "expected true or false"),
        ({"within_exposure": True, "step_px": 0}, "pixels above 0"),
        ({"within_exposure": True, "step_px": float("nan")}, "pixels above 0"),
        ({"within_exposure": True, "sub_frames": 1}, "from 2 to"),
        ({"within_exposure": True, "sub_frames": 2.5}, "whole number"),
        ({"most_sub_frames": None}, "whole number"),
    ],
)
def test_an_impossible_setting_is_named(table, message):
    with pytest.raises(ConfigError, match=message):
        motion_settings({"motion": table})


def test_a_switch_in_place_of_the_table_is_refused_with_what_to_type():
    with pytest.raises(ConfigError, match="is True; .* type for example motion.within_exposure="):
        motion_settings({"motion": True})


@pytest.mark.parametrize("config", [{}, {"motion": None}, {"motion": {"step_px": 2.0}}])
def test_nothing_moves_unless_asked_for(config):
    assert motion_settings(config) is None


def test_the_largest_motion_sets_the_number_of_sub_frames():
    settings = MotionSettings(step_px=0.5, most_sub_frames=20)
    # steps = motion / step, rounded up, and one sub-frame more
    assert [settings.count(px) for px in (0.1, 0.5, 0.6, 4.0, 100.0)] == [2, 2, 3, 9, 20]
    assert MotionSettings(sub_frames=4).count(100.0) == 4


def test_settings_without_effect_do_not_name_a_run():
    still = {"seed": 0}
    assert without_motion(still | {"motion": {"within_exposure": False, "step_px": 3.0}}) == still
    moving = still | {"motion": {"within_exposure": True}}
    assert without_motion(moving) == moving
