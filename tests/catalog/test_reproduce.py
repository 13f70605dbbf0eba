"""A stored run that is computed again has the same numbers; differences are named."""

from __future__ import annotations

import shutil

import pytest
from isethdr_catalog.reproduce import (
    Outcome,
    print_reproduction,
    reproduce,
    with_radiance_of,
)

import isethdr_core as hdr
from isethdr_core.runs.run import Result
from isethdr_core.storage.manifest import problems, read_manifest
from isethdr_core.storage.store import open_store, read_attrs, write_store

CHART = [
    "scene=macbeth",
    "scene.width=24",
    "scene.height=16",
    "lighting=ideal",
    "~renderer",
    "~flare.dirt",
    "lens=ideal",
    "sensor=bayer",
    "draws=1",
    "~metric.detection",
    "~metric.contrast",
    "report=false",
]


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """Return the home and the key of a small run."""
    home = tmp_path_factory.mktemp("home")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ISETHDR_HOME", str(home))
        patch.setattr("isethdr_catalog.report.write_report", lambda result: None)
        return home, hdr.run(hdr.compose(CHART)).key


@pytest.mark.slow
def test_a_run_computed_again_is_the_same(stored, capsys):
    home, key = stored
    found = reproduce(home, key[:6])
    assert found.outcome is Outcome.SAME and found.compared > 6 and not found.versions
    path = home / "runs" / f"{key}.zarr"
    assert not problems(path, read_manifest(path))
    print_reproduction(found)
    assert "the same versions" in capsys.readouterr().out


@pytest.mark.slow
def test_other_seeds_and_versions_are_named(stored, tmp_path, capsys):
    """The record of a run gets another seed and library version, but keeps its old numbers."""
    home, key = stored
    path = home / "runs" / f"{key}.zarr"
    attributes = read_attrs(path)
    attributes["config"]["seed"] += 1
    attributes["versions"]["numpy"] = "0.1"
    groups = {
        f"picture/{camera}": open_store(path, f"picture/{camera}").load()
        for camera in attributes["cameras"]
    }
    other = tmp_path / "other"
    write_store(other / "runs", "changed", groups, attributes)
    found = reproduce(other, "changed")
    assert [version.name for version in found.versions] == ["numpy"]
    named = {difference.number for difference in found.differences}
    assert "bayer picture, cd/m2, mean" in named and len(named) < found.compared
    assert found.outcome is Outcome.BEYOND, "the largest value of a picture has no interval"
    print_reproduction(found)
    shown = capsys.readouterr().out
    assert shown.index("numpy: 0.1") < shown.index("relative to interval")
    assert "without an interval: bayer " in shown
    shutil.rmtree(other)


def test_radiance_that_a_scene_names_is_found_from_the_temporary_home(tmp_path):
    path = tmp_path / "scenes" / "8f35-1.zarr"
    path.mkdir(parents=True)
    for name, found in (("8f", str(path)), ("gone", "gone"), ("/a/b.zarr", "/a/b.zarr")):
        attributes = {"config": {"scene": {"name": "stored", "store": name}, "seed": 1}}
        run = Result(tmp_path / "runs" / "a.zarr", attributes, computed=False)
        assert with_radiance_of(run) == {"scene": {"name": "stored", "store": found}, "seed": 1}
        assert attributes["config"]["scene"]["store"] == name, "the record does not change"
