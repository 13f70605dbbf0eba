"""Progress is silent without a terminal. On a terminal it shows the running stage and the remaining
time once a stage has taken two seconds.
"""

from __future__ import annotations

import os
import pty
import subprocess
import sys

from isethdr_core.cli import progress

CODE = """
import time
from isethdr_core.cli import progress
progress.SHOWN_AFTER_S = 0.2
with progress.shown("renderer mitsuba"):
    for part in progress.track(range(4), "rendering"):
        time.sleep(0.2)
progress.SHOWN_AFTER_S = 600
with progress.shown("quick stage"):
    pass
print("table")
"""


def on_a_terminal(code: str) -> str:
    """Return what a process writes to standard error when that is a terminal."""
    ours, theirs = pty.openpty()
    environment = {**os.environ, "COLUMNS": "100", "TERM": "xterm"}
    process = subprocess.Popen(
        [sys.executable, "-c", code], stderr=theirs, stdout=subprocess.DEVNULL, env=environment
    )
    os.close(theirs)
    said = b""
    while True:
        try:
            piece = os.read(ours, 4096)
        except OSError:  # end of file of a terminal on Linux
            break
        if not piece:
            break
        said += piece
    process.wait(600)
    os.close(ours)
    return said.decode(errors="replace")


def test_long_stages_show_on_a_terminal():
    said = on_a_terminal(CODE)
    assert "renderer mitsuba" in said and "rendering" in said and "remaining" in said
    assert "quick stage" not in said


def test_nothing_is_said_elsewhere():
    done = subprocess.run(
        [sys.executable, "-c", CODE + "import sys; print('rich' in sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["table", "False"] and done.stderr == ""


def test_tracked_items_come_unchanged():
    assert list(progress.track([3, 1, 2], "sorting")) == [3, 1, 2]
    assert list(progress.track((n for n in "ab"), "spelling", total=2)) == ["a", "b"]
