"""Files that can be made again may be removed at any time; stores in use stay, and are named."""

import os
import re
from pathlib import Path

import numpy as np
import pytest
from isethdr_catalog import space
from isethdr_catalog.commands import catalog
from isethdr_catalog.stored_scores import scores_of
from isethdr_catalog.verify import verify
from typer.testing import CliRunner

import isethdr_core as hdr
from isethdr_core.errors import CatalogError
from isethdr_core.storage.atomic_write import temporary_path
from isethdr_core.storage.bounded_cache import BoundedCache
from isethdr_core.storage.store import write_store

LONG_AGO_S = 1_000_000_000


@pytest.fixture
def home(isethdr_home):
    """Return a home with two scenes, of which a run has read one, and with files for reuse."""
    for name in ("read", "unread"):
        path = write_store(isethdr_home / "scenes", name, {}, {"kind": "scene", "recipe": name})
        os.utime(path, (LONG_AGO_S, LONG_AGO_S))
    run = {"kind": "run", "key": "reader", "scene_ids": ["read"], "cameras": []}
    write_store(isethdr_home / "runs", "reader", {}, run)
    (isethdr_home / "runs" / "reader.html").write_text("page")
    (isethdr_home / "runs" / "gone.html").write_text("page of a run that was removed by hand")
    BoundedCache(isethdr_home / "intermediate", 10**6).put("a" * 16, np.ones(1000))
    (isethdr_home / "kernels").mkdir()
    (isethdr_home / "kernels" / "psf.npy").write_bytes(bytes(5000))
    return isethdr_home


def called(*arguments, answer=None):
    return CliRunner().invoke(catalog, list(arguments), input=answer)


def test_usage_counts_what_the_disk_holds(home):
    found = {one.part: one for one in space.usage(home)}
    assert found.keys() == {"scenes", "runs", "intermediate", "kernels"}
    assert found["scenes"].entries == 2 and found["runs"].entries == 3
    assert found["kernels"].size == 8192  # two blocks of 4096 bytes
    files = [p for p in home.rglob("*") if p.is_file()]
    assert sum(one.size for one in found.values()) == sum(512 * p.stat().st_blocks for p in files)
    said = called("du", "--stores").output
    assert "intermediate" in said and "unread" in said
    assert space.usage(home / "absent") == []


def test_usage_names_every_folder_that_the_page_lists(isethdr_home):
    """`space` reports a folder that it does not know as files that isethdr did not make."""
    page = (Path(__file__).parents[2] / "docs" / "how-to" / "catalog.md").read_text()
    rows = re.findall(r"^\| (`[^|]*)\|", page.partition("## Find runs")[0], re.MULTILINE)
    folders = set(re.findall(r"`([a-z_]+)/", " ".join(rows)))
    assert {"scenes", "runs", "datasets", "training"} <= folders
    for name in folders:
        (isethdr_home / name).mkdir(parents=True, exist_ok=True)
    assert folders == {one.part for one in space.usage(isethdr_home)}


def test_a_dry_run_removes_nothing_and_gc_what_is_made_again(home):
    before = sorted(home.rglob("*"))
    assert "would be removed" in called("gc", "--dry-run").output
    assert sorted(home.rglob("*")) == before
    said = called("gc").output
    assert "MB freed" in said and "kept: 1 scene that no run has read" in said
    assert not list((home / "intermediate").iterdir()) and not list((home / "kernels").iterdir())
    assert not (home / "runs" / "gone.html").exists()
    assert (home / "runs" / "reader.html").exists() and (home / "scenes" / "unread.zarr").exists()
    called("gc", "--scenes")
    assert [p.stem for p in (home / "scenes").glob("*.zarr")] == ["read"]
    assert [report.problems for report in verify(home)] == [(), ()]


def test_radiance_that_may_be_in_use_stays(home):
    os.utime(home / "scenes" / "unread.zarr")  # just rendered: its run may still be at work
    assert space.unread_scenes(home) == []


def test_a_damaged_run_may_have_read_anything(home):
    (home / "runs" / "reader.zarr" / "zarr.json").write_text("{")
    with pytest.raises(CatalogError, match="reader is damaged.*catalog rm reader"):
        space.unread_scenes(home)
    with pytest.raises(CatalogError, match="may have been read by damaged runs.*--force"):
        space.remove_store(home, home / "scenes" / "unread.zarr")
    assert called("rm", "reader", "--yes").exit_code == 0
    assert len(space.unread_scenes(home)) == 2


def test_rm_removes_a_run_with_its_report_once_it_may(home):
    assert called("rm", "read", "--yes").exit_code != 0  # the scene, which `reader` has read
    assert (home / "scenes" / "read.zarr").exists()
    assert called("rm", "reader", answer="n\n").exit_code == 1
    assert (home / "runs" / "reader.zarr").exists()
    assert called("rm", "reader", answer="y\n").exit_code == 0
    assert not list((home / "runs").glob("*reader*"))
    assert called("rm", "read", "--yes").exit_code == 0
    with pytest.raises(CatalogError, match="begins the key of no store.*looked in.*first digits"):
        space.find_one(home, "reader")


def test_radiance_that_a_run_has_read_goes_by_force_alone(home):
    path = home / "scenes" / "read.zarr"
    with pytest.raises(CatalogError, match="was read by 1 run: reader;.*--force"):
        space.remove_store(home, path)
    assert called("rm", "read", "--yes", "--force").exit_code == 0 and not path.exists()


@pytest.mark.slow
def test_a_run_is_complete_without_what_is_kept_for_reuse(isethdr_home, monkeypatch):
    chart = ["scene=macbeth", "scene.width=48", "scene.height=32", "~flare.dirt", "lens=ideal"]
    camera = ["sensor=bayer", "sensor.rows=24", "sensor.columns=36", "lens.focal_length_mm=0.25"]
    fewer = ["~metric.detection", "~metric.contrast"]
    asked = ["experiment=five_lights", *chart, *camera, *fewer, "draws=1"]
    with monkeypatch.context() as without_page:
        without_page.setattr("isethdr_catalog.report.write_report", lambda result: None)
        result = hdr.run(hdr.compose(asked))
    assert any((isethdr_home / "intermediate").iterdir())
    assert called("gc").exit_code == 0
    assert not any((isethdr_home / "intermediate").iterdir())
    assert [report.problems for report in verify(isethdr_home)] == [()]
    assert called("show", result.key).exit_code == 0
    assert not hdr.run(hdr.compose(asked)).computed
    assert "macbeth" in result.path.with_suffix(".html").read_text()
    assert scores_of(result.path, hdr.build("metric", "pixel_shares"))


def test_gc_without_scenes_is_not_stopped_by_a_damaged_run(home):
    (home / "runs" / "reader.zarr" / "zarr.json").write_text("{")
    done = called("gc")
    assert done.exit_code == 0 and not list((home / "kernels").iterdir())
    assert "is not counted: the run reader is damaged" in done.output
    assert isinstance(called("gc", "--scenes").exception, CatalogError)


def test_radiance_of_the_sub_frames_of_a_run_is_in_use(home):
    run = {"kind": "run", "key": "moving", "scene_ids": ["read"], "cameras": []}
    motion = {"scene_ids": [["read"], ["unread"]]}
    write_store(home / "runs", "moving", {}, {**run, "motion": motion})
    assert space.unread_scenes(home) == []
    with pytest.raises(CatalogError, match="was read by 1 run: moving"):
        space.remove_store(home, home / "scenes" / "unread.zarr")


def test_a_file_that_a_process_writes_is_no_damage(home):
    temporary_path(home / "runs", "third").mkdir()
    done = called("verify")
    assert done.exit_code == 0 and "being written" in done.output
    assert "damaged" not in done.output


def test_radiance_of_a_dataset_is_in_use_as_long_as_its_records_exist(home):
    records = home / "datasets" / "tiny" / "scenes"
    records.mkdir(parents=True)
    (records / "00000.json").write_text('{"stores": ["unread"]}')
    (records / "00001.json").write_text("{")
    assert space.unread_scenes(home) == []
    refused = called("rm", "unread", "--yes")
    assert "is a scene of the dataset tiny" in str(refused.exception)
    (records / "00000.json").unlink()
    assert [one.path.stem for one in space.unread_scenes(home)] == ["unread"]


@pytest.mark.parametrize("scene", [{"store": "unread"}, {"path": "scenes/unread.zarr"}])
def test_radiance_that_the_scene_of_a_run_names_is_in_use(home, scene):
    run = {"kind": "run", "key": "named", "cameras": [], "config": {"scene": scene}}
    write_store(home / "runs", "named", {}, {**run, "scene_ids": [], "scene_id": ""})
    assert space.unread_scenes(home) == []
    assert space.dependents(home, home / "scenes" / "unread.zarr").readers == ("named",)
