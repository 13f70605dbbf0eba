"""Workers of a sweep end when the process that started them is gone, also when it was killed.

A killed process cannot stop its workers. Workers of joblib would finish their jobs, and the next
jobs that they have already received. Each worker therefore checks whether its parent still exists.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time

TERMINATED = 128 + signal.SIGTERM  # exit code
LOOK_S = 1.0  # time between two checks for the parent
UNWIND_S = 10.0  # time for removing half-written files


def exit_on_sigterm() -> None:
    """Turn SIGTERM into SystemExit, which unwinds the stack: half-written files are removed."""
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))


def end_with_parent() -> None:
    """Watch the parent of this process from now on, if another Python process started it as a
    worker.
    """
    parent = multiprocessing.parent_process()
    if parent is None:
        return
    if os.getppid() != parent.pid:
        os._exit(TERMINATED)
    if all(thread.name != __name__ for thread in threading.enumerate()):
        if threading.current_thread() is threading.main_thread():
            exit_on_sigterm()
        threading.Thread(target=_watch, args=(parent.pid,), name=__name__, daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(LOOK_S)
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(UNWIND_S)
    os._exit(TERMINATED)  # a computation that does not return to Python cannot unwind
