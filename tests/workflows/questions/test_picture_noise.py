"""How noise of the renderer changes answers on networks and filters; changes are paired by road."""

from __future__ import annotations

import pytest
from isethdr_workflows.paper.fig8_9_networks import RGB, RGBW
from isethdr_workflows.questions.picture_noise import (
    ANSWERS,
    CHANGES,
    DENOISED,
    PAIRS,
    STORED,
    Found,
    picture_noise,
    rows_of,
)

from isethdr_core.errors import ConfigError

ROADS = {"a": -0.01, "b": 0.0, "c": 0.01}


def found(road: str, filters: str, pair: tuple[str, str], better: float) -> Found:
    """Return scores of a network, shifted by `better`, and fixed scores of classical processing."""
    network = {"ssim": 0.5 + better, "psnr_db": 20 + better, "ciede2000": 5 + better}
    classical = {"ssim": 0.4, "psnr_db": 19.0, "ciede2000": 6.0}
    return Found(road, filters, 1.0, pair, network, classical)


def test_a_change_is_the_mean_of_its_pairs_less_the_stored_result():
    """Half A moves the RGB network by +0.3 and half B by +0.1, which is 0.2 on average. This is far
    beyond the limits of 0.1 +- 0.025 (Student's 4.303 times 0.01 over the square root of 3).
    Denoising does not move it.
    """
    moved = {("half_a", "half_a"): 0.3, ("half_b", "half_b"): 0.1}
    every = [
        found(road, filters, pair, own + moved.get(pair, 0.0) * (filters == RGB))
        for road, own in ROADS.items()
        for filters in (RGB, RGBW)
        for pair in PAIRS
    ]
    rows = {(row["answer"], row["score"]): row for row in rows_of(every)}
    assert len(rows) == 3 * len(ANSWERS)
    row = rows["network less classical, RGB", "ssim"]
    assert row["stored"] == pytest.approx(0.1)
    assert row["stored_high"] - 0.1 == pytest.approx(4.303 * 0.01 / 3**0.5, rel=1e-3)
    assert row["half_buffers"] == pytest.approx(0.2) == row["half_buffers_high"]
    assert row["other_half"] == pytest.approx(0.0) == row[DENOISED]
    assert row["changes"] == "half_buffers"
    assert rows["network less classical, RGBW", "ssim"]["changes"] == "none"
    assert rows["RGBW less RGB, networks", "ssim"]["half_buffers"] == pytest.approx(-0.2)
    assert rows["RGBW less RGB, classical", "ssim"]["changes"] == "none"


def test_all_scenes_of_a_road_count():
    """Each road has two scenes, in which the network is better by 0.3 and by 0.5."""
    every = [
        found(road, filters, pair, own + scene)
        for road, own in ROADS.items()
        for scene in (0.2, 0.4)
        for filters in (RGB, RGBW)
        for pair in PAIRS
    ]
    rows = {(row["answer"], row["score"]): row for row in rows_of(every)}
    row = rows["network less classical, RGB", "ssim"]
    assert row["stored"] == pytest.approx(0.4)  # the mean over both scenes
    # roads are the samples: the interval of three values with the standard deviation 0.01
    assert row["stored_high"] - 0.4 == pytest.approx(4.303 * 0.01 / 3**0.5, rel=1e-3)


def test_pictures_are_scored_against_the_noise_they_share_and_against_another():
    assert (STORED, STORED) in PAIRS
    for of, against in CHANGES["half_buffers"]:
        assert of == against
    for of, against in CHANGES["other_half"]:
        assert {of, against} == {"half_a", "half_b"}


def test_a_missing_model_is_refused_before_any_work():
    with pytest.raises(ConfigError, match="expected two models and two sensors"):
        picture_noise(rgb="a.onnx")
