"""The terminal shows text of users and plugins unchanged, and every path can be copied as
a whole.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from types import SimpleNamespace

import pytest
from isethdr_catalog.commands import catalog
from isethdr_workflows.study_command import show
from typer.testing import CliRunner

from isethdr_core import Component
from isethdr_core.cli import plugin_list, progress, summary_tables
from isethdr_core.cli.terminal import console, print_path
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
    console().print(summary_tables.forecast_table({text: 1.0}))
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
