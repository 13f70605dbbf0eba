"""Comparison of learned and classical pictures: search for classical settings, and the table."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
import xarray as xr
from isethdr_isp import MergeIsp
from isethdr_workflows.accuracy.isp_cost import Cost
from isethdr_workflows.training.learned_picture import road_scores, study
from isethdr_workflows.training.learned_picture.contest import Contest, Shot
from isethdr_workflows.training.learned_picture.diagram import NETWORK
from isethdr_workflows.training.learned_picture.settings import (
    GRID,
    SIGNS,
    Search,
    Setting,
    best_in,
)

from isethdr_core.errors import ConfigError

WANTED = {"ssim": (1.4, 20.0), "psnr_db": (0.5, 2.0), "ciede2000": (0.0, math.inf)}


def smooth_score(setting: Setting) -> dict[str, float]:
    """Return scores that are best at the settings `WANTED`, which differ from score to score."""
    scores = {}
    for name, (strength, snr) in WANTED.items():
        snr_distance = math.log(min(setting.design_snr, 100) / min(snr, 100)) ** 2
        distance = (setting.strength - strength) ** 2 + snr_distance
        distance += setting.demosaic != "guided"
        scores[name] = SIGNS[name] * -distance
    return scores


def test_the_search_finds_the_best_setting_of_each_score():
    search = Search(smooth_score)
    best = search.best()
    for name, (strength, snr) in WANTED.items():
        found = best[name]
        assert (found.strength, found.design_snr, found.demosaic) == (strength, snr, "guided")
    # the search varies one field after another, so it tries far fewer settings than the grid has
    assert len(search.tried) < math.prod(map(len, GRID.values())) / 2
    again = len(search.tried)
    search.best()
    assert len(search.tried) == again


@pytest.mark.parametrize("field", GRID)
def test_every_value_of_the_grid_is_taken_by_the_isp(field):
    for value in GRID[field]:
        isp = MergeIsp(**Setting()._replace(**{field: value}).fields())
        if field == "strength":
            assert isp.denoise == ("nl_means" if value else "none")
            assert isp.nl_means_strength == (value or 1.0)
        else:
            assert getattr(isp, field) == value


def test_the_middle_of_a_shot_keeps_the_array_in_phase():
    rows = xr.Dataset({"row": ("y", np.arange(270))})
    middle = Shot(rows, rows, None).middle()
    assert middle.captures.sizes["y"] == 135 and int(middle.captures.row[0]) == 64
    assert middle.reference.row.equals(middle.captures.row)


def compared(road, better):
    scores = {"ssim": 0.5, "psnr_db": 20.0, "ciede2000": 10.0}
    ours = {name: value + better for name, value in scores.items()}
    return study.Compared(road, ours, {Setting(): scores}, scores)


def test_a_row_is_the_paired_difference_over_roads():
    rows = [compared("a", 1.0), compared("b", 2.0), compared("b", 2.0), compared("c", 3.0)]
    costs = {NETWORK: Cost(2.0, 30.0), Setting(): Cost(1.0, 10.0)}
    row = study.row_of(0.1, "psnr_db", rows, Setting(), costs)
    assert row["roads"] == 3 and row["difference"] == pytest.approx(2.0)
    assert row["low"] < 2.0 < row["high"]
    assert row["network"] - row["classical"] == pytest.approx(row["difference"])
    assert (row["network_cpu_s"], row["classical_mb"]) == (2.0, 10.0)
    assert "nl_means_strength=1.0" in row["best_classical"]


def test_a_camera_without_a_network_has_its_classical_picture_and_the_matrix_alone():
    unknown = dict.fromkeys(SIGNS, math.nan)
    rows = [compared(name, 1.0)._replace(network=unknown) for name in "abc"]
    costs = {
        NETWORK: study.UNKNOWN,
        Setting(): Cost(1.0, 10.0),
        **dict.fromkeys(study.FEWER.values(), Cost(0.5, 5.0)),
    }
    row = study.row_of(0.1, "psnr_db", rows, Setting(), costs)
    assert math.isnan(row["network"]) and math.isnan(row["difference"])
    assert (row["classical"], row["classical_low"], row["matrix_alone"]) == (20.0, 20.0, 20.0)
    assert row["roads"] == 3
    every = [
        row._replace(classical={s: row.classical[Setting()] for s in costs if s != NETWORK})
        for row in rows
    ]
    assert [one.setting for one in study.work(0.1, every, Setting(), costs).points] == [
        "bilinear",
        "guided",
        "best classical",
    ]


def test_the_grid_is_kept(tmp_path):
    search = Search(smooth_score)
    search.best()
    path = tmp_path / "grid.csv"
    study.write_grid(path, [Contest(None, 0.1)], [search])
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(search.tried)
    assert best_in(path) == {0.1: search.best()}
    best = max(rows, key=lambda row: float(row["ssim"]))
    assert float(best["strength"]) == WANTED["ssim"][0] and best["lux"] == "0.1"


def test_scores_of_roads_are_read_again_for_the_same_model_and_camera_alone(tmp_path):
    model = tmp_path / "model.onnx"
    model.write_bytes(b"one")
    path = tmp_path / road_scores.FILE
    typed = ["sensor=typical_bayer"]
    rows = [compared(road, better) for road, better in (("a", 1.0), ("b", 2.0))]
    every = study.scores_by_road([Contest(None, 0.1)], [rows], [dict.fromkeys(SIGNS, Setting())])
    made_with = road_scores.made_with(model, typed)
    assert road_scores.read(path, made_with) == {}
    road_scores.write(path, made_with, every)
    found = road_scores.read(path, made_with)
    assert list(found) == [(0.1, "a"), (0.1, "b")] and list(found.values()) == every
    assert found[0.1, "b"].network == rows[1].network
    assert road_scores.read(path, road_scores.made_with(model, [*typed, "lens=ideal"])) == {}
    model.write_bytes(b"two")
    assert road_scores.read(path, road_scores.made_with(model, typed)) == {}


def test_scores_of_a_road_with_several_scenes_are_not_read_as_those_of_one(tmp_path):
    path = tmp_path / road_scores.FILE
    rows = [compared(road, better) for road, better in (("a", 1.0), ("a", 3.0), ("b", 2.0))]
    every = study.scores_by_road([Contest(None, 0.1)], [rows], [dict.fromkeys(SIGNS, Setting())])
    road_scores.write(path, ("digest", "typed"), every)
    assert list(road_scores.read(path, ("digest", "typed"))) == [(0.1, "b")]


def test_a_folder_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(ConfigError, match="expected a folder for the tables"):
        study.writable(str(tmp_path / "file" / "folder"))
