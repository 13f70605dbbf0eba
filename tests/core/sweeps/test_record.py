"""The record of a sweep: its name, its jobs, and the time that is left for the other jobs."""

from __future__ import annotations

from dataclasses import replace

import pytest

from isethdr_core.errors import ConfigError
from isethdr_core.sweeps import record
from isethdr_core.sweeps.record import (
    Job,
    check_free,
    name_of,
    read_jobs,
    read_sweep,
    seconds_left,
)

from .stored_sweep import stored_sweep


def test_a_sweep_and_its_jobs_are_read_as_they_were_written(isethdr_home):
    sweep = stored_sweep(isethdr_home, failed=True)
    assert read_sweep(sweep.folder) == sweep
    jobs = read_jobs(sweep.folder)
    assert [job.number for job in jobs] == [0, 1, 2, 3] and jobs[3].error == "glass broke"
    assert read_sweep(isethdr_home / "sweeps" / "other") is None


def test_a_sweep_that_begins_in_two_terminals_at_once_has_one_folder(isethdr_home, monkeypatch):
    sweep = stored_sweep(isethdr_home)
    # the other terminal makes the folder again after this one has removed it
    monkeypatch.setattr(record.shutil, "rmtree", lambda *_, **__: None)
    record.begin(sweep)
    assert read_sweep(sweep.folder) == sweep


def test_two_sweeps_of_one_name_are_an_error_and_the_same_command_is_not(isethdr_home):
    sweep = stored_sweep(isethdr_home)
    check_free(replace(sweep, overrides=sweep.overrides[::-1], started=7.0))
    with pytest.raises(ConfigError, match=r"'exposures' belongs to another sweep: sensor=bayer,.*"):
        check_free(replace(sweep, overrides=("seed=1,2",)))
    with pytest.raises(ConfigError, match="type for example name=exposures_2"):
        check_free(replace(sweep, overrides=()))


def test_the_same_command_has_the_same_name_in_any_order():
    assert name_of(["a=1,2", "b=3"]) == name_of(["b=3", "a=1,2"]) != name_of(["a=1,2", "b=4"])


def test_time_left_is_the_time_of_the_computed_jobs_times_those_to_come(isethdr_home):
    sweep = replace(stored_sweep(isethdr_home), total=10, started=200.0)
    stored = Job(0, (), 0.5, "a", ended=1000.5)  # 800 s after the start of the sweep
    computed = Job(1, (), 5.0, "b", computed=True, ended=1005.5)
    assert seconds_left(sweep, [stored], now=1020.0) is None
    assert seconds_left(sweep, [stored, computed], now=1020.0) == 20.0 * 8
    assert seconds_left(replace(sweep, total=2), [stored, computed], now=1020.0) == 0.0
