"""From a selection to a folder: what is chosen, the manifest, and the refusals."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys

import pytest
from isethdr_catalog.selection import StoredShot, select
from isethdr_workflows.export import exporting
from isethdr_workflows.export.exporting import chosen, exported, in_order, run
from isethdr_workflows.export.output_folder import exchange, replaced

from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.results.stored import open_run
from isethdr_core.storage.store import write_store


def keys(what):
    """Return the keys of the selected runs."""
    return [shot.path.stem for shot in select(what).shots]


def test_runs_sweeps_and_queries_are_selected(home):
    both = sorted([home.plain, home.labelled])
    assert keys(["first"]) == keys([home.plain[:6]]) == [home.plain]
    assert keys(["two"]) == keys([*both, "first"]) == keys(["sensor=bayer"]) == both
    assert keys(["lighting=night"]) == [home.labelled]
    assert [path.stem for path in select(["kind=scene"]).scenes] and not select(
        ["kind=scene"]
    ).shots


@pytest.mark.parametrize(
    ("what", "said"),
    [
        ([], "names no runs"),
        (["first", "sensor=bayer"], "names no runs; expected names .*, or conditions alone"),
        (["third"], "'third' names no run"),
        (["sensor=rgbw"], "nothing in .* meets sensor=rgbw"),
        (["sensr=bayer"], "no record has the property 'sensr'.*sensor"),
    ],
)
def test_what_selects_nothing_is_named(home, what, said):
    with pytest.raises(CatalogError, match=said):
        select(what)


def test_the_manifest_names_every_file_with_its_digest(home, tmp_path):
    out = tmp_path / "out"
    exported(["two"], out, ["png,exr"], title="Night", licence="CC0-1.0")
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["title"] == "Night" and manifest["licence"] == "CC0-1.0"
    rows = {row["path"]: row for row in manifest["files"]}
    held = {p.relative_to(out).as_posix(): p for p in out.rglob("*") if p.is_file()}
    assert rows.keys() == held.keys() - {"manifest.json"} and len(rows) == 6
    for name, path in held.items():
        if name in rows:
            content = path.read_bytes()
            assert rows[name]["sha256"] == hashlib.sha256(content).hexdigest()
            assert rows[name]["bytes"] == len(content)
    assert {row["run"] for row in rows.values()} == {home.plain, home.labelled}


def test_formats_are_names(home, tmp_path):
    assert chosen(["exr, png", "png"]) == ["png", "exr"]
    with pytest.raises(ConfigError, match="no format 'pgn'; did you mean 'png'"):
        exported(["first"], tmp_path / "out", ["pgn"])
    with pytest.raises(ConfigError, match="no format is named.*--to png"):
        exported(["first"], tmp_path / "out", [])


def test_the_folder_comes_last(home, tmp_path, capsys):
    with pytest.raises(ConfigError, match="no folder is named after first"):
        run(["first"], ["png"], False, "", "")
    with pytest.raises(ConfigError, match="no folder is named after kind=run sensor=bayer"):
        run(["kind=run", "sensor=bayer"], ["png"], False, "", "")
    run(["first", str(tmp_path / "out")], ["png"], False, "", "")
    shown = capsys.readouterr().out
    assert "1 picture of 1 run\n" in shown and shown.endswith(f"exported:\n{tmp_path / 'out'}\n")


def test_only_an_earlier_export_is_replaced(home, tmp_path):
    out = tmp_path / "out"
    exported(["first"], out, ["exr"])
    with pytest.raises(CatalogError, match="is not empty.*--force"):
        exported(["first"], out, ["png"])
    exported(["first"], out, ["png"], force=True)
    assert sorted(p.name for p in out.iterdir()) == ["manifest.json", "png"]
    (out / "notes.txt").write_text("mine")
    with pytest.raises(CatalogError, match="holds 'notes.txt', which no export wrote"):
        exported(["first"], out, ["exr"], force=True)
    assert (out / "notes.txt").read_text() == "mine" and list(tmp_path.glob(".*")) == []


def test_a_folder_that_cannot_be_made_is_named(home, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(CatalogError, match="is a file"):
        exported(["first"], tmp_path / "file", ["png"], force=True)
    with pytest.raises(CatalogError, match="there is no folder .*nowhere; make it first"):
        exported(["first"], tmp_path / "nowhere" / "out", ["png"])


def test_an_error_leaves_the_old_folder(home, tmp_path, monkeypatch):
    out = tmp_path / "out"
    exported(["first"], out, ["png"])
    before = (out / "manifest.json").read_bytes()
    full = OSError(28, "No space left on device")
    monkeypatch.setattr("isethdr_workflows.export.exporting._write_manifest", raising(full))
    with pytest.raises(CatalogError, match="No space left on device; .* is as it was"):
        exported(["first"], out, ["exr"], force=True)
    assert (out / "manifest.json").read_bytes() == before and list(tmp_path.glob(".*")) == []


def test_a_full_disk_is_named_when_an_exr_is_written(home, tmp_path, monkeypatch):
    """OpenEXR raises RuntimeError."""
    full = RuntimeError("Failed to write pixel data. No space left on device.")
    monkeypatch.setattr("isethdr_workflows.export.pictures.exr.write_exr", raising(full))
    with pytest.raises(CatalogError, match="No space left on device.; .* is as it was"):
        exported(["first"], tmp_path / "out", ["exr"])
    assert list(tmp_path.iterdir()) == []


def test_a_link_is_kept_and_its_folder_is_replaced(tmp_path):
    (tmp_path / "real").mkdir()
    link = tmp_path / "link"
    link.symlink_to("real")
    with replaced(link) as new:
        (new / "x").write_text("")
    assert link.is_symlink() and [p.name for p in (tmp_path / "real").iterdir()] == ["x"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["link", "real"]


def raising(error):
    """Return a function that raises `error`."""

    def fail(*_):
        raise error

    return fail


KILLED = """
import os, signal, sys
from pathlib import Path
from isethdr_workflows.export import output_folder
folder, after = Path(sys.argv[1]), sys.argv[2] == "after"
def killed_exchange(a, b, real=output_folder.exchange):
    if after:
        real(a, b)
    os.kill(os.getpid(), signal.SIGKILL)
output_folder.exchange = killed_exchange
with output_folder.replaced(folder) as new:
    for k in range(3):
        (new / f"{k}").write_text("new")
"""


@pytest.mark.parametrize("when", ["before", "after"])
def test_a_kill_leaves_the_old_folder_or_the_new_one(tmp_path, when):
    out = tmp_path / "out"
    out.mkdir()
    for k in range(2):
        (out / f"{k}").write_text("old")
    done = subprocess.run([sys.executable, "-c", KILLED, str(out), when], check=False)
    assert done.returncode == -signal.SIGKILL
    held = sorted((p.name, p.read_text()) for p in out.iterdir())
    expected = ("new", 3) if when == "after" else ("old", 2)
    assert held == [(f"{k}", expected[0]) for k in range(expected[1])]
    with replaced(out) as new:
        (new / "x").write_text("")
    assert [p.name for p in out.iterdir()] == ["x"]
    assert list(tmp_path.glob(".*")) == [], "what the killed one left is removed"


def test_two_folders_change_places(tmp_path):
    a = tmp_path / "a"
    b = tmp_path / "b"
    for path in (a, b):
        path.mkdir()
        (path / path.name).touch()
    exchange(a, b)
    assert os.listdir(a) == ["b"] and os.listdir(b) == ["a"]
    with pytest.raises(OSError):
        exchange(a, tmp_path / "c")


def frame_of(folder, road, time_s, lens="ideal", carried_s=0.01):
    """Store a run of two cameras that shows a road at a time; return its pictures. It is no frame
    of a sequence if `carried_s` is None.
    """
    scene = {"name": "street", "road": road, "time_s": time_s, "frames_per_s": 10.0}
    config = {"scene": scene, "lens": {"name": lens}}
    if carried_s is not None:
        config["exposures"] = {"front": {"exposure_s": carried_s * (1 + time_s)}}
    digest = hashlib.sha256(f"{road} {time_s} {lens} {carried_s}".encode()).hexdigest()[:16]
    path = write_store(folder, digest, {}, {"kind": "run", "config": config})
    return [StoredShot(path, camera) for camera in ("rear", "front")]


def test_sequences_follow_each_other_and_each_run_is_opened_once(tmp_path, monkeypatch):
    """Frames of two roads, or of one road through two lenses, belong to different sequences."""
    kinds = (("a", "ideal"), ("b", "ideal"), ("b", "cooke"))
    shots = [
        shot
        for time_s in (0.2, 0.0, 0.1)
        for road, lens in kinds
        for shot in frame_of(tmp_path, road, time_s, lens)
    ]
    opened = []
    monkeypatch.setattr(exporting, "open_run", lambda path: opened.append(path) or open_run(path))
    items = in_order(shots)
    assert [item.number for item in items] == list(range(1, 19))
    frames = [(item.sequence, item.time_s, item.camera) for item in items]
    shown = set()
    for item in items:
        config = item.attributes["config"]
        shown.add((item.sequence, config["scene"]["road"], config["lens"]["name"]))
    assert len(shown) == 3, "one road and lens in each sequence"
    expected = [
        (number, time_s, camera)
        for number in (1, 2, 3)
        for time_s in (0.0, 0.1, 0.2)
        for camera in ("front", "rear")
    ]
    assert frames == expected
    assert len(opened) == len(set(opened)) == 9


def test_each_sequence_has_each_time_once(tmp_path):
    """Two sequences with another control of exposure, and single runs of the same settings."""
    shots = [
        shot
        for carried_s in (0.01, 0.02, None)
        for time_s in (0.0, 0.1, 0.2)
        for shot in frame_of(tmp_path, "a", time_s, carried_s=carried_s)
    ]
    items = in_order(shots)
    expected = [
        (number, time_s, camera)
        for number in (1, 2, 3)
        for time_s in (0.0, 0.1, 0.2)
        for camera in ("front", "rear")
    ]
    assert [(item.sequence, item.time_s, item.camera) for item in items] == expected
    single = {item.sequence for item in items if "exposures" not in item.attributes["config"]}
    assert len(single) == 1, "single runs are no frames of a sequence"
