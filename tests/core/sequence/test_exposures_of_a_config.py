"""The table `exposures` of a config: the exposures that are carried into a frame."""

import pytest

from isethdr_core.errors import ConfigError
from isethdr_core.sequence.exposure import Exposure, as_config, exposures_of, without_exposures

CARRIED = {"bayer": Exposure(0.004, 2.0, (1.0, 0.1)), "rgbw": Exposure(0.01)}


def test_a_table_says_the_exposures_that_it_was_made_of():
    assert exposures_of({"exposures": as_config(CARRIED)}, ["bayer", "rgbw", "other"]) == CARRIED


def test_no_table_is_no_frame_and_leaves_the_name_of_a_run_as_it_was():
    assert exposures_of({}, ["bayer"]) is None and exposures_of({"exposures": {}}, []) == {}
    assert without_exposures({"seed": 1, "exposures": None}) == {"seed": 1}
    assert "exposures" in without_exposures({"exposures": {}})


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("auto", "expected a table of cameras"),
        ({"bayre": {"exposure_s": 0.1}}, "did you mean 'bayer'"),
        ({"bayer": 0.1}, "expected exposure_s"),
        ({"bayer": {"gain": 2.0}}, "expected exposure_s"),
        ({"bayer": {"exposure_s": 0.1, "iso": 100}}, "expected exposure_s"),
        ({"bayer": {"exposure_s": -1.0}}, "numbers above 0"),
        ({"bayer": {"exposure_s": 0.1, "gain": 0.5}}, "expected 1 or more"),
        ({"bayer": {"exposure_s": 0.1, "ratios": [1.0, "x"]}}, "numbers above 0"),
        ({"bayer": {"exposure_s": 0.1, "ratios": 0.1}}, "bayer.ratios is 0.1; expected a list"),
    ],
)
def test_a_wrong_table_is_refused_with_what_to_type(table, message):
    with pytest.raises(ConfigError, match=message):
        exposures_of({"exposures": table}, ["bayer"])
