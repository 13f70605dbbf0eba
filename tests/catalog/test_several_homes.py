"""Several homes at once: queries state the home of each record, and find a key in any home."""

import os

import pytest
from isethdr_catalog.commands import catalog
from isethdr_catalog.query import find, show, sql
from typer.testing import CliRunner

import isethdr as hdr
from isethdr_core.cli.home_option import use_homes
from isethdr_core.errors import CatalogError
from isethdr_core.storage.home_folder import OTHER_HOMES, existing_homes

from .test_catalog import put


@pytest.fixture
def two(tmp_path, monkeypatch):
    """Return two homes: one run is in both, each has a run and properties that the other lacks."""
    monkeypatch.setenv("ISETHDR_HOME", "elsewhere")
    monkeypatch.setenv(OTHER_HOMES, "")
    shared = {"kind": "run", "cameras": ["a"], "created": "2026-01-02", "config": {}, "scores": []}
    first = tmp_path / "first"
    second = tmp_path / "second"
    put(first, "f1", **shared, exposure=0.5, gain="high", created_by="me")
    put(first, "shared", **shared, exposure=2.0)
    put(second, "shared", **shared, exposure=2.0)
    put(second, "s1", **{**shared, "scores": [score(0.7)]}, exposure=1.0, gain=3)
    return [str(first), str(second)]


def score(value):
    more = {"object": "", "unit": "", "low": "NaN", "high": "NaN"}
    return {"camera": "a", "metric": "ssim", "value": value, **more}


def pairs(rows):
    return [(row["id"], row["home"].rpartition("/")[2]) for row in rows]


def test_records_of_all_homes_are_sorted_together(two):
    rows = hdr.find(home=two, kind="run", order_by="exposure")
    assert pairs(rows) == [
        ("f1", "first"),
        ("s1", "second"),
        ("shared", "first"),
        ("shared", "second"),
    ]
    assert [row["exposure"] for row in rows] == [0.5, 1.0, 2.0, 2.0]
    assert pairs(hdr.find(home=two, order_by="-exposure", limit=1)) == [("shared", "first")]


def test_properties_of_one_home_and_of_two_types(two):
    assert pairs(hdr.find(home=two, ssim__ge=0.5)) == [("s1", "second")]
    assert pairs(hdr.find(home=two, gain="high")) == [("f1", "first")]
    assert pairs(hdr.find(home=two, gain=3)) == [("s1", "second")]
    with pytest.raises(CatalogError, match="no record has the property 'exposura'"):
        hdr.find(home=two, exposura=1)
    homes = existing_homes(two)
    assert pairs(find(homes, **{"home": two[1], "id": "shared"})) == [("shared", "second")]


def test_one_home_states_itself_in_sql_and_adds_no_column_to_rows(two):
    [row] = hdr.find(home=two[0], gain="high")
    assert "home" not in row
    columns, rows = sql(two[0], "SELECT DISTINCT home FROM shots")
    assert (columns, rows) == (["home"], [(two[0],)])


def test_sql_views_hold_all_homes(two):
    homes = existing_homes(two)
    _, rows = sql(homes, "SELECT home, count(*) FROM stores GROUP BY home ORDER BY home")
    assert rows == [(two[0], 2), (two[1], 2)]
    _, rows = sql(homes, "SELECT home, value FROM scores")
    assert rows == [(two[1], 0.7)]
    _, rows = sql(homes, "SELECT id, exposure, gain FROM properties ORDER BY exposure LIMIT 2")
    assert rows == [("f1", 0.5, "high"), ("s1", 1.0, "3.0")]


def test_a_store_is_found_in_any_home(two):
    assert show(existing_homes(two), "s1")["path"].startswith(two[1])
    both = hdr.show("shared", home=two)
    assert both["homes"] == two and both["path"].startswith(two[0])
    found = hdr.compare("f1", "s1", home=[*two, two[0]])
    assert [found.a.path.stem, found.b.path.stem] == ["f1", "s1"]
    assert hdr.open_run("s1", home=two).path.stem == "s1"
    with pytest.raises(
        CatalogError, match="names no store .one of: f1, s1, shared.; .*first, .*second"
    ):
        hdr.show("s2", home=two)


def test_a_mistyped_home_is_one_error(two):
    with pytest.raises(CatalogError, match="there is no folder .*secund.*did you mean .*second"):
        hdr.find(home=[two[0], two[1].replace("second", "secund")])


def test_commands_read_all_homes_or_say_that_they_do_not(two):
    use_homes(two, "catalog")
    assert os.environ["ISETHDR_HOME"] == two[0] and os.environ[OTHER_HOMES] == two[1]
    said = CliRunner().invoke(catalog, ["find", "id=shared"])
    assert said.exit_code == 0 and said.output.count("shared.zarr") == 2
    assert "home" in said.output.splitlines()[0]
    refused = CliRunner().invoke(catalog, ["gc"])
    assert isinstance(refused.exception, CatalogError)
    assert "2 homes are named, but this command works in one" in str(refused.exception)
