"""The table of a sweep: parameters, scores of the frame, intervals, and the best row by score."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import replace

from isethdr_core.cli.sweep_summary import finish, print_sweep
from isethdr_core.sweeps.record import read_jobs, write_job
from isethdr_core.sweeps.score_order import differ, larger_is_better, most_telling_first
from isethdr_core.sweeps.table import Scored, as_csv, best_rows, short_names, sweep_table

from .stored_sweep import stored_sweep


def test_a_row_has_its_parameters_and_the_scores_of_the_frame_alone(isethdr_home):
    table = sweep_table(stored_sweep(isethdr_home, failed=True))
    assert [row.parameters["sensor"] for row in table.rows] == ["bayer", "bayer", "rgbw"]
    assert table.rows[0].scores["ssim"] == (0.50, 0.48, 0.52), "not that of the deer, 0.99"
    assert table.units == {"ssim": "", "vividness": "vv"} and table.tags == ("wet",)
    assert table.values("sensor.exposure_s") == ["0.004", "0.016"]
    assert table.rows[0].report == isethdr_home / "runs" / "exposures0.html"


def test_a_key_that_a_sweep_adds_to_a_table_has_its_values(isethdr_home):
    added = "lighting.weights.sky"
    sweep = replace(stored_sweep(isethdr_home), varied=(added,))
    for job in read_jobs(sweep.folder):
        write_job(sweep.folder, replace(job, overrides=(f"+{added}={job.number}",)))
    assert sweep_table(sweep).values(added) == ["0", "1", "2"]


def test_the_best_row_says_how_many_others_are_as_good(isethdr_home):
    best = best_rows(sweep_table(stored_sweep(isethdr_home)))
    ssim, high, low = best
    assert (ssim.row.job, ssim.alike, ssim.is_known) == (2, 1, True), "0.60 is within the interval"
    assert (high.end, high.row.job, high.is_known) == ("largest", 0, False)
    assert (low.end, low.row.job, low.alike) == ("smallest", 1, 0)


def test_a_score_that_differs_by_rounding_alone_has_no_best_row(isethdr_home):
    table = sweep_table(stored_sweep(isethdr_home))
    for k, row in enumerate(table.rows):
        row.scores["ssim"] = Scored(0.5 + k * 1e-13, math.nan, math.nan)
    assert {best.score for best in best_rows(table)} == {"vividness"}


def test_the_csv_holds_every_row_with_units_and_intervals(isethdr_home):
    rows = list(csv.DictReader(io.StringIO(as_csv(sweep_table(stored_sweep(isethdr_home))))))
    assert len(rows) == 3 and rows[2]["sensor"] == "rgbw" and rows[2]["run"] == "exposures2"
    assert (rows[2]["ssim"], rows[2]["ssim_low"], rows[2]["ssim_high"]) == ("0.61", "0.59", "0.63")
    assert rows[0]["vividness (vv)"] == "3" and rows[0]["vividness_low (vv)"] == ""


def test_a_sweep_is_printed_on_few_lines_of_80_columns(isethdr_home, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    sweep = stored_sweep(isethdr_home, failed=True)
    table = finish(sweep)
    said = capsys.readouterr().out.splitlines()
    assert str(sweep.folder / "table.csv") in said and str(sweep.folder / "index.html") in said
    paths = {str(sweep.folder / name) for name in ("table.csv", "index.html")}
    assert max(len(line.rstrip()) for line in said if line not in paths) <= 80 and len(said) < 30
    assert "sweep exposures: 3 computed, 1 failed" in said
    assert (sweep.folder / "table.csv").read_text() == as_csv(table)
    wide = table.rows * 40
    print_sweep(type(table)(table.sweep, table.jobs, wide, table.units))
    assert len(capsys.readouterr().out.splitlines()) < 50, "however many rows there are"


def test_the_order_of_scores():
    assert larger_is_better("ssim") and larger_is_better("snr_at_0.5")
    assert larger_is_better("ciede2000") is False and larger_is_better("ssim_white") is None
    assert most_telling_first(["ssim_white", "snr_at_2", "ssim"]) == [
        "ssim",
        "snr_at_2",
        "ssim_white",
    ]


def test_scores_differ_by_more_than_the_interval_of_their_difference():
    one = Scored(0.0, -3.0, 3.0)
    assert differ(one, Scored(5.01, 1.01, 9.01)) is True, "sqrt(3^2 + 4^2) = 5"
    assert differ(one, Scored(4.99, 0.99, 8.99)) is False
    unknown = Scored(9.0, math.nan, math.nan)
    assert differ(one, unknown) is None and differ(unknown, unknown) is False
    rounded = Scored(1.0 + 1e-12, 1.0 + 1e-12, 1.0 + 1e-12)
    assert differ(Scored(1.0, 1.0, 1.0), rounded) is False, "rounding is no difference"


def test_short_names_stay_clear():
    assert short_names(["sensor.exposure_s", "lens.f_number"]) == {
        "sensor.exposure_s": "exposure_s",
        "lens.f_number": "f_number",
    }
    twice = ["cameras.a.pitch_um", "cameras.b.pitch_um"]
    assert short_names(twice) == {name: name for name in twice}
