"""Steps are run once, go on after an interruption, and end with their driver."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from isethdr_workflows.experiments import command, driver, records, results
from isethdr_workflows.experiments.steps import LONGEST_MIN, STEPS, Step, steps_named
from isethdr_workflows.questions.tables import for_people

from isethdr_core.errors import CatalogError, ConfigError

ONE = Step("one", "first", ("study one",), ("experiments/one.md",), 1.0, "a guess")
TWO = Step("two", "second", ("study two a", "study two b"), ("experiments/two.md",), 2.0, "a guess")


@pytest.fixture
def ran(monkeypatch, isethdr_home):
    """Return the commands that were run; each writes the file of its step."""
    commands = []

    def run_command(text, _seconds):
        commands.append(text)
        name = text.split()[1]
        (isethdr_home / "experiments" / f"{name}.md").write_text(f"## table\n\n{text}\n")

    monkeypatch.setattr(driver, "run_command", run_command)
    monkeypatch.setattr(results, "STEPS", (ONE, TWO))
    return commands


def test_what_is_done_is_not_done_again(ran, isethdr_home):
    lines = []
    assert driver.run_steps((ONE, TWO), lines.append) == []
    assert ran == ["study one", "study two a", "study two b"]
    driver.run_steps((ONE, TWO), lines.append)
    assert len(ran) == 3 and lines[-1].endswith("done before")
    (isethdr_home / "experiments" / "one.md").unlink()
    driver.run_steps((ONE, TWO), lines.append)
    assert ran[3:] == ["study one"]
    driver.run_steps((replace(TWO, commands=("study two c",)),), lines.append)
    assert ran[4:] == ["study two c"]  # other commands make another step


def test_an_interrupted_step_goes_on_and_its_minutes_add_up(ran, monkeypatch):
    whole = driver.run_command

    def killed(text, seconds):
        if text.endswith("b") and not ran[2:]:
            ran.append(text)
            raise KeyboardInterrupt
        whole(text, seconds)

    monkeypatch.setattr(driver, "run_command", killed)
    clock = iter(range(0, 6000, 60))
    monkeypatch.setattr(driver.time, "monotonic", lambda: float(next(clock)))
    with pytest.raises(KeyboardInterrupt):
        driver.run_steps((ONE, TWO), print)
    begun = records.read(TWO)
    assert begun.minutes >= 1 and not begun.finished and not records.is_finished(TWO)
    driver.run_steps((ONE, TWO), print)
    assert ran == ["study one", "study two a", "study two b", "study two a", "study two b"]
    assert records.is_finished(TWO) and records.read(TWO).minutes > begun.minutes


def test_commands_are_printed_as_they_are_typed(isethdr_home):
    shown = driver.typed("study one 'a=[1, 2]' page={home}/one.md")
    assert shown == f"isethdr study one 'a=[1, 2]' page={isethdr_home}/one.md"


class Unwinding:
    """A command that gets Ctrl-C together with its driver, cleans up, and then ends."""

    def __init__(self):
        self.waits = 0
        self.signals = []

    def wait(self, _seconds):
        """Raise Ctrl-C first, then return."""
        self.waits += 1
        if self.waits == 1:
            raise KeyboardInterrupt
        return 130

    def poll(self):
        """Return the exit code after the second wait, None before."""
        return 130 if self.waits > 1 else None

    def send_signal(self, number):
        """Keep the signal."""
        self.signals.append(number)


def test_a_command_that_got_ctrl_c_is_left_to_unwind(monkeypatch):
    child = Unwinding()
    monkeypatch.setattr(driver.subprocess, "Popen", lambda *_: child)
    with pytest.raises(KeyboardInterrupt):
        driver.run_command("dataset list", 60)
    assert child.waits == 2 and not child.signals


def test_a_step_that_lacks_a_library_is_left_out(ran):
    lines = []
    needy = replace(ONE, needs=("no_such_library", "train"))
    assert driver.run_steps((needy, TWO), lines.append) == ["one"]
    assert "left out, it needs pip install 'isethdr[train]'" in lines[0]
    assert ran == list(TWO.commands)


def test_a_step_that_makes_nothing_and_a_full_disk_are_named(ran, monkeypatch):
    nothing = replace(ONE, makes=("experiments/three.md",))
    with pytest.raises(CatalogError, match=r"ended without experiments/three\.md"):
        driver.run_steps((nothing,), print)
    assert records.read(nothing).finished == ""

    def full(_path, _text):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(records, "write_text", full)
    with pytest.raises(CatalogError, match="No space left on device; finished steps are kept"):
        driver.run_steps((TWO,), print)


def test_the_page_says_what_was_not_run(ran, isethdr_home):
    driver.run_steps((ONE,), print)
    text = results.write_results().read_text()
    assert "| one | `isethdr study one` | 0.0 |" in text and "### table" in text
    assert "not run to its end" in text and "study two a`; `isethdr" in text
    assert text.count("## ") == 2  # the step and, one level lower, its table


def test_the_page_states_the_minutes_of_all_finished_steps(ran, isethdr_home):
    for step, minutes in ((ONE, 3.2), (TWO, 4.4)):
        driver.run_steps((step,), print)
        records.write(step, minutes, True, 1.0)
    text = results.write_results().read_text()
    assert "The finished steps took 8 minutes in all." in text
    assert f"{os.cpu_count()} processors (" in text


def test_several_tables_of_a_step_have_titles_of_their_own(ran, isethdr_home, monkeypatch):
    several = replace(TWO, makes=("experiments/two.md", "experiments/dark.md"))
    monkeypatch.setattr(results, "STEPS", (ONE, several))
    (isethdr_home / "experiments").mkdir(parents=True, exist_ok=True)
    (isethdr_home / "experiments" / "dark.md").write_text("| lux |\n|---|\n")
    driver.run_steps((ONE, several), print)
    titles = [line for line in results.page().splitlines() if line.startswith("## ")]
    assert titles == ["## one", "## two: two", "## two: dark"]


def test_a_csv_file_becomes_a_table():
    text = results.table_of("lux,score,value\n0.01,ssim,0.123456\n10,ssim,\n3,ssim,nan\n")
    rows = ["| 0.01 | ssim | 0.123 |", "| 10 | ssim |  |", "| 3 | ssim | – |"]
    assert text.splitlines()[2:] == rows


def test_of_several_tables_in_a_file_one_is_shown():
    text = results.table_of("table,row,value\nall,all,0.5\ndistance,10 m,0.25\n")
    assert text.splitlines()[2:] == ["| all | all | 0.5 |"]


def test_the_steps_fit_the_time_and_are_found_by_name():
    assert all(0 < step.minutes <= LONGEST_MIN for step in STEPS)
    # minutes were measured on two cores while tests ran; the aim is 150 minutes, which the steps
    # meet without the detector
    assert sum(step.minutes for step in STEPS) <= 180
    assert sum(step.minutes for step in STEPS if step.name != "detector") <= 150
    assert len({step.name for step in STEPS}) == len(STEPS) and all(step.makes for step in STEPS)
    assert [step.name for step in steps_named(("figures", "dataset"))] == ["dataset", "figures"]
    assert steps_named(()) == STEPS
    with pytest.raises(ConfigError, match="did you mean 'dirt'"):
        steps_named(("dirty",))


def test_the_commands_exist(monkeypatch, capsys):
    """The first word, or the study, of each command is known."""
    from isethdr_workflows import STUDIES

    for step in STEPS:
        for text in step.commands:
            words = text.split()
            assert words[0] in ("dataset", "train", "study", "experiments")
            assert words[0] != "study" or words[1] in STUDIES
    command.run(["figures"], dry_run=True)
    assert "isethdr study paper_fig2" in capsys.readouterr().out
    command.list_steps()
    assert "no step takes more than 40 min" in " ".join(capsys.readouterr().out.split())


def test_a_table_for_people_has_one_column_for_a_mean():
    row = {"term": "noise", "loss": 0.5, "loss_low": 0.25, "loss_high": 0.75, "roads": 3}
    assert for_people([row]) == [{"term": "noise", "loss": "0.5 (0.25 to 0.75)", "roads": 3}]


@pytest.mark.slow
def test_a_command_ends_with_a_driver_that_is_killed(tmp_path):
    """The test kills the driver. The driver's child, which only waits, then ends by itself."""
    inside = (
        "import sys, time, threading, os\n"
        "from isethdr_workflows.experiments.child import watch\n"
        "from isethdr_core.runs.parent_watch import exit_on_sigterm\n"
        "exit_on_sigterm()\n"
        "threading.Thread(target=watch, args=(os.getppid(),), daemon=True).start()\n"
        f"open({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid()))\n"
        "time.sleep(120)\n"
    )
    outside = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {inside!r}])"
    outer = subprocess.Popen([sys.executable, "-c", outside])
    pid = tmp_path / "pid"
    _wait(lambda: pid.exists() and pid.read_text())
    outer.send_signal(signal.SIGKILL)
    outer.wait()
    _wait(lambda: not Path(f"/proc/{pid.read_text()}").exists())


@pytest.mark.slow
def test_a_real_command_runs_fails_and_is_stopped(isethdr_home, capfd):
    isethdr_home.mkdir(parents=True)
    driver.run_command("dataset list", 120)
    assert "dataset" in capfd.readouterr().out
    with pytest.raises(CatalogError, match="ended with code 2"):
        driver.run_command("dataset report none", 120)
    began = time.monotonic()
    with pytest.raises(driver.OutOfTime):
        driver.run_command("dataset list", 0.05)
    assert time.monotonic() - began < driver.UNWIND_S + 5


def _wait(is_so, seconds=60.0):
    end = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < end, "waited for nothing"
        time.sleep(0.1)
