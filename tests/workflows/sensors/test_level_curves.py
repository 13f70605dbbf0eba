"""SNR and contrast detection over eight decades, as limited by shot noise and full well."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_workflows.sensors.level_curves import level_curves, viewer

from isethdr_core.errors import ConfigError


@pytest.mark.slow
def test_light_is_seen_better_until_the_well_is_full():
    rows = level_curves(sensor="bayer", per_decade=1)
    snr, seen = (np.array([r[key] for r in rows]) for key in ("snr_db", "detection"))
    full = next(k for k, r in enumerate(rows) if r["valid_percent"] < 50)
    assert np.all(np.diff(snr[:full]) > 0) and snr[0] < 0
    # SNR rises by 10 dB per decade with shot noise alone, by 20 dB with read noise alone, and by a
    # value in between with both
    steps = np.diff(snr[:full])
    assert np.all(steps > 8) and np.all(steps < 21)
    # saturated pixels show no contrast
    assert seen[0] < 0.2 and seen[full - 1] > 0.99 and np.all(seen[full:] == 0)


@pytest.mark.slow
def test_three_captures_reach_further_and_dip_where_one_takes_over():
    one, three = (level_curves(sensor=name, per_decade=2) for name in ("bayer", "split_pixel"))
    lasts = [
        max(r["luminance_cd_m2"] for r in rows if r["detection"] > 0.9) for rows in (one, three)
    ]
    assert lasts[1] > 10 * lasts[0]
    snr = np.array([r["snr_db"] for r in three if r["valid_percent"] > 99])
    # the small photodiode starts with a hundredth of the electrons
    assert np.any(np.diff(snr) < -3)


@pytest.mark.parametrize(
    "wrong", [{"contrast_percent": 0}, {"contrast_percent": 100.0}, {"per_decade": 0}]
)
def test_bad_settings_are_refused(wrong):
    with pytest.raises(ConfigError, match=f"{next(iter(wrong))} is .*expected.*type"):
        level_curves(**wrong)


def test_a_preset_is_a_sensor_too():
    assert callable(viewer("typical_rgbw"))
