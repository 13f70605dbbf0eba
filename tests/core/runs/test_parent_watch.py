"""Workers end when their parent is killed. Those at work unwind first; those that do not unwind are
ended all the same.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("joblib", reason="needs joblib: pip install 'isethdr[sweep]'")

PARENT = """
import sys, time
from pathlib import Path
from joblib import Parallel, delayed

def work(folder, number, stubborn):
    import os, time
    from isethdr_core.runs import parent_watch
    parent_watch.LOOK_S, parent_watch.UNWIND_S = 0.05, 0.5
    parent_watch.end_with_parent()
    (folder / f"{os.getpid()}.began").touch()
    try:
        end = time.monotonic() + 30
        while time.monotonic() < end:
            try:
                time.sleep(0.05)
            except SystemExit:
                if not stubborn:
                    raise
    finally:
        (folder / f"{os.getpid()}.unwound").touch()

Parallel(n_jobs=2)(delayed(work)(Path(sys.argv[1]), k, k == 1) for k in range(4))
"""


def living(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def wait_until(condition, seconds: float = 60.0) -> bool:
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return condition()


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
def test_workers_of_a_killed_parent_end(tmp_path):
    parent = subprocess.Popen([sys.executable, "-c", PARENT, str(tmp_path)])
    try:
        assert wait_until(lambda: len(list(tmp_path.glob("*.began"))) == 2)
    finally:
        parent.kill()
        parent.wait()
    workers = [int(p.stem) for p in tmp_path.glob("*.began")]
    assert os.getpid() not in workers
    assert wait_until(lambda: not any(map(living, workers)), 25), "the jobs themselves take 30 s"
    assert len(list(tmp_path.glob("*.unwound"))) == 1, "the stubborn one was ended"
    assert len(list(tmp_path.glob("*.began"))) == 2, "no further job was begun"
