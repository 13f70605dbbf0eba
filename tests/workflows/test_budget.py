"""The study of the error budget at a tiny size: errors stay within the allowed ones, stated errors
are upper bounds, and bad sizes are refused.
"""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_measured import budget
from isethdr_measured.budget import scenes
from isethdr_workflows.empty_home import empty_home

from isethdr_core.errors import ConfigError
from isethdr_core.plugins.registry import build
from isethdr_core.quantities import check_scene, tristimulus


@pytest.mark.slow
def test_what_is_allowed_is_kept_and_more_is_stated_than_is_wrong(monkeypatch):
    monkeypatch.setattr(scenes, "BANDS_NM", np.arange(460.0, 661.0, 50.0))
    monkeypatch.setattr(budget, "CAMERAS", {"street": "rgbw"})
    monkeypatch.setattr(scenes, "DAYLIGHT", np.ones((5, 1, 1)))
    monkeypatch.setattr(scenes, "WHITE_LED", np.linspace(1, 2, 5)[:, None, None])
    monkeypatch.setattr(scenes, "SODIUM", np.linspace(2, 1, 5)[:, None, None])
    monkeypatch.setattr(scenes, "TILE_UM", 16.0)
    monkeypatch.setattr(budget, "FRACTIONS", (0.03, 0.3))
    monkeypatch.setattr(budget, "BITS", (8, 12))
    monkeypatch.setattr(budget, "KERNELS", (0.03,))
    monkeypatch.setattr(budget, "AGAIN", 1)
    rows = budget.budget(width=24)
    assert [r["allowed"] for r in rows] == [0.03, 0.3] and rows[0]["bits"] > rows[1]["bits"]
    for row in rows:
        assert row["within"] >= 0.99
        # the error of the reference adds to the error found
        assert row["error_99"] <= row["stated_99"] + row["truth_error"]
        assert row["cold_cpu_s"] >= row["warm_cpu_s"] > 0


@pytest.mark.parametrize("name, brightest", [("tunnel", 8e3), ("street", 2e6), ("noon", 3e6)])
def test_scenes_are_of_the_light_they_say(name, brightest):
    made = scenes.scene(name, 32, 6.0)
    check_scene(made)
    luminance = tristimulus(
        build("lighting", "weights", weights={"ambient": 1.0, "lamps": 1.0})(made)
    ).xyz.values[..., 1]
    assert luminance.max() == pytest.approx(brightest, rel=0.05)  # other light adds
    assert luminance.max() > 700 * np.median(luminance) and made.sizes["x"] == 38


def test_no_kernel_is_at_hand_inside_and_the_home_is_as_before_after(monkeypatch, tmp_path):
    from isethdr_core.storage import store

    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    with empty_home() as folder:
        assert str(store.home()) == folder != str(tmp_path)
    assert str(store.home()) == str(tmp_path)


def test_a_field_of_no_width_is_refused():
    with pytest.raises(ConfigError, match="width=8; expected at least 16"):
        budget.budget(width=8)
