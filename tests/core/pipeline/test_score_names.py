"""Scores of a run have fields of the right types, and names that differ."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

import isethdr_core as hdr
from isethdr_core.data.score_checks import check_scores_of_parts
from isethdr_core.data.scores import Score
from isethdr_core.errors import ConfigError, PluginError, UnitError
from isethdr_core.pipeline.chain.camera_scores import (
    check_names,
    checked_scores,
    scores_of_other_picture,
)
from isethdr_core.pipeline.shot import developed
from isethdr_core.uncertainty import ledger


def test_two_metrics_with_one_score_are_refused_by_their_names():
    scores_of = {
        "similarity": [Score("ssim", 0.7, ""), Score("ssim", 0.6, "", "car")],
        "snr": [Score("snr_at_1", 20.0, "dB")],
        "b": [Score("ssim", 0.8, "")],
    }
    with pytest.raises(ConfigError, match=r"metric\.similarity and metric\.b both .*'ssim'"):
        check_names(scores_of)
    scores_of["b"] = [Score("snr_at_10", 30.0, "dB")]
    check_names(scores_of)


def test_a_run_with_two_metrics_of_one_score_ends_before_it_is_stored(isethdr_home):
    chart = ["scene=macbeth", "scene.width=24", "scene.height=16", "~renderer", "lighting=ideal"]
    camera = ["~flare.dirt", "sensor=bayer", "isp=linear", "draws=1", "report=false"]
    small = ["sensor.rows=16", "sensor.columns=24"]
    second = ["+metric@metric.b=ssim", "metric.b.compression=0"]
    with pytest.raises(ConfigError, match=r"metric\.ssim and metric\.b"):
        hdr.run(hdr.compose([*chart, *camera, *small, *second]))
    assert not list((isethdr_home / "runs").glob("*.zarr"))


@pytest.mark.parametrize(
    ("scores", "message"),
    [
        (
            [Score("d", 1.0, None)],
            r"metric 'dark' returned .*, whose unit is None; expected a text",
        ),
        (
            [Score("", 1.0, "")],
            "metric 'dark' returned .*, whose metric is ''; expected a text that",
        ),
        ([Score("d", 1.0, "", 3)], "whose object is 3; expected a text"),
        (
            [Score("d", "abc", "")],
            "metric 'dark' .* score 'd', whose value is 'abc'; expected a num",
        ),
        ([Score("d", None, "")], "score 'd', whose value is None; expected a number"),
        ([Score("d", 1j, "")], "score 'd', whose value is 1j; expected a number"),
        ([Score("d", np.ones((3, 3)), "")], "score 'd', whose value is array.*; expected a number"),
        ([Score("d", np.ones(1), "")], "score 'd', whose value is array.*; expected a number"),
        ([Score("d", 1.0, "", low=None)], "score 'd', whose low is None; expected a number"),
        ([Score("d", 1.0, ""), Score("d", 2.0, "")], "the score 'd' of the whole picture twice"),
        ([Score("d", 1.0, "", "car")] * 2, "the score 'd' of the object 'car' twice"),
        (Score("d", 1.0, ""), "expected a list of isethdr_core.Score"),
    ],
)
def test_a_score_of_a_wrong_type_is_an_error_that_names_the_metric(scores, message):
    with pytest.raises(PluginError, match=message) as told:
        checked_scores("dark", scores)
    assert "'dark'" in str(told.value) and "\n" not in str(told.value)


def test_numbers_of_numpy_are_values_of_scores():
    values = (1, 1.0, np.float32(1), np.int64(1), np.array(1.0), float("nan"))
    scores = [Score(f"d{k}", value, "dB") for k, value in enumerate(values)]
    given = ledger.collected(lambda: checked_scores("dark", scores)).result
    assert given == scores


def test_a_run_with_a_score_of_a_wrong_type_ends_before_it_is_stored(isethdr_home, offer):
    @dataclass(frozen=True)
    class Unitless:
        """A metric whose score has no unit."""

        def __call__(self, picture, truth, labels):
            return [Score("d", 1.0, None)]

    offer("metric", "unitless", Unitless)
    chart = ["scene=macbeth", "scene.width=24", "scene.height=16", "~renderer", "lighting=ideal"]
    camera = ["~flare.dirt", "sensor=bayer", "isp=linear", "draws=1", "report=false"]
    small = ["sensor.rows=16", "sensor.columns=24", "+metric@metric.b=unitless"]
    with pytest.raises(PluginError, match="metric 'b' returned .*, whose unit is None"):
        hdr.run(hdr.compose([*chart, *camera, *small]))
    assert not list((isethdr_home / "runs").glob("*.zarr"))


CAMERA = SimpleNamespace(picture=None, truth=None, labels=None)


@dataclass(frozen=True)
class Quick:
    """A metric with a method for further realisations that returns anything."""

    result: object

    def __call__(self, picture, truth, labels):
        return [Score("d", 1.0, "")]

    def further(self, picture, first, truth, labels):
        return self.result if self.result != "error" else {}["missing"]


@pytest.mark.parametrize(
    ("result", "message"),
    [
        (None, "returned None; expected a list of isethdr_core.Score"),
        ([Score("d", "x", "")], "returned the score 'd', whose value is 'x'; expected a number"),
        ([Score("d", 1.0, ""), Score("d", 2.0, "")], "the score 'd' of .* twice; expected .*: 'd'"),
    ],
)
def test_scores_of_further_realisations_are_checked_too(result, message):
    with pytest.raises(PluginError, match=f"further of metric 'dark' .*{message}"):
        scores_of_other_picture("dark", Quick(result), None, CAMERA)


def test_an_error_in_a_further_realisation_names_the_metric():
    with pytest.raises(KeyError) as told:
        scores_of_other_picture("dark", Quick("error"), None, CAMERA)
    assert told.value.__notes__ == ["in further of metric 'dark'"]


@pytest.mark.parametrize(
    ("scores", "message"),
    [
        (None, "of_parts of metric 'Own' returned None; expected a list of 2 lists"),
        ([[]], "of_parts of metric 'Own' returned a list of 1; expected a list of 2"),
        ([Score("d", 1.0, "")] * 2, "of_parts, part 0, of metric 'Own' returned Score.*a list of"),
        (
            [[], [Score("d", "x", "")]],
            "part 1, of metric 'Own' .* whose value is 'x'; expected a n",
        ),
    ],
)
def test_scores_of_parts_are_one_list_for_each_part(scores, message):
    with pytest.raises(PluginError, match=message):
        check_scores_of_parts("Own", scores, 2)


def test_the_picture_of_an_isp_is_checked_before_it_is_scored():
    class Own:
        """An isp without a picture."""

        def __call__(self, captures):
            return None

    with pytest.raises(UnitError, match="the picture of isp Own has no variable 'xyz'"):
        developed(Own(), None)
