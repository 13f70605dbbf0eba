"""Chunks of a sweep: every job runs once, and results keep their order even if a chunk fails."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from omegaconf import OmegaConf

from isethdr_core.config import chunk_launcher
from isethdr_core.config.chunk_launcher import (
    ChunkLauncher,
    ChunksEndedError,
    ChunkSettings,
    check,
    chunks,
)
from isethdr_core.errors import ConfigError


class InThisProcess:
    """A stand-in for submitit in this process; a chunk with a job called `killed` ends early."""

    def __init__(self):
        self.parts = []

    def map_array(self, call, batches, parts):
        self.parts = parts
        return [Task(call, batch, jobs) for batch, jobs in zip(batches, parts, strict=True)]


class Task:
    def __init__(self, call, batch, jobs):
        self.error = None
        if any("killed" in typed for _, typed in jobs):
            self.error = RuntimeError("Job (task=0) was killed\nand more lines")
        else:
            self.returned = call(batch, jobs)

    def exception(self):
        return self.error

    def result(self):
        return self.returned


@pytest.fixture
def launcher(tmp_path, monkeypatch):
    """Return a launcher of three chunks and its engine; a job returns its number and overrides."""
    engine = InThisProcess()
    monkeypatch.setattr(chunk_launcher, "find_spec", lambda name: name)
    monkeypatch.setattr(chunk_launcher, "executor", lambda settings, folder: engine)
    monkeypatch.setattr(chunk_launcher, "_run_job", lambda batch, number, typed: (number, typed))
    # a chunk sets the global state of Hydra, which the other tests of this process share
    monkeypatch.setattr(chunk_launcher.Singleton, "set_state", lambda state: None)
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    found = ChunkLauncher(engine="local", workers=3)
    config = OmegaConf.create({"hydra": {"sweep": {"dir": str(tmp_path)}}})
    found.setup(hydra_context=SimpleNamespace(), task_function=print, config=config)
    return found, engine


def test_every_job_is_in_one_chunk_and_chunks_differ_by_one_at_most():
    parts = chunks(list(range(200)), 30)
    assert sorted(job for part in parts for job in part) == list(range(200))
    assert {len(part) for part in parts} == {6, 7} and len(parts) == 30
    assert chunks([1, 2], 10) == [[1], [2]]


def test_results_come_in_the_order_of_the_jobs(launcher):
    launched, engine = launcher
    typed = [[f"seed={k}"] for k in range(8)]
    returned = launched.launch(typed, initial_job_idx=4)
    assert returned == [(4 + k, typed[k]) for k in range(8)]
    assert [len(part) for part in engine.parts] == [3, 3, 2]


def test_a_chunk_that_is_killed_is_named_after_the_others(launcher):
    launched, _ = launcher
    with pytest.raises(ChunksEndedError, match=r"1 of 3 chunks .* was killed; their output is in"):
        launched.launch([["a"], ["killed"], ["b"]], initial_job_idx=0)


def test_impossible_settings_name_what_to_type(monkeypatch):
    settings = ChunkSettings()
    with pytest.raises(ConfigError, match=r"pip install 'isethdr\[slurm\]'"):
        monkeypatch.setattr(chunk_launcher, "find_spec", lambda _: None)
        check(settings)
    with pytest.raises(ConfigError, match="hydra.launcher.workers is 0"):
        check(replace(settings, workers=0))
    with pytest.raises(ConfigError, match="engine is 'ray'; expected slurm or local"):
        check(replace(settings, engine="ray"))
