"""The study of LED lamps at night: which captures keep them."""

import numpy as np
import pytest
from isethdr_workflows.sensors.led_flicker import DUTY, FREQUENCY_HZ, led_flicker


@pytest.mark.slow
def test_short_exposures_miss_lamps_that_the_small_photodiode_keeps(tmp_path):
    rows = {(r["sensor"], r["capture"]): r for r in led_flicker(str(tmp_path))}
    for (_, capture), row in rows.items():
        # dark gaps longer than the exposure: 1 - duty - frequency x exposure of the phases
        if capture != "merged picture":
            gap = max(0.0, 1 - DUTY - FREQUENCY_HZ * row["exposure_ms"] / 1e3)
            # 400 phases, two ends
            assert row["never_lit_percent"] == pytest.approx(100 * gap, abs=0.5)
    assert rows["staggered", "T2"]["lamps_seen"] <= 1 and rows["staggered", "T3"]["lamps_seen"] <= 1
    merged = rows["staggered", "merged picture"]
    assert merged["lamps_seen"] == 1 and merged["darkest"] < 0.01
    # the instant is one in which that lamp is on
    assert merged["brightest"] == pytest.approx(1 / DUTY, rel=0.02)
    small = rows["split_pixel", "SPLG"]
    assert small["lamps_seen"] == 5
    # 1.44 periods: one pulse or two, of the 1.44 that the mean over time has; noise of 1500 e is 3
    # %, over some hundred pixels
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
