"""The summary tables of a run: they account for all seconds and memory, on few lines."""

from isethdr_core.cli.summary_tables import (
    broken,
    ledger_table,
    metrics_together,
    print_statements,
    score_text,
    target_texts,
    worst_text,
)
from isethdr_core.cli.terminal import console
from isethdr_core.ledger import Ledger, LeftOut, Row

from ..stated_rows import row, said


def test_metrics_of_a_camera_are_one_row_and_nothing_is_lost():
    ledger = Ledger(
        [
            Row("lens ideal", 1.0, 5),
            Row(
                "metric ssim bayer",
                2.0,
                7,
                row("metric ssim bayer", said(1.0, "dB", "bound")).errors,
            ),
            Row("metric snr bayer", 0.5, 3, [], [LeftOut("a", "b", 0.0, "dB")]),
            Row("metric ssim rgbw", 0.25, 9),
        ]
    )
    rows = metrics_together(ledger)
    assert [r.stage for r in rows] == ["lens ideal", "metrics bayer", "metrics rgbw"]
    assert sum(r.seconds for r in rows) == sum(r.seconds for r in ledger)
    assert rows[1].peak_bytes == 7 and len(rows[1].errors) == 1 and len(rows[1].left_out) == 1
    assert ledger[1].seconds == 2.0  # the ledger itself is unchanged


def test_the_worst_error_stands_for_the_others():
    terms = [said(0.01, "relative", "bound"), said(0.2, "relative", "statistical")]
    assert worst_text(row("lens l", *terms).errors) == "0.2 relative (statistical) +1"
    # errors in decibels and errors of a part of the light cannot be compared with it
    terms += [said(5.0, "dB", "bound"), said(0.5, "relative", "bound", part="halo")]
    assert worst_text(row("lens l", *terms).errors) == "0.2 relative (statistical) +3"
    assert worst_text([]) == ""


def test_an_interval_is_shown_only_where_it_is_known():
    assert score_text({"value": 1.5, "low": 1.0, "high": 2.0}) == "1.5 ± 0.5"
    for low, high in ((None, None), (float("nan"), float("nan")), (1.5, 1.5), (1.0, float("inf"))):
        assert score_text({"value": 1.5, "low": low, "high": high}) == "1.5"


def test_a_ledger_fits_80_columns_and_loses_no_word(capsys):
    label = "0.000152 standard deviations of the sensor's noise (statistical)"
    term = said(0.000152, "standard deviations of the sensor's noise", "statistical")
    stages = ["lens diffraction_limited_with_a_long_name_for_a_plugin", "picture split_pixel"]
    rows = [row(stage, term) for stage in stages]
    table = ledger_table(Ledger(rows), expected=dict.fromkeys(stages, 1234.5))
    console().print(table, width=80)
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= 80
    places = [shown.count(word) for word in label.split()]
    assert min(places) >= len(stages)


def test_statements_of_a_plan_fit_80_columns_in_a_pipe_and_lose_no_word(monkeypatch, capsys):
    monkeypatch.delenv("COLUMNS", raising=False)
    unit = "standard deviations of the sensor's noise"
    stated = [said(0.000152, unit, "bound", label=f"share number {n}") for n in (1, 2)]
    whole = row("plan", *stated)
    why = "no metric reads them, and the lens has the same point spread everywhere in its field"
    whole.left_out.append(LeftOut("labels depth, distance, category, normal", why, 3e-6, "labels"))
    print_statements(Ledger([whole, Row("lens ideal")]))
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    # each statement is a paragraph: two spaces before its first line, more before the others
    paragraphs = "\n".join(lines).replace("\n      ", " ").splitlines()
    assert paragraphs == [
        "plan: errors stated",
        f"  0.000152 {unit} (bound): share number 1",
        f"  0.000152 {unit} (bound): share number 2",
        "plan: left out",
        f"  labels depth, distance, category, normal: {why} (bound 3e-06 labels)",
    ]


def test_a_long_name_breaks_at_its_underscores():
    assert broken("dynamic_range_dark_noise", 24) == "dynamic_range_dark_noise"
    assert broken("dynamic_range_dark_noise", 20) == "dynamic_range_dark_\nnoise"
    assert broken("ciede2000", 4) == "ciede2000", "no underscore"


def test_targets_of_a_lighting_are_told_with_their_units():
    targets = {
        "sky": {"wanted": 0.00032, "reached": 0.00032},
        "median_cd_m2": {"wanted": 5.0, "reached": 4.5},
        "dynamic_range": {"wanted": 1e6, "reached": 2e5},
    }
    assert target_texts(targets) == [
        "sky: 0.00032 cd/m2 wanted, 0.00032 cd/m2 reached",
        "median: 5 cd/m2 wanted, 4.5 cd/m2 reached",
        "dynamic_range: 1e+06 wanted, 2e+05 reached",
    ]
