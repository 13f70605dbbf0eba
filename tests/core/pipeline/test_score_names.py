"""Two metrics of a run may not give scores of the same name."""

from __future__ import annotations

import pytest

import isethdr_core as hdr
from isethdr_core.data.scores import Score
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.chain.camera_scores import check_names


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
