"""The index is a cache. It never hides a store, even if stores are renamed or clocks change."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import duckdb
import pytest
from isethdr_catalog import index
from isethdr_catalog.index import refresh
from isethdr_catalog.query import find, sql

from isethdr_core.errors import CatalogError


def put(home: Path, name: str, **attrs) -> Path:
    """Write a store that has only root attributes, and rename it into `home`."""
    attrs = {"kind": "run", "format": 1, "complete": True, "cameras": ["a"]} | attrs
    folder = home / ("runs" if attrs["kind"] == "run" else "scenes")
    hidden = folder / f".{name}.new"
    hidden.mkdir(parents=True)
    text = json.dumps({"zarr_format": 3, "node_type": "group", "attributes": attrs})
    (hidden / "zarr.json").write_text(text)
    return hidden.rename(folder / f"{name}.zarr")


def names(home: Path) -> list[str]:
    return sorted(row["id"] for row in find(home, kind="run", limit=10**6))


@pytest.fixture
def read(monkeypatch) -> list[str]:
    """Return a list that receives a store's name each time the index reads its attributes."""
    seen = []
    real = index.records

    def spy(path, folder):
        seen.append(Path(path).stem)
        return real(path, folder)

    monkeypatch.setattr(index, "records", spy)
    return seen


def test_a_store_renamed_in_while_a_refresh_reads_is_found(tmp_path, monkeypatch):
    put(tmp_path, "first")
    real = index.records

    def meanwhile(path, folder):
        if not (tmp_path / "runs/second.zarr").exists():
            put(tmp_path, "second")
        return real(path, folder)

    monkeypatch.setattr(index, "records", meanwhile)
    assert refresh(tmp_path).records == 1
    assert names(tmp_path) == ["first", "second"]


def test_forty_stores_that_arrive_during_refreshes_are_all_found(tmp_path):
    expected = [f"r{k:02d}" for k in range(40)]
    writer = threading.Thread(target=lambda: [put(tmp_path, name) for name in expected])
    writer.start()
    while writer.is_alive():
        refresh(tmp_path)
    writer.join()
    assert names(tmp_path) == expected


@pytest.mark.parametrize("shift_s", [-(10**6), 10**6])
def test_a_clock_that_is_set_hides_nothing(tmp_path, shift_s):
    put(tmp_path, "first")
    refresh(tmp_path)
    when = (tmp_path / "index.duckdb").stat().st_mtime + shift_s
    os.utime(tmp_path / "index.duckdb", (when, when))
    put(tmp_path, "second")
    for path in (
        tmp_path / "runs",
        tmp_path / "runs/second.zarr",
        tmp_path / "runs/second.zarr/zarr.json",
    ):
        os.utime(path, (1, 1))
    assert names(tmp_path) == ["first", "second"]


def test_only_new_and_changed_stores_are_read(tmp_path, read):
    for name in ("a", "b", "c"):
        put(tmp_path, name, lighting="day")
    assert refresh(tmp_path).records == 3
    read.clear()
    put(tmp_path, "d", lighting="night")
    shutil.rmtree(tmp_path / "runs/a.zarr")
    shutil.rmtree(tmp_path / "runs/b.zarr")
    put(tmp_path, "b", lighting="dusk")
    assert refresh(tmp_path).records == 3 and read == ["b", "d"]
    assert {row["id"]: row["lighting"] for row in find(tmp_path, lighting__ne="")} == {
        "b": "dusk",
        "c": "day",
        "d": "night",
    }
    assert read == ["b", "d"]


def test_the_last_store_that_goes_leaves_no_record(tmp_path):
    shutil.rmtree(put(tmp_path, "a"))
    assert refresh(tmp_path).records == 0
    put(tmp_path, "b")
    refresh(tmp_path)
    shutil.rmtree(tmp_path / "runs/b.zarr")
    assert refresh(tmp_path).records == 0 and names(tmp_path) == []


def test_a_damaged_store_does_not_ask_for_a_new_index_each_time(tmp_path):
    put(tmp_path, "whole")
    put(tmp_path, "half", complete=False)
    refresh(tmp_path)
    before = index._stamp(tmp_path / "index.duckdb")
    assert [Path(p).stem for p in refresh(tmp_path).skipped] == ["half"]
    assert index._stamp(tmp_path / "index.duckdb") == before
    shutil.rmtree(tmp_path / "runs/half.zarr")
    put(tmp_path, "half")
    assert names(tmp_path) == ["half", "whole"]


def test_a_scene_gets_the_lightings_of_runs_that_came_later(tmp_path):
    put(tmp_path, "s", kind="scene")
    put(tmp_path, "a", lighting="night", scene_ids=["s"])
    assert [row["id"] for row in find(tmp_path, kind="scene", lighting="night")] == ["s"]
    put(tmp_path, "b", lighting="day", scene_id="s")
    [row] = find(tmp_path, kind="scene", lighting="day")
    assert row["lighting"] == ["day", "night"]


@pytest.mark.parametrize("indexed", [False, True])
def test_a_home_that_cannot_be_written_is_queried_from_memory(tmp_path, monkeypatch, indexed):
    put(
        tmp_path,
        "first",
        scores=[{"camera": "a", "metric": "ssim", "object": "", "value": 0.5, "unit": "1"}],
    )
    if indexed:
        refresh(tmp_path)
    put(tmp_path, "second")
    before = sorted(tmp_path.rglob("*"))

    def refused(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "mkdir", refused)
    with pytest.raises(CatalogError, match="cannot write .*index.duckdb.*ISETHDR_HOME"):
        refresh(tmp_path)
    assert names(tmp_path) == ["first", "second"]
    assert sql(tmp_path, "SELECT id, value FROM scores")[1] == [("first", 0.5)]
    assert sorted(tmp_path.rglob("*")) == before


KILLED = """
import os, signal, sys
from isethdr_catalog import index
os.replace = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
index.refresh(sys.argv[1])
"""


@pytest.mark.slow
def test_what_an_interrupted_refresh_leaves_is_removed(tmp_path):
    put(tmp_path, "a")
    old = tmp_path / ".index-abc"  # name of older versions
    old.mkdir()
    os.utime(old, (1, 1))
    done = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], check=False)
    assert done.returncode == -signal.SIGKILL
    assert len(list(tmp_path.glob(".index*.tmp"))) == 1
    assert names(tmp_path) == ["a"]
    left = {p.name for p in tmp_path.iterdir()} - {"index.state.json"}
    assert left == {"index.duckdb", "runs"}


MEASURED = """
import json, sys, time
from pathlib import Path
import duckdb
from isethdr_catalog.index import refresh
from peak_memory import peak_bytes
from test_index import put
home = Path(sys.argv[1])
duckdb.sql("SELECT 1").fetchall()
before = peak_bytes()
records = refresh(home).records
put(home, "new")
start_s = time.process_time()
assert refresh(home).records == records + 1
print(json.dumps([records, time.process_time() - start_s, (peak_bytes() - before) / 1e6]))
"""


@pytest.mark.slow
def test_one_new_run_among_20_000_costs_little(tmp_path):
    """Indexing one more run takes below 1 s of CPU time and 50 MB per 10,000 records.

    Measured are 0.3 s and 25 MB per 10,000 records.
    """
    for k in range(20_000):
        put(
            tmp_path,
            f"r{k:05d}",
            lighting="night",
            config={"seed": k},
            objects=[{"category": "person", "distance_m": k}],
        )
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join([*map(str, Path(__file__).parents[:2]), *sys.path])
    }
    done = subprocess.run(
        [sys.executable, "-c", MEASURED, str(tmp_path)],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    records, seconds, megabytes = json.loads(done.stdout)
    print(f"{records} records: {seconds:.2f} s of CPU for one more, {megabytes:.0f} MB")
    assert records == 20_000 and seconds < 1.0 and megabytes < 2 * 50


@pytest.fixture
def settled(monkeypatch):
    """Count each state of a folder as settled; normally it settles some seconds after a change."""
    monkeypatch.setattr(index, "SETTLED_S", -1e9)


@pytest.mark.slow
def test_a_folder_that_did_not_change_is_not_compared_again(tmp_path, settled, monkeypatch):
    put(tmp_path, "a", lighting="day")
    put(tmp_path, "s", kind="scene")
    assert names(tmp_path) == ["a"]
    calls = []
    real = index.stamps
    monkeypatch.setattr(index, "stamps", lambda folder: calls.append(folder) or real(folder))
    assert names(tmp_path) == ["a"] and not calls
    assert sql(tmp_path, "SELECT count(*) FROM shots")[1] == [(2,)] and not calls
    put(tmp_path, "b")
    assert names(tmp_path) == ["a", "b"] and len(calls) == 1
    (tmp_path / "runs/a.labels.json").write_text(
        json.dumps({"name": "first", "tags": [], "sweeps": []})
    )
    assert [row["id"] for row in find(tmp_path, name="first")] == ["a"] and len(calls) == 2
    shutil.rmtree(tmp_path / "runs/b.zarr")
    assert names(tmp_path) == ["a"] and len(calls) == 3
    (tmp_path / "index.duckdb").unlink()
    assert names(tmp_path) == ["a"] and len(calls) == 4
    index.forget(tmp_path)
    assert names(tmp_path) == ["a"] and len(calls) == 5


def test_an_index_of_fewer_stores_is_completed(tmp_path, settled):
    put(tmp_path, "a")
    assert names(tmp_path) == ["a"]
    shutil.copy(tmp_path / "index.duckdb", tmp_path / "of_another_process")
    put(tmp_path, "b")
    assert names(tmp_path) == ["a", "b"]
    os.replace(tmp_path / "of_another_process", tmp_path / "index.duckdb")
    assert names(tmp_path) == ["a", "b"]


def test_a_folder_that_changed_a_moment_ago_is_compared_again(tmp_path):
    put(tmp_path, "a")
    names(tmp_path)
    assert index.state(tmp_path) is None


# property: (values in three stores, [(operator, value in the query, numbers of stores found)])
OF_SEVERAL_TYPES = {
    # the column of the index becomes text
    "gain": ((1, 2.5, "auto"), [("", "auto", {2}), ("", 1, {0}), ("__ge", 2, {1})]),
    "in_list": ((1, [1, 2], "1"), [("", 1, {0, 1, 2})]),  # lists match by element
    "on": ((True, False, "true"), [("", True, {0, 2})]),
    "far": ((1e-5, 10**17, -3), [("", 1e-5, {0}), ("__in", [10**17, -3], {1, 2})]),
    "half": ((0.1, "[half a list", "x"), [("__ne", "x", {0, 1})]),
    "quoted": (("it's", 'a "b"', "x"), [("", "it's", {0})]),
}


@pytest.mark.slow
def test_properties_of_several_types_are_found(tmp_path):
    """The type of each property changes from refresh to refresh."""
    for k in range(3):
        config = {name: values[k] for name, (values, _) in OF_SEVERAL_TYPES.items()}
        put(tmp_path, f"r{k}", config={**config, "Gain": k, "": k, "odd \"n'ame": k})
        refresh(tmp_path)
    for name, (values, answers) in OF_SEVERAL_TYPES.items():
        for operator, asked, expected in answers:
            found = find(tmp_path, **{f"config.{name}{operator}": asked})
            assert {row["id"] for row in found} == {f"r{k}" for k in expected}, name
            assert all(row[f"config.{name}"] == values[int(row["id"][1:])] for row in found)
    rows = find(tmp_path, order_by="config.Gain")
    assert [row["config.Gain"] for row in rows] == [0, 1, 2]
    assert len(find(tmp_path, **{"config.odd \"n'ame__ge": 1})) == 2


def test_a_property_of_removed_stores_is_not_known(tmp_path):
    shutil.rmtree(put(tmp_path, "a", config={"old": 1}))
    put(tmp_path, "a", config={"old": 1})
    put(tmp_path, "b", config={"new": 1})
    assert len(find(tmp_path, **{"config.old": 1})) == 1
    shutil.rmtree(tmp_path / "runs/a.zarr")
    with pytest.raises(CatalogError, match="no record has the property 'config.old'"):
        find(tmp_path, **{"config.old": 1})


def test_a_misspelt_operator_gets_the_list_of_operators(tmp_path):
    put(tmp_path, "a", sensor="bayer")
    with pytest.raises(CatalogError, match=r"'like' is no operator; .* ge, le, gt, lt, ne, in"):
        find(tmp_path, sensor__like="bayer")
    with pytest.raises(CatalogError, match="no record has the property 'senso.like'; did"):
        find(tmp_path, senso__like="bayer")


def test_a_store_that_another_process_indexed_meanwhile_has_one_record(tmp_path, monkeypatch):
    put(tmp_path, "first")
    refresh(tmp_path)
    put(tmp_path, "second")
    real = index._remove_scratch

    def meanwhile(folder):
        """Refresh in another process, after this one has compared and before it writes."""
        monkeypatch.setattr(index, "_remove_scratch", real)
        refresh(tmp_path)

    monkeypatch.setattr(index, "_remove_scratch", meanwhile)
    assert refresh(tmp_path).records == 2
    assert names(tmp_path) == ["first", "second"]


def test_a_truth_value_is_found_as_typed_in_python_and_in_json(tmp_path):
    put(tmp_path, "on", leave_out=True)
    put(tmp_path, "off", leave_out=False)
    for text in (True, "True", "true"):
        assert [row["id"] for row in find(tmp_path, leave_out=text)] == ["on"]
    assert [row["id"] for row in find(tmp_path, leave_out__ne="True")] == ["off"]


def test_a_full_disk_is_one_line(tmp_path, monkeypatch):
    put(tmp_path, "a")

    def full(_writer, _stores):
        raise duckdb.IOException("IO Error: Could not write: No space left on device")

    monkeypatch.setattr(index.index_file.Writer, "add", full)
    with pytest.raises(CatalogError, match=r"cannot write .*index.duckdb: .*No space left on dev"):
        refresh(tmp_path)
    with pytest.raises(CatalogError, match=r"folder of temporary files: .*No space left on device"):
        find(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["runs"]
