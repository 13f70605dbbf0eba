"""Each page of docs/measured is made by one command, and each command that it names exists."""

from __future__ import annotations

import importlib
import re
import shlex
import sys

import pytest
from isethdr_measured import STUDIES as MEASURED_STUDIES
from isethdr_workflows import STUDIES

from .source import ROOT, name_of

PAGES_ON_DISK = sorted((ROOT / "docs" / "measured").glob("*.md"))


sys.path.insert(0, str(ROOT / "scripts"))
pages = importlib.import_module("measured_pages")


def exists(command: str) -> bool:
    """Return whether a command of a page can be typed: its study, script or program is there."""
    words = shlex.split(command)
    if words[:2] == ["isethdr", "study"]:
        return words[2] in STUDIES
    if words[:3] == ["python", "-m", "isethdr_measured"]:
        return words[3] in MEASURED_STUDIES
    if words[0] == "python":
        return (ROOT / words[1]).is_file()
    return words[:3] in (["isethdr", "experiments", "run"], ["isethdr", "dataset", "score"])


@pytest.mark.parametrize("page", PAGES_ON_DISK, ids=name_of)
def test_a_measured_page_names_the_command_that_makes_it(page):
    head = " ".join(page.read_text().split()[:70])
    assert f"python scripts/measured_pages.py {page.stem}" in head
    assert page.stem in pages.PAGES


def test_every_page_that_can_be_made_is_there():
    assert sorted(pages.PAGES) == [page.stem for page in PAGES_ON_DISK]


@pytest.mark.parametrize("name", pages.PAGES)
def test_the_commands_of_a_page_exist(name):
    assert [command for command in pages.PAGES[name].commands if not exists(command)] == []


@pytest.mark.parametrize("page", PAGES_ON_DISK, ids=name_of)
def test_the_commands_that_a_measured_page_shows_exist(page):
    shown = re.findall(r"^## `([^`]+)`$", page.read_text(), re.MULTILINE)
    assert [command for command in shown if not exists(command)] == []


@pytest.mark.parametrize("name", [name for name, page in pages.PAGES.items() if page.is_stored])
def test_a_stored_page_equals_its_stored_rows(name):
    """The page was not edited by hand, and each of its commands has stored rows."""
    assert (pages.MEASURED / f"{name}.md").read_text() == pages.page_text(name, pages.PAGES[name])


def test_a_stored_measurement_is_read_as_it_was_written(tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "STORED", tmp_path)
    one = pages.Measurement("isethdr study a_study", "on 2026-11-27", 'name,value\n"a, b",1.5\n')
    (tmp_path / "a_page.toml").write_text(one.as_toml())
    [read] = pages.stored_measurements("a_page").values()
    assert read.command == one.command and read.measured == one.measured
    assert pages.section_of(read, {}) == [
        "## `isethdr study a_study`",
        "Measured on 2026-11-27.",
        "| name | value |\n|---|---|\n| a, b | 1.5 |",
    ]


def test_a_page_shows_only_the_columns_meant_for_it():
    shown = {"b": pages.Column(shown=False), "c": pages.Column("third", 2)}
    rows = [{"a": "1", "b": "2", "c": "3.456"}]
    assert pages.markdown(rows, shown) == "| a | third |\n|---|---|\n| 1 | 3.5 |"


def test_a_number_has_no_digits_below_those_of_its_error():
    shown = {"bias": pages.Column("bias, %", error="error"), "error": pages.Column(digits=2)}
    rows = [{"bias": "-0.7321", "error": "16.993", "count": "12"}, {"bias": "1.26", "error": "nan"}]
    assert [pages.short(rows[0], name, shown.get(name, pages.Column())) for name in rows[0]] == [
        "-1",
        "17",
        "12",
    ]
    assert pages.short(rows[1], "bias", shown["bias"]) == "1.26"
    assert pages.markdown(rows[:1], shown).startswith("| bias, % | error | count |")


def test_the_largest_difference_is_nan_where_one_is(tmp_path):
    """A difference of nan must not hide behind the numbers that other cases record."""
    agreement = importlib.import_module("agreement_isetcam")
    report = tmp_path / "report.xml"
    values = "".join(f'<property name="volts" value="{v}"/>' for v in ("1e-7", "nan", "2e-7"))
    report.write_text(f"<testsuite>{values}</testsuite>")
    assert agreement.recorded(report)["volts"] != agreement.recorded(report)["volts"]
