"""The terminal shows text of users and plugins unchanged. A narrow terminal cuts nothing, and each
path stays in one piece, so that it can be copied.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from types import SimpleNamespace

import pytest
from isethdr_catalog.commands import catalog
from isethdr_catalog.reproduce import Difference, Reproduction, print_reproduction
from isethdr_workflows.study_command import show
from typer.testing import CliRunner

from isethdr_core import Component
from isethdr_core.cli import plugin_list, progress, summary_tables
from isethdr_core.cli.terminal import console, number_of, print_path, print_table
from isethdr_core.ledger import Ledger, LeftOut, Row
from isethdr_core.plugins import registry
from isethdr_core.runs.run_warnings import SATURATED_FRAME, RunWarning
from isethdr_core.storage import store
from isethdr_core.uncertainty.error_terms import ErrorTerm, Quantity, Source

STRANGE = ["[red]bold[/red]", "[/]", ":car:", "[link=file:///x]y[/link]", "a[0]", "\\[b]"]


@pytest.fixture(autouse=True)
def narrow(monkeypatch):
    monkeypatch.setenv("COLUMNS", "400")


def a_result(text: str, folder: Path) -> SimpleNamespace:
    term = ErrorTerm(Source("picture", text), Quantity.ELECTRONS, text, 0.5, text, "bound", text)
    omission = LeftOut(text, text, 1.0, text)
    score = {"metric": text, "unit": text, "camera": text, "object": ""}
    return SimpleNamespace(
        computed=False,
        key=text,
        path=folder / "run.zarr",
        attributes={"lighting_notes": {text: text}},
        warnings=[asdict(RunWarning(SATURATED_FRAME, text, 0.5, 0.05, text))],
        ledger=Ledger([Row(f"picture {text}", errors=[term], left_out=[omission])]),
        cameras=[text],
        scores=[score | {"value": 1.0, "low": None, "high": None}],
    )


@pytest.mark.parametrize("text", STRANGE)
def test_a_run_is_printed_as_it_is_named(text, tmp_path, capsys):
    result = a_result(text, tmp_path)
    summary_tables.print_result(result)
    summary_tables.print_statements(result.ledger)
    console().print(summary_tables.runtime_estimate_table({text: 1.0}))
    show([{"name": text, text: 1.0}], text)
    shown = capsys.readouterr().out
    assert shown.count(text) >= 15, "in every cell, title and note"


@pytest.mark.parametrize("text", STRANGE)
def test_plugins_are_listed_as_they_are_named(text, monkeypatch, capsys):
    @dataclass(frozen=True)
    class Sensor:
        __doc__ = f"A sensor {text}."

        def __call__(self, light, generator): ...

    known = {("sensor", "odd"): Component("sensor", "odd", Sensor)}
    broken = (registry.BrokenPlugin("odd", "acme", f"it says {text}"),)
    monkeypatch.setattr(registry, "components", lambda: known)
    monkeypatch.setattr(registry, "broken_plugins", lambda: broken)
    assert plugin_list.print_plugins("sensor") == 1
    shown = capsys.readouterr().out
    assert f"A sensor {text}." in shown and f"it says {text}" in shown


def test_progress_shows_a_stage_as_it_is_named():
    display = progress._display()
    for text in STRANGE:
        task = display.add_task(text, total=1)
        column = display.columns[1]
        assert column.render(display.tasks[-1]).plain == text
        display.remove_task(task)


def test_a_path_stands_alone_on_its_line_however_narrow_the_terminal(
    isethdr_home, monkeypatch, capsys
):
    monkeypatch.setenv("COLUMNS", "40")
    folder = isethdr_home / ("a folder with spaces " * 4)
    print_path("store", folder)
    result = a_result("x", folder)
    result.path.mkdir(parents=True)
    summary_tables.print_result(result)
    lines = capsys.readouterr().out.splitlines()
    assert str(folder) in lines and str(result.path) in lines


def test_the_catalog_prints_paths_whole(isethdr_home, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    name = "name-" + 60 * "x"
    path = store.write_store(isethdr_home / "runs", name, {}, {"kind": "run", "cameras": ["[red]"]})
    call = CliRunner().invoke
    found = call(catalog, ["find", "kind=run"]).output
    assert str(path) in found.splitlines() and "[red]" in found
    (path / "zarr.json").write_text("{")
    assert str(path) in call(catalog, ["refresh"]).output.splitlines()
    assert str(path) in call(catalog, ["verify"]).output.splitlines()


WIDE = 80  # columns of a newly opened terminal
KEY = "1f3a8f35a2694e9b"
LONG_NAME = "a_name_of_a_run_that_says_all_about_it"


@pytest.fixture
def terminal_of_80_columns(monkeypatch):
    """Have rich write to a terminal of 80 columns, without colours."""
    monkeypatch.setenv("COLUMNS", str(WIDE))
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "dumb")


@pytest.fixture
def stored_run(isethdr_home):
    """Return the store of a run with a long key and name, and with a score of many digits."""
    attributes = {
        "kind": "run",
        "name": LONG_NAME,
        "cameras": ["split_pixel"],
        "lighting": "night_rural",
        "config": {
            "seed": 1234567,
            "sensor": {"name": "split_pixel"},
            "lens": {"f_number": 1.7999999523162842},
        },
        "scores": [
            {"camera": "split_pixel", "metric": metric, "object": "", "value": value, "unit": ""}
            for metric, value in (("ssim", 0.4932123456789), ("valid_share", 1.0))
        ],
    }
    return store.write_store(isethdr_home / "runs", KEY, {}, attributes)


def lines_that_fit(shown: str, *paths: object) -> list[str]:
    """Return the lines of an output, after a check that nothing is cut and only paths are wider
    than the terminal.
    """
    lines = shown.splitlines()
    beside = [line for line in lines if line not in map(str, paths)]
    assert "…" not in shown
    assert max(map(len, beside)) <= WIDE, max(beside, key=len)
    return lines


def test_find_cuts_nothing_at_80_columns(stored_run, terminal_of_80_columns):
    asked = ["kind=run", "ssim__ge=0.1", "config.lens.f_number__ge=1", "config.seed=1234567"]
    shown = CliRunner().invoke(catalog, ["find", *asked, "lighting=night_rural"]).output
    lines = lines_that_fit(shown, stored_run)
    assert lines[0] == f"id: {KEY}" and str(stored_run) in lines
    assert "config.lens.f_number: 1.8" in shown and "config.seed: 1234567" in shown
    assert "0.49321" in shown and "0.493212" not in shown and "kind" not in shown
    few = CliRunner().invoke(catalog, ["find", "sensor=split_pixel", "ssim__ge=0.1"]).output
    heads, row, *_ = lines_that_fit(few, stored_run)
    assert heads.split() == ["id", "kind", "camera", "sensor", "ssim", "valid_share"]
    assert row.split() == [KEY, "run", "split_pixel", "split_pixel", "0.49321", "1"]


def test_sql_cuts_nothing_at_80_columns(stored_run, terminal_of_80_columns):
    words = " ".join(f"word{number}" for number in range(60))
    text = f"SELECT name, path, 2.0 / 3 AS share, '{words}' AS text, id FROM properties"
    shown = CliRunner().invoke(catalog, ["sql", text]).output
    lines = lines_that_fit(shown)
    assert lines[0] == f"name: {LONG_NAME}"
    assert lines[1].startswith(f"    path: runs/{KEY}.zarr | share: 0.66667 | text: word0")
    assert " ".join(shown.split()).endswith(f"{words} | id: {KEY}")
    shown = CliRunner().invoke(catalog, ["sql", "SELECT id, lighting FROM properties"]).output
    assert [line.split() for line in lines_that_fit(shown)] == [
        ["id", "lighting"],
        [KEY, "night_rural"],
    ]


def test_differences_of_a_reproduced_run_fit_80_columns(terminal_of_80_columns, capsys):
    numbers = (
        Difference("split_pixel picture, cd/m2, standard deviation", 1 / 3, 0.4, math.nan, None),
        Difference("split_pixel object_contrast_snr pedestrian 12", 12.25, 12.5, 0.125, True),
        Difference("split_pixel ssim", 0.5, 0.49, 0.04, False),
    )
    print_reproduction(Reproduction([], 40, list(numbers)))
    shown = capsys.readouterr().out
    lines = lines_that_fit(shown)
    text = " ".join(shown.split())
    assert "split_pixel ssim 0.5 0.49 -0.01 0.25" in text, "a quarter of the interval's half width"
    assert "12.25 12.5 0.25 2 " in text
    assert "beyond their intervals: split_pixel object_contrast_snr pedestrian 12 " in text
    assert "without an interval: split_pixel picture, cd/m2, standard deviation " in text
    assert lines[-1].startswith("3 of 40 numbers differ, 2 of them beyond")


def test_a_study_fits_80_columns(terminal_of_80_columns, capsys):
    row = {f"a_quantity_{number}_cd_m2": math.pi * 10**number for number in range(8)}
    show([row | {"sensor": "split_pixel"}] * 2, "a study with " + "a long title " * 12)
    shown = capsys.readouterr().out
    lines_that_fit(shown)
    assert shown.count("a_quantity_1_cd_m2: 31.42 |") == 2 and "sensor: split_pixel" in shown
    show([{"sensor": "split_pixel", "why": "noise " * 30, "ssim": 0.5}], "a table")
    shown = capsys.readouterr().out
    lines_that_fit(shown)
    assert shown.count("noise") == 30 and "│ split_pixel │" in shown


def test_a_table_in_a_file_may_be_wider(monkeypatch, capsys):
    monkeypatch.delenv("COLUMNS")
    print_table(["a", "b"], [["x" * 90, 0.125]])
    assert capsys.readouterr().out.splitlines()[1].split() == ["x" * 90, "0.125"]


def test_one_thing_is_counted_in_the_singular():
    assert [number_of(k, "road") for k in (0, 1, 2)] == ["0 roads", "1 road", "2 roads"]
    assert [number_of(k, "entry", "entries") for k in (1, 2)] == ["1 entry", "2 entries"]


def test_a_path_that_is_no_utf8_is_printed(capsys):
    print_path("store", Path("/data/\udce9/1f3a.zarr"))
    assert capsys.readouterr().out == "store:\n/data/?/1f3a.zarr\n"
