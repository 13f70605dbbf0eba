"""A command of a step in a process of its own, which ends when the driver has ended.

A driver that is killed cannot end its command. Therefore the command checks whether its parent
process still exists. If not, it exits by an exception, so that incomplete files are removed.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time

from isethdr_core.cli.commands import main
from isethdr_core.runs.parent_watch import LOOK_S, TERMINATED, UNWIND_S, exit_on_sigterm


def watch(parent: int) -> None:
    """End this process some seconds after its parent has ended.

    Parameters
    ----------
    parent : id of the process that started this one.
    """
    while os.getppid() == parent:
        time.sleep(LOOK_S)
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(UNWIND_S)
    os._exit(TERMINATED)  # a computation that does not return to Python cannot unwind


if __name__ == "__main__":
    exit_on_sigterm()
    parent_pid = int(sys.argv.pop(1))
    threading.Thread(target=watch, args=(parent_pid,), daemon=True).start()
    main()
