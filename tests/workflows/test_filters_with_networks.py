"""Comparison of RGB and RGBW filters with networks: pairs by road, crossings, refusals."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from isethdr_workflows.dataset.record import SceneRecord
from isethdr_workflows.paper.fig8_9_networks import (
    CLASSICAL,
    NETWORK,
    RGB,
    RGBW,
    Filters,
    Found,
    known_of,
    paper_fig8_9_networks,
    rows_of,
    shown_lux,
)
from isethdr_workflows.training.learned_picture.road_scores import HeldOut
from isethdr_workflows.training.picture.roads import Road

from isethdr_core.errors import ConfigError


def found(filters, lux, road, better):
    """Return scores of a network that are `better`, and classical scores equal for all cameras."""
    network = {"ssim": 0.5 + better, "psnr_db": 20 + better, "ciede2000": 5 - better}
    classical = {"ssim": 0.4, "psnr_db": 20.0, "ciede2000": 6.0}
    return Found(filters, lux, road, network, classical)


# RGBW is better by 0.1 at 0.1 lux and worse by 0.1 at 10 lux; roads differ by up to 0.02
ROADS = {"a": -0.02, "b": 0.0, "c": 0.02}
SCORES = [
    found(filters, lux, road, gain if filters == RGBW else 0.0)
    for filters in (RGB, RGBW)
    for road, own in ROADS.items()
    for lux, gain in ((0.1, 0.1 + own), (10.0, -0.1 + own))
]


def row(lux, score, development):
    of = (lux, score, development)
    return next(
        row for row in rows_of(SCORES) if (row["lux"], row["score"], row["development"]) == of
    )


@pytest.mark.parametrize(("score", "sign"), [("ssim", 1), ("psnr_db", 1), ("ciede2000", -1)])
@pytest.mark.slow
def test_differences_are_paired_by_road_and_cross_where_they_should(score, sign):
    dark = row(0.1, score, NETWORK)
    assert dark["roads"] == 3 and dark["difference"] == pytest.approx(sign * 0.1)
    assert dark["difference"] == pytest.approx(dark["rgbw"] - dark["rgb"])
    # Student's 4.303 times the standard deviation of 0.02, over the square root of 3
    assert dark["high"] - dark["difference"] == pytest.approx(4.303 * 0.02 / 3**0.5, rel=1e-3)
    # for each score, the crossing is half way between 0.1 and 10 lux on a logarithmic scale; RGB is
    # better above it
    assert dark["crossing_lux"] == pytest.approx(1.0)
    assert dark["crossing_low"] < 1.0 < dark["crossing_high"]


def test_equal_cameras_have_no_crossing():
    same = row(10.0, "ssim", CLASSICAL)
    assert same["difference"] == 0 and math.isnan(same["crossing_lux"])


def test_scores_beside_a_model_serve_if_they_are_of_all_illuminances():
    scores = {"ssim": 0.5, "psnr_db": 20.0, "ciede2000": 5.0}
    known = {(lux, "a"): HeldOut(lux, "a", scores, scores) for lux in (0.1, 1.0)}
    filters = Filters(None, [], None, {0.1: {}, 1.0: {}}, known)
    road = Road(SceneRecord(0, "plain", "a", ()), Path("a"))
    kept = known_of(RGB, filters, road)
    assert kept == [Found(RGB, lux, "a", scores, scores) for lux in (0.1, 1.0)]
    assert known_of(RGB, filters._replace(best={0.1: {}, 3.0: {}}), road) == []
    assert known_of(RGB, filters, Road(SceneRecord(1, "plain", "b", ()), Path("b"))) == []


def test_other_illuminances_than_those_of_the_paper_are_shown_too():
    assert shown_lux([0.01, 0.1, 1.0]) == [0.1, 1.0]
    assert shown_lux([5.0, 0.5, 0.05]) == [0.05, 0.5]


def test_a_missing_model_is_refused_before_any_work():
    with pytest.raises(ConfigError, match="expected two models and two sensors"):
        paper_fig8_9_networks(rgb="a.onnx")
