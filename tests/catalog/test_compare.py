"""Comparing two runs: the settings that differ, and whether scores differ beyond their
intervals.
"""

from __future__ import annotations

import pytest
from isethdr_catalog.commands import catalog
from isethdr_catalog.compare import ABSENT, Setting, compare
from isethdr_catalog.query import show, sql
from typer.testing import CliRunner

from isethdr_core.errors import CatalogError
from isethdr_core.runs.labels import Labels, add_labels
from isethdr_core.storage.store import write_store

from ..core.sweeps.stored_sweep import attributes, stored_sweep


def test_only_what_differs_is_listed(isethdr_home):
    stored_sweep(isethdr_home)
    found = compare(isethdr_home, "exposures1", "exposures2")
    assert found.settings == [Setting("sensor.name", "bayer", "rgbw")]
    other = attributes("other", "rgbw", (0.7, 0.69, 0.71), 2.0)
    other["config"]["lens"] = {"name": "ideal"}
    write_store(isethdr_home / "runs", "other", {}, other)
    found = compare(isethdr_home, "exposures2", "other")
    assert found.settings == [Setting("lens.name", ABSENT, "ideal")]
    ssim, vividness = found.scores
    assert (ssim.score, ssim.differs) == ("ssim", True), "0.09 is more than sqrt(0.02^2 + 0.01^2)"
    assert ssim.difference == pytest.approx(0.09) and vividness.differs is False


def test_intervals_decide_whether_scores_differ(isethdr_home):
    stored_sweep(isethdr_home)
    near, far = (compare(isethdr_home, "exposures2", f"exposures{k}") for k in (1, 0))
    assert [pair.differs for pair in near.scores] == [False, None], "vividness has no interval"
    assert far.scores[0].differs is True


def test_a_run_is_found_by_its_name(isethdr_home):
    stored_sweep(isethdr_home)
    add_labels(isethdr_home / "runs" / "exposures1.zarr", Labels("mine"))
    assert show(isethdr_home, "mine")["key"] == "exposures1"


def test_an_error_names_ten_stores_and_not_hundreds(isethdr_home):
    for number in range(30):
        write_store(isethdr_home / "runs", f"ab{number:02}", {}, {"kind": "run", "cameras": []})
    with pytest.raises(CatalogError) as many:
        show(isethdr_home, "ab")
    assert str(many.value).count("ab") == 11 and "and 20 more" in str(many.value)
    with pytest.raises(CatalogError) as none:
        show(isethdr_home, "zz")
    assert str(none.value).count("ab") <= 11 and "30 names are known" in str(none.value)


def test_a_scene_is_no_run(isethdr_home):
    write_store(isethdr_home / "scenes", "room", {}, {"kind": "scene", "recipe": "room"})
    with pytest.raises(CatalogError, match="'room' is a scene; expected a run"):
        compare(isethdr_home, "room", "room")


def test_a_mistyped_home_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path / "typo"))
    for command in (["find"], ["sql", "SELECT 1"], ["show", "a"], ["compare", "a", "b"], ["du"]):
        refused = CliRunner().invoke(catalog, command).exception
        assert isinstance(refused, CatalogError) and "there is no folder" in str(refused)
    assert not (tmp_path / "typo").exists()


def test_scores_of_frames_and_of_objects_are_two_tables(isethdr_home):
    """A mean over the view `scores` averages frames only; it includes no object's scores."""
    stored_sweep(isethdr_home)
    _, [(mean, count)] = sql(
        isethdr_home, "SELECT avg(value), count(*) FROM scores WHERE metric = 'ssim'"
    )
    assert mean == pytest.approx(0.57) and count == 3
    _, rows = sql(isethdr_home, "SELECT DISTINCT object, value FROM object_scores")
    assert rows == [("deer 1", 0.99)]
