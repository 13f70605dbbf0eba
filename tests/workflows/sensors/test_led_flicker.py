"""The study of LED lamps at night: which captures keep them."""

import numpy as np
import pytest
from isethdr_workflows.sensors.led_flicker import DUTY, FREQUENCY_HZ, led_flicker

from isethdr_core.errors import ConfigError


def test_a_folder_that_does_not_exist_is_found_before_the_work(tmp_path):
    with pytest.raises(ConfigError, match="expected a folder that exists"):
        led_flicker(str(tmp_path / "missing"))


def test_shares_of_no_phases_are_refused():
    with pytest.raises(ConfigError, match="phases is 0; expected 1 or more"):
        led_flicker(phases=0)


@pytest.mark.slow
def test_short_exposures_miss_lamps_that_the_small_photodiode_keeps(tmp_path):
    rows = {(r["sensor"], r["capture"]): r for r in led_flicker(str(tmp_path))}
    for (_, capture), row in rows.items():
        # a lamp is never lit if the whole exposure falls into a dark gap: a share of
        # 1 - duty - frequency x exposure of the phases
        if capture != "merged picture":
            gap = max(0.0, 1 - DUTY - FREQUENCY_HZ * row["exposure_ms"] / 1e3)
            # 0.5 %: 400 phases, and two ends of the gap
            assert row["never_lit_percent"] == pytest.approx(100 * gap, abs=0.5)
    assert rows["staggered", "T2"]["lamps_seen"] <= 1 and rows["staggered", "T3"]["lamps_seen"] <= 1
    merged = rows["staggered", "merged picture"]
    assert merged["lamps_seen"] == 1 and merged["darkest"] < 0.01
    # that lamp is on at the instant of the exposure
    assert merged["brightest"] == pytest.approx(1 / DUTY, rel=0.02)
    small = rows["split_pixel", "SPLG"]
    assert small["lamps_seen"] == 5
    # the exposure is 1.44 periods long, so it holds one pulse or two; the mean over time holds 1.44
    # pulses. 2 %: noise of 1500 e is 3 % in each of about a hundred pixels
    assert small["darkest"] == pytest.approx(1 / 1.44, rel=0.02) and small[
        "brightest"
    ] == pytest.approx(2 / 1.44, rel=0.02)
    merged = rows["split_pixel", "merged picture"]
    assert np.allclose(
        [merged["darkest"], merged["brightest"]], [small["darkest"], small["brightest"]], rtol=0.02
    )
    assert (tmp_path / "led_flicker.png").stat().st_size > 10_000 and (
        tmp_path / "rolling_bands.png"
    ).stat().st_size > 10_000
