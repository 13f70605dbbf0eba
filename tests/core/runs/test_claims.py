"""Of several processes that need the same work, one does it. If it dies, exactly one other process
takes its place.
"""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from isethdr_core.runs import claims as claims_module
from isethdr_core.runs.claims import Rhythm, claimed

# 600 s: on a loaded machine, a process may stand still for seconds although it is alive
QUICK = Rhythm(beat_s=0.02, dead_after_s=600, look_s=0.02)
WORKER = """
import os, sys, time
from pathlib import Path
from isethdr_core.runs.claims import Rhythm, claimed
folder, seconds, name = Path(sys.argv[1]), float(sys.argv[2]), sys.argv[3]
tell = lambda text: print(text, flush=True)
with claimed(folder, "scene", tell, Rhythm(beat_s=0.02, dead_after_s=600, look_s=0.02)) as waited:
    print("holds", waited, flush=True)
    inside = folder / "inside"
    os.close(os.open(inside, os.O_CREAT | os.O_EXCL))      # fails where two are inside
    (folder / f"{name}.began").touch()
    end = time.monotonic() + seconds
    while time.monotonic() < end and not (folder / "end").exists():
        time.sleep(0.01)
    inside.unlink()
print("done", flush=True)
"""


@pytest.fixture
def worker(tmp_path):
    """Return a function that starts a process which holds the claim for some seconds, or until
    there is a file `end`.
    """
    children = []

    def start(seconds: float, name: str = "w") -> subprocess.Popen:
        command = [sys.executable, "-c", WORKER, str(tmp_path), str(seconds), name]
        child = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            # a shell that starts the tests in the background makes them ignore Ctrl-C
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        children.append(child)
        return child

    yield start
    for child in children:
        child.kill()
        child.communicate()


def claims(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.iterdir() if ".claim-" in p.name)


def test_one_works_and_the_other_waits_and_says_for_whom(tmp_path, worker):
    first = worker(600)
    assert first.stdout.readline() == "holds False\n"
    said = []

    def tell(line):
        said.append(line)
        (tmp_path / "end").touch()

    with claimed(tmp_path, "scene", tell, QUICK) as waited:
        assert waited and first.wait(600) == 0
        assert claims(tmp_path) == [".scene.claim-0"]
    [line] = said
    assert line.startswith(f"waiting for scene: process {first.pid} on ")
    assert claims(tmp_path) == []


def test_another_name_is_not_waited_for(tmp_path):
    with claimed(tmp_path, "a", print), claimed(tmp_path, "b", print) as waited:
        assert not waited


def test_a_killed_holder_is_replaced_at_once(tmp_path, worker):
    first = worker(60)
    assert first.stdout.readline() == "holds False\n"
    assert claims(tmp_path) == [".scene.claim-0"]
    first.kill()  # without `wait`: a zombie counts as dead
    slow = Rhythm(beat_s=1, dead_after_s=1000, look_s=0.01)
    start_s = time.monotonic()
    with claimed(tmp_path, "scene", print, slow):
        assert time.monotonic() - start_s < 500
        assert claims(tmp_path) == [".scene.claim-1"]
    assert claims(tmp_path) == []


def test_claims_that_killed_processes_left_on_other_scenes_are_removed(tmp_path, worker):
    first = worker(60)
    assert first.stdout.readline() == "holds False\n"
    first.kill()
    first.wait(60)  # a busy machine takes a while to end it
    (tmp_path / ".far.claim-0").write_text(json.dumps({"host": "elsewhere", "process": first.pid}))
    with claimed(tmp_path, "other", print):
        assert claims(tmp_path) == [".far.claim-0", ".other.claim-0"]


@pytest.mark.slow
def test_of_many_that_wait_for_a_killed_holder_one_at_a_time_takes_over(tmp_path, worker):
    first = worker(60, "first")
    assert first.stdout.readline() == "holds False\n"
    waiting = [worker(0.02, f"w{k}") for k in range(5)]
    assert all(w.stdout.readline().startswith("waiting for ") for w in waiting)
    first.kill()
    (tmp_path / "inside").unlink()
    assert [w.wait(600) for w in waiting] == [0] * 5, waiting[0].stderr.read()
    assert len(list(tmp_path.glob("w?.began"))) == 5 and claims(tmp_path) == []


class Clock:
    """A stand-in for the module `time` in the claims: sleeping takes no time and calls the test."""

    def __init__(self, at_each_look=lambda now_s: None):
        self.now_s = 0.0
        self.at_each_look = at_each_look

    def monotonic(self):
        return self.now_s

    def sleep(self, seconds):
        self.now_s += seconds
        self.at_each_look(self.now_s)


def test_a_holder_that_stands_still_is_replaced_and_leaves_its_successor_alone(
    tmp_path, worker, monkeypatch
):
    first = worker(600)
    assert first.stdout.readline() == "holds False\n"
    first.send_signal(signal.SIGSTOP)
    os.waitpid(first.pid, os.WUNTRACED)
    monkeypatch.setattr(claims_module, "time", clock := Clock())
    rhythm = Rhythm(beat_s=0.02, dead_after_s=1.0, look_s=0.02)
    with claimed(tmp_path, "scene", print, rhythm):
        assert 1.0 < clock.now_s < 1.1
        (tmp_path / "end").touch()
        first.send_signal(signal.SIGCONT)
        assert first.wait(600) == 0
        assert claims(tmp_path) == [".scene.claim-1"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_waiting_process_that_ends_leaves_nothing(tmp_path, worker, number):
    with claimed(tmp_path, "scene", print, QUICK):
        other = worker(0)
        assert other.stdout.readline().startswith("waiting for ")
        other.send_signal(number)
        other.wait(600)
        assert claims(tmp_path) == [".scene.claim-0"]


def test_ctrl_c_releases(tmp_path, worker):
    first = worker(60)
    assert first.stdout.readline() == "holds False\n"
    first.send_signal(signal.SIGINT)
    first.wait(600)
    assert claims(tmp_path) == []


@pytest.mark.parametrize("step_s", [-1000, 1000])
def test_clocks_of_other_machines_do_not_matter(tmp_path, monkeypatch, step_s):
    """The clock of the claim's machine runs backwards or far ahead. The claim counts as alive as
    long as the time of its file changes.
    """
    path = tmp_path / ".scene.claim-7"
    path.write_text(
        json.dumps({"host": "elsewhere", "namespace": "", "process": 1, "started": "1"})
    )
    when = itertools.count(10**9, step_s)

    def beat_for_two_seconds(now_s):
        if now_s < 2.0:
            os.utime(path, (next(when),) * 2)

    clock = Clock(beat_for_two_seconds)
    monkeypatch.setattr(claims_module, "time", clock)
    rhythm = Rhythm(beat_s=0.02, dead_after_s=1.0, look_s=0.02)
    with claimed(tmp_path, "scene", print, rhythm) as waited:
        assert waited and claims(tmp_path) == [".scene.claim-8"]
        # a second after the last beat, give or take two looks of 0.02 s
        assert 2.95 < clock.now_s < 3.05


def test_a_claim_that_was_released_while_it_was_judged_dead_is_not_taken_over(
    tmp_path, monkeypatch
):
    """The claim is gone when the next number is created; the process then starts again at 0."""
    path = tmp_path / ".scene.claim-4"
    path.touch()

    def dead(self, found):
        found.unlink()  # its holder has finished in this moment
        return True

    monkeypatch.setattr(claims_module._Watch, "is_dead", dead)
    with claimed(tmp_path, "scene", print, QUICK):
        assert claims(tmp_path) == [".scene.claim-0"]


def test_a_process_that_ends_while_its_state_is_read_has_ended(monkeypatch):
    """Between opening and reading, /proc answers that there is no such process."""

    def gone(path):
        raise ProcessLookupError(3, "No such process")

    monkeypatch.setattr(Path, "read_text", gone)
    assert claims_module._started(os.getpid()) is None


@pytest.mark.parametrize("alive", [True, False])
def test_a_process_that_the_system_hides_ends_when_no_signal_reaches_it(monkeypatch, alive):
    """Below /proc there may be no files of other users' processes."""
    owner = claims_module._machine() | {"process": os.getpid(), "started": "17"}
    assert claims_module._has_ended(owner)  # another process has its number

    def hidden(path):
        raise FileNotFoundError(2, "No such file or directory")

    monkeypatch.setattr(Path, "read_text", hidden)
    monkeypatch.setattr(claims_module, "_answers", lambda process: alive)
    assert claims_module._has_ended(owner) is not alive
