"""The progress line of a sweep: redrawn on a terminal, and printed now and then elsewhere."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from rich.console import Console

from isethdr_core.cli import progress, sweep_progress
from isethdr_core.cli.sweep_progress import SweepProgress, is_due
from isethdr_core.cli.terminal import duration
from isethdr_core.sweeps.record import Job, write_job

from .stored_sweep import stored_sweep

RUNS = 200
RUN_S = 10.0


@pytest.fixture
def long_sweep(isethdr_home):
    """Return a sweep of 200 runs that started at second 1000, without any result."""
    sweep = replace(stored_sweep(isethdr_home), total=RUNS)
    for path in (sweep.folder / "jobs").glob("*.json"):
        path.unlink()
    return sweep


def working(sweep, monkeypatch):
    """Return a function `wait` that advances a simulated clock; each run takes 10 s."""
    clock = [sweep.started]
    monkeypatch.setattr("time.time", lambda: clock[0])

    def wait(seconds):
        before = int((clock[0] - sweep.started) / RUN_S)
        clock[0] += seconds
        done = int((clock[0] - sweep.started) / RUN_S)
        for number in range(before, min(done, RUNS)):
            ended = sweep.started + RUN_S * (number + 1)
            job = Job(number, (), RUN_S, f"key{number}", computed=True, ended=ended)
            write_job(sweep.folder, job)
        return done > RUNS

    return wait


def test_few_lines_are_printed_where_there_is_no_terminal(long_sweep, monkeypatch, capsys):
    sweep_progress._printed(SweepProgress(long_sweep), working(long_sweep, monkeypatch))
    said = capsys.readouterr()
    lines = said.err.splitlines()
    assert lines[0] == "3 of 200 runs done, about 32 min 50 s left" and said.out == ""
    assert len(lines) <= 45, "20 lines in 10 minutes, then fewer and fewer"
    assert len(set(lines)) == len(lines)


def test_no_line_is_repeated_while_nothing_is_done(long_sweep, monkeypatch, capsys):
    ticks = iter([False] * 100 + [True])
    clock = iter(range(1000, 100_000, 60))
    monkeypatch.setattr("time.time", lambda: float(next(clock)))
    sweep_progress._printed(SweepProgress(long_sweep), lambda _: next(ticks))
    assert capsys.readouterr().err == ""


def test_a_terminal_shows_one_line(long_sweep, monkeypatch):
    out = io.StringIO()
    terminal = Console(file=out, force_terminal=True, width=80)
    monkeypatch.setattr(sweep_progress, "console", lambda stderr: terminal)
    monkeypatch.setattr("time.time", lambda: 1030.0)
    ended = iter([False, True])

    def wait(_):
        write_job(long_sweep.folder, Job(0, (), 5.0, "a", computed=True, ended=1030.0))
        write_job(long_sweep.folder, Job(1, (), 5.0, error="glass broke", ended=1030.0))
        return next(ended)

    sweep_progress._drawn(SweepProgress(long_sweep), wait)
    said = out.getvalue()
    assert "2 of 200 runs done, 1 failed, about 16 min 30 s left" in said
    assert said.count("\n") == 1, "the line is drawn in its place"


def test_lines_become_rarer():
    assert not is_due(20.0, 20.0) and is_due(31.0, 30.0)
    assert not is_due(7200.0, 300.0) and is_due(7200.0, 360.0)


def test_stages_of_a_job_are_not_shown(monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setattr(progress, "_display", lambda: pytest.fail("a stage is shown"))
    with progress.hidden(), progress.shown("renderer"):
        pass


def test_times_are_written_for_people():
    shown = [duration(s) for s in (2.04, 42.0, 200.0, 3900.0)]
    assert shown == ["2.0 s", "42 s", "3 min 20 s", "1 h 05 min"]
