"""Scores with and without denoising: the table holds scores of the whole frame, and their ratio."""

from __future__ import annotations

import math

import pytest
import xarray as xr
from isethdr_measured import denoised_scores

from isethdr_core.data.scores import Score


def test_scores_of_objects_are_left_out():
    def metric(picture, truth, labels):
        return [Score("ssim", 0.5, ""), Score("ssim", 0.9, "", object="deer")]

    found = denoised_scores.scores_of_frame(metric, xr.Dataset(), xr.Dataset())
    assert [score.value for score in found] == [0.5]


@pytest.mark.slow
def test_an_edge_is_measured_on_the_same_shots_with_and_without_denoising(monkeypatch):
    monkeypatch.setattr(denoised_scores, "CONTRASTS", (10.0,))
    small = denoised_scores.EDGE | {"width": 64, "height": 72, "horizontal_field_deg": 2.0}
    monkeypatch.setattr(denoised_scores, "EDGE", small)
    config = denoised_scores.hdr.compose([])
    (row,) = denoised_scores.edges(config, "split_pixel", 1)
    assert row["share"] == row["denoised"] / row["plain"]
    assert 0.1 < row["plain"] < 0.5  # cycles per pixel, below Nyquist
    assert not math.isnan(row["share"])
