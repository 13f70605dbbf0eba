"""Sweeps run every job once, give the same stores with every launcher, resume after a kill, and
find mistakes before the first job.
"""

from __future__ import annotations

import json
import os
import re
import signal
import time
from contextlib import suppress
from pathlib import Path

import pytest

from isethdr_core.runs.labels import Labels, read_labels

from .command import (
    LIGHTS,
    error_lines,
    here,
    installed_trouble,
    isethdr,
    leftovers,
    start,
    stores,
    wait_for,
)

SWEEP = ["run", "-m", *LIGHTS, "lighting=ideal", "sensor=ideal,bayer", "seed=1,2"]


def attributes(home):
    """Return the root attributes of every stored run."""
    return [
        json.loads((p / "zarr.json").read_text())["attributes"]
        for p in (home / "runs").glob("*.zarr")
    ]


def test_a_sweep_stores_every_combination_once(isethdr_home, monkeypatch, capsys):
    code, said = here(monkeypatch, capsys, *SWEEP, "name=pairs", "tags=night,wet")
    assert code == 0, said
    made = stores(isethdr_home)
    found = {(a["choices"]["sensor"], a["config"]["seed"]) for a in attributes(isethdr_home)}
    assert len(made) == 4 and found == {(s, seed) for s in ("ideal", "bayer") for seed in (1, 2)}
    sweep = isethdr_home / "sweeps" / "pairs"
    assert len((sweep / "table.csv").read_text().splitlines()) == 5
    labels = {read_labels(isethdr_home / "runs" / name) for name in made}
    assert labels == {Labels(tags=("night", "wet"), sweeps=("pairs",))}
    code, said = here(monkeypatch, capsys, "run", "-m", *LIGHTS, "seed=1,2", "name=pairs")
    assert code == 2 and said.startswith("error: the name 'pairs' belongs to another sweep")


@pytest.mark.slow
def test_every_launcher_stores_the_same(isethdr_home, tmp_path, monkeypatch, capsys):
    other = tmp_path / "joblib"
    few = [*SWEEP[:-2], "sensor=bayer", "seed=1"]
    parallel = start(  # with two workers joblib runs even one job in another process
        *few, "hydra/launcher=joblib", "hydra.launcher.n_jobs=2", ISETHDR_HOME=str(other)
    )
    code, said = here(monkeypatch, capsys, *few)
    assert code == 0, said
    _, said = parallel.communicate(timeout=600)
    assert parallel.returncode == 0, said
    there = stores(other)
    assert len(there) == 1 and there.keys() == stores(isethdr_home).keys()
    for name in there:
        one, two = (
            json.loads((h / "runs" / name / "zarr.json").read_text())["attributes"]["scores"]
            for h in (isethdr_home, other)
        )
        assert one == two, "processes must not change a result"


@pytest.mark.slow
def test_chunks_store_the_same(isethdr_home, tmp_path, monkeypatch, capsys):
    pytest.importorskip("submitit", reason="type pip install 'isethdr[slurm]'")
    other = tmp_path / "chunks"
    few = [*SWEEP[:-2], "sensor=bayer", "seed=1,2,3"]
    chunks = ["hydra/launcher=local_chunks", "hydra.launcher.workers=2"]
    started = start(*few, *chunks, ISETHDR_HOME=str(other))
    code, said = here(monkeypatch, capsys, *few)
    assert code == 0, said
    out, err = started.communicate(timeout=600)
    assert started.returncode == 0, err
    assert "3 computed" in out
    assert stores(other).keys() == stores(isethdr_home).keys() and len(stores(other)) == 3


@pytest.mark.slow
def test_a_killed_sweep_goes_on_where_it_stopped(isethdr_home, tmp_path):
    plugins = [installed_trouble(tmp_path / "plugins")]
    sweep = ["run", "-m", *LIGHTS, "lighting=ideal", "sensor=ideal", "seed=1,2"]
    mark = tmp_path / "mark"
    process = start(*sweep, plugins=plugins, ACME_WAIT="store", ACME_AFTER="2", ACME_MARK=str(mark))
    wait_for(mark, process)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    first = stores(isethdr_home)
    assert len(first) == 1 and len(leftovers(isethdr_home)) == 1, (
        "killed while the second store was written"
    )

    again = isethdr(*sweep, plugins=plugins)
    assert again.returncode == 0, again.stderr
    then = stores(isethdr_home)
    assert len(then) == 2 and first.items() <= then.items(), (
        "the first store is neither lost nor written again"
    )
    assert "1 computed, 1 stored before" in again.stdout and leftovers(isethdr_home) == []


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
def test_workers_of_a_killed_sweep_end_and_leave_nothing(isethdr_home, tmp_path):
    """Only the command itself is killed, not its process group."""
    plugins = [installed_trouble(tmp_path / "plugins")]
    mark = tmp_path / "mark"
    sweep = [
        "run",
        "-m",
        *LIGHTS,
        "lighting=ideal",
        "sensor=ideal",
        "seed=1,2",
        "+metric@metric.acme=acme",
    ]
    launcher = ["hydra/launcher=joblib", "hydra.launcher.n_jobs=2"]
    process = start(*sweep, *launcher, plugins=plugins, ACME_WAIT="store", ACME_MARK=str(mark))
    wait_for(mark, process)
    workers = children(process.pid)
    process.kill()
    assert workers
    end = time.monotonic() + 300  # the jobs wait for twice as long
    while any(map(alive, workers)) and time.monotonic() < end:
        time.sleep(0.1)
    process.communicate()
    assert not any(map(alive, workers))
    assert stores(isethdr_home) == {} and leftovers(isethdr_home) == []


def children(parent: int) -> list[int]:
    """Return the processes that `parent` started."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has just ended
            if int(stat.read_text().rpartition(")")[2].split()[1]) == parent:
                found.append(int(stat.parent.name))
    return found


def alive(pid: int) -> bool:
    """Return whether a process exists and is no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_a_mistake_anywhere_in_a_sweep_is_found_before_its_first_job(
    isethdr_home, monkeypatch, capsys
):
    mistakes = {
        "error: job sensor=rgwb: .*did you mean 'rgbw'": ["sensor=bayer,rgwb"],
        "error: job sensor.pitch_um=-1 seed=1: .*pitch_um is -1": [
            "sensor=bayer",
            "sensor.pitch_um=3,-1",
            "seed=1,2",
        ],
        "error: sensor 'rgwb' is not installed": ["sensor=rgwb"],
        "error: the tag is 'a/b'; .* type for example tags=": ["sensor=ideal", "tags=[a/b]"],
        "error: the name is 'a/b'; .* type for example name=a_b": ["sensor=ideal", "name=a/b"],
    }
    for message, overrides in mistakes.items():
        code, said = here(monkeypatch, capsys, "run", "-m", *LIGHTS, "lighting=ideal", *overrides)
        [line] = said.splitlines()
        assert code == 2 and re.match(message, line), line
    assert not isethdr_home.exists()


@pytest.mark.slow
def test_a_field_of_a_swept_kind_and_a_job_that_fails(isethdr_home):
    """Both sensors have the field. A job that fails does not stop the others."""
    done = isethdr(
        "run",
        "-m",
        *LIGHTS,
        "lighting=ideal",
        "sensor=ideal,bayer",
        "sensor.exposure_s=0.01",
        "sensor.columns=20",
        "sensor.rows=20",
        "+metric@metric.line=line_profile",
        "metric.line.row=-1,60000",
    )
    assert done.returncode == 1
    said = [line for line in error_lines(done) if line.startswith("error: job ")]
    assert len(said) == 2 and all("metric.line.row=60000" in line for line in said)
    assert "Traceback" not in done.stderr
    assert {
        (a["choices"]["sensor"], a["config"]["sensor"]["exposure_s"])
        for a in attributes(isethdr_home)
    } == {("ideal", 0.01), ("bayer", 0.01)}
